"""Execution of a motion: runs the control loop, and brings the arm to rest however it ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from bioscara.arguments import function, number
from bioscara.control.controllers.goals import AcceptedGoal, GoalStatus
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import (
    GoalAbortedError,
    InvalidArgumentError,
    MotionCancelledError,
    MotionTimeoutError,
)
from bioscara.planning import Trajectory
from bioscara.report import Phase
from bioscara.robot.connection.arm_session import ArmSession
from bioscara.robot.motions.cycle_recorder import Cancelled, CycleRecorder, Observe, ignore, never

SETTLING = 0.3
"""Duration for which the end of a trajectory is held, so that the records show it at rest [s]."""

_MAX_DECELERATION_TIME = 5.0
"""Longest duration of decelerating to rest on the path [s]."""

G = TypeVar("G", bound=AcceptedGoal)


class MotionExecution:
    """A call that moves the arm, from its first cycle to rest.

    Args:
        session: ArmSession of the arm.
        observe: Receives a record each cycle.
        cancelled: Called each cycle; True ends the motion.
        timeout: Longest duration from now [s]; None for no limit.

    Raises:
        InvalidArgumentError: The timeout is not above zero, or a callback cannot be called.
        NotInitializedError: The robot is not connected.
    """

    def __init__(
        self,
        session: ArmSession,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        timeout: float | None = None,
    ) -> None:
        self._stack, self._clock, self._arbiter = session.stack, session.clock, session.arbiter
        self._timeout = math.inf if timeout is None else number("timeout", timeout, infinite=True)
        if not self._timeout > 0.0:
            raise InvalidArgumentError(f"timeout {self._timeout:g} s must be above zero")
        function("observe", observe)
        function("cancelled", cancelled)
        self._deadline = self._clock.now() + self._timeout
        self._observe, self._cancelled = observe, cancelled
        self._recorder = CycleRecorder(self._stack, session.begin)
        self._arbiter.mark_cycling()
        self._stack.loop.restart()

    def follow(
        self,
        trajectory: Trajectory,
        phase: Phase,
        speed: Callable[[], float],
        until_start: float = 0.0,
    ) -> None:
        """Follow a checked trajectory that starts at the arm's position; hold its end for a while.

        Args:
            trajectory: Trajectory to follow.
            phase: Phase that the records have.
            speed: Returns the commanded share of the planned speed; called each cycle.
            until_start: Time from now to the start of the trajectory proper [s].

        Raises:
            MotionCancelledError: It was stopped; the arm is at rest.
            GoalAbortedError: It was not followed to its end; the arm is at rest.
            BioscaraError: The error that stopped the arm.
        """
        controller, scaling = self._stack.trajectory, math.nan

        def apply_speed() -> None:
            nonlocal scaling
            if (commanded := speed()) != scaling:
                scaling = commanded
                controller.set_scaling(commanded)

        apply_speed()
        now = self._clock.now()
        zero = now + until_start
        message = Goal(JointTrajectory.of(trajectory), collision_checked=True)
        goal = self.pursue(lambda: controller.send_goal(message, now), phase, zero, apply_speed)
        if goal.status is not GoalStatus.SUCCEEDED:
            self._come_to_rest(zero)
            raise GoalAbortedError(goal.text, goal.error_code)
        if phase is Phase.TRAJECTORY:
            until = self._clock.now() + SETTLING
            self.run(lambda: self._clock.now() >= until, Phase.SETTLING, zero)

    def pursue(
        self,
        send: Callable[[], G],
        phase: Phase,
        zero: float = math.nan,
        before_cycle: Callable[[], None] = lambda: None,
    ) -> G:
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

        self.run(done, phase, zero)
        return goals[0]

    def run(self, done: Callable[[], bool], phase: Phase, zero: float = math.nan) -> None:
        """Run cycles until ``done``.

        Args:
            done: Called each cycle.
            phase: Phase that the records have.
            zero: Time at which the trajectory began or will begin [s]; NaN if there is none.

        Raises:
            MotionCancelledError: It was stopped; the arm is at rest.
            MotionTimeoutError: It took too long; the arm is at rest.
            BioscaraError: The error that stopped the arm.
        """
        supervisor = self._stack.supervisor
        try:
            while not done():
                if self._arbiter.stopped or self._cancelled():
                    raise MotionCancelledError(self._interrupted(phase, zero))
                if self._clock.now() >= self._deadline:
                    raise MotionTimeoutError(
                        f"not done within {self._timeout:g} s; the arm was brought to rest"
                    )
                self._cycle(self._observe, phase, zero)
                if supervisor.state is not FaultState.CLEAR:
                    raise supervisor.faults[0].error()
        except BaseException:
            self._come_to_rest(zero)
            raise

    def _cycle(self, observe: Observe, phase: Phase, zero: float) -> None:
        cycle = self._stack.loop.step()
        # Building a record takes about a sixth of the host's time in a cycle.
        if observe is not ignore:
            observe(self._recorder.record(cycle, phase, zero))

    def _come_to_rest(self, zero: float) -> None:
        supervisor, observe = self._stack.supervisor, self._observe
        problem: BaseException | None = None
        since = self._clock.now()
        while True:
            try:
                self._rest(observe, zero, since)
                break
            except BaseException as error:
                # Neither a failing observer nor any number of Ctrl-C may leave the arm moving.
                if observe is ignore and isinstance(error, Exception):
                    raise
                problem, observe = error, ignore
        if supervisor.faults:
            # A full disk does not undo a stop; acknowledging writes the evidence again.
            with suppress(OSError):
                supervisor.keep_evidence()
        if problem is not None:
            raise problem

    def _rest(self, observe: Observe, zero: float, since: float) -> None:
        supervisor, now = self._stack.supervisor, self._clock.now()
        self._stack.gripper.cancel()
        supervisor.halt(now)
        while not supervisor.halted and now - since < _MAX_DECELERATION_TIME:
            self._cycle(observe, Phase.STOPPING, zero)
            now = self._clock.now()
        supervisor.stop(now)
        while True:
            self._cycle(observe, Phase.STOPPING, zero)
            if supervisor.stopper.at_rest(self._clock.now(), now):
                break

    def _interrupted(self, phase: Phase, zero: float) -> str:
        """Describe the interrupted phase and the time of the interruption."""
        if phase is Phase.HOMING:
            goal = self._stack.homing.goal
            return f"interrupted while homing {(goal and goal.current) or 'the arm'}"
        if phase is Phase.JOG:
            return "interrupted while jogging"
        if math.isnan(zero):
            return "interrupted while moving the jaws"
        into = self._clock.now() - zero
        where = "into" if into >= 0.0 else "before the start of"
        return f"interrupted {abs(into):.2f} s {where} the trajectory"
