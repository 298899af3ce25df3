"""Motion within an operation: sends goals, and brings the arm to rest however the motion ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeVar

from bioscara.control.controllers.goal_handle import AcceptedGoal, GoalStatus
from bioscara.control.controllers.joint_trajectory import PreparedGoal
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import GoalAbortedError, MotionCancelledError, MotionTimeoutError
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.operations.fault_handling import keep_evidence
from bioscara.robot.operations.operation import Cycle, Cycles, Operation

SETTLING = 0.3
"""Duration for which the end of a trajectory is held, so that the records show it at rest [s]."""

_MAX_DECELERATION_TIME = 5.0
"""Longest duration of decelerating to rest on the path [s]."""

G = TypeVar("G", bound=AcceptedGoal)


class MotionExecution:
    """Moves the arm for an operation, from the first cycle to rest.

    Args:
        arm: The arm.
        operation: The operation; its timeout counts from now.

    Attributes:
        elapsed: Time of the trajectory that has passed on it [s], also after its end.
    """

    def __init__(self, arm: Arm, operation: Operation[Any]) -> None:
        self._arm, self._operation = arm, operation
        self._stack, self._clock = arm.stack, arm.session.clock
        self._deadline = self._clock.now() + operation.timeout
        self.elapsed = 0.0
        arm.restart_loop(operation)

    def follow(self, message: PreparedGoal, phase: Phase, until_start: float = 0.0) -> Cycles[None]:
        """Follow a checked trajectory that starts at the arm's position; hold its end for a while.

        Args:
            message: The trajectory as a goal.
            phase: Phase that the records have.
            until_start: Time from now to the start of the trajectory proper [s].

        Raises:
            MotionCancelledError: It was stopped; the arm is at rest.
            GoalAbortedError: It was not followed to its end; the arm is at rest.
            BioscaraError: The error that stopped the arm.
        """
        controller, scaling, now = self._stack.trajectory, math.nan, self._clock.now()
        self.elapsed = 0.0

        def before_cycle() -> None:
            nonlocal scaling
            # Feedback continues after the end of the goal, then on holding or stopping.
            if (feedback := controller.feedback) is not None and feedback.time > now:
                self.elapsed = feedback.trajectory_time
            if (wanted := self._arm.speed_of(self._operation)) != scaling:
                scaling = wanted
                controller.set_scaling(wanted)

        before_cycle()
        zero = now + until_start
        goal = yield from self.pursue(
            lambda: controller.send_goal(message, now), phase, zero, before_cycle
        )
        if goal.status is not GoalStatus.SUCCEEDED:
            yield from self._come_to_rest(zero)
            raise GoalAbortedError(goal.text, goal.error_code)
        if phase is Phase.TRAJECTORY:
            until = self._clock.now() + SETTLING
            yield from self.run(lambda: self._clock.now() >= until, Phase.SETTLING, zero)

    def pursue(
        self,
        send: Callable[[], G],
        phase: Phase,
        zero: float = math.nan,
        before_cycle: Callable[[], None] = lambda: None,
    ) -> Cycles[G]:
        """Send a goal and run cycles until it is done.

        Args:
            send: Sends the goal. From then on a controller owns it and any cycle would continue
                it, so an exception that interrupts this call also ends the goal.
            phase: As for :meth:`run`.
            zero: As for :meth:`run`.
            before_cycle: Called before each cycle.

        Returns:
            The goal.

        Raises:
            GoalRejectedError: The goal was refused; nothing moved.
            BioscaraError: As :meth:`run`.
        """
        goals: list[G] = []

        def done() -> bool:
            if not goals:
                goals.append(send())
            if not goals[0].done:
                before_cycle()
            return goals[0].done

        yield from self.run(done, phase, zero)
        return goals[0]

    def run(
        self,
        done: Callable[[], bool],
        phase: Phase,
        zero: float = math.nan,
        *,
        interrupted: Callable[[BaseException], object] = lambda _: None,
    ) -> Cycles[None]:
        """Run cycles until ``done``.

        Args:
            done: Called each cycle.
            phase: Phase that the records have.
            zero: Time at which the trajectory began or will begin [s]; NaN if there is none.
            interrupted: Called with the reason before the arm is brought to rest.

        Raises:
            MotionCancelledError: It was stopped; the arm is at rest.
            MotionTimeoutError: It took too long; the arm is at rest.
            BioscaraError: The error that stopped the arm.
        """
        operation, supervisor, cycle = self._operation, self._stack.supervisor, Cycle(phase, zero)
        try:
            while not done():
                if operation.claim.stopped:
                    raise MotionCancelledError(self._interrupted(phase, zero))
                if self._clock.now() >= self._deadline:
                    raise MotionTimeoutError(
                        f"not done within {operation.timeout:g} s; the arm was brought to rest"
                    )
                yield cycle
                if supervisor.state is not FaultState.CLEAR:
                    raise supervisor.faults[0].error()
        except GeneratorExit:
            raise
        except BaseException as error:
            interrupted(error)
            yield from self._come_to_rest(zero)
            raise

    def _come_to_rest(self, zero: float) -> Cycles[None]:
        supervisor, since = self._stack.supervisor, self._clock.now()
        while True:
            try:
                yield from self._rest(zero, since)
                break
            except KeyboardInterrupt as error:
                # No number of Ctrl-C may leave the arm moving.
                self._operation.interrupt(error)
        if supervisor.faults:
            keep_evidence(self._arm)

    def _rest(self, zero: float, since: float) -> Cycles[None]:
        supervisor, now = self._stack.supervisor, self._clock.now()
        stopping = Cycle(Phase.STOPPING, zero)
        supervisor.halt(now)
        while not supervisor.halted and now - since < _MAX_DECELERATION_TIME:
            yield stopping
            now = self._clock.now()
        supervisor.stop(now)
        while True:
            yield stopping
            if supervisor.stopper.at_rest(self._clock.now(), now):
                break

    def _interrupted(self, phase: Phase, zero: float) -> str:
        """Describe the interrupted phase and the time of the interruption."""
        if phase is Phase.HOMING:
            goal = self._stack.homing.goal
            return f"interrupted while homing {(goal and goal.current) or 'the arm'}"
        if phase is Phase.JOG:
            return "interrupted while jogging"
        if phase is Phase.CONTROLLERS:
            return "interrupted while controllers of clients commanded the arm"
        into = self._clock.now() - zero
        where = "into" if into >= 0.0 else "before the start of"
        return f"interrupted {abs(into):.2f} s {where} the trajectory"


def ready(arm: Arm, operation: Operation[Any]) -> Cycles[None]:
    """Enable the arm, bound it by its workspace and run a cycle, unless the operation was stopped.

    Raises:
        MotionCancelledError: It was stopped; nothing moved.
        FaultedError: A fault is latched.
        BioscaraError: A joint was not enabled.
    """
    arm.pace(homing=False)
    operation.claim.require_not_stopped()
    yield from arm.session.enabling(operation.claim.require_not_stopped)
    arm.stack.use_workspace(arm.workspace)
    arm.restart_loop(operation)
    yield None
