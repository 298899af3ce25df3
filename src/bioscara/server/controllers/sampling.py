"""Samples of the interfaces and of clients' controllers, taken in the control loop."""

from __future__ import annotations

import math
import time

from bioscara.api.messages import ControllersSample, GripperStatus, TrajectoryStatus
from bioscara.control.controllers.controller import AnyController
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.loop.loop import CycleReport
from bioscara.hardware import LifecycleState
from bioscara.robot.arm import Arm
from bioscara.server.controllers.controller_goals import ControllerGoals

EXECUTING = GoalStatus.EXECUTING


class ControllerSampler:
    """Makes a sample at the end of each cycle."""

    def __init__(self, arm: Arm, goals: ControllerGoals) -> None:
        self._arm, self._goals = arm, goals
        claims = arm.stack.manager.claims
        self._states, self._commands = (
            tuple(claims.states.values()),
            tuple(claims.commands.values()),
        )
        self._state_names, self._command_names = tuple(claims.states), tuple(claims.commands)

    def sample(self, number: int, cycle: CycleReport) -> ControllersSample:
        """Return the sample of a cycle of a given number."""
        stack, clock = self._arm.stack, self._arm.session.clock
        active = [each for each in stack.clients if each.state is LifecycleState.ACTIVE]
        values = (self._status(controller) for controller in active)
        return ControllersSample(
            cycle=number,
            time=cycle.time,
            wall=time.time() - (clock.now() - cycle.time),
            state_names=self._state_names,
            states=tuple([handle.value for handle in self._states]),
            command_names=self._command_names,
            commands=tuple([handle.value for handle in self._commands]),
            active=tuple([controller.name for controller in active]),
            controllers=tuple([value for value in values if value is not None]),
            ended=self._goals.ended,
            activity=stack.manager.activity,
        )

    def _status(self, controller: AnyController) -> TrajectoryStatus | GripperStatus | None:
        if isinstance(controller, JointTrajectoryController):
            return self._trajectory(controller)
        if isinstance(controller, GripperActionController):
            return self._gripper(controller)
        return None

    def _trajectory(self, controller: JointTrajectoryController) -> TrajectoryStatus | None:
        state, feedback, goal = controller.controller_state, controller.feedback, controller.goal
        if state is None or feedback is None:
            return None
        return TrajectoryStatus(
            name=controller.name,
            time=state.time,
            joints=state.joint_names,
            trajectory_time=state.trajectory_time,
            reference=state.reference,
            feedback=state.feedback,
            error=state.error,
            output=state.output,
            scaling=state.speed_scaling_factor,
            point=feedback.point,
            # One that waits to be planned has no progress.
            goal=self._goals.number(goal) if goal and goal.status is EXECUTING else None,
        )

    def _gripper(self, controller: GripperActionController) -> GripperStatus:
        goal = controller.goal
        result = None if goal is None else goal.result
        return GripperStatus(
            name=controller.name,
            joint=controller.parameters.joint,
            goal=self._goals.number(goal),
            position=controller.position,
            velocity=controller.state_handles[1].value,
            effort=math.nan,
            reached=result is not None and result.reached_goal,
            stalled=result is not None and result.stalled,
        )
