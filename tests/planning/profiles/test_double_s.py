"""Motions of one joint from state to state: fastest, or of a given duration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bioscara.planning.profiles.double_s import durations, fastest, lasting
from bioscara.planning.profiles.segments import Bounds, MotionState, Profile
from planning.states import random_state, ruckig_duration

shares = st.floats(-1.0, 1.0)


@st.composite
def bounds(draw: st.DrawFn) -> Bounds:
    return Bounds(*(draw(st.floats(0.05, 20.0)) for _ in range(2)), draw(st.floats(0.5, 500.0)))


@st.composite
def states(draw: st.DrawFn, limits: Bounds) -> MotionState:
    """Draw a state that the joint can have reached and can leave."""
    most, hardest, jerk = limits
    acceleration = draw(shares) * min(hardest, math.sqrt(1.999 * jerk * most))
    room = most - acceleration**2 / (2.0 * jerk)
    return MotionState(draw(st.floats(-3.0, 3.0)), draw(shares) * max(room, 0.0), acceleration)


@st.composite
def problems(draw: st.DrawFn) -> tuple[MotionState, MotionState, Bounds]:
    limits = draw(bounds())
    return draw(states(limits)), draw(states(limits)), limits


def obeys(profile: Profile, start: MotionState, goal: MotionState, limits: Bounds) -> None:
    assert profile.at(0.0) == start
    assert profile.at(profile.duration) == pytest.approx(goal, rel=1e-9, abs=1e-9)
    for time in np.arange(0.0, min(profile.duration, 3.0), 1e-3).tolist():
        _, velocity, acceleration = profile.at(time)
        assert abs(velocity) <= limits.velocity * (1.0 + 1e-9)
        assert abs(acceleration) <= limits.acceleration * (1.0 + 1e-9)
    for knot in profile.knots:
        assert abs(knot.jerk) <= limits.jerk * (1.0 + 1e-12)


@given(problems())
def test_the_fastest_motion_obeys(problem: tuple[MotionState, MotionState, Bounds]) -> None:
    start, goal, limits = problem
    profile = fastest(start, goal, limits)
    obeys(profile, start, goal, limits)
    assert profile.duration == pytest.approx(durations(start, goal, limits)[0], rel=1e-12)


@pytest.mark.parametrize("acceleration", [0.75, -0.75, 0.0])
@pytest.mark.parametrize("difference", [0.0, 1e-18, -1e-18])
def test_a_state_that_is_the_goal_takes_no_time(acceleration: float, difference: float) -> None:
    here, there = MotionState(0.3, 0.0, acceleration), MotionState(0.3, difference, acceleration)
    assert fastest(here, there, Bounds(1.0, 1.0, 7.5)).duration == 0.0


@given(st.data(), st.floats(1e-8, 1.0), st.sampled_from([1e4, 1e6]))
def test_limits_that_are_not_reached_make_no_difference(
    data: st.DataObject, way: float, loose: float
) -> None:
    """A motion that stays far below the limits still ends at its goal."""
    jerk = 40.0
    # The orders of magnitude that belong to the displacement at that jerk.
    sizes = way, 0.25 * (jerk * way * way) ** (1 / 3), 0.25 * (jerk * jerk * way) ** (1 / 3)
    start, goal = (MotionState(*(data.draw(shares) * size for size in sizes)) for _ in range(2))
    least = fastest(start, goal, Bounds(100.0, 100.0, jerk)).duration
    for limits in (
        Bounds(loose, 100.0, jerk),
        Bounds(100.0, loose, jerk),
        Bounds(loose, loose, jerk),
    ):
        longer = lasting(2.0 * durations(start, goal, limits)[-1], start, goal, limits)
        assert longer is not None
        for profile in (fastest(start, goal, limits), longer):
            assert profile.at(profile.duration) == pytest.approx(goal, abs=1e-9)
        assert fastest(start, goal, limits).duration == pytest.approx(least, rel=1e-6, abs=1e-9)


def test_the_possible_durations_of_a_fast_joint_have_a_gap() -> None:
    start, goal, limits = MotionState(0.0, 1.0), MotionState(0.4, 1.0), Bounds(1.0, 2.0, 80.0)
    least, *_, last = durations(start, goal, limits)
    assert least == pytest.approx(0.4)
    assert last > 1.0
    assert lasting(0.5 * (least + last), start, goal, limits) is None
    profile = lasting(last + 0.1, start, goal, limits)
    assert profile is not None
    obeys(profile, start, goal, limits)


def test_random_states_of_one_joint_take_no_longer_than_ruckig() -> None:
    rng = np.random.default_rng(5)  # no odd ones: ruckig ends the process on some of them
    for _ in range(500):
        limits = Bounds(*rng.uniform((0.1, 0.1, 0.5), (5.0, 20.0, 500.0)).tolist())
        start, goal = (random_state(rng, limits, rng.uniform(-3, 3)) for _ in range(2))
        ours = fastest(start, goal, limits).duration
        assert ours <= ruckig_duration([start], [goal], [limits]) * 1.001


@given(problems(), st.floats(0.0, 5.0))
def test_a_motion_of_a_duration_is_found_where_there_is_one(
    problem: tuple[MotionState, MotionState, Bounds], extra: float
) -> None:
    start, goal, limits = problem
    changes = durations(start, goal, limits)
    duration = changes[0] + extra
    profile = lasting(duration, start, goal, limits)
    if profile is None:
        assert duration < changes[-1], "from the last change on every duration is possible"
    else:
        assert profile.duration == pytest.approx(duration, rel=1e-12)
        obeys(profile, start, goal, limits)
