"""The gripper of a robot."""

from __future__ import annotations

from bioscara.arguments import flag
from bioscara.control.controllers.gripper_messages import GripperResult
from bioscara.robot.arm import Arm
from bioscara.robot.operations.move_gripper import MoveGripper
from bioscara.robot.operations.operation import OnCycle, Operation
from bioscara.robot.operations.power import DisableGripper, EnableGripper


class RobotGripper:
    """The gripper; its position is the width between the jaws in metres.

    The servo is driven from the first call that needs it. It has no sensor: the commanded width is
    taken as the actual width once the jaws had the time to reach it. The jaws may move while the
    arm moves.

    Args:
        arm: The arm that it belongs to.
    """

    __slots__ = ("_arm",)

    def __init__(self, arm: Arm) -> None:
        self._arm = arm

    @property
    def width(self) -> float:
        """Last commanded width of the jaws [m]; NaN while the servo is not driven."""
        return self._arm.jaws.commanded

    @property
    def widths(self) -> tuple[float, float]:
        """Smallest and largest width that the jaws may have [m].

        While the servo is driven, they are at the commanded width or, until a motion has
        succeeded, anywhere along its travel. While it is not driven, they may have been moved by
        hand.
        """
        return self._arm.jaws.range()

    def enable(self) -> None:
        """Drive the servo at its present position: the jaws do not move.

        Raises:
            GripperError: There is no output for it, or it cannot be used.
            FaultedError: A fault is latched.
            BusyError: The jaws move.
        """
        self._arm.execute(EnableGripper())

    def disable(self) -> None:
        """Release the servo; a held object may fall.

        Raises:
            BusyError: The jaws move.
        """
        self._arm.execute(DisableGripper())

    def move(
        self,
        width: float,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[GripperResult]:
        """Move the jaws; keyword arguments as all motions of the robot.

        Args:
            width: Width between them [m].
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return when they had the time to reach the width.

        Raises:
            GoalRejectedError: The width is outside the limits or no finite number; nothing moved.
            ZoneError: The clearance of a jaw would be too small, at the arm's position or along the
                motion it is making; nothing moved. The position of an arm that is not homed is
                unknown: then nothing is checked.
            GripperError: The servo cannot be driven, the width cannot be saved in its file (nothing
                moved), or the jaws were blocked.
            MotionCancelledError: A stop was requested; the jaws stay where they are.
            BusyError: The jaws move, or the arm does so in a motion that was not planned.
        """
        operation = MoveGripper(width, timeout=timeout, on_cycle=on_cycle)
        if flag("wait", wait):
            self._arm.execute(operation)
        else:
            self._arm.start(operation)
        return operation
