"""The operation of each task that a client can begin."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Generic, NamedTuple, TypeVar

from bioscara.api import messages as m
from bioscara.api.values import scene_of
from bioscara.errors import ConflictError, InvalidArgumentError, NotSupportedError
from bioscara.planning.collision.scene import Scene
from bioscara.robot.arm import Arm
from bioscara.robot.operations.change_workspace import ChangeWorkspace
from bioscara.robot.operations.execution import SETTLING
from bioscara.robot.operations.fault_handling import Acknowledge, Recover
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory, MakePlan, checked
from bioscara.robot.operations.motions.grasp import OPENING, SQUEEZE, Attach, Grasp, Release
from bioscara.robot.operations.motions.home import Home
from bioscara.robot.operations.motions.jog import Jog
from bioscara.robot.operations.motions.move_gripper import MoveGripper
from bioscara.robot.operations.operation import Cycles, OnCycle, Operation
from bioscara.robot.operations.power import Disable, DisableGripper, Enable, EnableGripper
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.workspace import Workspace
from bioscara.server.kept_files import KeptFile
from bioscara.server.tasks.jog_stream import JogStream, velocity_of
from bioscara.server.tasks.uploads import Uploads

T = TypeVar("T")

_Limits = dict[str, Any]
"""Arguments that the operations of motions have in common."""

_RELEASED = 0.05
"""Time at rest after which a jog with an expiry ends [s]: the next press may follow at once."""


class TaskOperations:
    """Makes the operations of one arm.

    Args:
        arm: The arm.
        plans: Plans that can be executed, by their numbers.
        uploads: Trajectories that came in parts.
        revision: Returns the number of the present workspace.
        conflict: Returns the error for a change of another workspace than the present one.
        table: The file with the poses.
        scene: The file with the zones.
    """

    def __init__(
        self,
        arm: Arm,
        plans: Mapping[int, Plan],
        uploads: Uploads,
        revision: Callable[[], int],
        conflict: Callable[[int], Exception],
        table: KeptFile[TeachTable],
        scene: KeptFile[Scene],
    ) -> None:
        self._table, self._scene = table, scene
        self._arm, self._plans, self._uploads = arm, plans, uploads
        self._revision, self._conflict = revision, conflict
        self._makers: dict[type[m.Task], Callable[[Any, _Limits], Operation[Any]]] = {
            m.HomeTask: lambda task, limits: Home(
                joints=task.joints, sensitivity=task.sensitivity, current=task.current, **limits
            ),
            m.Follow: self._follow,
            m.Execute: self._execute,
            m.JogTask: _jog,
            m.MoveGripperTask: self._move_gripper,
            m.OpenGripperTask: self._move_gripper,
            m.CloseGripperTask: self._move_gripper,
            m.GraspTask: self._move_gripper,
            m.ReleaseLoad: self._move_gripper,
        }

    def operation(
        self, task: m.AnyTask, timeout: float | None, on_cycle: OnCycle | None
    ) -> Operation[Any]:
        """Return the operation of a task, which is not begun.

        Args:
            task: The task.
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives the record of each cycle.

        Raises:
            InvalidArgumentError: A value cannot be used.
            NotSupportedError: It is no task.
        """
        limits: _Limits = {"timeout": timeout, "on_cycle": on_cycle}
        if isinstance(task, m.PlannedMotion):
            return FollowTrajectory(f"{name_of(task)}()", planned(task), **limits)
        if isinstance(task, m.WorkspaceChange):
            return self._change(task)
        if (simple := _SIMPLE.get(type(task))) is not None:
            return simple()
        if (maker := self._makers.get(type(task))) is not None:
            return maker(task, limits)
        raise NotSupportedError(f"{name_of(task)} is no task")

    def _execute(self, task: m.Execute, limits: _Limits) -> FollowTrajectory:
        if task.plan not in self._plans:
            raise InvalidArgumentError(
                f"there is no plan {task.plan}, or it was dropped for newer ones; plan it again"
            )
        plan = self._plans[task.plan]
        return FollowTrajectory(
            "execute()", lambda planner: checked(plan.trajectory, planner, planned=True), **limits
        )

    def _move_gripper(self, task: m.Task, limits: _Limits) -> MoveGripper:
        jaws = self._arm.session.parameters.gripper
        match task:
            case m.OpenGripperTask():
                return MoveGripper(jaws.upper, name="gripper.open()", **limits)
            case m.CloseGripperTask():
                return MoveGripper(jaws.lower, name="gripper.close()", **limits)
            case m.MoveGripperTask():
                return MoveGripper(task.width, **limits)
            case m.GraspTask():
                squeeze = SQUEEZE if task.squeeze is None else task.squeeze
                return Grasp(task.load, task.width, squeeze, **limits)
            case m.ReleaseLoad():
                return Release(OPENING if task.opening is None else task.opening, **limits)
        raise NotSupportedError(f"{name_of(task)} is no task of the gripper")

    def _follow(self, task: m.Follow, limits: _Limits) -> FollowTrajectory:
        trajectory = self._uploads.completed(task.upload, task.trajectory)
        return FollowTrajectory(
            "execute()" if task.planned else "follow()",
            lambda planner: checked(trajectory, planner, planned=task.planned),
            approach=task.approach,
            **limits,
        )

    def _change(self, task: m.WorkspaceChange) -> Operation[None]:
        change = _changed(task)

        def apply(workspace: Workspace) -> Workspace:
            # All devices are claimed: nothing else changes the workspace meanwhile.
            if task.revision is not None and task.revision != self._revision():
                raise self._conflict(self._revision())
            return change(workspace)

        if isinstance(task, m.AttachTask):
            return _CheckedAttach(task, apply)
        if isinstance(task, m.SetTable) and task.save:
            table = _Kept("the poses", self._table, task.table, Workspace.with_table)
            return _SavedChange("setting table", apply, table, self._revision)
        if isinstance(task, m.SetScene):
            scene = _Kept("the scene", self._scene, scene_of(task.scene), _with_scene)
            return _SavedChange("setting scene", apply, scene, self._revision)
        if isinstance(task, m.DetachTask | m.ConfirmScene):
            return ChangeWorkspace(f"{name_of(task)}()", apply)
        return ChangeWorkspace(f"setting {name_of(task).removeprefix('set_')}", apply)


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

    def __init__(
        self,
        name: str,
        change: Callable[[Workspace], Workspace],
        kept: _Kept[Any],
        revision: Callable[[], int],
    ) -> None:
        super().__init__(name, change)
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


class _CheckedAttach(Attach):
    """Attaches a load to the workspace of a given revision."""

    def __init__(self, task: m.AttachTask, change: Callable[[Workspace], Workspace]) -> None:
        super().__init__(task.load)
        self._change = change


def name_of(message: m.ApiMessage) -> str:
    """Return the kind of a message."""
    return str(message.__struct_config__.tag)


def planned(motion: m.PlannedMotion) -> MakePlan:
    """Return the function that plans a motion: the method of the planner with its name."""
    values = {field: getattr(motion, field) for field in motion.__struct_fields__}
    return lambda planner: getattr(planner, name_of(motion))(**values)


def make_plan(arm: Arm, motion: m.PlannedMotion) -> Plan:
    """Return the plan of a motion from where the arm is; nothing moves."""
    return planned(motion)(Planner(arm.workspace, arm.positions))


_SIMPLE: dict[type[m.Task], Callable[[], Operation[Any]]] = {
    m.EnableTask: Enable,
    m.DisableTask: Disable,
    m.EnableGripperTask: EnableGripper,
    m.DisableGripperTask: DisableGripper,
    m.AcknowledgeTask: Acknowledge,
    m.RecoverTask: Recover,
}


def _jog(task: m.JogTask, limits: _Limits) -> Jog:
    if task.expiry is None and task.joints is None and task.tool is None:
        return Jog(JogStream(), **limits)
    stream = JogStream(task.expiry, velocity_of(task))
    return Jog(stream, settling=SETTLING if task.expiry is None else _RELEASED, **limits)


def _with_scene(space: Workspace, scene: Scene) -> Workspace:
    return space.with_scene(replace(scene, widths=space.scene.widths))


def _changed(task: m.WorkspaceChange) -> Callable[[Workspace], Workspace]:
    match task:
        case m.SetScene():
            scene = scene_of(task.scene)
            return lambda space: _with_scene(space, scene)
        case m.SetTable():
            return lambda space: space.with_table(task.table)
        case m.SetTool():
            return lambda space: space.with_tool(task.name)
        case m.SetReducedSpeed():
            return lambda space: space.with_reduced_speed(task.reduced)
        case m.AttachTask():
            return lambda space: space.with_load(task.load)
    return Workspace.confirmed if isinstance(task, m.ConfirmScene) else Workspace.without_load
