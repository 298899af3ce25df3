"""The gripper of a robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress

from bioscara.arguments import number
from bioscara.control.controllers.goals import GoalStatus
from bioscara.control.controllers.gripper_messages import GripperGoal, GripperResult
from bioscara.errors import GoalRejectedError, GripperError, NotHomedError
from bioscara.hardware import GripperHardware, LifecycleState
from bioscara.model import GripperParameters
from bioscara.report import Phase
from bioscara.robot.call_arbiter import CallArbiter, exclusive
from bioscara.robot.running import Motion
from bioscara.robot.stack import GRIPPER, Stack


class RobotGripper:
    """The gripper; its position is the width between the jaws in metres.

    The servo is driven from the first call that needs it. It has no sensor: the commanded width is
    taken as the actual width once the jaws had the time to reach it.

    Args:
        hardware: The hardware component of the gripper.
        parameters: Parameters of the gripper.
        turn: The robot's arbiter: calls of robot and gripper run one at a time.
        stack: Returns the control stack; raises while the robot is not connected.
        motion: Returns a motion that runs the control loop.
        now: Returns the time [s].
        check: Raises if a jaw would touch something during the motion to a width [m].
    """

    def __init__(
        self,
        hardware: GripperHardware,
        parameters: GripperParameters,
        turn: CallArbiter,
        stack: Callable[[], Stack],
        motion: Callable[[], Motion],
        now: Callable[[], float],
        check: Callable[[float], None],
    ) -> None:
        self._hardware, self._turn = hardware, turn
        self._stack, self._motion, self._now = stack, motion, now
        self._check, self._every = check, (parameters.lower, parameters.upper)
        self._moving: tuple[float, float] | None = None

    @property
    def width(self) -> float:
        """Last commanded width of the jaws [m]; NaN while the servo is not driven."""
        return self._hardware.states["gripper/position"].value

    @property
    def widths(self) -> tuple[float, float]:
        """Smallest and largest width that the jaws may have [m].

        While the servo is driven, they are at the commanded width or, until a motion has
        succeeded, anywhere along its travel. While it is not driven, they may have been moved by
        hand.
        """
        told = self.width
        if math.isnan(told):
            return self._every
        return self._moving or (told, told)

    @exclusive("gripper.enable()")
    def enable(self) -> None:
        """Drive the servo at its present position: the jaws do not move.

        Raises:
            GripperError: There is no output for it, or it cannot be used.
            FaultedError: A fault is latched.
            BusyError: Another call is using the arm.
        """
        self._drive()

    def _drive(self) -> None:
        self._turn.require_wanted()
        stack = self._stack()
        stack.supervisor.require_clear()
        if self._hardware.state is not LifecycleState.ACTIVE:
            self._hardware.set_state(LifecycleState.ACTIVE)
        if stack.gripper.state is not LifecycleState.ACTIVE:
            stack.loop.restart()
            stack.loop.step()
            stack.manager.switch(self._now(), (GRIPPER,))

    @exclusive("gripper.disable()")
    def disable(self) -> None:
        """Release the servo; a held object may fall.

        Raises:
            BusyError: Another call is using the arm.
        """
        if self._hardware.state is LifecycleState.ACTIVE:
            stack = self._stack()
            stack.manager.set_hardware_state(
                self._hardware.name, LifecycleState.INACTIVE, self._now()
            )

    @exclusive("gripper.move()")
    def move(self, width: float) -> GripperResult:
        """Move the jaws and return when they had the time to reach the width.

        Args:
            width: Width between them [m].

        Raises:
            GoalRejectedError: The width is outside the limits or no finite number; nothing moved.
            ZoneError: The clearance of a jaw at the arm's position would be too small; nothing
                moved. The position of an arm that is not homed is unknown: then nothing is checked.
            GripperError: The servo cannot be driven, the width cannot be saved in its file (nothing
                moved), or the jaws were blocked.
            MotionCancelledError: A stop was requested; the jaws stay where they are.
            BusyError: Another call is using the arm.
        """
        self._drive()
        width = number("the width", width, error=GoalRejectedError)
        stack, wanted = self._stack(), GripperGoal((width,))
        stack.gripper.check(wanted)
        low, high = self.widths
        with suppress(NotHomedError):
            self._check(width)
        # Before the first cycle: the disk may take longer than one.
        self._hardware.keep(width)
        self._moving = min(low, width), max(high, width)
        try:
            goal = self._motion().pursue(lambda: stack.gripper.send_goal(wanted), Phase.SETTLING)
        finally:
            try:
                self._hardware.keep()
            except GripperError as error:
                # The jaws are at rest at a known width: the error matters only after a power loss,
                # so it stops nothing.
                stack.supervisor.warnings.append(str(error))
        if goal.status is not GoalStatus.SUCCEEDED or goal.result is None:
            raise GripperError(f"the gripper did not reach {width:g} m: {goal.text}")
        self._moving = None
        return goal.result
