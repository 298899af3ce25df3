"""Averages what nobody planned, so that it does not make the belts swing.

Who plans or jogs commands gently by itself. What anybody else commands is bounded joint by joint and
kept clear as it is; what is sent to the joints is its average over the periods of the belts. So it
comes later by half of these, all joints alike.
"""

from __future__ import annotations

from collections.abc import Sequence

from bioscara.control.guard import Guard
from bioscara.control.manager import ControllerManager
from bioscara.planning.smoothing import Smoothed


class Smoothing:
    """The last stage of the limiter; and, for it foresees with what was bounded, its first.

    Between cycles a guard has what was sent; while commands are bounded, what would be sent
    without this.

    Args:
        guards: All joints of the arm.
        manager: Knows who drives them.

    Attributes:
        windows: Over how long is averaged, once for each [s]; may be changed at rest.
    """

    def __init__(self, guards: Sequence[Guard], manager: ControllerManager) -> None:
        self._guards, self._manager = tuple(guards), manager
        self.windows: tuple[float, ...] = ()
        self._average: Smoothed | None = None
        self._asked: list[tuple[float, float]] = []

    def foresee(self, period: float) -> None:
        """Go on from what was bounded last, not from what was sent.

        Args:
            period: Time since the last cycle [s].
        """
        gentle = True
        for controller in self._manager.driving:
            if not controller.proven:
                gentle = False
                break
        if gentle or not self.windows:
            if self._average is not None:
                self._average = None
                for guard in self._guards:
                    guard.keep()
            return
        if self._average is None:
            self._begin()
            return
        for guard, (place, speed) in zip(self._guards, self._asked, strict=True):
            guard.go_on(place, speed)

    def apply(self, period: float) -> None:
        """Send the average; to be called when everything was bounded.

        Args:
            period: Time since the last cycle [s].
        """
        if self._average is None:
            return
        guards = self._guards
        asked = [guard.speed if guard.commanded else 0.0 for guard in guards]
        self._asked = [(guard.reference, guard.speed) for guard in guards]
        for guard, speed in zip(guards, self._average.step(asked, period), strict=True):
            guard.send(speed, period)

    def _begin(self) -> None:
        """Take it that the joints have long moved as they do."""
        speeds = [guard.speed if guard.commanded else 0.0 for guard in self._guards]
        self._average = Smoothed(self.windows, speeds)
        for guard, speed in zip(self._guards, speeds, strict=True):
            guard.lead(speed * sum(self.windows) / 2.0)
