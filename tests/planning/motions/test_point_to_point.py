"""Motions of several joints: invariants, and ruckig as the oracle of the fastest motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.planning import Trajectory, check, point_to_point
from bioscara.planning.motions.double_s import Bounds
from bioscara.planning.trajectory.retiming import stretched
from planning.limits import LIMITS, NAMES, ROUGH
from planning.peers import ruckig_duration

GOAL = (-0.26026, 0.0179, 0.53642, -0.69014)
"""Of data/planned_time_optimal.yaml, from zero; ``FIELD`` are the limits it was planned with."""

poses = st.tuples(*(st.floats(limit.lower, limit.upper) for limit in LIMITS))


@dataclass(frozen=True)
class Limit:
    name: str
    max_velocity: float
    max_acceleration: float
    lower: float = -math.pi
    upper: float = math.pi
    unit: str = "rad"
    jerk: float = math.nan

    @property
    def max_jerk(self) -> float:
        return self.max_acceleration / 0.025 if math.isnan(self.jerk) else self.jerk


FIELD = [Limit("j1", 0.5, 2.0), Limit("j2", 1.0, 2.0), *(Limit(n, 5.0, 14.0) for n in ("j3", "j4"))]


@pytest.mark.parametrize("highest", [1e4, 1e5, 1e6])
def test_a_motion_with_a_loose_velocity_limit_takes_time(highest: float) -> None:
    goal = [1e-14 * highest**2]
    loose, tight = (point_to_point(["j"], [0.0], goal, [Limit("j", v, 1.0)]) for v in (highest, 10))
    assert loose.duration == pytest.approx(tight.duration, rel=1e-3)


def test_random_motions_of_four_joints_take_no_longer_than_ruckig() -> None:
    rng = np.random.default_rng(4)
    limits = [Bounds(l.max_velocity, l.max_acceleration, l.max_jerk) for l in LIMITS]  # noqa: E741
    lower = np.array([limit.lower for limit in LIMITS])
    span = np.array([limit.upper for limit in LIMITS]) - lower
    for _ in range(500):
        # From a thousandth of the range on: each limit is the one that counts in some of them.
        start = lower + span * rng.uniform(0.0, 1.0, 4)
        goal = np.clip(
            start + span * rng.uniform(-1.0, 1.0, 4) * 10.0 ** rng.uniform(-3.0, 0.0),
            lower,
            lower + span,
        )
        ours = point_to_point(NAMES, start.tolist(), goal.tolist(), LIMITS)
        assert ours.duration <= ruckig_duration(start, goal, limits) * 1.001
        _within(ours)


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
    limits = LIMITS if jerk_limited else ROUGH
    motion = point_to_point(NAMES, start, goal, limits, velocity_scaling=speed)
    check(motion, LIMITS)
    check(stretched(motion, 1.5), LIMITS)
    _within(motion)
    first, last = motion.sample(0.0), motion.sample(motion.duration)
    if motion.duration:
        assert first.positions == start
    assert last == (goal, (0.0,) * len(NAMES), (0.0,) * len(NAMES))
    assert first.velocities == (0.0,) * len(NAMES)
    full = point_to_point(NAMES, start, goal, limits)
    assert motion.duration == pytest.approx(full.duration / speed, rel=1e-6, abs=1e-7)
    positions, velocities, _ = motion.sample_many(np.linspace(0.0, motion.duration, 300))
    low, high = np.minimum(start, goal), np.maximum(start, goal)
    assert (positions >= low - 1e-9).all(), "no joint overshoots"
    assert (positions <= high + 1e-9).all(), "no joint overshoots"
    for index, limit in enumerate(LIMITS):
        assert np.abs(velocities[:, index]).max() <= speed * limit.max_velocity * (1 + 1e-9)


@pytest.mark.parametrize(("jerk_limited", "most"), [(False, 0.7706), (True, 0.7956)])
def test_the_reference_motion_is_within_its_bound_of_time(jerk_limited: bool, most: float) -> None:
    limits = FIELD if jerk_limited else [replace(each, jerk=math.inf) for each in FIELD]
    motion = point_to_point(NAMES, (0.0,) * 4, GOAL, limits)
    assert motion.duration <= most
    _within(motion, FIELD)
    assert motion.sample(motion.duration).positions == GOAL


def test_a_goal_that_is_the_start_takes_no_time() -> None:
    here = tuple(0.5 * (limit.lower + limit.upper) for limit in LIMITS)
    for limits in (LIMITS, ROUGH):
        motion = point_to_point(NAMES, here, here, limits)
        assert motion.duration == 0.0
        assert motion.sample(0.0).positions == here


@pytest.mark.parametrize("speed", [0.0, 1e-200, 1e-120, 9e-4, -1.0, 10.0, math.nan])
def test_a_speed_out_of_range_is_refused(speed: float) -> None:
    with pytest.raises(InvalidArgumentError, match=r"scaling .* outside 0\.001 \.\. 1|nan"):
        point_to_point(NAMES, (0.0,) * 4, GOAL, LIMITS, velocity_scaling=speed)


@pytest.mark.parametrize("speed", [1.0, 0.3])
def test_from_beyond_a_limit_a_motion_only_leads_back(speed: float) -> None:
    start, goal = (-3.2, 0.35, 2.9, 0.0), (-3.0, 0.338, -2.6, 0.5)
    way = point_to_point(NAMES, start, goal, LIMITS, velocity_scaling=speed)
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
