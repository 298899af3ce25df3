"""Laws of the ramp on which joints come to rest."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given, strategies as st

from bioscara.control.braking import braking_duration, braking_way, ramp

durations = st.floats(0.0, 2.0)
periods = st.floats(1e-3, 0.02)


@given(durations, periods, st.integers(1, 50))
def test_a_ramp_that_begins_anew_leads_to_the_same_place(
    duration: float, period: float, cycles: int
) -> None:
    begin = 0.5 * period
    ends = [ramp(begin + n * period, duration) for n in (0, cycles - 1, cycles)]
    covered, mean = ends[2] - ends[0], (ends[2] - ends[1]) / period
    again = mean * braking_way(mean * duration, period)
    assert covered + again == pytest.approx(braking_way(duration, period), abs=1e-12)


@given(st.floats(0.02, 2.0), periods)
def test_way_and_duration_are_inverse(duration: float, period: float) -> None:
    assert braking_duration(braking_way(duration, period), period) == pytest.approx(duration)


@given(durations, periods)
def test_the_deceleration_is_never_above_that_of_the_ramp(duration: float, period: float) -> None:
    # From a mean velocity of 1 at the beginning: a cycle changes it by 1 / duration at most.
    ways = [ramp((n + 0.5) * period, duration) for n in range(int(duration / period) + 4)]
    means = [1.0, *((b - a) / period for a, b in pairwise(ways))]
    if duration >= period:
        changes = [(a - b) / period for a, b in pairwise(means)]
        assert max(changes) <= (1.0 + 1e-9) / duration
