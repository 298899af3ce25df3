"""The steps of a sequence, and the sequence; each is checked when it is made."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.model.validation import Before, Checked, Problem, Within, is_number, require_none
from bioscara.planning.motions.waypoints import LEAST_BLEND, MOST_BLEND, Motion, Waypoint
from bioscara.robot import tasks
from bioscara.robot.planner import Planner
from bioscara.robot.tasks.written import Unusable, struct_of, values_of as fields_of
from bioscara.robot.workspace.tools import FINGERS, check_name
from bioscara.spelling import did_you_mean

SCHEMA = 1
"""Version of the schema of sequences."""
STEPS_MAX = 200
"""Most steps of a sequence: a YAML file with so many is read in a second."""
_TITLE_MAX = 100
_WAYPOINT = re.compile(r"waypoint (\d+): ")


Wait = tasks.Wait
"""The task that rests for a time."""

PATHS = (tasks.MoveLinear, tasks.MoveCircular)
"""The tasks after which the tool need not rest."""

KINDS: dict[str, type[Any]] = {kind.kind(): kind for kind in tasks.TASKS if kind.step}
"""The kinds of steps, by their names in a file."""
RENAMED = {
    "gripper_move": "move_gripper",
    "gripper_open": "open_gripper",
    "gripper_close": "close_gripper",
}
"""Names of kinds in older files, and those that they have now."""


@dataclass(frozen=True, slots=True)
class Step:
    """A task as a part of a sequence.

    Attributes:
        task: The task.
        blend: Distance from the goal of a line or an arc at which the tool may leave its path for
            that of the next step [m]; 0 rests at the goal.

    Raises:
        InvalidArgumentError: It is no task of a sequence, or the blend is not possible.
    """

    task: tasks.ArmTask
    blend: float = 0.0

    def __post_init__(self) -> None:
        if type(self.task) not in KINDS.values():
            raise InvalidArgumentError(
                f"{shown(self.task)} is no step; there are {', '.join(KINDS)}"
            )
        if problem := _blend_problem(type(self.task), self.blend):
            raise InvalidArgumentError(f"blend: {problem}")

    @property
    def kind(self) -> str:
        """Its name in a file."""
        return self.task.kind()


def _valid_name(value: object) -> object:
    if isinstance(value, str):
        try:
            check_name("the", value)
        except InvalidArgumentError as error:
            raise ValueError(str(error).removeprefix("the name ")) from None
    return value


def _one_line(value: object) -> object:
    if isinstance(value, str) and (len(value) > _TITLE_MAX or not (value + "x").isprintable()):
        raise ValueError(f"it must be one printable line of at most {_TITLE_MAX} characters")
    return value


def _blend_problem(kind: type[Any], blend: object) -> str:
    """Return why a kind of step cannot have a blend; empty if it can."""
    if not is_number(blend):
        return f"{shown(blend)} is not a number"
    if not 0.0 <= blend <= MOST_BLEND:
        return f"{blend:g} is outside 0 .. {MOST_BLEND:g} m"
    if 0.0 < blend < LEAST_BLEND:
        return f"{blend:g} m is below {LEAST_BLEND:g} m; 0 rests at the goal"
    return "only lines and arcs have one; leave it out" if blend and kind not in PATHS else ""


def _step(values: object) -> object:
    """Return the step of values that name their kind, or of a task."""
    if isinstance(values, Step):
        return values
    if not isinstance(values, Mapping):
        try:
            return Step(values)  # type: ignore[arg-type]  # it is checked there
        except InvalidArgumentError as error:
            raise ValueError(str(error)) from None
    name: Any = values.get("kind")
    kind = KINDS.get(name) if isinstance(name, str) else None
    if kind is None:
        hint = f"there are {', '.join(KINDS)}"
        if isinstance(name, str) and name in RENAMED:
            raise ValueError(f"the kind {name} is called {RENAMED[name]} now")
        if isinstance(name, str):
            raise ValueError(f"there is no kind {name!r}; {did_you_mean(name, KINDS, hint)}")
        raise ValueError(f"it needs a kind; {hint}")
    given = {key: value for key, value in values.items() if key not in {"kind", "blend"}}
    blend = values.get("blend", 0.0)
    task: Any = struct_of(kind, given)
    problems = list(task.problems) if isinstance(task, Unusable) else []
    if text := _blend_problem(kind, blend):
        problems.append(Problem(text, ("blend",)))
    require_none(problems)
    return Step(task, float(blend))


class StepSequence(Checked):
    """Steps in the order in which they are carried out.

    Attributes:
        schema: Version of the schema.
        title: A description for people.
        tool: Name of the tool that it is for: with another one mounted it is refused.
        steps: The steps; a task is one, too.
    """

    schema: Annotated[int, Within(1, 10**6)] = SCHEMA
    title: Annotated[str, Before(_one_line)] = ""
    tool: Annotated[str, Before(_valid_name)] = FINGERS
    steps: tuple[Annotated[Any, Before(_step)], ...]

    def problems(self) -> Iterator[Problem]:
        """Yield no or too many steps, and blends at places where the arm has to rest."""
        if not self.steps:
            yield Problem("there is none; a sequence has at least one step", ("steps",))
        if len(self.steps) > STEPS_MAX:
            yield Problem(f"{len(self.steps)} steps, at most {STEPS_MAX}; divide them", ("steps",))
        for index, step in enumerate(self.steps):
            if not step.blend:
                continue
            following = self.steps[index + 1 : index + 2]
            if not (following and type(following[0].task) in PATHS):
                why = "the next step is no line or arc" if following else "it is the last step"
                text = f"{step.blend:g} m, but {why}, so that the arm rests there; give blend 0"
                yield Problem(text, ("steps", index, "blend"))

    def runs(self, first: int = 0, last: int | None = None) -> Iterator[Run]:
        """Yield the steps, those joined by blends together.

        Args:
            first: Index of the step to begin with.
            last: Index of the step to end before; None for all.
        """
        steps = self.steps[:last]
        begin = first
        for index, step in enumerate(steps[first:], first):
            if not step.blend or index + 1 == len(steps):
                yield Run(begin, steps[begin : index + 1])
                begin = index + 1


class Run(NamedTuple):
    """One step, or several that blends join: one motion.

    Attributes:
        first: Index of the first step.
        steps: The steps.
    """

    first: int
    steps: tuple[Step, ...]

    @property
    def label(self) -> str:
        """Numbers and kinds of the steps, for people: ``2-4 move_linear, move_circular``."""
        kinds = ", ".join(dict.fromkeys(step.kind for step in self.steps))
        last = self.first + len(self.steps)
        numbers = f"{last}" if len(self.steps) == 1 else f"{self.first + 1}-{last}"
        return f"{numbers} {kinds}"

    def task(self, planner: Planner) -> tasks.ArmTask:
        """Return the task that carries it out.

        Args:
            planner: Has the teach table, in which the names of joined steps are looked up.

        Raises:
            InvalidArgumentError: There is no pose or frame of a name, or a pose was taught with
                another tool; the message begins with the step, counted from 1.
        """
        if len(self.steps) == 1:
            return self.steps[0].task
        waypoints = (*self._waypoints(planner),)
        with about(self.first, len(self.steps)):
            return tasks.MoveSequence(waypoints=waypoints)

    def _waypoints(self, planner: Planner) -> Iterator[Waypoint]:
        last = self.steps[-1]
        for index, step in enumerate(self.steps, self.first):
            with about(index):
                # A run that is cut short rests at its end.
                task, blend = step.task, 0.0 if step is last else step.blend
                if isinstance(task, tasks.MoveCircular):
                    via, pose = planner.arc_of(task.via, task.pose, task.frame)
                    yield Waypoint(pose, Motion.CIRC, blend, via, task.velocity_scaling)
                elif isinstance(task, tasks.MoveLinear):
                    pose = planner.pose_of(task.pose, task.frame)
                    yield Waypoint(pose, Motion.LIN, blend, None, task.velocity_scaling)


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


def require_names(sequence: StepSequence, planner: Planner) -> None:
    """Raise unless the arm has the tool, the poses and the frames that a sequence names.

    Args:
        sequence: The sequence.
        planner: Has the teach table; where the arm is, is not asked.

    Raises:
        InvalidArgumentError: Another tool is mounted, or a name is not in the table; the message
            begins with the step, counted from 1.
    """
    require_tool(sequence, planner.workspace.tool.name)
    for index, step in enumerate(sequence.steps):
        with about(index):
            match step.task:
                case tasks.MoveNamed(name=name):
                    planner.workspace.table.pose(name)
                case tasks.MoveCircular(via=via, pose=pose, frame=frame):
                    planner.arc_of(via, pose, frame)
                case (
                    tasks.MoveTo(pose=pose, frame=frame) | tasks.MoveLinear(pose=pose, frame=frame)
                ):
                    planner.pose_of(pose, frame)


def require_tool(sequence: StepSequence, mounted: str) -> None:
    """Raise unless the tool of a sequence is mounted.

    Raises:
        InvalidArgumentError: Another one is; names the remedy.
    """
    if sequence.tool != mounted:
        raise InvalidArgumentError(
            f"the sequence is for tool {sequence.tool}, the arm has {mounted}; set robot.tool = "
            f"{sequence.tool!r} once that is mounted, or --tool {sequence.tool}"
        )


def values_of(sequence: StepSequence) -> dict[str, object]:
    """Return a sequence as plain values, without those that are the default."""
    values: dict[str, object] = {"schema": sequence.schema}
    if sequence.title:
        values["title"] = sequence.title
    values["tool"] = sequence.tool
    values["steps"] = [_plain(step) for step in sequence.steps]
    return values


def _plain(step: Step) -> dict[str, object]:
    values = {"kind": step.kind, **fields_of(step.task)}
    return {**values, "blend": step.blend} if step.blend else values


def sequence_of(values: object) -> StepSequence:
    """Return the sequence of plain values, as a browser sends them.

    Raises:
        ConfigurationError: A value cannot be used; the message names the step, counted from 1.
    """
    if isinstance(values, Mapping) and values.get("schema", SCHEMA) != SCHEMA:
        raise ConfigurationError(
            f"schema {shown(values['schema'])} cannot be read; this version of bioscara reads "
            f"{SCHEMA}"
        )

    def name(location: tuple[str | int, ...]) -> str:
        match location:
            case ("steps", int(index), *rest):
                return " ".join([f"step {index + 1}", *(str(each) for each in rest)])
        return ".".join(map(str, location))

    return StepSequence.checked(values, lambda _: "", name)
