"""Times and velocities for points that have positions only."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from bioscara.control.controllers.joint_trajectory.goal_messages import JointTrajectory, Point


def timed(trajectory: JointTrajectory, frequency: float) -> JointTrajectory:
    """Return a trajectory with its points at a frequency, if it has no times.

    Args:
        trajectory: As sent; without times every ``time`` is 0.
        frequency: Points per second [Hz], the first 1 / ``frequency`` after the start; 0 changes
            nothing.
    """
    if not frequency or any(point.time for point in trajectory.points):
        return trajectory
    return JointTrajectory(
        trajectory.joint_names,
        tuple(
            point._replace(time=(index + 1) / frequency)
            for index, point in enumerate(trajectory.points)
        ),
        trajectory.stamp,
    )


def upsampled(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return points with the velocities of the cubic spline through their positions.

    The spline is twice continuously differentiable, and at rest at both ends. Points of which one
    has velocities or accelerations are returned as they are.

    Args:
        points: Checked; times increase strictly.
    """
    if any(point.velocities or point.accelerations for point in points):
        return tuple(points)
    times = [point.time for point in points]
    columns = zip(*(point.positions for point in points), strict=True)
    velocities = zip(*(_spline_velocities(times, column) for column in columns), strict=True)
    return tuple(
        point._replace(velocities=tuple(row)) for point, row in zip(points, velocities, strict=True)
    )


def _spline_velocities(times: Sequence[float], positions: Sequence[float]) -> list[float]:
    """Return the velocities at which accelerations agree from piece to piece.

    Elimination in the tridiagonal system
    ``v[i-1]/h[i-1] + 2 v[i] (1/h[i-1] + 1/h[i]) + v[i+1]/h[i] = 3 (s[i-1]/h[i-1] + s[i]/h[i])``
    with the lengths ``h`` and the slopes ``s`` of the pieces.
    """
    inverse = [1.0 / (after - before) for before, after in pairwise(times)]
    slopes = [
        (after - before) * each
        for (before, after), each in zip(pairwise(positions), inverse, strict=True)
    ]
    factors, rests = [0.0], [0.0]
    for index in range(1, len(inverse)):
        left, right = inverse[index - 1], inverse[index]
        pivot = 2.0 * (left + right) - left * factors[-1]
        side = 3.0 * (slopes[index - 1] * left + slopes[index] * right)
        rests.append((side - left * rests[-1]) / pivot)
        factors.append(right / pivot)
    velocities = [0.0]
    if inverse:
        for factor, rest in zip(reversed(factors[1:]), reversed(rests[1:]), strict=True):
            velocities.append(rest - factor * velocities[-1])
        velocities.append(0.0)
    return velocities[::-1]
