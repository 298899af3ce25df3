"""Straight lines and arcs of the tool, timed."""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.kinematics import Joints, Pose, Scara
from bioscara.kinematics.pose import require_pose
from bioscara.planning.limits import JointLimits, ToolLimits
from bioscara.planning.paths.segments import Arc, Line
from bioscara.planning.topp.topp import parameterise
from bioscara.planning.trajectory.trajectory import Trajectory


def linear(
    kinematics: Scara,
    start: Joints,
    goal: Pose,
    limits: Sequence[JointLimits],
    tool: ToolLimits | None = None,
    *,
    velocity_scaling: float = 1.0,
    window: float = 0.0,
) -> Trajectory:
    """Return the fastest motion of the tool on a straight line, with yaw changing uniformly.

    Args:
        kinematics: The arm.
        start: Its joint positions [rad, m, rad, rad]; the elbow stays on this side.
        goal: Goal pose of the tool; it turns by the shorter rotation.
        limits: Of the joints, j1 to j4.
        tool: Limits of the tool; those of :class:`ToolLimits` unless given.
        velocity_scaling: Share of that speed, 0.001 to 1.
        window: Window over which the speed along the path is averaged [s]; 0 for no averaging.

    Raises:
        InvalidArgumentError: A value is not finite, or the goal is the present pose of the tool.
        UnreachableError: Start, goal or a pose between is out of reach or limits.
    """
    goal = _reachable(kinematics, start, goal)
    path = Line(kinematics.forward(start), goal)
    return parameterise(
        kinematics, path, start, limits, tool, velocity_scaling=velocity_scaling, window=window
    )


def circular(
    kinematics: Scara,
    start: Joints,
    via: Pose,
    goal: Pose,
    limits: Sequence[JointLimits],
    tool: ToolLimits | None = None,
    *,
    velocity_scaling: float = 1.0,
    window: float = 0.0,
) -> Trajectory:
    """Return the fastest motion of the tool on an arc, with yaw changing uniformly.

    Args:
        kinematics: The arm.
        start: Its joint positions [rad, m, rad, rad]; the elbow stays on this side.
        via: A point on the arc; its yaw does not matter.
        goal: Goal pose of the tool; it turns by the shorter rotation.
        limits: Of the joints, j1 to j4.
        tool: Limits of the tool; those of :class:`ToolLimits` unless given.
        velocity_scaling: Share of that speed, 0.001 to 1.
        window: Window over which the speed along the path is averaged [s]; 0 for no averaging.

    Raises:
        InvalidArgumentError: A value is not finite, or the points are on one line.
        UnreachableError: Start, goal or a pose between is out of reach or limits.
    """
    goal = _reachable(kinematics, start, goal)
    path = Arc.through(kinematics.forward(start), via, goal)
    return parameterise(
        kinematics, path, start, limits, tool, velocity_scaling=velocity_scaling, window=window
    )


def _reachable(kinematics: Scara, start: Joints, goal: object) -> Pose:
    """Return the goal; an unreachable one is refused as such, before the path to it."""
    pose = require_pose("the goal", goal)
    kinematics.solve(pose, start)
    return pose
