"""Parts of a motion join without a jump, whatever the time asked for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bioscara.report import Phase
from bioscara.robot.timeline import Reference, Segment, Timeline, hold

DURATIONS = st.lists(st.floats(0.01, 10.0), min_size=1, max_size=5)


def ramps(durations: list[float]) -> Timeline:
    """Parts that together move one joint at 1 unit/s."""
    segments, begin = [], 0.0
    for duration in durations:

        def sample(time: float, begin: float = begin) -> Reference:
            return Reference((begin + time,), (1.0,))

        segments.append(Segment(Phase.TRAJECTORY, duration, sample))
        begin += duration
    return Timeline(segments)


@given(DURATIONS, st.floats(-5.0, 60.0))
def test_the_reference_is_continuous_and_ends_are_held(durations: list[float], time: float) -> None:
    timeline = ramps(durations)
    assert timeline.duration == pytest.approx(sum(durations))
    expected = min(max(time, 0.0), timeline.duration)
    assert timeline.sample(time).positions[0] == pytest.approx(expected, abs=1e-9)


def test_each_time_belongs_to_its_part() -> None:
    timeline = Timeline(
        [hold(Phase.APPROACH, (1.0,), 1.0), hold(Phase.TRAJECTORY, (2.0,), 2.0)], zero=1.0
    )
    assert timeline.phase(0.999) is Phase.APPROACH
    assert timeline.phase(1.0) is Phase.TRAJECTORY
    assert timeline.phase(99.0) is Phase.TRAJECTORY
    assert timeline.sample(0.5) == Reference((1.0,), (0.0,))
    assert timeline.sample(1.5) == Reference((2.0,), (0.0,))
