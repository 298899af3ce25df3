"""Warnings of the arm, each told once."""

from __future__ import annotations

from collections.abc import Collection
from itertools import takewhile

from bioscara.robot import Robot


class Warnings:
    """Knows which warnings of a robot were told already.

    Args:
        robot: A connected robot; those that it has now were told.
        notes: What was told of the plan already: a robot warns of it again.
    """

    def __init__(self, robot: Robot, notes: Collection[str] = ()) -> None:
        self._robot = robot
        self._notes = notes
        self._last = (robot.warnings or ("",))[-1]

    def fresh(self) -> list[str]:
        """Return those that came since it was last asked, oldest first, as sentences."""
        warnings, last = self._robot.warnings, self._last
        if not warnings or warnings[-1] is last:
            return []
        self._last = warnings[-1]
        # The oldest are dropped by and by, so their number tells nothing.
        new = [*takewhile(lambda text: text is not last, reversed(warnings))]
        return [f"warning: {text}" for text in reversed(new) if text not in self._notes]
