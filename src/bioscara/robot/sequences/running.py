"""Carries a sequence out on a robot, in this process or of an owner."""

from __future__ import annotations

from collections.abc import Callable

from bioscara.errors import MotionCancelledError
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.operations.operation import OnCycle
from bioscara.robot.sequences.dry_run import dry_run
from bioscara.robot.sequences.steps import Run, StepSequence, about


def run_sequence(
    robot: ArmMethods,
    sequence: StepSequence,
    *,
    on_step: Callable[[Run], object] | None = None,
    on_note: Callable[[str], object] | None = None,
    on_cycle: OnCycle | None = None,
) -> None:
    """Carry out a sequence from where the arm is, as one call: a stop since its begin ends it.

    The whole sequence is planned before anything moves, and each motion again when its turn comes.

    Args:
        robot: The robot, connected and homed.
        sequence: The sequence.
        on_step: Called before each step, or before several that blends join.
        on_note: Called after a motion with each note on its plan.
        on_cycle: Receives a record of all joints each cycle of a motion or wait.

    Raises:
        InvalidArgumentError: Another tool is mounted, or a step cannot be carried out; the message
            names the step. A refusal by the first planning has moved nothing.
        MotionCancelledError: It was stopped; the arm is at rest.
        BioscaraError: As the motions of the robot.
    """
    with robot.one_call() as call:
        planner = robot.plan
        for verdict in dry_run(sequence, planner.workspace, planner.here()):
            if call.stopped:
                raise MotionCancelledError("stopped while the sequence was planned; nothing moved")
            if verdict.error is not None:
                raise verdict.error
        for run in [*sequence.runs()]:
            if call.stopped:
                raise MotionCancelledError(f"stopped before step {run.first + 1}")
            if on_step is not None:
                on_step(run)
            task = run.task(robot.plan)
            with about(run.first, len(run.steps)):
                motion = robot.do(task, on_cycle=on_cycle)
            if on_note is not None:
                for note in motion.notes:
                    on_note(note)
