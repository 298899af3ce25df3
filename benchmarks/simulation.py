"""Speed of the simulation of four joints with their firmware."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.arm import ready
from benchmarks.floors import ADDITIONS, additions
from benchmarks.measure import Row, at_most, medians
from bioscara.drivers import Setpoint, track
from bioscara.sim import SimulatedArm

SPAN = 5.0
STEP = 0.001
MOST, MOST_DRIVEN = 1000, 2000
"""Additions that a joint's millisecond may cost, without and with the drivers."""


def _row(what: str, run: Callable[[], object], most: float) -> Row:
    """Measure a function that simulates four joints for :data:`SPAN`."""
    took, floor = medians(run, additions(), rounds=7, number=(1, 20))
    tick, addition = took / (4 * SPAN / STEP), floor / ADDITIONS
    note = f"{SPAN / took:.0f} times real time"
    return at_most(f"{what}: a joint's millisecond", tick, most, addition, "an addition", note)


def _steps(arm: SimulatedArm) -> None:
    for _ in range(int(SPAN / STEP)):
        arm.run(STEP)


def rows() -> list[Row]:
    """Measure one long call and 1 ms steps, each with the arm holding and with it moving."""
    arm, joints = ready(frequency=None)
    original = ready(v1=True, frequency=None)[0]

    def moving() -> None:
        for cycle in range(int(SPAN / 0.01)):
            share = cycle * 0.01 / SPAN
            goals = [
                Setpoint(joint.parameters.home_position * (1 - 0.02 * share), 0.0)
                for joint in joints
            ]
            track(joints, goals)
            arm.run(0.01)

    firmware = "four joints with their original firmware"
    return [
        _row("four joints, one call", lambda: arm.run(SPAN), MOST),
        _row("four joints, 1 ms steps from Python", lambda: _steps(arm), MOST),
        _row(f"{firmware}, one call", lambda: original.run(SPAN), MOST),
        _row(f"{firmware}, 1 ms steps from Python", lambda: _steps(original), MOST),
        _row("four joints, tracked at 100 Hz by the drivers", moving, MOST_DRIVEN),
    ]
