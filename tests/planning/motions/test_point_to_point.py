"""Motions from state to state: invariants, and ruckig as the oracle of the fastest motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.planning import Trajectory, check, point_to_point, state_to_state
from bioscara.planning.profiles.double_s import durations, fastest, lasting
from bioscara.planning.profiles.segments import Bounds, MotionState, Profile
from bioscara.planning.trajectory.retiming import stretched
from planning.limits import LIMITS, NAMES

GOAL = (-0.26026, 0.0179, 0.53642, -0.69014)
"""Of data/planned_time_optimal.yaml, from zero; ``FIELD`` are the limits it was planned with."""

poses = st.tuples(*(st.floats(limit.lower, limit.upper) for limit in LIMITS))
shares = st.floats(-1.0, 1.0)


@dataclass(frozen=True)
class Limit:
    name: str
    max_velocity: float
    max_acceleration: float
    lower: float = -math.pi
    upper: float = math.pi
    unit: str = "rad"

    @property
    def max_jerk(self) -> float:
        return self.max_acceleration / 0.025


FIELD = [Limit("j1", 0.5, 2.0), Limit("j2", 1.0, 2.0), *(Limit(n, 5.0, 14.0) for n in ("j3", "j4"))]


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


def peer(
    starts: Sequence[MotionState], goals: Sequence[MotionState], limits: Sequence[Bounds]
) -> float:
    """Return the duration that ruckig finds [s]; its waypoints stay unset: they go to a server."""
    ruckig = pytest.importorskip("ruckig")
    planner, task = ruckig.Ruckig(len(starts)), ruckig.InputParameter(len(starts))
    for prefix, given_states in (("current", starts), ("target", goals)):
        for field in MotionState._fields:
            setattr(task, f"{prefix}_{field}", [getattr(state, field) for state in given_states])
    for field in Bounds._fields:
        setattr(task, f"max_{field}", [getattr(limit, field) for limit in limits])
    result = ruckig.Trajectory(len(starts))
    assert planner.calculate(task, result) in {ruckig.Result.Working, ruckig.Result.Finished}
    return float(result.duration)


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


@pytest.mark.parametrize("highest", [1e4, 1e5, 1e6])
def test_a_motion_with_a_loose_velocity_limit_takes_time(highest: float) -> None:
    goal = [1e-14 * highest**2]
    loose, tight = (point_to_point(["j"], [0.0], goal, [Limit("j", v, 1.0)]) for v in (highest, 10))
    assert loose.duration == pytest.approx(tight.duration, rel=1e-3)


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
        start, goal = (_random_state(rng, limits, rng.uniform(-3, 3)) for _ in range(2))
        ours = fastest(start, goal, limits).duration
        assert ours <= peer([start], [goal], [limits]) * 1.001


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


def test_random_states_of_four_joints_take_no_longer_than_ruckig() -> None:
    rng = np.random.default_rng(4)
    limits = [Bounds(l.max_velocity, l.max_acceleration, l.max_jerk) for l in LIMITS]  # noqa: E741
    spans = [limit.upper - limit.lower for limit in LIMITS]
    refused = 0
    for _ in range(500):
        starts, goals = (
            [
                _random_state(rng, bound, limit.lower + span * rng.uniform(0.2, 0.8))
                for bound, limit, span in zip(limits, LIMITS, spans, strict=True)
            ]
            for _ in range(2)
        )
        try:
            ours = state_to_state(NAMES, starts, goals, LIMITS)
        except TrajectoryError as refusal:
            assert "position" in str(refusal)  # noqa: PT017
            refused += 1
            continue
        assert ours.duration <= peer(starts, goals, limits) * 1.001
        _within(ours)
    assert refused < 250, "most stay between the position limits"


def _random_state(rng: np.random.Generator, limits: Bounds, position: float) -> MotionState:
    most, hardest, jerk = limits
    acceleration = rng.uniform(-1, 1) * min(hardest, math.sqrt(1.99 * jerk * most))
    room = most - acceleration**2 / (2.0 * jerk)
    return MotionState(position, rng.uniform(-room, room), acceleration)


def _within(motion: Trajectory, limits: Sequence[Limit] = LIMITS) -> None:
    """Assert that a motion keeps speed and acceleration on a grid of 1 ms."""
    _, velocities, accelerations = motion.sample_many(np.arange(0.0, motion.duration, 1e-3))
    for index, limit in enumerate(limits):
        assert np.abs(velocities[:, index]).max(initial=0.0) <= limit.max_velocity * (1 + 1e-9)
        peak = np.abs(accelerations[:, index]).max(initial=0.0)
        assert peak <= limit.max_acceleration * (1 + 1e-9)


@given(poses, poses, st.floats(0.05, 1.0), st.booleans())
def test_point_to_point_goes_from_rest_to_rest_within_limits(
    start: tuple[float, ...], goal: tuple[float, ...], speed: float, jerk_limited: bool
) -> None:
    motion = point_to_point(NAMES, start, goal, LIMITS, speed=speed, jerk_limited=jerk_limited)
    check(motion, LIMITS)
    check(stretched(motion, 1.5), LIMITS)
    _within(motion)
    first, last = motion.sample(0.0), motion.sample(motion.duration)
    if motion.duration:
        assert first.positions == start
    assert last == (goal, (0.0,) * len(NAMES), (0.0,) * len(NAMES))
    assert first.velocities == (0.0,) * len(NAMES)
    full = point_to_point(NAMES, start, goal, LIMITS, jerk_limited=jerk_limited)
    assert motion.duration == pytest.approx(full.duration / speed, rel=1e-6, abs=1e-7)
    positions, velocities, _ = motion.sample_many(np.linspace(0.0, motion.duration, 300))
    low, high = np.minimum(start, goal), np.maximum(start, goal)
    assert (positions >= low - 1e-9).all(), "no joint overshoots"
    assert (positions <= high + 1e-9).all(), "no joint overshoots"
    for index, limit in enumerate(LIMITS):
        assert np.abs(velocities[:, index]).max() <= speed * limit.max_velocity * (1 + 1e-9)


@pytest.mark.parametrize(("jerk_limited", "most"), [(False, 0.7706), (True, 0.7956)])
def test_the_reference_motion_is_within_its_bound_of_time(jerk_limited: bool, most: float) -> None:
    motion = point_to_point(NAMES, (0.0,) * 4, GOAL, FIELD, jerk_limited=jerk_limited)
    assert motion.duration <= most
    _within(motion, FIELD)
    assert motion.sample(motion.duration).positions == GOAL


def test_a_goal_that_is_the_start_takes_no_time() -> None:
    here = tuple(0.5 * (limit.lower + limit.upper) for limit in LIMITS)
    for jerk_limited in (True, False):
        motion = point_to_point(NAMES, here, here, LIMITS, jerk_limited=jerk_limited)
        assert motion.duration == 0.0
        assert motion.sample(0.0).positions == here


@pytest.mark.parametrize("speed", [0.0, 1e-200, 1e-120, 9e-4, -1.0, 10.0, math.nan])
def test_a_speed_out_of_range_is_refused(speed: float) -> None:
    with pytest.raises(InvalidArgumentError, match=r"speed .* outside 0\.001 \.\. 1|nan"):
        point_to_point(NAMES, (0.0,) * 4, GOAL, LIMITS, speed=speed)


@pytest.mark.parametrize("speed", [1.0, 0.3])
def test_from_beyond_a_limit_a_motion_only_leads_back(speed: float) -> None:
    start, goal = (-3.2, 0.35, 2.9, 0.0), (-3.0, 0.338, -2.6, 0.5)
    way = point_to_point(NAMES, start, goal, LIMITS, speed=speed)
    positions, _, _ = way.sample_many(np.linspace(0.0, way.duration, 1000))
    assert positions[0] == pytest.approx(start)
    assert positions[-1] == pytest.approx(goal)
    forth = np.diff(positions, axis=0) * np.sign(np.subtract(goal, start))
    assert forth.min() > -1e-9


@pytest.mark.parametrize(
    ("start", "goal", "words"),
    [
        ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 2.7, 0.0), r"j3: goal 2\.7 rad is outside -2\.6"),
        ((0.0, 0.0, 0.0, 0.0), (0.0, 150.0, 0.0, 0.0), "j2: goal 150 m is .* millimetres"),
        ((0.0, 0.0, 0.0, 0.0), (30.0, 0.1, 0.0, 0.0), "j1: goal 30 rad is .* degrees"),
        ((0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 0.0), "j1: goal is nan"),
        ((0.0, 0.0, math.inf, 0.0), (0.0, 0.0, 0.0, 0.0), "j3: start is inf"),
        ((0.0, 0.0), (0.0, 0.0, 0.0, 0.0), "start: 2 values for 4 joints"),
    ],
)
def test_positions_beyond_limits_or_not_finite_are_refused(
    start: tuple[float, ...], goal: tuple[float, ...], words: str
) -> None:
    with pytest.raises(TrajectoryError, match=words):
        point_to_point(NAMES, start, goal, LIMITS)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        (MotionState(0.0, 1.1, 0.0), r"j1: velocity of the start, 1\.1 rad/s, exceeds .* 1 rad/s"),
        (MotionState(0.0, 0.0, -3.0), r"j1: acceleration of the start, -3 rad/s\^2, exceeds"),
        (
            MotionState(0.0, 0.99, 2.0),
            r"j1: velocity where the acceleration is zero of the start, 1\.0",
        ),
        (MotionState(0.0, math.nan, 0.0), "j1: velocity of the start, nan"),
        (MotionState(3.0, 0.9, 0.0), r"j1 at .* position 3\.\d+ rad is outside"),
    ],
)
def test_states_that_cannot_be_left_are_refused(start: MotionState, words: str) -> None:
    rest = [MotionState(0.0)] * 3
    with pytest.raises(TrajectoryError, match=words):
        state_to_state(NAMES, [start, *rest], [MotionState(0.0), *rest], LIMITS)
