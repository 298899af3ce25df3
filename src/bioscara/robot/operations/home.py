"""Homing of the joints."""

from __future__ import annotations

import math

from bioscara.control.controllers.goals import GoalStatus
from bioscara.errors import HomingError
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.connection.stack import HOMING
from bioscara.robot.operations.execution import MotionExecution
from bioscara.robot.operations.homing_order import joints_to_home
from bioscara.robot.operations.operation import Cycles, OnCycle, Operation


class Home(Operation[None]):
    """Homes the joints that are not homed, and those that must be homed again before them.

    Args:
        timeout: Longest duration [s]; None for no limit except each joint's own.
        on_cycle: Receives the record of each cycle.
    """

    def __init__(self, *, timeout: float | None = None, on_cycle: OnCycle | None = None) -> None:
        super().__init__("home()", timeout=timeout, on_cycle=on_cycle)
        self._progress = math.nan

    @property
    def progress(self) -> float:
        """Share of the joints that are homed, 0 to 1."""
        return 1.0 if self.done and self.error is None else self._progress

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Home the joints in the order of the parameters."""
        stack, clock = arm.stack, arm.session.clock
        arm.pace(homing=True)
        execution = MotionExecution(arm, self)
        self.claim.require_not_stopped()
        if arm.paused:
            stack.supervisor.warnings.append(f"{self.name} begins paused: it moves after resume()")
            yield from execution.run(lambda: not arm.paused, Phase.HOMING)
        arm.session.enable()
        directions, notes = joints_to_home(stack.arm.axes)
        if not directions:
            return
        stack.supervisor.warnings.extend(notes)
        stack.use(HOMING, clock.now())
        axes = [axis for axis in stack.arm.axes if axis.name in directions]

        def count() -> None:
            self._progress = sum(axis.homed for axis in axes) / len(axes)

        goal = yield from execution.pursue(
            lambda: stack.homing.send_goal(directions), Phase.HOMING, before_cycle=count
        )
        if goal.status is not GoalStatus.SUCCEEDED:
            raise HomingError(goal.text)
        stack.manager.switch(clock.now(), (), (HOMING,))
