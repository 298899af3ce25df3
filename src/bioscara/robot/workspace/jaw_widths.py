"""The widths that the jaws of the gripper may have; there is no sensor."""

from __future__ import annotations

import math

from bioscara.hardware import GripperHardware
from bioscara.model import GripperParameters


class JawWidths:
    """The widths that the jaws may have.

    Attributes:
        held: Width of the object between the jaws [m]; None if they hold none.
    """

    def __init__(self, hardware: GripperHardware, parameters: GripperParameters) -> None:
        self._hardware = hardware
        self._full = parameters.lower, parameters.upper
        self._travel: tuple[float, float] | None = None
        self._announced: float | None = None
        self.held: float | None = None

    @property
    def commanded(self) -> float:
        """Last commanded width [m]; NaN while the servo is not driven."""
        return self._hardware.states["gripper/position"].value

    def range(self) -> tuple[float, float]:
        """Return the smallest and largest width that the jaws may have [m], also soon."""
        low, high = self.present()
        width = self._announced
        return (low, high) if width is None else (min(low, width), max(high, width))

    def present(self) -> tuple[float, float]:
        """Return the smallest and largest width that the jaws may have now [m]."""
        commanded = self.commanded
        if math.isnan(commanded):
            return self._full
        held = commanded if self.held is None else self.held
        return self._travel or (commanded, max(commanded, held))

    def announce(self, width: float) -> None:
        """Extend the range by a width to which the jaws will move [m]."""
        self._announced = width

    def withdraw(self) -> None:
        """Undo the announcement of a width, as the jaws did not begin to move."""
        self._announced = None

    def begin_travel(self, width: float) -> None:
        """Extend the range by a width to which the jaws begin to move [m]."""
        low, high = self.present()
        self._travel = min(low, width), max(high, width)
        self._announced = self.held = None

    def hold(self, width: float) -> None:
        """Let the range be from the commanded width to that of an object between the jaws [m]."""
        self._travel, self.held = None, width

    def end_travel(self) -> None:
        """Reduce the range to the commanded width, which the jaws have reached."""
        self._travel = None
