"""The compiled firmware behind a bus that records frames and injects faults."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from bioscara.bus import Bus, FaultyBus, Transaction
from bioscara.drivers import Joint
from bioscara.errors import BusTimeoutError, CommunicationError
from bioscara.model import JointParameters, load_parameters
from bioscara.protocol import Register
from bioscara.sim import FirmwareBus, SimulatedArm

ARM = load_parameters()
NEAR = {"j1": -3.0, "j2": 0.33, "j3": 2.58, "j4": 2.9}
"""Close to the end stops that homing seeks."""


def home_error(joint: str, *, v1: bool) -> float:
    """Return the largest error of a homed joint's position [rad or m].

    Ours backs off and measures at rest, within 3 degrees of the motor. An original joint sets its
    zero in the moment in which the rotor snaps back against the stop: an electrical period of 7.2
    degrees and the yield of the belt.
    """
    parameters = next(row for row in ARM.joints if row.name == joint)
    return math.radians(15.0 if v1 else 3.0) / abs(parameters.reduction)


def clock_is_held(arm: SimulatedArm) -> bool:
    """Return whether a joint holds the clock, so that no transfer ends until its power is cycled.

    An original joint does so when more is read than it answers, for which one flipped bit in a
    request is enough.
    """
    (answer,) = FirmwareBus(arm).transfer((Transaction(0x11, bytes((Register.PING,)), 0),))
    return isinstance(answer, BusTimeoutError)


class Tap(Bus):
    """Records the frames that reach the joints, and their calls."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self.calls: list[list[Transaction]] = []

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        self.calls.append(list(transactions))
        return self._bus.transfer(transactions)

    def close(self) -> None:
        self._bus.close()

    def count(self, register: Register) -> int:
        """Return how many frames of ``register`` arrived."""
        return sum(t.write[:1] == bytes((register,)) for call in self.calls for t in call)


class World:
    """An arm near its end stops, its bus with faults, and four unused drivers."""

    def __init__(
        self, *, v1: bool = False, v1_frames: bool = False, frequency: float | None = 400e3
    ) -> None:
        self.arm = SimulatedArm(seed=1, v1=v1, v1_frames=v1_frames, frequency=frequency)
        for name, position in NEAR.items():
            self.arm.set_position(name, position)
            self.arm.reset(name)
        self.arm.run(1.0 if v1 else 0.2)
        self.tap = Tap(FirmwareBus(self.arm))
        self.bus = FaultyBus(self.tap, seed=1, clock=self.arm.clock)
        self.joints = [self.joint(parameters) for parameters in ARM.joints]

    def joint(self, parameters: JointParameters, **changes: object) -> Joint:
        """Return a separate driver, as another host would have."""
        return Joint(self.bus, self.arm.clock, replace(parameters, **changes))

    def ready(self, *names: str) -> list[Joint]:
        """Return these joints, initialised, enabled and homed."""
        joints = [joint for joint in self.joints if joint.name in (names or NEAR)]
        for joint in joints:
            joint.init()
            joint.home()
        return joints
