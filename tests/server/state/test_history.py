"""The history of an arm: no peak is lost, no row repeated, and the loop waits for no reader."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st

from bioscara.api import messages as m
from bioscara.errors import InvalidArgumentError, LimitError
from bioscara.robot import tasks
from bioscara.server.state.history import DURATION, StateHistory
from served import RawClient, arm_served, eventually

RATE = 10
NAMES = ("j1", "j2")


def sample(cycle: int, value: float, **changes: object) -> m.StateSample:
    """Return the state of an arm with two joints in a cycle."""
    values = {
        "cycle": cycle, "time": cycle / RATE, "names": NAMES, "positions": (value, -value),
        "velocities": (0.0, 0.0), "qualities": (0, 0), "stamps": (0.0, 0.0), "flags": (0, 0),
        "commands": (value + 0.01, -value), "pose": None, "width": math.nan, "enabled": True,
        "fault": "clear", "paused": False, "speed_override": 1.0, "moving": (), "late": 1e-4,
        "bus_time": 2e-3,
    }  # fmt: skip
    return m.StateSample(**(values | changes))  # type: ignore[arg-type]


def kept(values: list[float]) -> StateHistory:
    """Return the history of an arm whose first joint had these positions."""
    history = StateHistory(NAMES, RATE)
    for cycle, value in enumerate(values):
        history.add(sample(cycle, value))
    return history


POSITIONS = st.one_of(st.floats(-4.0, 4.0, width=32), st.just(math.nan))


@given(st.lists(POSITIONS, min_size=1, max_size=300), st.integers(2, 40))
def test_the_smallest_and_the_largest_value_are_never_lost(
    values: list[float], points: int
) -> None:
    answer = kept(values).between(0.0, None, points)
    assert len(answer.time) <= max(points, 2)
    assert all(before < after for before, after in pairwise(answer.time))
    assert answer.time[-1] == pytest.approx((len(values) - 1) / RATE)
    known = [value for value in values if not math.isnan(value)]
    shown = [value for value in answer.positions[0] if not math.isnan(value)]
    assert bool(known) == bool(shown)
    if known:
        assert min(shown) == pytest.approx(min(known), abs=1e-6)
        assert max(shown) == pytest.approx(max(known), abs=1e-6)
        assert -min(answer.positions[1], key=lambda v: math.inf if math.isnan(v) else v) == (
            pytest.approx(max(known), abs=1e-6)
        )


@given(st.integers(1, 400), st.integers(0, 400), st.integers(0, 400))
def test_the_rows_of_a_time_come_once_and_in_order(count: int, begin: int, length: int) -> None:
    history = kept([float(cycle % 7) for cycle in range(count)])
    answer = history.between(begin / RATE, (begin + length) / RATE, 5000)
    wanted = [cycle for cycle in range(count) if begin <= cycle <= begin + length]
    assert [round(time * RATE) for time in answer.time] == wanted
    assert list(answer.positions[0]) == [float(cycle % 7) for cycle in wanted]


def test_ten_minutes_are_kept_in_memory_that_does_not_grow() -> None:
    history = StateHistory(NAMES, RATE)
    cycles = round(2.5 * DURATION * RATE)
    for cycle in range(cycles):
        history.add(sample(cycle, float(cycle)))
    answer = history.between(-math.inf, None, 5000)
    assert answer.time[-1] == pytest.approx((cycles - 1) / RATE)
    assert answer.time[0] == answer.oldest == pytest.approx((cycles - DURATION * RATE) / RATE)
    assert answer.positions[0][-1] == cycles - 1


def test_a_joint_without_power_has_no_error_and_loads_are_those_reported() -> None:
    history = StateHistory(NAMES, RATE)
    history.add(sample(0, 0.5))
    history.add(sample(1, 0.5, enabled=False))
    answer = history.between(0.0, None, 100)
    assert answer.loads is None
    assert answer.errors[0][0] == pytest.approx(0.01)
    assert math.isnan(answer.errors[0][1])
    history.add(sample(2, 0.5, loads=(12.0, math.nan)))
    answer = history.between(0.0, None, 100)
    assert answer.loads is not None
    assert np.array(answer.loads) == pytest.approx(
        np.array([[math.nan, math.nan, 12.0], [math.nan] * 3]), nan_ok=True
    )


def test_questions_that_make_no_sense_are_refused() -> None:
    history = kept([0.0] * 20)
    for points in (0, 1, 5001):
        with pytest.raises(LimitError, match="points of the history"):
            history.between(0.0, None, points)
    with pytest.raises(InvalidArgumentError, match="end before begin"):
        history.between(1.0, 0.5, 10)
    with pytest.raises(InvalidArgumentError):
        history.between(math.nan, None, 10)
    assert history.between(5.0, 9.0, 10).time == ()


def test_a_client_sees_a_motion_that_ended_before_it_came() -> None:
    with arm_served() as served, RawClient() as client:
        begin = served.owner.sample.time
        epoch = client.acquire()
        goal = client.request(m.Start(task=tasks.MoveRelative(z=0.01)), epoch).goal.goal
        eventually(lambda: served.owner.goals.get(goal).operation.done)
        with RawClient(name="later") as other:
            answer = other.request(m.GetHistory(begin=begin, points=400))
    assert isinstance(answer, m.History)
    assert answer.names == served.owner.sample.names
    assert len(answer.time) <= 400
    rise = answer.commands[1][-1] - answer.commands[1][0]
    assert rise == pytest.approx(0.01, abs=1e-4)
    assert max(map(abs, answer.velocities[1])) > 0.01
    assert 0.0 < max(abs(error) for error in answer.errors[1]) < 0.01
    assert min(answer.bus_time) > 0.0
