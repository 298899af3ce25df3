"""The types of the fields of tasks: unit, range and check of each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from bioscara.arguments import flag, items, shown, text
from bioscara.errors import InvalidArgumentError, LimitError, TrajectoryError
from bioscara.kinematics import Pose
from bioscara.kinematics.pose import ANGLE_MAX, PLACE_MAX, require_near, require_near_place
from bioscara.planning.limits import SLOWEST, check_share
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity, require_velocity
from bioscara.planning.motions.waypoints import Waypoint, require_waypoints
from bioscara.robot.tasks.checks import Check, checked_by, within
from bioscara.robot.tasks.forms import JointForm, LoadForm, PoseForm
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.tools import OFFSET_MAX


def _pose_or_name(require: Callable[[str, object], Pose], what: str) -> Check:
    def check(_: str, value: object) -> Pose | str:
        return value if isinstance(value, str) and value else require(what, value)

    return check


def _positions(_: str, value: object) -> tuple[Any, ...]:
    remedy = "give one for each joint, or a pose to move_to()"
    if isinstance(value, Pose):
        raise TrajectoryError(f"the positions of the joints are {shown(value)}; {remedy}")
    # The planner, which knows their names, checks each.
    return items("the positions of the joints", value, remedy, error=TrajectoryError)


def _load(_: str, value: object) -> Load:
    if not isinstance(value, Load):
        raise InvalidArgumentError(f"the load is {shown(value)}; give Load(name, shape)")
    return value


WAYPOINTS = 1000
"""Largest number of waypoints of one motion: to plan them takes some seconds."""


def waypoints(_: str, value: object) -> tuple[Waypoint, ...]:
    """Return waypoints as a tuple.

    Raises:
        LimitError: There are too many.
        InvalidArgumentError: They are no waypoints, or a value cannot be used.
    """
    given = items("the waypoints", value, "give a list of Waypoint(pose)")
    if len(given) > WAYPOINTS:
        raise LimitError("the number of waypoints of one motion", len(given), 1, WAYPOINTS, "")
    return require_waypoints(given)


Share = Annotated[
    float, checked_by(lambda name, value: check_share(value, name), minimum=SLOWEST, maximum=1.0)
]
"""A share of the limits."""
Displacement = Annotated[float, within(-PLACE_MAX, PLACE_MAX, "m", "are these millimetres?")]
"""A displacement along an axis."""
Turn = Annotated[float, within(-ANGLE_MAX, ANGLE_MAX, "rad", "are these degrees?")]
"""A rotation about the vertical."""
Width = Annotated[float, within(0.0, OFFSET_MAX, "m", "give a width between these, in metres")]
"""A width between the jaws, or a part of one."""
Target = Annotated[Pose | str, checked_by(_pose_or_name(require_near, "the goal"), PoseForm)]
"""A pose of the tool: by its numbers, or by its name in the teach table."""
Via = Annotated[Pose | str, checked_by(_pose_or_name(require_near_place, "the via"), PoseForm)]
"""Likewise; its yaw is not used."""
Name = Annotated[str, checked_by(text)]
"""A name of the teach table."""
OfJoints = Annotated[JointVelocity, checked_by(lambda _, v: require_velocity(v, JointVelocity))]
"""A velocity of the joints."""
OfTool = Annotated[ToolVelocity, checked_by(lambda _, v: require_velocity(v, ToolVelocity))]
"""A velocity of the tool."""
Flag = Annotated[bool, checked_by(flag)]
"""True or false."""
Positions = Annotated[tuple[float, ...], checked_by(_positions, JointForm)]
"""A position of each joint."""
ALoad = Annotated[Load, checked_by(_load, LoadForm)]
"""An object that the arm carries."""
