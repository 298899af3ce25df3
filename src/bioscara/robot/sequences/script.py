"""Writes a sequence as a Python program, which does the same with the calls of a robot."""

from __future__ import annotations

import json
from collections.abc import Iterator
from textwrap import indent

import msgspec

from bioscara.kinematics import Pose
from bioscara.robot import tasks
from bioscara.robot.sequences.steps import PATHS, Step, StepSequence
from bioscara.robot.tasks.forms import LoadForm
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.tools import FINGERS

_LONG = 90
_BEGIN = """\
# Another arm is given by its name: python FILE arm:NAME; a simulated one is used without it.
robot = Robot.connect(sys.argv[1]) if sys.argv[1:] else Robot.simulated()
with robot:
"""
_TABLE = """\
if sys.argv[2:]:  # The file with the named poses, unless the arm's owner has them.
    robot.table = load_table(Path(sys.argv[2]), robot.table.fingers)
"""
_ITS_TOOL = f"""\
if robot.tool.name != "{FINGERS}":
    raise SystemExit(f"the sequence is for tool {FINGERS}, the arm has {{robot.tool.name}}")"""


def to_script(sequence: StepSequence, first: int = 0, last: int | None = None) -> str:
    """Return a sequence as the text of a Python program.

    It homes the arm first, and uses the simulated one unless an argument names another.

    Args:
        sequence: The sequence.
        first: Index of the step to begin with.
        last: Index of the step to end before, where the arm rests; None for all.
    """
    body = [*_body(sequence, first, last)]
    text = "\n".join(body)
    known = ("Load(", "Motion.", "Pose(", "Prism.", "Waypoint(")
    names = [name[:-1] for name in known if name in text]
    table = any(_uses_table(step.task) for step in sequence.steps)
    names += ["Robot", *(["load_table"] if table or sequence.tool != FINGERS else [])]
    imports = ["import sys"]
    if "load_table" in names:
        imports.insert(1, "from pathlib import Path")
    title = sequence.title.replace("\\", "\\\\").replace('"', "'")
    parts = [
        f'"""{title or "A sequence of steps"}: written from a sequence."""',
        "",
        *imports,
        "",
        f"from bioscara import {', '.join(sorted(set(names)))}",
        "",
        _BEGIN + indent(_TABLE if "load_table" in names else "", "    ") + indent(text, "    "),
    ]
    return "\n".join(parts) + "\n"


def _uses_table(task: tasks.ArmTask) -> bool:
    if isinstance(task, tasks.MoveNamed) or getattr(task, "frame", None) is not None:
        return True
    return any(isinstance(getattr(task, field, None), str) for field in ("pose", "via"))


def _body(sequence: StepSequence, first: int, last: int | None) -> Iterator[str]:
    if sequence.tool != FINGERS:
        yield f"robot.tool = {_quoted(sequence.tool)}  # It must be mounted."
    else:
        yield _ITS_TOOL
    yield "robot.home()"
    for run in sequence.runs(first, last):
        if len(run.steps) == 1:
            yield line_of(run.steps[0].task)
            continue
        yield "robot.move_sequence(\n    ["
        for index, step in enumerate(run.steps, 1):
            yield f"        {_waypoint(step, rests=index == len(run.steps))},"
        yield f"    ]\n)  # Steps {run.first + 1} to {run.first + len(run.steps)}."


def line_of(task: tasks.ArmTask) -> str:
    """Return a task as the call of a robot that does the same."""
    arguments = []
    # The shares of the limits are the first fields, and the last arguments.
    for field in sorted(msgspec.structs.fields(type(task)), key=_is_share):
        value = getattr(task, field.name)
        if field.required:
            arguments.append(_python(value))
        elif value != field.default:
            arguments.append(f"{field.name}={_python(value)}")
    line = f"robot.{task.call()}({', '.join(arguments)})"
    return line if len(line) < _LONG else f"robot.{task.call()}(\n    {', '.join(arguments)}\n)"


def _is_share(field: msgspec.structs.FieldInfo) -> bool:
    return field.name.endswith("_scaling")


def _waypoint(step: Step, *, rests: bool) -> str:
    task = step.task
    assert isinstance(task, PATHS)  # noqa: S101  only these have blends
    words = [_pose(task.pose, task.frame)]
    if isinstance(task, tasks.MoveCircular):
        # In the base, as a waypoint is.
        words += ["Motion.CIRC", f"via={_pose(task.via, task.frame)}"]
    if step.blend and not rests:
        words.append(f"blend={step.blend!r}")
    if task.velocity_scaling != 1.0:
        words.append(f"velocity_scaling={task.velocity_scaling!r}")
    return f"Waypoint({', '.join(words)})"


def _pose(pose: Pose | str, frame: str | None) -> str:
    """Return a pose in the base, where no task looks up its name or its frame."""
    if isinstance(pose, str):
        return f"robot.plan.pose_of({_quoted(pose)})"
    return (
        _python(pose) if frame is None else f"robot.plan.pose_of({_python(pose)}, {_quoted(frame)})"
    )


def _python(value: object) -> str:
    """Return a value as Python."""
    match value:
        case Pose():
            return f"Pose({', '.join(repr(float(each)) for each in value)})"
        case Load():
            return _load(LoadForm.of(value))
        case str():
            return _quoted(value)
        case tuple():
            return repr([*value])
    return repr(value)


def _load(box: LoadForm) -> str:
    corners = f"{box.lower!r}, {box.upper!r}"
    words = [_quoted(box.name), f"Prism.between({corners}{f', {box.yaw!r}' if box.yaw else ''})"]
    if box.mass:
        words.append(f"mass={box.mass!r}")
    if box.touches:
        words.append(f"touches=[{', '.join(map(_quoted, box.touches))}]")
    if box.max_speed is not None:
        words.append(f"max_speed={box.max_speed!r}")
    return f"Load({', '.join(words)})"


def _quoted(text: str) -> str:
    # JSON escapes a character above U+FFFF as two, which Python does not join.
    return json.dumps(text) if text.isascii() else ascii(text)
