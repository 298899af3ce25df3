"""The gripper of an arm that another process owns."""

from __future__ import annotations

import math
from collections.abc import Callable

from bioscara.api import messages as m
from bioscara.control.controllers.gripper_messages import GripperResult
from bioscara.remote.remote_operation import RemoteOperation
from bioscara.robot.operations.motions.grasp import OPENING, SQUEEZE
from bioscara.robot.operations.operation import OnCycle
from bioscara.robot.workspace.load import Load

Begin = Callable[[m.AnyTask, float | None, OnCycle | None, bool], RemoteOperation[GripperResult]]
"""Begins a task: with its timeout, its callback, and whether to wait for its end."""


class RemoteGripper:
    """The gripper, with the interface of ``Robot.gripper``.

    Args:
        begin: Begins a task.
        state: Returns the newest state of the arm.
        widths: Returns the widths that the jaws may have.
    """

    __slots__ = ("_begin", "_state", "_widths")

    def __init__(
        self,
        begin: Begin,
        state: Callable[[], m.StateSample],
        widths: Callable[[], tuple[float, float]],
    ) -> None:
        self._begin, self._state, self._widths = begin, state, widths

    def __repr__(self) -> str:
        width = self.width
        where = "not driven" if math.isnan(width) else f"at {width:.4f} m"
        return f"<RemoteGripper {where}>"

    @property
    def width(self) -> float:
        """Last commanded width of the jaws [m]; NaN while the servo is not driven."""
        return self._state().width

    @property
    def widths(self) -> tuple[float, float]:
        """Smallest and largest width that the jaws may have [m]."""
        return self._widths()

    def enable(self) -> None:
        """Drive the servo at its present position; errors as ``Robot.gripper.enable``."""
        self._begin(m.EnableGripperTask(), None, None, True)

    def disable(self) -> None:
        """Release the servo; a held object may fall."""
        self._begin(m.DisableGripperTask(), None, None, True)

    def move(
        self,
        width: float,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> RemoteOperation[GripperResult]:
        """Move the jaws to a width [m]; arguments and errors as ``Robot.gripper.move``."""
        return self._begin(m.MoveGripperTask(width), timeout, on_cycle, wait)

    def open(
        self, *, timeout: float | None = None, on_cycle: OnCycle | None = None, wait: bool = True
    ) -> RemoteOperation[GripperResult]:
        """Move the jaws to their largest width."""
        return self._begin(m.OpenGripperTask(), timeout, on_cycle, wait)

    def close(
        self, *, timeout: float | None = None, on_cycle: OnCycle | None = None, wait: bool = True
    ) -> RemoteOperation[GripperResult]:
        """Move the jaws to their smallest width."""
        return self._begin(m.CloseGripperTask(), timeout, on_cycle, wait)

    def grasp(
        self,
        load: Load,
        width: float | None = None,
        *,
        squeeze: float = SQUEEZE,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> RemoteOperation[GripperResult]:
        """Close the jaws on a load, then attach it; as ``Robot.gripper.grasp``."""
        return self._begin(m.GraspTask(load, width, squeeze), timeout, on_cycle, wait)

    def release(
        self,
        opening: float = OPENING,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> RemoteOperation[GripperResult]:
        """Open the jaws, then detach the load; as ``Robot.gripper.release``."""
        return self._begin(m.ReleaseLoad(opening), timeout, on_cycle, wait)
