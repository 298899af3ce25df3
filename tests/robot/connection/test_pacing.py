"""Simulated time is held back to the wall clock, never advanced."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from bioscara import Robot
from bioscara.robot.connection.pacing import PacedClock
from bioscara.sim import FirmwareBus
from simulated import ARM, simulated_bus


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


def test_the_lateness_of_a_wait_is_that_in_real_time() -> None:
    simulated, wall = Hands(0.0), Hands(0.0)
    clock = PacedClock(simulated, wall)
    clock.sleep_until(1.0)
    assert clock.late == 0.0
    clock.paced = True
    clock.sleep_until(2.0)
    assert clock.late == 0.0
    wall.time += 1.1
    clock.sleep_until(3.0)
    assert clock.late == pytest.approx(0.1)
    # It makes up for that.
    clock.sleep_until(4.0)
    assert clock.late == 0.0
    clock.real_time_factor = 10.0
    clock.sleep_until(5.0)
    wall.time += 0.3
    clock.sleep_until(6.0)
    assert clock.late == pytest.approx(0.2)


def test_a_cycle_that_is_late_in_real_time_alone_is_counted_as_late(tmp_path: Path) -> None:
    arm, wall = simulated_bus().arm, Hands(0.0)
    clock = PacedClock(arm.clock, wall)
    with Robot(FirmwareBus(arm), clock, ARM, "paced", evidence=tmp_path, pace_motion=True) as robot:
        clock.paced = True
        loop = robot.runner.arm.stack.loop
        loop.restart()
        assert [loop.step().timing.late for _ in range(5)] == pytest.approx([0.0] * 5)
        assert loop.statistics.overruns == 0
        # The simulation computed for 25 ms in one cycle of 10 ms, and makes up for it.
        wall.time += 0.025
        late = [loop.step().timing.late for _ in range(4)]
        assert late == pytest.approx([0.015, 0.005, 0.0, 0.0], abs=1e-6)
        assert loop.statistics.overruns == 1
        assert loop.statistics.late.maximum == pytest.approx(0.015)
        # Ten times as fast, 5 ms are five cycles; in both cases the joints received all in time.
        clock.real_time_factor = 10.0
        loop.step()
        wall.time += 0.005
        assert loop.step().timing.late == pytest.approx(0.004)
        assert loop.statistics.overruns == 2
        assert robot.faults == ()
