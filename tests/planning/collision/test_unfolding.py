"""Motions by an open elbow: their positions, and that they are one motion at rest at each."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, strategies as st

from bioscara.kinematics import Joints
from bioscara.planning import check, point_to_point
from bioscara.planning.collision.unfolding import OPEN, by_open_elbow, joined
from planning.limits import LIMITS

NAMES = tuple(limit.name for limit in LIMITS)
places = st.builds(Joints, *(st.floats(limit.lower, limit.upper) for limit in LIMITS))


def legs(stations: list[Joints]):  # type: ignore[no-untyped-def]
    return [point_to_point(NAMES, a, b, LIMITS) for a, b in pairwise(stations)]


@given(places, places)
def test_folded_only_the_elbow_moves(start: Joints, goal: Joints) -> None:
    stations = by_open_elbow(start, goal)
    assert (stations[0], stations[-1]) == (start, goal)
    assert len(stations) == 2 + (abs(start.j3) > OPEN) + (abs(goal.j3) > OPEN)
    for before, after in pairwise(stations):
        if max(abs(before.j3), abs(after.j3)) > OPEN:
            assert before._replace(j3=0.0) == after._replace(j3=0.0)


@given(places, places)
def test_it_is_one_motion_within_the_limits_that_rests_at_each_place(
    start: Joints, goal: Joints
) -> None:
    stations = by_open_elbow(start, goal)
    parts = legs(stations)
    whole = joined(parts)
    check(whole, LIMITS)
    assert whole.duration == pytest.approx(sum(part.duration for part in parts))
    times = np.cumsum([0.0, *(part.duration for part in parts)])
    at, rates, _ = whole.sample_many(times)
    assert at == pytest.approx(np.array(stations), abs=1e-9)
    assert rates == pytest.approx(np.zeros_like(rates), abs=1e-6)
    some = np.linspace(0.0, parts[-1].duration, 20)
    expected = parts[-1].sample_many(some)[0]
    assert whole.sample_many(times[-2] + some)[0] == pytest.approx(expected, abs=1e-9)


def test_a_motion_to_the_same_position_is_empty() -> None:
    here = Joints(0.1, 0.1, 0.1, 0.1)
    assert joined(legs([here, here, here])).duration == 0.0
