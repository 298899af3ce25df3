"""Stretching of a trajectory in time so that it can be executed."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.errors import TrajectoryError
from bioscara.planning.limits import JointLimits
from bioscara.planning.trajectory.extrema import joint_extrema
from bioscara.planning.trajectory.trajectory import Trajectory
from bioscara.planning.trajectory.validation import check


def stretched(trajectory: Trajectory, factor: float) -> Trajectory:
    """Return the same path with ``factor`` times the duration.

    Velocities become 1/factor, accelerations 1/factor^2 of the former ones.
    """
    velocities, accelerations = trajectory.velocities, trajectory.accelerations
    cubic = velocities is not None and accelerations is None
    return Trajectory(
        trajectory.joint_names,
        trajectory.times * factor,
        trajectory.positions,
        None if velocities is None else velocities / factor,
        None if accelerations is None else accelerations / factor**2,
        cubics=trajectory.coefficients[..., 2:4] / (factor**2, factor**3) if cubic else None,
    )


def stretch_factor(trajectory: Trajectory, limits: Sequence[JointLimits]) -> float:
    """Return the least time factor with which velocities and accelerations meet every limit.

    It is at least 1.

    Args:
        trajectory: The trajectory.
        limits: Of the joints; joints without limits are skipped.
    """
    by_name = {limit.name: limit for limit in limits}
    factor = 1.0
    for name, ranges in zip(trajectory.joint_names, joint_extrema(trajectory), strict=True):
        if name not in by_name:
            continue  # check() reports it
        limit = by_name[name]
        fastest = abs(ranges.velocity.largest.value)
        hardest = abs(ranges.acceleration.largest.value)
        factor = max(
            factor,
            fastest / limit.max_velocity,
            math.sqrt(hardest / limit.max_acceleration),
        )
    return factor


def fit(trajectory: Trajectory, limits: Sequence[JointLimits]) -> tuple[Trajectory, float]:
    """Stretch a trajectory in time by the least factor that meets every limit.

    Args:
        trajectory: The trajectory to fit.
        limits: Of all joints of the arm.

    Returns:
        The trajectory and the factor, 1.0 if it fits already.

    Raises:
        TrajectoryError: It cannot be fitted: an unknown joint, or a position limit.
    """
    factor = stretch_factor(trajectory, limits)
    if not math.isfinite(factor):
        raise TrajectoryError("the trajectory cannot be fitted: a limit is zero")
    result = trajectory if factor == 1.0 else stretched(trajectory, factor)
    check(result, limits)
    return result, factor
