"""The widths that the jaws of the gripper may have; there is no sensor."""

from __future__ import annotations

import math

from bioscara.hardware import GripperHardware
from bioscara.model import GripperParameters


class JawWidths:
    """The widths that the jaws may have.

    Args:
        hardware: The hardware component of the gripper.
        parameters: Parameters of the gripper.
    """

    def __init__(self, hardware: GripperHardware, parameters: GripperParameters) -> None:
        self._hardware = hardware
        self._full = parameters.lower, parameters.upper
        self._travel: tuple[float, float] | None = None
        self._before: tuple[float, float] | None = None

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
        self._travel, self._before = (min(low, width), max(high, width)), self._travel

    def refuse_travel(self) -> None:
        """Undo the last extension of the range, as the jaws did not begin to move."""
        self._travel = self._before

    def end_travel(self) -> None:
        """Reduce the range to the commanded width, which the jaws have reached."""
        self._travel = None
