"""The motion that a goal asks for, from where the arm rests."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.control.controllers.joint_trajectory import Point
from bioscara.planning import Trajectory
from bioscara.planning.limits import JointLimits
from bioscara.planning.trajectory.retiming import stretch_factor, stretched
from bioscara.planning.trajectory.validation import TOLERANCE

_AT_FIRST = 1e-4
"""Distance [rad or m] up to which the arm counts as being at the first point."""


def course_of(
    joint_names: Sequence[str],
    points: Sequence[Point],
    here: Sequence[float],
    limits: Sequence[JointLimits],
) -> Trajectory:
    """Return the motion from where the arm rests to the first point, and through all points.

    A first point at time 0 is approached in the time that the joints need for that, and the others
    come later by as much.

    Args:
        joint_names: The joints.
        points: Points of one form: positions alone, with velocities, or with accelerations too.
        here: Positions of the joints [rad or m].
        limits: Of the joints, in the same order.
    """
    first = points[0]
    nothing = (0.0,) * len(here)
    start = Point(
        0.0,
        tuple(here),
        nothing if first.velocities else (),
        nothing if first.accelerations else (),
    )
    times = [point.time for point in points]
    if first.time > 0.0:
        points, times = (start, *points), [0.0, *times]
    elif math.dist(first.positions, here) <= _AT_FIRST:
        points = (first._replace(positions=start.positions), *points[1:])
    else:
        lead = _lead_time(first, here, limits)
        points, times = (start, *points), [0.0, *(lead + time for time in times)]
    moving = bool(first.velocities)
    return Trajectory(
        joint_names,
        times,
        [point.positions for point in points],
        [point.velocities for point in points] if moving else None,
        [point.accelerations for point in points] if moving and first.accelerations else None,
    )


def within(trajectory: Trajectory, limits: Sequence[JointLimits]) -> Trajectory:
    """Return a motion that is slow enough for the joints; as a whole it takes longer."""
    factor = stretch_factor(trajectory, limits)
    return stretched(trajectory, factor) if factor > 1.0 + TOLERANCE else trajectory


def _lead_time(first: Point, here: Sequence[float], limits: Sequence[JointLimits]) -> float:
    """Return a time in which all joints get to the first point without being too fast [s]."""
    times = []
    for there, at, limit, speed in zip(
        first.positions, here, limits, first.velocities or (0.0,) * len(here), strict=True
    ):
        distance = abs(there - at)
        times += [
            # A cubic is 1.5 times as fast as a line, and accelerates by 6 d / t^2; a quintic less.
            2.0 * distance / limit.max_velocity,
            math.sqrt(8.0 * distance / limit.max_acceleration),
            4.0 * abs(speed) / limit.max_acceleration,
        ]
    return max(times)
