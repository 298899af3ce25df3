"""Changes of tool, load and speed limit; nothing moves."""

from __future__ import annotations

from bioscara.robot.arm import Arm
from bioscara.robot.operations.change_workspace import ChangeWorkspace
from bioscara.robot.operations.motions import grasp
from bioscara.robot.tasks.fields import ALoad, Flag, Name
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.tasks.task import Conditions, Task
from bioscara.robot.workspace.workspace import Workspace

__all__ = ["Attach", "ConfirmScene", "Detach", "SetReducedSpeed", "SetTool", "WorkspaceTask"]


class WorkspaceChange(Task, frozen=True, kw_only=True):
    """A change of the workspace.

    Attributes:
        revision: Number of the workspace that it applies to, of a client; null for any. Refused
            with a ConflictError if another client has changed the workspace since.
    """

    scope = Scope.OPERATE

    revision: int | None = None

    def changed(self, workspace: Workspace) -> Workspace:
        """Return the workspace with the change."""
        raise NotImplementedError

    def operation(self, arm: Arm, conditions: Conditions) -> ChangeWorkspace:  # noqa: ARG002
        """Return the operation."""
        name = f"setting {self.method}" if self.method else f"{self.kind()}()"
        return ChangeWorkspace(name, self.changed)


class SetTool(WorkspaceChange, frozen=True, kw_only=True, tag="set_tool"):
    """Mount another tool of the table.

    Attributes:
        name: Its name.
    """

    method = "tool"

    name: Name

    def changed(self, workspace: Workspace) -> Workspace:
        """Return the workspace with the change."""
        return workspace.with_tool(self.name)


class SetReducedSpeed(WorkspaceChange, frozen=True, kw_only=True, tag="set_reduced_speed"):
    """Let the tool keep to 250 mm/s, or not.

    Attributes:
        reduced: Whether it does.
    """

    method = "reduced_speed"

    reduced: Flag

    def changed(self, workspace: Workspace) -> Workspace:
        """Return the workspace with the change."""
        return workspace.with_reduced_speed(self.reduced)


class Attach(WorkspaceChange, frozen=True, kw_only=True, tag="attach"):
    """Declare that the tool carries a load.

    Attributes:
        load: The load.
    """

    load: ALoad

    def operation(self, arm: Arm, conditions: Conditions) -> grasp.Attach:  # noqa: ARG002
        """Return the operation."""
        return grasp.Attach(self.load)


class Detach(WorkspaceChange, frozen=True, kw_only=True, tag="detach"):
    """Declare that the tool carries nothing."""

    def changed(self, workspace: Workspace) -> Workspace:
        """Return the workspace with the change."""
        return workspace.without_load()


class ConfirmScene(WorkspaceChange, frozen=True, kw_only=True, tag="confirm_scene"):
    """Declare that scene, tool and load, which are those of the owner's last run, still hold."""

    def changed(self, workspace: Workspace) -> Workspace:
        """Return the workspace with the change."""
        return workspace.confirmed()


WorkspaceTask = SetTool | SetReducedSpeed | Attach | Detach | ConfirmScene
"""The tasks that change the workspace."""
