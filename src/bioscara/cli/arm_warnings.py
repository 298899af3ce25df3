"""Warnings of the arm, each reported once."""

from __future__ import annotations

from collections.abc import Collection
from itertools import takewhile

from bioscara.robot import Robot


class Warnings:
    """Filters the warnings of a robot for those not yet reported.

    Args:
        robot: A connected robot; its present warnings count as reported.
        notes: Notes on the plan that were reported already; the robot repeats them as warnings.
    """

    def __init__(self, robot: Robot, notes: Collection[str] = ()) -> None:
        self._robot = robot
        self._notes = notes
        self._last = (robot.warnings or ("",))[-1]

    def fresh(self) -> list[str]:
        """Return the warnings since the last call, oldest first, as sentences."""
        warnings, last = self._robot.warnings, self._last
        if not warnings or warnings[-1] is last:
            return []
        self._last = warnings[-1]
        # The oldest are dropped over time, so their number is no indication.
        new = [*takewhile(lambda text: text is not last, reversed(warnings))]
        return [f"warning: {text}" for text in reversed(new) if text not in self._notes]
