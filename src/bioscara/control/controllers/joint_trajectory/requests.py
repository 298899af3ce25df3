"""Conversion of a sent trajectory into one that can be followed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from bioscara.control.controllers.joint_trajectory.interfaces import Handles
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator
from bioscara.control.controllers.joint_trajectory.messages import JointTrajectory
from bioscara.control.controllers.joint_trajectory.parameters import JointTrajectoryParameters
from bioscara.control.controllers.joint_trajectory.upsampling import upsampled
from bioscara.control.controllers.joint_trajectory.validation import validate
from bioscara.errors import GoalRejectedError, TrajectoryError
from bioscara.model import JointParameters


class Request(NamedTuple):
    """A checked trajectory that waits for its first cycle.

    Attributes:
        course: Through its points.
        stamp: When it starts [s]; 0 for its first cycle.
        missing: Indices of the joints that it leaves out.
        collision_checked: Whether the whole path from rest is known to be clear.
    """

    course: Interpolator
    stamp: float
    missing: frozenset[int]
    collision_checked: bool = False


def accept(
    trajectory: JointTrajectory,
    parameters: JointTrajectoryParameters,
    handles: Handles,
    limits: Mapping[str, JointParameters],
    time: float,
    *,
    smooth: bool = False,
) -> Request:
    """Return a trajectory that can be followed, ready for its first cycle.

    Args:
        trajectory: The sent trajectory.
        parameters: The controller's.
        handles: Its joints.
        limits: Of the joints that have some, by name.
        time: Now [s].
        smooth: Whether a smooth curve is drawn through points that have positions only.

    Raises:
        GoalRejectedError: It cannot be followed.
    """
    commanded, measured = handles.commanded(), handles.measured().positions
    points = validate(trajectory, parameters, time, commanded, measured, limits)
    names = trajectory.joint_names
    missing = {index for index, name in enumerate(parameters.joints) if name not in names}
    try:
        course = Interpolator(
            upsampled(points) if smooth else points,
            interpolate=parameters.interpolation_method == "splines",
        )
    except TrajectoryError as error:
        raise GoalRejectedError(str(error)) from error
    return Request(course, trajectory.stamp, frozenset(missing))
