"""The motions of the gripper's jaws, and its servo."""

from __future__ import annotations

from bioscara.robot.arm import Arm
from bioscara.robot.operations import power
from bioscara.robot.operations.motions import grasp
from bioscara.robot.operations.motions.move_gripper import MoveGripper as MoveJaws
from bioscara.robot.tasks.fields import ALoad, Width
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.tasks.task import Conditions, Task

__all__ = [
    "CloseGripper",
    "DisableGripper",
    "EnableGripper",
    "Grasp",
    "GripperTask",
    "MoveGripper",
    "OpenGripper",
    "Release",
]


class MoveGripper(Task, frozen=True, tag="move_gripper"):
    """Move the jaws to a width.

    Attributes:
        width: Width between the jaws.
    """

    scope = Scope.OPERATE
    method = "gripper.move"
    step = True

    width: Width

    def operation(self, arm: Arm, conditions: Conditions) -> MoveJaws:  # noqa: ARG002
        """Return the operation."""
        return MoveJaws(self.width, **conditions._asdict())


class OpenGripper(Task, frozen=True, tag="open_gripper"):
    """Move the jaws to their largest width."""

    scope = Scope.OPERATE
    method = "gripper.open"
    step = True

    def operation(self, arm: Arm, conditions: Conditions) -> MoveJaws:
        """Return the operation."""
        width = arm.session.parameters.gripper.upper
        return MoveJaws(width, name=f"{self.call()}()", **conditions._asdict())


class CloseGripper(Task, frozen=True, tag="close_gripper"):
    """Move the jaws to their smallest width."""

    scope = Scope.OPERATE
    method = "gripper.close"
    step = True

    def operation(self, arm: Arm, conditions: Conditions) -> MoveJaws:
        """Return the operation."""
        width = arm.session.parameters.gripper.lower
        return MoveJaws(width, name=f"{self.call()}()", **conditions._asdict())


class Grasp(Task, frozen=True, tag="grasp"):
    """Close the jaws on a load, then attach it.

    Attributes:
        load: The load.
        width: Its width between the jaws; null for that of its shape.
        squeeze: By how much the commanded width is smaller, for the force of the jaws.
    """

    scope = Scope.OPERATE
    method = "gripper.grasp"
    step = True

    load: ALoad
    width: Width | None = None
    squeeze: Width = grasp.SQUEEZE

    def operation(self, arm: Arm, conditions: Conditions) -> grasp.Grasp:  # noqa: ARG002
        """Return the operation."""
        return grasp.Grasp(self.load, self.width, self.squeeze, **conditions._asdict())


class Release(Task, frozen=True, tag="release"):
    """Open the jaws, then detach the load.

    Attributes:
        opening: By how much they open.
    """

    scope = Scope.OPERATE
    method = "gripper.release"
    step = True

    opening: Width = grasp.OPENING

    def operation(self, arm: Arm, conditions: Conditions) -> grasp.Release:  # noqa: ARG002
        """Return the operation."""
        return grasp.Release(self.opening, **conditions._asdict())


class EnableGripper(Task, frozen=True, tag="enable_gripper"):
    """Drive the servo of the gripper."""

    scope = Scope.OPERATE
    method = "gripper.enable"
    simple_operation = power.EnableGripper


class DisableGripper(Task, frozen=True, tag="disable_gripper"):
    """Release the servo of the gripper."""

    scope = Scope.OPERATE
    method = "gripper.disable"
    simple_operation = power.DisableGripper


GripperTask = (
    MoveGripper | OpenGripper | CloseGripper | Grasp | Release | EnableGripper | DisableGripper
)
"""The tasks of the gripper."""
