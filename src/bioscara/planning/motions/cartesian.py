"""Straight lines and arcs of the tool, timed."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.kinematics import Joints, Pose, Scara
from bioscara.kinematics.pose import require_pose
from bioscara.planning.limits import JointLimits
from bioscara.planning.paths.path import Arc, Line
from bioscara.planning.tool_limits import ToolLimits
from bioscara.planning.topp.topp import parameterise
from bioscara.planning.trajectory.trajectory import Trajectory


def linear(
    arm: Scara,
    start: Joints,
    goal: Pose,
    limits: Sequence[JointLimits],
    tool: ToolLimits | None = None,
    *,
    speed: float = 1.0,
    window: float = 0.0,
) -> Trajectory:
    """Return the fastest motion of the tool on a straight line, turning evenly on the way.

    Args:
        arm: The arm.
        start: Where its joints are [rad, m, rad, rad]; the elbow stays on this side.
        goal: Of the tool; it turns there by the shorter way.
        limits: Of the joints, j1 to j4.
        tool: Limits of the tool; those of :class:`ToolLimits` unless given.
        speed: Share of that speed, 0.001 to 1.
        window: Over how long the speed along the path is averaged [s]; 0 for not at all.

    Raises:
        InvalidArgumentError: A value is not finite, or the goal is where the tool is.
        UnreachableError: Start, goal or a place between is out of reach or limits.
    """
    goal = require_pose("the goal", goal)
    arm.solve(goal, start)
    path = Line(arm.forward(start), goal)
    return parameterise(arm, path, start, limits, tool, speed=speed, window=window)


def circular(
    arm: Scara,
    start: Joints,
    via: Pose,
    goal: Pose,
    limits: Sequence[JointLimits],
    tool: ToolLimits | None = None,
    *,
    speed: float = 1.0,
    window: float = 0.0,
) -> Trajectory:
    """Return the fastest motion of the tool on an arc, turning evenly on the way.

    Args:
        arm: The arm.
        start: Where its joints are [rad, m, rad, rad]; the elbow stays on this side.
        via: A point on the arc; its yaw does not matter.
        goal: Of the tool; it turns there by the shorter way.
        limits: Of the joints, j1 to j4.
        tool: Limits of the tool; those of :class:`ToolLimits` unless given.
        speed: Share of that speed, 0.001 to 1.
        window: Over how long the speed along the path is averaged [s]; 0 for not at all.

    Raises:
        InvalidArgumentError: A value is not finite, or the points are on one line.
        UnreachableError: Start, goal or a place between is out of reach or limits.
    """
    goal = require_pose("the goal", goal)
    arm.solve(goal, start)
    path = Arc.through(arm.forward(start), via, goal)
    return parameterise(arm, path, start, limits, tool, speed=speed, window=window)
