"""Keeps the tool at or below a speed by taking more time for the same path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.kinematics import Scara, batch
from bioscara.planning.fit import stretched
from bioscara.planning.trajectory import Array, Trajectory

REDUCED_SPEED = 0.25
"""Speed of the tool until full speed is asked for [m/s]: the reduced speed of ISO 10218-1."""
_STEP, _SAMPLES = 1e-3, 50_000


def peak_tool_speed(trajectory: Trajectory, arm: Scara, elsewhere: Sequence[float]) -> float:
    """Return how fast the tool gets on a trajectory [m/s].

    Looked at each millisecond; a trajectory longer than 50 s at 50000 instants.

    Args:
        trajectory: For some or all of the joints.
        arm: The arm with its tool.
        elsewhere: Where the joints are that the trajectory does not name [rad, m, rad, rad].

    Raises:
        TrajectoryError: It names a joint that the arm does not have.
    """
    names = [limit.name for limit in arm.limits]
    unknown = [name for name in trajectory.joint_names if name not in names]
    if unknown:
        raise TrajectoryError(f"{unknown[0]} is not a joint of the arm; it has {', '.join(names)}")
    count = min(max(int(trajectory.duration / _STEP) + 2, 2), _SAMPLES)
    positions, velocities, _ = trajectory.sample_many(np.linspace(0.0, trajectory.duration, count))
    joints = np.tile(np.asarray(elsewhere, dtype=np.float64), (count, 1))
    rates = np.zeros_like(joints)
    columns = [names.index(name) for name in trajectory.joint_names]
    joints[:, columns], rates[:, columns] = positions, velocities
    return _peak(batch.tool_speeds(arm, joints, rates))


def _peak(speeds: Array) -> float:
    """Return the largest speed, also between evenly spaced samples."""
    before, here, after = speeds[:-2], speeds[1:-1], speeds[2:]
    top = (here >= before) & (here >= after) & (2.0 * here > before + after)
    # The summit of the parabola through three samples.
    rise, bend = (after - before)[top], (2.0 * here - before - after)[top]
    return float(np.max(here[top] + rise * rise / (8.0 * bend), initial=speeds.max()))


def reduced(
    trajectory: Trajectory, arm: Scara, elsewhere: Sequence[float], speed: float = REDUCED_SPEED
) -> tuple[Trajectory, float]:
    """Return the trajectory in so much more time that the tool keeps to a speed.

    Args:
        trajectory: For some or all of the joints.
        arm: The arm with its tool.
        elsewhere: Where the joints are that the trajectory does not name [rad, m, rad, rad].
        speed: Of the tool [m/s].

    Returns:
        The trajectory and the factor, 1.0 where it is slow enough as it is.

    Raises:
        InvalidArgumentError: The speed is not above zero.
        TrajectoryError: It names a joint that the arm does not have.
    """
    if not speed > 0.0:
        raise InvalidArgumentError(f"tool speed {speed} m/s must be above zero")
    peak = peak_tool_speed(trajectory, arm, elsewhere)
    if peak <= speed:
        return trajectory, 1.0
    return stretched(trajectory, peak / speed), peak / speed
