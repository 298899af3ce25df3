"""Speed of the simulation of four joints with their firmware, relative to real time."""

from __future__ import annotations

from benchmarks.arm import ready
from benchmarks.measure import Row, seconds
from bioscara.drivers import Setpoint, track
from bioscara.sim import SimulatedArm

SPAN = 5.0
STEP = 0.001


def speeds(arm: SimulatedArm) -> tuple[float, float]:
    """Return the ratio of simulated to real time in one long call, and in steps of 1 ms."""

    def steps() -> None:
        for _ in range(int(SPAN / STEP)):
            arm.run(STEP)

    return SPAN / seconds(lambda: arm.run(SPAN), repeat=5), SPAN / seconds(steps, repeat=3)


def rows() -> list[Row]:
    """Measure one long call and 1 ms steps, each with the arm holding and with it moving."""
    arm, joints = ready(frequency=None)
    once, stepped = speeds(arm)
    original, original_stepped = speeds(ready(v1=True, frequency=None)[0])

    def moving() -> None:
        for cycle in range(int(SPAN / 0.01)):
            share = cycle * 0.01 / SPAN
            goals = [
                Setpoint(joint.parameters.home_position * (1 - 0.02 * share), 0.0)
                for joint in joints
            ]
            track(joints, goals)
            arm.run(0.01)

    driven = SPAN / seconds(moving, repeat=3)
    return [
        Row(
            "four joints, one call",
            f"{once:.0f} times real time",
            "real time",
            "at least 100 times",
            once >= 100,
        ),
        Row(
            "four joints, 1 ms steps from Python",
            f"{stepped:.0f} times real time",
            "real time",
            "at least 50 times",
            stepped >= 50,
        ),
        Row(
            "four joints with their original firmware, one call",
            f"{original:.0f} times real time",
            "real time",
            "at least 100 times",
            original >= 100,
        ),
        Row(
            "four joints with their original firmware, 1 ms steps from Python",
            f"{original_stepped:.0f} times real time",
            "real time",
            "at least 50 times",
            original_stepped >= 50,
        ),
        Row(
            "four joints, tracked at 100 Hz by the drivers",
            f"{driven:.0f} times real time",
            "real time",
            "at least 50 times",
            driven >= 50,
        ),
    ]
