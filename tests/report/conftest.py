"""A made-up run whose errors are known in closed form."""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import UTC, datetime

import pytest

from bioscara.report import (
    CycleHistory,
    CycleRecord,
    JointInfo,
    JointRecord,
    Outcome,
    Phase,
    RunSummary,
    SampleQuality,
)

NAMES = ("j1", "j2")
PERIOD = 0.01


def made_up_cycles(count: int = 300, error: float = 0.002) -> list[CycleRecord]:
    """j1 follows with a constant error; j2 with an error of the double in cycle 150 alone."""
    cycles = []
    for index in range(count):
        start = index * PERIOD
        phase = Phase.APPROACH if index < 50 else Phase.TRAJECTORY
        joints = []
        for number in range(2):
            time = start + 0.001 * (number + 1)
            wrong = error if number == 0 else 2 * error * (index == 150)
            joints.append(
                JointRecord(
                    time, math.sin(time), math.cos(time), math.sin(time) + wrong, math.cos(time),
                    0, SampleQuality.GOOD, 12.0,
                )
            )  # fmt: skip
        cycles.append(CycleRecord(phase, start, start - 0.5, 0.004, 0, 0.0001, tuple(joints)))
    return cycles


def history_of(cycles: list[CycleRecord]) -> CycleHistory:
    history = CycleHistory(NAMES)
    for cycle in cycles:
        history.append(cycle)
    return history


@pytest.fixture
def make_history() -> Callable[[list[CycleRecord]], CycleHistory]:
    return history_of


@pytest.fixture
def cycles() -> list[CycleRecord]:
    return made_up_cycles()


@pytest.fixture
def many_cycles() -> list[CycleRecord]:
    return made_up_cycles(20_000)


@pytest.fixture
def history(cycles: list[CycleRecord]) -> CycleHistory:
    return history_of(cycles)


@pytest.fixture
def summary() -> RunSummary:
    return RunSummary(
        title="made up",
        arm="simulation (in this process)",
        source="nowhere.csv",
        version="0.1.0",
        started=datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC),
        outcome=Outcome.COMPLETED,
        message="",
        joints=(JointInfo("j1", 0x11, "rad", "v2"), JointInfo("j2", 0x12, "m", "v2")),
        planned_duration=2.5,
    )
