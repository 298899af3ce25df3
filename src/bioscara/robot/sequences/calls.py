"""A sequence as calls of a robot: poses and frames by name are looked up."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.planning.motions.waypoints import Motion, Waypoint
from bioscara.robot.sequences.steps import (
    ArcStep,
    CloseStep,
    GraspStep,
    GripperStep,
    JointsStep,
    LineStep,
    MotionStep,
    NamedStep,
    OpenStep,
    PathStep,
    Place,
    PointToPointStep,
    ReleaseStep,
    Step,
    StepSequence,
    WaitStep,
)
from bioscara.robot.workspace.workspace import Workspace

_WAYPOINT = re.compile(r"waypoint (\d+): ")


class Call(NamedTuple):
    """A call of a robot that carries out one step, or several that blends join.

    Attributes:
        first: Index of the first step.
        steps: The steps.
        method: Method of the robot, as ``move_linear`` or ``gripper.grasp``; ``sleep`` for a wait.
        arguments: Its positional arguments.
        keywords: Its keyword arguments.
    """

    first: int
    steps: tuple[Step, ...]
    method: str
    arguments: tuple[Any, ...] = ()
    keywords: dict[str, Any] = {}  # noqa: RUF012  never changed

    @property
    def label(self) -> str:
        """Numbers and kinds of the steps, for people: ``2-4 move_linear, move_circular``."""
        kinds = ", ".join(dict.fromkeys(step.KIND for step in self.steps))
        last = self.first + len(self.steps)
        numbers = f"{last}" if len(self.steps) == 1 else f"{self.first + 1}-{last}"
        return f"{numbers} {kinds}"


def calls(sequence: StepSequence, workspace: Workspace) -> Iterator[Call]:
    """Yield the calls of a sequence.

    Args:
        sequence: The sequence.
        workspace: Has the teach table and the kinematics of the arm.

    Raises:
        InvalidArgumentError: There is no pose or frame of a name, or a pose of the tool was taught
            with another tool; the message begins with the step, counted from 1.
    """
    for first, run in sequence.runs():
        yield call_of(first, run, workspace)


def call_of(first: int, run: tuple[Step, ...], workspace: Workspace) -> Call:
    """Return the call of one step, or of several that blends join; errors as :func:`calls`."""
    if len(run) > 1:
        return Call(first, run, "move_sequence", ([*_waypoints(first, run, workspace)],))
    with about(first):
        step = run[0]
        if isinstance(step, MotionStep):
            method, arguments = _motion(step, workspace)
            return Call(first, run, method, arguments, {"velocity_scaling": step.speed})
        return Call(first, run, *action_of(step))


class about:  # noqa: N801  a context manager, named as its use reads
    """Prefix the message of an error with the step that it concerns.

    Args:
        first: Index of the first step that is carried out; messages count from 1.
        number: Number of the steps.
    """

    def __init__(self, first: int, number: int = 1) -> None:
        self._first, self._number = first, number

    def __enter__(self) -> None:
        return

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        if isinstance(error, InvalidArgumentError):
            error.args = (of_steps(str(error), self._first, self._number),)


def of_steps(text: str, first: int, number: int) -> str:
    """Return a sentence on steps that are planned together, with the step that it concerns."""
    if number == 1:
        return f"step {first + 1}: {text}"
    # A planned sequence counts its waypoints from 0.
    if (found := _WAYPOINT.match(text)) is not None:
        return f"step {first + int(found[1]) + 1}: {text[found.end() :]}"
    return f"steps {first + 1}-{first + number}: {text}"


def _motion(step: MotionStep, workspace: Workspace) -> tuple[str, tuple[Any, ...]]:
    match step:
        case JointsStep():
            return "move_joints", (step.joints.joints,)
        case NamedStep():
            workspace.table.pose(step.name)
            return "move_named", (step.name,)
        case ArcStep():
            return "move_circular", (via_of(step, workspace), goal_of(step, workspace))
        case LineStep():
            return "move_linear", (goal_of(step, workspace),)
        case PointToPointStep():
            return "move_to", (goal_of(step, workspace),)
    raise InvalidArgumentError(f"{type(step).__name__} is no motion")


def action_of(step: Step) -> tuple[str, tuple[Any, ...], dict[str, Any]]:
    """Return method, arguments and keywords of a step that is no motion of the arm."""
    match step:
        case GripperStep():
            return "gripper.move", (step.width,), {}
        case OpenStep():
            return "gripper.open", (), {}
        case CloseStep():
            return "gripper.close", (), {}
        case GraspStep():
            given = {"width": step.width, "squeeze": step.squeeze}
            keywords = {name: value for name, value in given.items() if value is not None}
            return "gripper.grasp", (step.load.made(),), keywords
        case ReleaseStep():
            return "gripper.release", () if step.opening is None else (step.opening,), {}
        case WaitStep():
            return "sleep", (step.seconds,), {}
    raise InvalidArgumentError(f"{type(step).__name__} is no step")


def _waypoints(first: int, run: tuple[Step, ...], workspace: Workspace) -> Iterator[Waypoint]:
    for index, step in enumerate(run, first):
        assert isinstance(step, PathStep)  # noqa: S101  only these have blends
        with about(index):
            via = via_of(step, workspace) if isinstance(step, ArcStep) else None
            motion = Motion.LIN if via is None else Motion.CIRC
            # A run that is cut short rests at its end.
            blend = step.blend if index + 1 < first + len(run) else 0.0
            yield Waypoint(goal_of(step, workspace), motion, blend, via, step.speed)


def goal_of(step: PathStep | PointToPointStep, workspace: Workspace) -> Pose:
    """Return the goal of a step in the base; errors as :func:`calls`."""
    return _pose(step.pose, step.name, step.frame, workspace)


def via_of(step: ArcStep, workspace: Workspace) -> Pose:
    """Return the point on an arc in the base; errors as :func:`calls`."""
    return _pose(step.via, step.via_name, step.frame, workspace)


def _pose(place: Place | None, name: str | None, frame: str | None, workspace: Workspace) -> Pose:
    if place is not None:
        pose = place.pose
        return pose if frame is None else workspace.table.frame(frame).compose(pose)
    taught = workspace.table.pose(name or "")
    if taught.joints is not None:
        return workspace.kinematics.forward(taught.joints)
    mounted = workspace.tool.name
    if taught.tool != mounted or taught.pose_tool_in_base is None:
        raise InvalidArgumentError(
            f"pose {name} was taught with tool {taught.tool}, the arm has {mounted}"
        )
    return taught.pose_tool_in_base
