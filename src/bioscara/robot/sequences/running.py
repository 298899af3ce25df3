"""Carries a sequence out on a robot, in this process or of an owner."""

from __future__ import annotations

import time
from collections.abc import Callable
from operator import attrgetter
from typing import Protocol

from bioscara.errors import MotionCancelledError
from bioscara.robot.operations.operation import OnCycle
from bioscara.robot.planner import Planner
from bioscara.robot.sequences.calls import Call, about, calls
from bioscara.robot.sequences.dry_run import dry_run
from bioscara.robot.sequences.steps import StepSequence

_LOOK = 0.05
"""Period of the check for a request to stop, during a wait [s]."""


class _Robot(Protocol):
    """What :class:`bioscara.Robot` and :class:`bioscara.RemoteRobot` have."""

    @property
    def plan(self) -> Planner:
        """Plans motions from where the arm is."""
        ...


def run_sequence(
    robot: _Robot,
    sequence: StepSequence,
    *,
    on_step: Callable[[Call], object] | None = None,
    on_cycle: OnCycle | None = None,
    cancelled: Callable[[], bool] = lambda: False,
) -> None:
    """Carry out a sequence from where the arm is.

    The whole sequence is planned before anything moves, and each motion again when its turn comes.

    Args:
        robot: The robot, connected and homed.
        sequence: The sequence.
        on_step: Called before each step, or before several that blends join.
        on_cycle: Receives a record of all joints each cycle of a motion.
        cancelled: Returns whether to stop before the next step, or in a wait.

    Raises:
        InvalidArgumentError: Another tool is mounted, or a step cannot be carried out; the message
            names the step. A refusal by the first planning has moved nothing.
        MotionCancelledError: It was stopped; the arm is at rest.
        BioscaraError: As the motions of the robot.
    """
    workspace = robot.plan.workspace
    for verdict in dry_run(sequence, workspace, robot.plan.here()):
        if verdict.error is not None:
            raise verdict.error
    for call in [*calls(sequence, workspace)]:
        if cancelled():
            raise MotionCancelledError(f"stopped before step {call.first + 1}")
        if on_step is not None:
            on_step(call)
        with about(call.first, len(call.steps)):
            _carry_out(robot, call, on_cycle, cancelled)


def _carry_out(
    robot: _Robot, call: Call, on_cycle: OnCycle | None, cancelled: Callable[[], bool]
) -> None:
    if call.method == "sleep":
        _rest(call, cancelled)
        return
    attrgetter(call.method)(robot)(*call.arguments, **call.keywords, on_cycle=on_cycle)


def _rest(call: Call, cancelled: Callable[[], bool]) -> None:
    end = time.monotonic() + call.arguments[0]
    while (remaining := end - time.monotonic()) > 0.0:
        if cancelled():
            raise MotionCancelledError(f"stopped in the wait of step {call.first + 1}")
        time.sleep(min(remaining, _LOOK))
