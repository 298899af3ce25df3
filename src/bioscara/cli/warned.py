"""Warnings of the arm, each told once."""

from __future__ import annotations

from itertools import takewhile

from bioscara.robot import Robot


class Warnings:
    """Knows which warnings of a robot were told already.

    Args:
        robot: A connected robot; those that it has now were told.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._last = (robot.warnings or ("",))[-1]

    def fresh(self) -> list[str]:
        """Return those that came since it was last asked, oldest first, as sentences."""
        warnings, last = self._robot.warnings, self._last
        if not warnings or warnings[-1] is last:
            return []
        self._last = warnings[-1]
        # The oldest are dropped by and by, so their number tells nothing.
        new = [*takewhile(lambda text: text is not last, reversed(warnings))]
        return [f"warning: {text}" for text in reversed(new)]
