"""The tool's highest speed is found in every segment, in a trajectory of any length."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from bioscara.kinematics import Joints, batch
from bioscara.planning.limits import REDUCED_SPEED
from bioscara.planning.motions.point_to_point import point_to_point
from bioscara.planning.motions.tool_speed import peak_tool_speed, reduced
from bioscara.planning.trajectory.trajectory import Trajectory
from planning.limits import LIMITS, NAMES
from planning.scenes import ARM, random_joints

HERE = Joints(0.0, 0.2, 1.0, 0.0)


def dense(trajectory: Trajectory, begin: float, end: float) -> float:
    """Return the largest speed of the tool at very many instants [m/s]."""
    # At its very end a trajectory is at rest, at any speed of arrival.
    times = np.linspace(begin, np.nextafter(end, 0.0), 20_001)
    # Where the velocity jumps, at a point of the trajectory, the speed before it counts too.
    times = np.union1d(times, np.nextafter(trajectory.times[1:], 0.0))
    positions, velocities, _ = trajectory.sample_many(times)
    return float(batch.tool_speeds(ARM, positions, velocities).max())


@given(st.integers(0, 2**32 - 1))
@example(2521)
@settings(max_examples=20)
def test_no_instant_is_faster_than_the_peak(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 8))
    times = np.cumsum(rng.uniform(0.1, 3.0, count))
    places = np.cumsum(0.2 * rng.normal(size=(count, 4)), axis=0)
    velocities, accelerations = 0.3 * rng.normal(size=(2, count, 4))
    for trajectory in (
        point_to_point(NAMES, random_joints(rng), random_joints(rng), LIMITS),
        Trajectory(NAMES, times, places),
        Trajectory(NAMES, times, places, velocities),
        Trajectory(NAMES, times, places, velocities, accelerations),
    ):
        fastest = dense(trajectory, trajectory.times[0], trajectory.duration)
        peak = peak_tool_speed(trajectory, ARM, HERE)
        assert fastest <= peak * (1.0 + 1e-5)
        assert peak <= fastest * (1.0 + 1e-3)


@pytest.mark.parametrize("wait", [10.0, 4e3, 4e4, 1e5])
def test_the_tool_is_slow_also_in_a_long_trajectory(wait: float) -> None:
    """The arm waits for hours, moves for half a second and waits again."""
    motion = point_to_point(NAMES, HERE, (0.2, 0.2, 1.3, 0.5), LIMITS)
    rest = np.zeros(4)
    long = Trajectory(
        NAMES,
        np.concatenate(([0.0], wait / 2.0 + motion.times, [wait])),
        np.vstack((HERE, motion.positions, motion.positions[-1])),
        np.vstack((rest, motion.velocities, rest)),
    )
    slowed, factor = reduced(long, ARM, HERE)
    assert factor > 1.0
    fastest = dense(slowed, slowed.times[1], slowed.times[-2])
    assert fastest == pytest.approx(REDUCED_SPEED, rel=1e-5)
