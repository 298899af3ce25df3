"""The motions of the arm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from bioscara.drivers.joint.homing import check_current, check_sensitivity
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot.arm import Arm
from bioscara.robot.operations.motions import home
from bioscara.robot.operations.motions.rest import Rest
from bioscara.robot.tasks.checks import checked_by, within
from bioscara.robot.tasks.fields import Displacement, Name, Positions, Target, Turn, Via, waypoints
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.tasks.task import Conditions, PlannedMotion, Task

__all__ = [
    "Home",
    "Motion",
    "MoveCircular",
    "MoveJoints",
    "MoveLinear",
    "MoveNamed",
    "MoveRelative",
    "MoveSequence",
    "MoveTo",
    "Unfold",
    "Wait",
]


WAIT_MAX = 3600.0
"""Longest wait [s]."""


class MoveJoints(PlannedMotion, frozen=True, kw_only=True, tag="move_joints"):
    """Move all joints to positions; they start and end together.

    Attributes:
        positions: One for each joint.
    """

    step = True

    positions: Positions


class MoveTo(PlannedMotion, frozen=True, kw_only=True, tag="move_to"):
    """Move to a pose by the closest joint solution; the path of the tool is a curve.

    Attributes:
        pose: Goal pose of the tool, or its name in the teach table.
        frame: Name of the work frame that the pose is given in; null for the base.
    """

    step = True

    pose: Target
    frame: Name | None = None


class MoveLinear(PlannedMotion, frozen=True, kw_only=True, tag="move_linear"):
    """Move to a pose along a line.

    Attributes:
        pose: Goal pose of the tool, or its name in the teach table.
        frame: Name of the work frame that the pose is given in; null for the base.
    """

    step = True

    pose: Target
    frame: Name | None = None


class MoveRelative(PlannedMotion, frozen=True, kw_only=True, tag="move_relative"):
    """Move along a line by a displacement along the axes of the base.

    Attributes:
        x: Along x.
        y: Along y.
        z: Along z.
        yaw: Rotation about the vertical, by less than half a turn.
    """

    step = True

    x: Displacement = 0.0
    y: Displacement = 0.0
    z: Displacement = 0.0
    yaw: Turn = 0.0


class MoveCircular(PlannedMotion, frozen=True, kw_only=True, tag="move_circular"):
    """Move to a pose along an arc through another one.

    Attributes:
        via: Pose on the arc, or its name in the teach table; its yaw is not used.
        pose: Goal pose of the tool, or its name in the teach table.
        frame: Name of the work frame that both are given in; null for the base.
    """

    step = True

    via: Via
    pose: Target
    frame: Name | None = None


class MoveNamed(PlannedMotion, frozen=True, kw_only=True, tag="move_named"):
    """Move to a pose of the teach table; if it was taught with joints, these are the goal.

    Attributes:
        name: Name of the pose.
    """

    step = True

    name: Name


class MoveSequence(PlannedMotion, frozen=True, kw_only=True, tag="move_sequence"):
    """Move along waypoints with rounded corners.

    Attributes:
        waypoints: The waypoints.
    """

    waypoints: Annotated[tuple[Waypoint, ...], checked_by(waypoints)]


class Unfold(PlannedMotion, frozen=True, kw_only=True, tag="unfold"):
    """Open the elbow alone, so that a folded arm can move freely."""

    step = True


def _chosen(_: str, value: Any) -> Any:
    return home.chosen(value)


def _sensitivity(name: str, value: Any) -> Any:
    return _kept(value, home.per_joint(name, value, check_sensitivity))


def _current(name: str, value: Any) -> Any:
    return _kept(value, home.per_joint(name, value, check_current))


def _kept(given: Any, numbers: dict[str, int]) -> Any:
    """Return checked numbers by joint, as one number where one was given."""
    return numbers if isinstance(given, Mapping) else next(iter(numbers.values()))


class Home(Task, frozen=True, tag="home"):
    """Home the joints that are not homed, or chosen ones.

    Attributes:
        joints: Names of the joints to home, also where they are homed; null for all that are not.
            Refused where another joint has to be homed before.
        sensitivity: Position error that counts as a touch: one for all joints, by their names, or
            null for the configured ones.
        current: Drive current [%], likewise.
    """

    scope = Scope.OPERATE

    joints: Annotated[tuple[str, ...] | None, checked_by(_chosen)] = None
    sensitivity: Annotated[int | dict[str, int] | None, checked_by(_sensitivity)] = None
    current: Annotated[int | dict[str, int] | None, checked_by(_current)] = None

    def operation(self, arm: Arm, conditions: Conditions) -> home.Home:  # noqa: ARG002
        """Return the operation."""
        return home.Home(
            joints=self.joints,
            sensitivity=self.sensitivity,
            current=self.current,
            **conditions._asdict(),
        )


class Wait(Task, frozen=True, tag="wait"):
    """Rest for a time of the arm's clock; nothing moves.

    Attributes:
        seconds: The time; what passes in a pause does not count.
    """

    scope = Scope.OPERATE
    method = "rest"
    step = True

    seconds: Annotated[float, within(0.0, WAIT_MAX, "s")]

    def operation(self, arm: Arm, conditions: Conditions) -> Rest:  # noqa: ARG002
        """Return the operation."""
        return Rest(self.seconds, **conditions._asdict())


Motion = (
    MoveJoints
    | MoveTo
    | MoveLinear
    | MoveRelative
    | MoveCircular
    | MoveNamed
    | MoveSequence
    | Unfold
)
"""The motions that can be planned."""
