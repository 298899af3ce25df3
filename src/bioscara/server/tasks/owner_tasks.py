"""The operation of each task that a client can begin; what needs the owner is here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Generic, NamedTuple, TypeVar

from bioscara.api import messages as m
from bioscara.api.values import scene_of
from bioscara.errors import ConflictError
from bioscara.planning import Trajectory
from bioscara.planning.collision.scene import Scene
from bioscara.robot.arm import Arm
from bioscara.robot.operations.change_workspace import ChangeWorkspace
from bioscara.robot.operations.execution import SETTLING
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory, checked
from bioscara.robot.operations.motions.jog import Jog
from bioscara.robot.operations.operation import Cycles, Operation
from bioscara.robot.tasks.task import Conditions
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.workspace import Workspace
from bioscara.server.kept_files import KeptFile
from bioscara.server.tasks.jog_stream import JogStream, velocity_of

T = TypeVar("T")

_RELEASED = 0.05
"""Time at rest after which a jog with an expiry ends [s]: the next press may follow at once."""


class OwnerTasks:
    """Makes the operations of one arm.

    Args:
        arm: The arm.
        revision: Returns the number of the present workspace.
        table: The file with the poses.
        scene: The file with the zones.
    """

    def __init__(
        self,
        arm: Arm,
        revision: Callable[[], int],
        table: KeptFile[TeachTable],
        scene: KeptFile[Scene],
    ) -> None:
        self._table, self._scene = table, scene
        self._arm, self._revision = arm, revision

    def operation(
        self, task: m.AnyTask, conditions: Conditions, trajectory: Trajectory | None
    ) -> Operation[Any]:
        """Return the operation of a task, which is not begun.

        Args:
            task: The task.
            conditions: Its longest duration, and the receiver of the records.
            trajectory: The trajectory to follow, if it is to follow one.

        Raises:
            InvalidArgumentError: A value cannot be used.
        """
        match task:
            case m.Follow() if trajectory is not None:
                return FollowTrajectory(
                    "execute()" if task.planned else "follow()",
                    partial(checked, trajectory, planned=task.planned),
                    approach=task.approach,
                    **conditions._asdict(),
                )
            case m.Execute() if trajectory is not None:
                plan = partial(checked, trajectory, planned=True)
                return FollowTrajectory("execute()", plan, **conditions._asdict())
            case m.Jog():
                return _jog(task, conditions)
            case m.SetScene() | m.SetTable():
                return self._change(task)
        return task.operation(self._arm, conditions)

    def _change(self, task: m.SetScene | m.SetTable) -> ChangeWorkspace:
        if isinstance(task, m.SetScene):
            scene = _Kept("the scene", self._scene, scene_of(task.scene), _with_scene)
            return _SavedChange("setting scene", scene, self._revision)
        table = task.table
        if not task.save:
            return ChangeWorkspace("setting table", lambda space: space.with_table(table))
        poses = _Kept("the poses", self._table, table, Workspace.with_table)
        return _SavedChange("setting table", poses, self._revision)


class _Kept(NamedTuple, Generic[T]):
    """A part of the workspace that is kept in a file.

    Attributes:
        what: Its name in messages.
        file: The file.
        value: Its new value.
        use: Returns a workspace with another value of it.
    """

    what: str
    file: KeptFile[T]
    value: T
    use: Callable[[Workspace, T], Workspace]

    def save(self, workspace: Workspace) -> Workspace | None:
        """Save the new value; return the workspace with that of another program, if it has one."""
        other = self.file.save(self.value)
        return None if other is None else self.use(workspace, other)


class _SavedChange(ChangeWorkspace):
    """Replaces a part of the workspace and its file, or takes over that of another program."""

    def __init__(self, name: str, kept: _Kept[Any], revision: Callable[[], int]) -> None:
        super().__init__(name, lambda space: kept.use(space, kept.value))
        self._kept, self._revision = kept, revision
        self._taken_over = False

    def prepare(self, arm: Arm) -> None:
        """Make the new workspace, then save that part: here, as a disk may be slow."""
        super().prepare(arm)
        if (other := self._kept.save(arm.workspace)) is not None:
            self._workspace, self._taken_over = other, True

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Replace the workspace, without a control cycle."""
        yield from super().cycles(arm)
        if self._taken_over:
            raise ConflictError(
                f"another program has changed the file with {self._kept.what}: the arm has "
                "its content now; read it, and repeat the change",
                self._revision(),
            )


def _jog(task: m.Jog, conditions: Conditions) -> Jog:
    if task.expiry is None and task.joints is None and task.tool is None:
        return Jog(JogStream(), **conditions._asdict())
    stream = JogStream(task.expiry, velocity_of(task))
    settling = SETTLING if task.expiry is None else _RELEASED
    return Jog(stream, settling=settling, **conditions._asdict())


def _with_scene(space: Workspace, scene: Scene) -> Workspace:
    return space.with_scene(replace(scene, widths=space.scene.widths))
