"""A simulated arm that is ready to move, for the benchmarks."""

from __future__ import annotations

from bioscara.drivers import Joint
from bioscara.model import load_parameters
from bioscara.sim import FirmwareBus, SimulatedArm

NEAR = {"j1": -3.0, "j2": 0.33, "j3": 2.58, "j4": 2.9}
"""Close to the end stops, so that homing is short."""


def ready(
    *, v1: bool = False, frequency: float | None = 100e3, names: tuple[str, ...] = tuple(NEAR)
) -> tuple[SimulatedArm, list[Joint]]:
    """Return an arm and the drivers of these joints, enabled and homed."""
    arm = SimulatedArm(v1=v1, frequency=frequency, positions=NEAR)
    bus = FirmwareBus(arm)
    joints = [
        Joint(bus, arm.clock, parameters)
        for parameters in load_parameters().joints
        if parameters.name in names
    ]
    for joint in joints:
        joint.init()
        joint.enable()
        joint.home()
        joint.enable()
    return arm, joints
