"""Averages what nobody planned, so that it does not make the belts swing.

Planned motions and jogs are gentle by themselves. Any other command is bounded joint by joint and
kept clear first; what is sent to the joints is its average over the periods of the belts. It comes
later by half of these, all joints alike.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from bioscara.control.guard import Guard
from bioscara.control.manager import ControllerManager
from bioscara.planning.shapes import Array
from bioscara.planning.smoothing import Smoothed

_EACH = 3
"""Of so many cycles one is looked at."""


class Smoothing:
    """The last stage of the limiter, whose look ahead comes first.

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
        self._places.append([guard.here - guard.lag for guard in self._guards])
        self._places.append([guard.here for guard in self._guards])

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

    def way(self, speeds: Sequence[float], duration: float, period: float) -> Array | None:
        """Return what is sent from now on if all joints brake together; None for no average.

        Args:
            speeds: From which they brake [rad/s or m/s].
            duration: Until they stand, if they were not averaged [s].
            period: Time from cycle to cycle [s].

        Returns:
            The joints from where they are sent to now on, shape (n, joints).
        """
        if self._average is None:
            return None
        count = math.ceil((duration + sum(self.windows)) / period) + 2
        left = np.clip(1.0 - (np.arange(count) + 0.5) * period / max(duration, period), 0.0, None)
        left[0] = 1.0
        sent = self._average.ahead(np.outer(left, speeds), period)
        here = np.array([guard.here - guard.lag for guard in self._guards])
        way = here + np.cumsum(sent, axis=0) * period
        # An average bends so little that between its thirds it is straight to 0.2 mm.
        return np.vstack((here, way[_EACH - 1 :: _EACH], way[-1]))

    def within(self) -> tuple[list[float], list[float]]:
        """Return between which positions the joints were asked to be of late [rad or m]."""
        columns = list(zip(*self._places, strict=True))
        return [min(column) for column in columns], [max(column) for column in columns]

    @property
    def averages(self) -> bool:
        """Whether what is sent is an average."""
        return self._average is not None

    def _begin(self) -> None:
        """Take it that the joints have long moved as they do."""
        speeds = [guard.speed if guard.commanded else 0.0 for guard in self._guards]
        self._average = Smoothed(self.windows, speeds)
        for guard, speed in zip(self._guards, speeds, strict=True):
            guard.lead(speed * sum(self.windows) / 2.0)
        count = 2 * (math.ceil(sum(self.windows) * self._manager.rate) + 2)
        self._places: deque[list[float]] = deque(maxlen=count)
        self._places.append([guard.here - guard.lag for guard in self._guards])
        self._places.append([guard.here for guard in self._guards])
