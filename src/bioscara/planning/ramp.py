"""Simple motions that need no path: to a pose, and to rest."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.planning.limits import JointLimits
from bioscara.planning.trajectory import Trajectory

_PEAK_VELOCITY = 15.0 / 8.0
"""Peak of the time law 10 s^3 - 15 s^4 + 6 s^5 in way per time (its derivative at 1/2)."""

_PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
"""... and in way per time squared (its second derivative at 1/2 - 1/sqrt(12))."""

_SHORTEST = 0.02
"""A ramp takes at least this long [s], so that its polynomials stay well conditioned."""


def ramp(
    joint_names: Sequence[str],
    start: Sequence[float],
    goal: Sequence[float],
    limits: Sequence[JointLimits],
    scale: float = 1.0,
) -> Trajectory:
    """Return a motion from rest to rest in which all joints start and end together.

    Each joint follows the quintic time law with zero velocity and acceleration at both ends.

    Args:
        joint_names: The joints.
        start: Where they are [rad or m].
        goal: Where they go [rad or m].
        limits: Of these joints, in the same order.
        scale: Share of the speed limits to use, above 0 and at most 1; accelerations use its
            square.

    Raises:
        InvalidArgumentError: The scale is outside its range.
        TrajectoryError: The goal is outside the position limits, or a value is not finite.
    """
    if not 0.0 < scale <= 1.0:
        raise InvalidArgumentError(f"speed scale {scale} is outside 0 .. 1 (0 excluded)")
    duration = _SHORTEST
    for limit, here, there in zip(limits, start, goal, strict=True):
        if not (math.isfinite(here) and math.isfinite(there)):
            raise TrajectoryError(f"{limit.name}: cannot plan from {here} to {there}")
        if not limit.lower - 1e-6 <= there <= limit.upper + 1e-6:
            raise TrajectoryError(
                f"{limit.name}: goal {there:.6g} {limit.unit} is outside {limit.lower:g} .. "
                f"{limit.upper:g} {limit.unit}"
            )
        way = abs(there - here)
        duration = max(
            duration,
            _PEAK_VELOCITY * way / (scale * limit.max_velocity),
            math.sqrt(_PEAK_ACCELERATION * way / (scale**2 * limit.max_acceleration)),
        )
    rest = [[0.0] * len(joint_names)] * 2
    return Trajectory(joint_names, (0.0, duration), (tuple(start), tuple(goal)), rest, rest)


def stop_ramp(
    joint_names: Sequence[str],
    positions: Sequence[float],
    velocities: Sequence[float],
    limits: Sequence[JointLimits],
) -> Trajectory:
    """Return the motion that brings moving joints to rest together, each at constant deceleration.

    Args:
        joint_names: The joints.
        positions: Where they are [rad or m].
        velocities: How they move [rad/s or m/s].
        limits: Of these joints, in the same order; the slowest to stop sets the time.
    """
    duration = max(
        _SHORTEST,
        *(
            abs(velocity) / limit.max_acceleration
            for velocity, limit in zip(velocities, limits, strict=True)
        ),
    )
    ends = [
        position + velocity * duration / 2.0
        for position, velocity in zip(positions, velocities, strict=True)
    ]
    # With these ends the cubic between the points is the parabola of constant deceleration.
    return Trajectory(
        joint_names,
        (0.0, duration),
        (tuple(positions), ends),
        (tuple(velocities), (0.0,) * len(ends)),
    )
