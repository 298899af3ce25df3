"""Conversion of a sent trajectory into one that can be followed.

Work that takes long with many points is done by :func:`prepare`, in any thread and before the
control cycle that accepts the trajectory.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from bioscara.control.controllers.joint_trajectory.goal_messages import Goal, JointTrajectory, Point
from bioscara.control.controllers.joint_trajectory.goal_validation import (
    Range,
    arranged,
    check_form,
    check_limits,
    check_stamp,
    ranges,
)
from bioscara.control.controllers.joint_trajectory.interfaces import Handles
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.control.controllers.joint_trajectory.upsampling import upsampled
from bioscara.errors import GoalRejectedError, TrajectoryError
from bioscara.model import JointParameters


class Request(NamedTuple):
    """A checked trajectory that waits for its first cycle.

    Attributes:
        course: Through its points.
        stamp: When it starts [s]; 0 for its first cycle.
        missing: Indices of the joints that it leaves out.
        collision_checked: Whether the whole path from rest is known to be clear.
        speed: Share of the speed that was asked for.
    """

    course: Interpolator
    stamp: float
    missing: frozenset[int]
    collision_checked: bool = False
    speed: float = 1.0


class Curve(NamedTuple):
    """The curve of a trajectory.

    Attributes:
        points: Its points in the order of the controller's joints.
        within: Ranges of their values, for each joint.
        course: The curve through them; follows one goal.
    """

    points: Sequence[Point]
    within: Sequence[Range]
    course: Interpolator


class PreparedTrajectory(NamedTuple):
    """A trajectory whose form is checked.

    Attributes:
        trajectory: As sent.
        curve: Its curve; None if that depends on the positions of the arm.
        smooth: Whether a smooth curve is drawn through points that have positions only.
        speed: Share of the speed that was asked for.
    """

    trajectory: JointTrajectory
    curve: Curve | None
    smooth: bool
    speed: float = 1.0


class PreparedGoal(NamedTuple):
    """A goal whose form is checked; sent once.

    Attributes:
        goal: As sent.
        trajectory: Its trajectory.
    """

    goal: Goal
    trajectory: PreparedTrajectory


def prepare(
    trajectory: JointTrajectory, parameters: JointTrajectoryParameters, *, smooth: bool = False
) -> PreparedTrajectory:
    """Check the form of a trajectory, and draw its curve if it has all joints and positions.

    Args:
        trajectory: The sent trajectory, in plain floats.
        parameters: The controller's.
        smooth: Whether a smooth curve is drawn through points that have positions only.

    Raises:
        GoalRejectedError: It cannot be followed.
    """
    check_form(trajectory, parameters)
    complete = len(trajectory.joint_names) == len(parameters.joints)
    if not complete or parameters.allow_integration_in_goal_trajectories:
        return PreparedTrajectory(trajectory, None, smooth)
    curve = _curve(trajectory, parameters, (), smooth=smooth)
    return PreparedTrajectory(trajectory, curve, smooth)


def points_of(
    prepared: PreparedTrajectory,
    parameters: JointTrajectoryParameters,
    commanded: Sequence[float],
) -> Sequence[Point]:
    """Return the points of a trajectory in the order of the controller's joints.

    Args:
        prepared: The trajectory.
        parameters: The controller's.
        commanded: Positions of joints that it leaves out, and for integration [rad or m].

    Raises:
        GoalRejectedError: It ends in motion, which the parameters do not permit.
    """
    if prepared.curve is not None:
        return prepared.curve.points
    return arranged(prepared.trajectory, parameters, commanded)


def accept(
    prepared: PreparedTrajectory,
    parameters: JointTrajectoryParameters,
    handles: Handles,
    limits: Mapping[str, JointParameters],
    time: float,
) -> Request:
    """Return a trajectory that can be followed, ready for its first cycle.

    Args:
        prepared: The trajectory.
        parameters: The controller's.
        handles: Its joints.
        limits: Of the joints that have some, by name.
        time: Now [s].

    Raises:
        GoalRejectedError: It cannot be followed.
    """
    trajectory, names = prepared.trajectory, prepared.trajectory.joint_names
    commanded, measured = handles.commanded(), handles.measured().positions
    check_stamp(trajectory, time)
    curve = prepared.curve or _curve(trajectory, parameters, commanded, smooth=prepared.smooth)
    check_limits(curve.points, curve.within, parameters, limits, commanded, measured)
    missing = {index for index, name in enumerate(parameters.joints) if name not in names}
    return Request(curve.course, trajectory.stamp, frozenset(missing), speed=prepared.speed)


def _curve(
    trajectory: JointTrajectory,
    parameters: JointTrajectoryParameters,
    commanded: Sequence[float],
    *,
    smooth: bool,
) -> Curve:
    points = arranged(trajectory, parameters, commanded)
    try:
        course = Interpolator(
            upsampled(points) if smooth else points,
            interpolate=parameters.interpolation_method == "splines",
        )
    except TrajectoryError as error:
        raise GoalRejectedError(str(error)) from error
    return Curve(points, ranges(points, len(parameters.joints)), course)
