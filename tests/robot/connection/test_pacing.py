"""Simulated time is held back to the wall clock, never advanced."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from bioscara.robot.connection.pacing import PacedClock


class Hands:
    """A clock that is set by hand; sleeping sets it."""

    def __init__(self, time: float) -> None:
        self.time = time

    def now(self) -> float:
        return self.time

    def sleep_until(self, deadline: float) -> None:
        self.time = max(self.time, deadline)


@given(st.lists(st.floats(0.001, 1.0), min_size=1, max_size=30), st.floats(-1e3, 1e3))
def test_paced_time_is_never_ahead_of_the_wall_clock(steps: list[float], origin: float) -> None:
    simulated, wall = Hands(0.0), Hands(origin)
    clock = PacedClock(simulated, wall)
    clock.paced = True
    for step in steps:
        clock.sleep_until(clock.now() + step)
        assert wall.now() - origin == pytest.approx(clock.now(), abs=1e-9)


def test_unpaced_time_does_not_depend_on_the_wall_clock() -> None:
    simulated, wall = Hands(0.0), Hands(5.0)
    clock = PacedClock(simulated, wall)
    clock.sleep_until(100.0)
    assert (clock.now(), wall.now()) == (100.0, 5.0)


def test_pacing_enabled_late_does_not_make_up_for_earlier_lag() -> None:
    simulated, wall = Hands(0.0), Hands(5.0)
    clock = PacedClock(simulated, wall)
    clock.sleep_until(100.0)
    clock.paced = True
    clock.sleep_until(101.0)
    assert wall.now() == pytest.approx(6.0)


def test_a_long_pause_is_not_caught_up() -> None:
    simulated, wall = Hands(0.0), Hands(0.0)
    clock = PacedClock(simulated, wall)
    clock.paced = True
    clock.sleep_until(1.0)
    wall.time += 30.0
    clock.sleep_until(2.0)
    before = wall.now()
    clock.sleep_until(3.0)
    assert wall.now() == pytest.approx(before + 1.0)
