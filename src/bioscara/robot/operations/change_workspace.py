"""Another tool, scene or speed limit for an arm; nothing moves."""

from __future__ import annotations

from collections.abc import Callable

from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import EVERYTHING
from bioscara.robot.operations.operation import Cycles, Operation
from bioscara.robot.workspace.workspace import Workspace


class ChangeWorkspace(Operation[None]):
    """Replaces the workspace between two motions.

    Args:
        name: Name of the change in messages, such as ``"setting scene"``.
        change: Returns the new workspace for the present one.
    """

    devices = EVERYTHING

    def __init__(self, name: str, change: Callable[[Workspace], Workspace]) -> None:
        super().__init__(name)
        self._change = change
        self._workspace: Workspace | None = None

    def prepare(self, arm: Arm) -> None:
        """Make the new workspace."""
        self._workspace = self._change(arm.workspace)

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Replace the workspace, without a control cycle."""
        if self._workspace is not None:
            arm.use_workspace(self._workspace)
        yield from ()
