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
from bioscara.robot.connection.arm_session import ArmSession
from bioscara.robot.connection.call_arbiter import exclusive
from bioscara.robot.connection.stack import GRIPPER
from bioscara.robot.motions.execution import MotionExecution


class JawWidths:
    """The widths that the jaws may have; there is no sensor.

    Args:
        hardware: The hardware component of the gripper.
        parameters: Parameters of the gripper.
    """

    def __init__(self, hardware: GripperHardware, parameters: GripperParameters) -> None:
        self._hardware = hardware
        self._full = parameters.lower, parameters.upper
        self._travel: tuple[float, float] | None = None

    @property
    def commanded(self) -> float:
        """Last commanded width [m]; NaN while the servo is not driven."""
        return self._hardware.states["gripper/position"].value

    def range(self) -> tuple[float, float]:
        """Return the smallest and largest width that the jaws may have [m]."""
        commanded = self.commanded
        if math.isnan(commanded):
            return self._full
        return self._travel or (commanded, commanded)

    def begin_travel(self, width: float) -> None:
        """Extend the range by a width to which the jaws begin to move [m]."""
        low, high = self.range()
        self._travel = min(low, width), max(high, width)

    def end_travel(self) -> None:
        """Reduce the range to the commanded width, which the jaws have reached."""
        self._travel = None


class RobotGripper:
    """The gripper; its position is the width between the jaws in metres.

    The servo is driven from the first call that needs it. It has no sensor: the commanded width is
    taken as the actual width once the jaws had the time to reach it.

    Args:
        session: ArmSession of the arm: calls of robot and gripper run one at a time.
        jaws: The widths that the jaws may have.
        check_width: Raises if a jaw would touch something during the motion to a width [m].
    """

    def __init__(
        self, session: ArmSession, jaws: JawWidths, check_width: Callable[[float], None]
    ) -> None:
        self._session, self._arbiter, self._hardware = session, session.arbiter, session.gripper
        self._jaws, self._check_width = jaws, check_width

    @property
    def width(self) -> float:
        """Last commanded width of the jaws [m]; NaN while the servo is not driven."""
        return self._jaws.commanded

    @property
    def widths(self) -> tuple[float, float]:
        """Smallest and largest width that the jaws may have [m].

        While the servo is driven, they are at the commanded width or, until a motion has
        succeeded, anywhere along its travel. While it is not driven, they may have been moved by
        hand.
        """
        return self._jaws.range()

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
        self._arbiter.require_not_stopped()
        stack = self._session.stack
        stack.supervisor.require_clear()
        if self._hardware.state is not LifecycleState.ACTIVE:
            self._hardware.set_state(LifecycleState.ACTIVE)
        if stack.gripper.state is not LifecycleState.ACTIVE:
            stack.cycle()
            stack.manager.switch(self._session.clock.now(), (GRIPPER,))

    @exclusive("gripper.disable()")
    def disable(self) -> None:
        """Release the servo; a held object may fall.

        Raises:
            BusyError: Another call is using the arm.
        """
        if self._hardware.state is LifecycleState.ACTIVE:
            manager, now = self._session.stack.manager, self._session.clock.now()
            manager.set_hardware_state(self._hardware.name, LifecycleState.INACTIVE, now)

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
        stack, message = self._session.stack, GripperGoal((width,))
        stack.gripper.check(message)
        with suppress(NotHomedError):
            self._check_width(width)
        # Before the first cycle: the disk may take longer than one.
        self._hardware.keep(width)
        self._jaws.begin_travel(width)
        try:
            execution = MotionExecution(self._session)
            goal = execution.pursue(lambda: stack.gripper.send_goal(message), Phase.SETTLING)
        finally:
            try:
                self._hardware.keep()
            except GripperError as error:
                # The jaws are at rest at a known width: the error matters only after a power loss,
                # so it stops nothing.
                stack.supervisor.warnings.append(str(error))
        if goal.status is not GoalStatus.SUCCEEDED or goal.result is None:
            raise GripperError(f"the gripper did not reach {width:g} m: {goal.text}")
        self._jaws.end_travel()
        return goal.result
