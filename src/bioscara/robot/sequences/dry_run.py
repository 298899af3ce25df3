"""Plans each step of a sequence from where the one before it ends; nothing moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bioscara.errors import BioscaraError, InvalidArgumentError
from bioscara.kinematics import Joints
from bioscara.planning import Trajectory
from bioscara.robot import tasks
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.sequences.steps import Run, StepSequence, about, of_steps, require_tool
from bioscara.robot.tasks.task import PlannedMotion
from bioscara.robot.workspace.workspace import Workspace

_APART = 1e-3
"""Least time between two points of a picture [s]."""


class Verdict(NamedTuple):
    """Result of planning for a step, or for several that blends join.

    Attributes:
        run: The steps.
        task: The task that carries them out; None if it cannot be resolved.
        duration: How long they take [s]; of the jaws by their highest speed. NaN if refused.
        trajectory: The motion of the arm; None if it rests.
        notes: Notes on the plan.
        error: Why it is refused; None if it is not.
    """

    run: Run
    task: tasks.ArmTask | None
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

    The changes of earlier steps are assumed: where the arm is, the width of the jaws, the load.

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
    for run in sequence.runs(first, last):
        task = None
        begin, number = run.first, len(run.steps)
        try:
            task = run.task(Planner(workspace, lambda: start))
            with about(begin, number):
                plan, workspace, duration = _planned(task, workspace, here)
        except BioscaraError as error:
            yield Verdict(run, task, float("nan"), error=error)
            return
        if plan is None:
            yield Verdict(run, task, duration)
            continue
        here = Joints(*plan.trajectory.positions[-1].tolist())
        notes = tuple(of_steps(note, begin, number) for note in plan.notes)
        yield Verdict(run, task, duration, plan.trajectory, notes)


def _planned(
    task: tasks.ArmTask, workspace: Workspace, here: Joints
) -> tuple[Plan | None, Workspace, float]:
    """Return the plan of a task, the workspace after it and its duration [s]."""
    if isinstance(task, tasks.Wait):
        return None, workspace, task.seconds
    planner = Planner(workspace, lambda: here)
    if isinstance(task, PlannedMotion):
        plan = task.plan(planner)
        return plan, workspace, plan.trajectory.duration
    width, held = _width(task, workspace)
    jaws = workspace.parameters.gripper
    if not jaws.lower <= width <= jaws.upper:
        raise InvalidArgumentError(
            f"the width of the jaws, {width:.4g} m, is outside {jaws.lower:g} .. {jaws.upper:g} m"
        )
    planner.check_width(width)
    low, high = workspace.widths
    farthest = max(abs(width - low), abs(width - high))
    after = workspace.with_widths(width, held)
    if isinstance(task, tasks.Grasp):
        after = after.with_load(task.load)
        after.surroundings.check_load(after.kinematics, here)
    elif isinstance(task, tasks.Release):
        after = after.without_load()
    return None, after, farthest / jaws.max_velocity


def _width(task: tasks.ArmTask, workspace: Workspace) -> tuple[float, float]:
    """Return the width that a task of the gripper commands, and the largest after it [m]."""
    jaws = workspace.parameters.gripper
    match task:
        case tasks.OpenGripper():
            width = jaws.upper
        case tasks.CloseGripper():
            width = jaws.lower
        case tasks.Grasp():
            held = task.load.width if task.width is None else task.width
            return held - task.squeeze, held
        case tasks.Release():
            low, high = workspace.widths
            # Jaws of unknown width are not driven yet: they open to the largest width.
            width = high if (low, high) == (jaws.lower, jaws.upper) else high + task.opening
        case tasks.MoveGripper():
            width = task.width
        case _:
            raise InvalidArgumentError(f"a {task.kind()} cannot be planned beforehand")
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
