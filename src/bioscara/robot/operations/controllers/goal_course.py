"""The motion that a goal of a client asks for, and the course on which it is carried out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.control.controllers.joint_trajectory import JointTrajectory, Point
from bioscara.planning import Trajectory
from bioscara.planning.limits import JointLimits
from bioscara.planning.motions.tool_speed import reduced
from bioscara.planning.trajectory.retiming import stretch_factor, stretched
from bioscara.planning.trajectory.validation import TOLERANCE
from bioscara.robot.planner import Planner

_AT_FIRST = 1e-4
"""Distance [rad or m] up to which the arm counts as being at the first point."""


def motion_of(
    joint_names: Sequence[str], points: Sequence[Point], here: Sequence[float]
) -> Trajectory:
    """Return the motion from where the joints rest to the first point, and through all points.

    With a first point at time 0 it begins there.

    Args:
        joint_names: The joints.
        points: Points of one form: positions alone, with velocities, or with accelerations too.
        here: Positions of the joints [rad or m].
    """
    first, nothing = points[0], (0.0,) * len(here)
    if first.time:
        start = Point(
            0.0, tuple(here), first.velocities and nothing, first.accelerations and nothing
        )
        points = (start, *points)
    elif math.dist(first.positions, here) <= _AT_FIRST:
        points = (first._replace(positions=tuple(here)), *points[1:])
    moving = bool(first.velocities)
    return Trajectory(
        joint_names,
        [point.time for point in points],
        [point.positions for point in points],
        [point.velocities for point in points] if moving else None,
        [point.accelerations for point in points] if moving and first.accelerations else None,
    )


def within(trajectory: Trajectory, limits: Sequence[JointLimits]) -> Trajectory:
    """Return a motion that is slow enough for the joints; as a whole it takes longer."""
    factor = stretch_factor(trajectory, limits)
    return stretched(trajectory, factor) if factor > 1.0 + TOLERANCE else trajectory


def course_of(
    planner: Planner, points: Sequence[Point], here: Sequence[float]
) -> tuple[Trajectory, ...]:
    """Return the course on which a goal is carried out, in one part or two.

    Where several points begin with one that cannot be reached in its time, the arm goes there by a
    motion of its own, and the others come later by as much. All else that is too fast makes the
    whole motion slower.

    Args:
        planner: Planner of the arm.
        points: Points of one form, of all joints in the planner's order.
        here: Where the joints rest [rad, m, rad, rad].

    Raises:
        TrajectoryError: The curve leaves the limits of a joint's position.
        ZoneError: The path is not free.
    """
    first, names = points[0], planner.joint_names
    if _is_reached(planner, points, here):
        motion = within(motion_of(names, points, here), planner.workspace.parameters.joints)
        return (planner.check_trajectory(motion, here).trajectory,)
    approach = planner.move_joints(first.positions).trajectory
    if len(points) == 1:
        return (approach,)
    later = [point._replace(time=point.time - first.time) for point in points]
    motion = motion_of(names, later, first.positions)
    motion = within(motion, planner.workspace.parameters.joints)
    return approach, planner.check_trajectory(motion, first.positions).trajectory


def _is_reached(planner: Planner, points: Sequence[Point], here: Sequence[float]) -> bool:
    """Return whether the first of several points, or the only one, is reached in its time."""
    first, space = points[0], planner.workspace
    if not first.time:
        return math.dist(first.positions, here) <= _AT_FIRST
    lead = motion_of(planner.joint_names, points[:1], here)
    if len(points) == 1:
        return True
    if stretch_factor(lead, space.parameters.joints) > 1.0 + TOLERANCE:
        return False
    speed = space.commanded_speed
    return math.isinf(speed) or reduced(lead, planner.kinematics, here, speed)[1] == 1.0


def joined_points(parts: Sequence[Trajectory]) -> tuple[Point, ...]:
    """Return the points of a course, at rest between its parts."""
    joined: list[Point] = []
    for part in parts:
        begin = joined[-1].time if joined else 0.0
        points = [each._replace(time=begin + each.time) for each in JointTrajectory.of(part).points]
        if joined:
            # The shared point has the fields that the curve after it needs.
            last = joined.pop()
            points[0] = points[0] if points[0].velocities else last
        joined += points
    return tuple(joined)
