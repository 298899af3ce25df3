"""Times of the arm's clock in a recording."""

from __future__ import annotations

import pytest

from bioscara.recording.writing.wall_clock import WallClock

_SECOND = 10**9


class Clocks:
    """A wall clock that can be set, and one that cannot."""

    def __init__(self) -> None:
        self.wall, self.steady = 1_700_000_000 * _SECOND, 50.0

    def pass_time(self, seconds: float, *, set_by: float = 0.0) -> None:
        self.wall += round((seconds + set_by) * _SECOND)
        self.steady += seconds


def test_a_step_of_the_wall_clock_changes_nothing_until_the_next_file() -> None:
    clocks = Clocks()
    time = WallClock(7.0, lambda: clocks.wall, lambda: clocks.steady)
    begin = time.stamp(7.0)
    assert begin == clocks.wall
    clocks.pass_time(10.0, set_by=3600.0)
    assert time.stamp(17.0) == begin + 10 * _SECOND
    time.renew(17.0)
    assert time.stamp(17.0) == clocks.wall == begin + 3610 * _SECOND


@pytest.mark.parametrize("pace", [0.5, 2.0, 20.0])
def test_a_simulation_of_another_pace_stays_in_its_own_time(pace: float) -> None:
    clocks = Clocks()
    time = WallClock(7.0, lambda: clocks.wall, lambda: clocks.steady)
    begin = time.stamp(7.0)
    clocks.pass_time(10.0)
    time.renew(7.0 + 10.0 * pace)
    assert time.stamp(7.0 + 10.0 * pace) == begin + round(10.0 * pace * _SECOND)
