"""The gripper of a robot."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

from bioscara.control.controllers.gripper_messages import GripperResult
from bioscara.robot import tasks
from bioscara.robot.operations.motions.grasp import OPENING, SQUEEZE
from bioscara.robot.operations.operation import OnCycle
from bioscara.robot.operations.running import Running
from bioscara.robot.workspace.load import Load


class Do(Protocol):
    """Carries out a task of a robot, as ``ArmMethods.do``."""

    def __call__(
        self,
        task: tasks.ArmTask,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[Any]:
        """Carry it out."""


class RobotGripper:
    """The gripper of a robot; its position is the width between the jaws in metres.

    The servo is driven from the first call that needs it. It has no sensor: the commanded width is
    taken as the actual width once the jaws had the time to reach it. The jaws may move while the
    arm moves.

    Args:
        do: Carries out a task.
        jaws: Returns the commanded width of the jaws, and those that they may have [m].
    """

    __slots__ = ("_do", "_jaws")

    def __init__(self, do: Do, jaws: Callable[[], tuple[float, tuple[float, float]]]) -> None:
        self._do, self._jaws = do, jaws

    def __repr__(self) -> str:
        width = self.width
        where = "not driven" if math.isnan(width) else f"at {width:.4f} m"
        return f"<RobotGripper {where}>"

    @property
    def width(self) -> float:
        """Last commanded width of the jaws [m]; NaN while the servo is not driven."""
        return self._jaws()[0]

    @property
    def widths(self) -> tuple[float, float]:
        """Smallest and largest width that the jaws may have [m].

        While the servo is driven, they are at the commanded width; until a motion has succeeded,
        anywhere along its travel; with a load that was grasped, up to its width. While it is not
        driven, they may have been moved by hand.
        """
        return self._jaws()[1]

    def enable(self) -> None:
        """Drive the servo at its present position: the jaws do not move.

        Raises:
            GripperError: There is no output for it, or it cannot be used.
            FaultedError: A fault is latched.
            BusyError: The jaws move.
        """
        self._do(tasks.EnableGripper())

    def disable(self) -> None:
        """Release the servo; a held object may fall.

        Raises:
            BusyError: The jaws move.
        """
        self._do(tasks.DisableGripper())

    def move(
        self,
        width: float,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[GripperResult]:
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
            LifecycleError: The jaws hold a load; :meth:`release` it.
            BusyError: The jaws move, or the arm does so in a motion that was not planned.
        """
        return self._do(tasks.MoveGripper(width), timeout=timeout, on_cycle=on_cycle, wait=wait)

    def open(
        self, *, timeout: float | None = None, on_cycle: OnCycle | None = None, wait: bool = True
    ) -> Running[GripperResult]:
        """Move the jaws to their largest width; keyword arguments and errors as :meth:`move`."""
        return self._do(tasks.OpenGripper(), timeout=timeout, on_cycle=on_cycle, wait=wait)

    def close(
        self, *, timeout: float | None = None, on_cycle: OnCycle | None = None, wait: bool = True
    ) -> Running[GripperResult]:
        """Move the jaws to their smallest width; keyword arguments and errors as :meth:`move`."""
        return self._do(tasks.CloseGripper(), timeout=timeout, on_cycle=on_cycle, wait=wait)

    def grasp(
        self,
        load: Load,
        width: float | None = None,
        *,
        squeeze: float = SQUEEZE,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[GripperResult]:
        """Close the jaws on a load, then attach it; the arm must be at rest.

        The servo has no sensor: whether there is an object is not known. Unless the jaws arrive,
        the load is not attached.

        Args:
            load: The load, which lies between the jaws.
            width: Its width where the jaws hold it [m]; None for that of its shape.
            squeeze: By how much the commanded width is smaller, for the force of the jaws [m].
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return when the load is attached.

        Raises:
            InvalidArgumentError: A value is not possible, or the load may touch a zone that is not
                in the scene; nothing moved, as with all following errors except the last ones.
            LifecycleError: A load is attached already.
            ZoneError: The load or a jaw is too near to a body; see ``Load.touches``.
            BusyError: The jaws or the arm move.
            GripperError, MotionCancelledError: As :meth:`move`.
        """
        task = tasks.Grasp(load, width, squeeze)
        return self._do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def release(
        self,
        opening: float = OPENING,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[GripperResult]:
        """Open the jaws, then detach the load; the arm must be at rest.

        Unless the jaws arrive, the load stays attached.

        Args:
            opening: By how much they open, from the width of a load that was grasped [m].
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return when the load is detached.

        Raises:
            LifecycleError: No load is attached; nothing moved, as with all following errors except
                the last ones.
            GoalRejectedError: The jaws cannot open so far.
            ZoneError: A jaw would be too near to a body.
            BusyError: The jaws or the arm move.
            GripperError, MotionCancelledError: As :meth:`move`.
        """
        return self._do(tasks.Release(opening), timeout=timeout, on_cycle=on_cycle, wait=wait)
