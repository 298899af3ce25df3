"""Averages that suppress the oscillation of a belt, and motions averaged with them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from bioscara.kinematics import Joints, Pose, batch
from bioscara.planning import Trajectory, Waypoint, check, linear, point_to_point, sequence
from bioscara.planning.moving_average import Smoothed, averaged, most_jerk, velocity_jumps
from planning.limits import LIMITS, NAMES, ROUGH
from planning.scenes import ARM

PERIOD, WINDOW = 0.01, 0.23
START = Joints(-0.6, 0.2, 1.2, -0.6)
REST = (0.0, 0.0, 0.0, 0.0)


def for_all(value: float) -> tuple[float, float, float, float]:
    """Return different values for the joints, of which the third is tested."""
    return -value, 2.0 * value, value, 0.5 * value


def swung(velocities: np.ndarray, period: float) -> np.ndarray:
    """Return the velocity of a load without damping behind a belt, each millisecond."""
    omega, step = 2.0 * math.pi / period, 1e-4
    dense = np.interp(
        np.arange(0.0, PERIOD * (len(velocities) - 1), step),
        PERIOD * np.arange(len(velocities)),
        velocities,
    )
    twist = load = 0.0
    loads = []
    for motor in dense:
        load += omega**2 * twist * step
        twist += (motor - load) * step
        loads.append(load)
    return np.array(loads[::10])


@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.integers(1, 60)), min_size=1, max_size=8))
def test_a_load_is_never_faster_than_the_averaged_command(parts: list[tuple[float, int]]) -> None:
    average, sent = Smoothed((0.2,), REST), [0.0]
    for value, count in parts:
        sent += [average.step(for_all(value), PERIOD)[2] for _ in range(count)]
    sent += [average.step(for_all(parts[-1][0]), PERIOD)[2] for _ in range(30)]
    highest = max(abs(value) for value, _ in parts)
    assert np.abs(swung(np.array(sent), 0.2)).max() <= highest * 1.01 + 1e-6
    assert sent[-1] == pytest.approx(parts[-1][0])


@given(
    st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=40),
    st.lists(st.floats(-1.0, 1.0), min_size=1, max_size=40),
)
def test_predicted_averages_are_the_later_ones(before: list[float], after: list[float]) -> None:
    average = Smoothed((WINDOW, 0.11), REST)
    for value in before:
        average.step(for_all(value), PERIOD)
    ahead = average.ahead(np.array([for_all(value) for value in after]), PERIOD)[:, 2]
    come = [average.step(for_all(value), PERIOD)[2] for value in after]
    assert ahead == pytest.approx(come, abs=1e-9)


def test_an_average_has_the_same_displacement_also_when_periods_differ() -> None:
    rng = np.random.default_rng(3)
    average, asked, sent = Smoothed((WINDOW, 0.107), REST), 0.0, 0.0
    for cycle in range(400):
        period = float(rng.uniform(0.008, 0.012))
        value = float(rng.uniform(-1.0, 1.0)) if cycle < 300 else 0.0
        asked += value * period
        sent += average.step(for_all(value), period)[2] * period
    assert sent == pytest.approx(asked, abs=5e-3)
    assert average.step(REST, PERIOD) == REST


def test_a_line_that_is_averaged_stays_on_its_path_within_all_limits() -> None:
    here = ARM.forward(START)
    goal = Pose(here.x - 0.1, here.y + 0.3, here.z + 0.02, here.yaw + 0.3)
    jumping = linear(ARM, START, goal, LIMITS)
    gentle = linear(ARM, START, goal, LIMITS, window=WINDOW)
    check(gentle, LIMITS)
    times = np.arange(0.0, gentle.duration, 1e-3)
    positions, velocities, _ = gentle.sample_many(times)
    poses = batch.forward(ARM, positions)[:, :3]
    way = np.array(goal[:3]) - here[:3]
    off = np.cross(poses - here[:3], way / np.linalg.norm(way))
    assert np.linalg.norm(off, axis=1).max() < 2e-6
    assert batch.tool_speeds(ARM, positions, velocities).max() <= 0.25 * (1.0 + 1e-5)
    assert jumping.duration + WINDOW < gentle.duration * 1.001 < jumping.duration + 2.0 * WINDOW
    assert (most_jerk(gentle) < 0.5 * most_jerk(jumping)).all()


def test_a_blend_is_passed_no_faster_than_it_can_be() -> None:
    here = ARM.forward(START)
    ways = [
        Waypoint(here._replace(x=here.x - 0.1), blend=0.01),
        Waypoint(here._replace(x=here.x - 0.1, y=here.y + 0.1)),
    ]
    jumping = sequence(ARM, START, ways, LIMITS).trajectory
    gentle = sequence(ARM, START, ways, LIMITS, window=WINDOW).trajectory
    check(gentle, LIMITS)
    assert gentle.duration < 1.6 * jumping.duration


def test_a_motion_of_joints_that_is_averaged_takes_a_window_longer() -> None:
    goal = (0.4, 0.25, 0.2, 0.9)
    motion = point_to_point(NAMES, START, goal, ROUGH)
    gentle = averaged(motion, WINDOW)
    check(gentle, LIMITS)
    assert gentle.duration == pytest.approx(motion.duration + WINDOW)
    assert gentle.positions[-1] == pytest.approx(goal)
    most = [2.0 * limit.max_acceleration / WINDOW for limit in LIMITS]
    assert (most_jerk(gentle) <= np.array(most) * 1.02).all()


def test_a_jump_of_the_velocity_is_found_and_is_one_of_the_jerk() -> None:
    smooth = point_to_point(NAMES, START, (0.4, 0.25, 0.2, 0.9), ROUGH)
    points = smooth.positions[[0, -1]]
    straight = Trajectory(NAMES, (0.0, smooth.duration), points)
    moving = Trajectory(NAMES, (0.0, smooth.duration), points, ((0.1, 0.0, 0.0, 0.0), REST))
    assert not velocity_jumps(smooth)
    assert not velocity_jumps(Trajectory(NAMES, (0.0,), points[:1]))
    for jumping in (straight, moving):
        assert velocity_jumps(jumping)
        assert (most_jerk(jumping) > 2.0 * most_jerk(smooth))[0]
        assert not velocity_jumps(averaged(jumping, WINDOW))
