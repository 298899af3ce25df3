"""Plans each step of a sequence from where the one before it ends; nothing moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from bioscara.errors import BioscaraError, InvalidArgumentError
from bioscara.kinematics import Joints
from bioscara.planning import Trajectory
from bioscara.robot.operations.motions.grasp import OPENING, SQUEEZE
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.sequences.calls import Call, about, call_of, of_steps
from bioscara.robot.sequences.steps import StepSequence, require_tool
from bioscara.robot.workspace.workspace import Workspace

_APART = 1e-3
"""Least time between two points of a picture [s]."""


class Verdict(NamedTuple):
    """What planning says of a step, or of several that blends join.

    Attributes:
        call: The call that carries them out; without a method if it cannot be resolved.
        duration: How long they take [s]; of the jaws by their highest speed. NaN if refused.
        trajectory: The motion of the arm; None if it rests.
        notes: Notes on the plan.
        error: Why it is refused; None if it is not.
    """

    call: Call
    duration: float
    trajectory: Trajectory | None = None
    notes: tuple[str, ...] = ()
    error: BioscaraError | None = None


def dry_run(
    sequence: StepSequence,
    workspace: Workspace,
    start: Joints,
    *,
    first: int = 0,
    last: int | None = None,
) -> Iterator[Verdict]:
    """Yield the verdict on each step, up to the first one that is refused.

    What the steps change is taken as done: where the arm is, the width of the jaws, the load.

    Args:
        sequence: The sequence.
        workspace: Tool, scene, load and speed limit at its begin.
        start: Where the arm is then [rad, m, rad, rad].
        first: Index of the step to begin with.
        last: Index of the step to end before; None for all.

    Raises:
        InvalidArgumentError: It is for another tool than the mounted one.
    """
    require_tool(sequence, workspace.tool.name)
    here = start
    for begin, run in sequence.runs(first, last):
        call = Call(begin, run, "")
        try:
            call = call_of(begin, run, workspace)
            with about(begin, len(run)):
                plan, workspace, duration = _planned(call, workspace, here)
        except BioscaraError as error:
            yield Verdict(call, float("nan"), error=error)
            return
        if plan is None:
            yield Verdict(call, duration)
            continue
        here = Joints(*plan.trajectory.positions[-1].tolist())
        notes = tuple(of_steps(note, begin, len(run)) for note in plan.notes)
        yield Verdict(call, duration, plan.trajectory, notes)


def _planned(
    call: Call, workspace: Workspace, here: Joints
) -> tuple[Plan | None, Workspace, float]:
    """Return the plan of a call, the workspace after it and its duration [s]."""
    if call.method == "sleep":
        return None, workspace, call.arguments[0]
    planner = Planner(workspace, lambda: here)
    if not call.method.startswith("gripper."):
        plan: Plan = getattr(planner, call.method)(*call.arguments, **call.keywords)
        return plan, workspace, plan.trajectory.duration
    width, held = _width(call, workspace)
    jaws = workspace.parameters.gripper
    if not jaws.lower <= width <= jaws.upper:
        raise InvalidArgumentError(
            f"the width of the jaws, {width:.4g} m, is outside {jaws.lower:g} .. {jaws.upper:g} m"
        )
    planner.check_width(width)
    low, high = workspace.widths
    farthest = max(abs(width - low), abs(width - high))
    after = workspace.with_widths(width, held)
    if call.method == "gripper.grasp":
        after = after.with_load(call.arguments[0])
        after.surroundings.check_load(after.kinematics, here)
    elif call.method == "gripper.release":
        after = after.without_load()
    return None, after, farthest / jaws.max_velocity


def _width(call: Call, workspace: Workspace) -> tuple[float, float]:
    """Return the width that a call of the gripper commands, and the largest after it [m]."""
    jaws = workspace.parameters.gripper
    given: dict[str, Any] = call.keywords
    match call.method.removeprefix("gripper."):
        case "open":
            width = jaws.upper
        case "close":
            width = jaws.lower
        case "grasp":
            held = given.get("width", call.arguments[0].width)
            return held - given.get("squeeze", SQUEEZE), held
        case "release":
            low, high = workspace.widths
            opening = call.arguments[0] if call.arguments else OPENING
            # Jaws of unknown width are not driven yet: they open to the largest width.
            width = high if (low, high) == (jaws.lower, jaws.upper) else high + opening
        case _:
            width = call.arguments[0]
    return width, width


def joined(verdicts: Sequence[Verdict]) -> Trajectory | None:
    """Return the motions of verdicts as one trajectory, with the rests between; None if none.

    It is for a picture and not to be followed: points less than a millisecond apart are left out.
    """
    times: list[float] = []
    rows: list[tuple[list[float], list[float]]] = []
    begin, names = 0.0, ()
    for verdict in verdicts:
        if (motion := verdict.trajectory) is not None:
            names, still = motion.joint_names, np.zeros_like(motion.positions)
            speeds = still if motion.velocities is None else motion.velocities
            columns = motion.times + begin, motion.positions, speeds
            points = zip(*(column.tolist() for column in columns), strict=True)
            for when, *row in points:
                if not times or when - times[-1] > _APART:
                    times.append(when)
                    rows.append((row[0], row[1]))
            rows[-1] = motion.positions[-1].tolist(), speeds[-1].tolist()
        if verdict.error is None:
            begin += verdict.duration
    if not times:
        return None
    return Trajectory(names, times, [row[0] for row in rows], [row[1] for row in rows])
