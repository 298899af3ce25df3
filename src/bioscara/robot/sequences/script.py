"""Writes a sequence as a Python program, which does the same with the calls of a robot."""

from __future__ import annotations

import json
from collections.abc import Iterator
from textwrap import indent

from bioscara.robot.sequences.calls import action_of
from bioscara.robot.sequences.steps import (
    ArcStep,
    GraspStep,
    JointsStep,
    LoadBox,
    MotionStep,
    NamedStep,
    PathStep,
    Place,
    PointToPointStep,
    Step,
    StepSequence,
    WaitStep,
)
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
_TAUGHT = '''\
def taught(name: str) -> Pose:
    """Return the pose of the mounted tool at a named pose."""
    entry = robot.table.pose(name)
    if entry.joints is not None:
        return robot.kinematics.forward(entry.joints)
    if entry.tool != robot.tool.name or entry.pose_tool_in_base is None:
        raise SystemExit(f"pose {name} was taught with tool {entry.tool}, not {robot.tool.name}")
    return entry.pose_tool_in_base
'''


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
    table = any(_uses_table(step) for step in sequence.steps)
    helper = "taught(" in text
    if helper:
        names.append("Pose")
    names += ["Robot", *(["load_table"] if table or sequence.tool != FINGERS else [])]
    imports = ["import sys"]
    if "sleep(" in text:
        imports.append("from time import sleep")
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
        *(["", _TAUGHT, ""] if helper else []),
        _BEGIN + indent(_TABLE if "load_table" in names else "", "    ") + indent(text, "    "),
    ]
    return "\n".join(parts) + "\n"


def _uses_table(step: Step) -> bool:
    values = (getattr(step, field, None) for field in ("name", "via_name", "frame"))
    return any(value is not None for value in values)


def _body(sequence: StepSequence, first: int, last: int | None) -> Iterator[str]:
    if sequence.tool != FINGERS:
        yield f"robot.tool = {_quoted(sequence.tool)}  # It must be mounted."
    else:
        yield _ITS_TOOL
    yield "robot.home()"
    for begin, run in sequence.runs(first, last):
        if len(run) == 1:
            yield _line(run[0])
            continue
        yield "robot.move_sequence(\n    ["
        for index, step in enumerate(run, 1):
            assert isinstance(step, PathStep)  # noqa: S101  only these have blends
            yield f"        {_waypoint(step, rests=index == len(run))},"
        yield f"    ]\n)  # Steps {begin + 1} to {begin + len(run)}."


def _line(step: Step) -> str:
    """Return the call of one step."""
    match step:
        case WaitStep():
            return f"sleep({step.seconds!r})"
        case JointsStep():
            return f"robot.move_joints({[*step.joints.joints]!r}{_speed(step)})"
        case NamedStep():
            return f"robot.move_named({_quoted(step.name)}{_speed(step)})"
        case ArcStep():
            return f"robot.move_circular({_via(step)}, {_goal(step)}{_speed(step)})"
        case PathStep() | PointToPointStep():
            return f"robot.{step.KIND}({_goal(step)}{_speed(step)})"
    method, given, keywords = action_of(step)
    arguments = [repr(each) for each in given]
    if isinstance(step, GraspStep):
        arguments = [_load(step.load)]
    arguments += [f"{name}={value!r}" for name, value in keywords.items()]
    line = f"robot.{method}({', '.join(arguments)})"
    return line if len(line) < _LONG else f"robot.{method}(\n    {', '.join(arguments)}\n)"


def _speed(step: MotionStep) -> str:
    return "" if step.speed == 1.0 else f", velocity_scaling={step.speed!r}"


def _waypoint(step: PathStep, *, rests: bool) -> str:
    words = [_goal(step)]
    if isinstance(step, ArcStep):
        words += ["Motion.CIRC", f"via={_via(step)}"]
    if step.blend and not rests:
        words.append(f"blend={step.blend!r}")
    if step.speed != 1.0:
        words.append(f"speed={step.speed!r}")
    return f"Waypoint({', '.join(words)})"


def _goal(step: PathStep | PointToPointStep) -> str:
    return _pose(step.pose, step.name, step.frame)


def _via(step: ArcStep) -> str:
    return _pose(step.via, step.via_name, step.frame)


def _pose(place: Place | None, name: str | None, frame: str | None) -> str:
    if place is None:
        return f"taught({_quoted(name or '')})"
    numbers = ", ".join(repr(float(value)) for value in place.pose)
    return f"Pose({numbers})" if frame is None else f"robot.frame({_quoted(frame)}).pose({numbers})"


def _load(box: LoadBox) -> str:
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
