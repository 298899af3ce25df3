"""Averages raw commands over the periods of the belts, so that the belts do not swing.

Planned motions and jogs are already smooth. Any other command is bounded joint by joint and kept
clear first; its average over the periods of the belts is sent to the joints. The average lags by
half of these periods, all joints alike. Averaging begins at rest: begun in motion, the average
would carry the arm on for that time before it brakes.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.control.manager.manager import ControllerManager
from bioscara.planning.arrays import Array
from bioscara.planning.moving_average import Smoothed

_EACH = 3
"""One of so many cycles is checked."""


class Smoothing:
    """The last stage of the limiter; its :meth:`foresee` is called first.

    Between cycles a guard holds the sent command; while commands are bounded, the one that would
    be sent without this stage.

    Args:
        guards: All joints of the arm.
        manager: Knows the controllers that drive them.

    Attributes:
        windows: Lengths of the averages, applied one after the other [s]; may be changed at rest.
        waits: Whether raw commands have taken over a moving arm, which has to come to rest first.
        sent: Where the joints were sent to in the cycle before [rad or m].
    """

    def __init__(self, guards: Sequence[JointLimiter], manager: ControllerManager) -> None:
        self._guards, self._manager = tuple(guards), manager
        self.windows: tuple[float, ...] = ()
        self.waits = False
        self._average: Smoothed | None = None
        self.sent: list[float] = []

    def foresee(self, period: float) -> None:
        """Continue from the last bounded command, not from the sent one.

        Args:
            period: Time since the last cycle [s].
        """
        gentle = True
        for controller in self._manager.driving:
            if not controller.collision_checked:
                gentle = False
                break
        self.waits = False
        if gentle or not self.windows:
            if self._average is not None:
                self._average = None
                for guard in self._guards:
                    guard.keep()
            return
        if self._average is None:
            self.waits = any(guard.state[1] for guard in self._guards)
            if not self.waits:
                self._begin()
            return
        for guard in self._guards:
            guard.go_on()
        self._note()

    def apply(self, period: float) -> None:
        """Send the average; to be called after all bounds.

        Args:
            period: Time since the last cycle [s].
        """
        if self._average is None:
            return
        one, two, three, four = self._guards
        asked = one.state[1], two.state[1], three.state[1], four.state[1]
        a, b, c, d = self._average.step(asked, period)
        one.send(a, period)
        two.send(b, period)
        three.send(c, period)
        four.send(d, period)

    def way(
        self, speeds: Sequence[float], duration: float, period: float, rest: Sequence[float]
    ) -> Array:
        """Return the setpoints sent from now on if all joints brake together.

        Args:
            speeds: From which they brake, after this cycle [rad/s or m/s].
            duration: Until they stand, without averaging [s].
            period: Time from cycle to cycle [s].
            rest: Where they come to rest [rad or m].

        Returns:
            The joints from where they were sent to before this cycle on, shape (n, joints).

        Raises:
            RuntimeError: Nothing is averaged now.
        """
        if self._average is None:
            raise RuntimeError("nothing is averaged")
        count = math.ceil((duration + sum(self.windows)) / period) + 2
        left = np.clip((0.5 - np.arange(count)) * (period / max(duration, period)) + 1.0, 0.0, 1.0)
        sent = self._average.ahead(left[:, None] * speeds, period)
        # An average bends so little that between its thirds it is straight to 0.2 mm.
        way = self.sent + sent.cumsum(axis=0) * period
        return np.vstack((self.sent, way[_EACH - 1 :: _EACH], rest))

    def within(self) -> list[list[float]]:
        """Return the bounds of the recently sent and requested joint positions [rad or m]."""
        columns = list(zip(*self._recent, strict=True))
        return [[min(column) for column in columns], [max(column) for column in columns]]

    @property
    def averages(self) -> bool:
        """Whether the sent commands are averages."""
        return self._average is not None

    def _begin(self) -> None:
        """Begin averaging, assuming that the joints have long been at rest."""
        self._average = Smoothed(self.windows, (0.0,) * len(self._guards))
        count = math.ceil(sum(self.windows) * self._manager.rate) + 2
        self._recent: deque[list[float]] = deque(maxlen=2 * count)
        self._note()

    def _note(self) -> None:
        """Remember the sent and the requested joint positions."""
        self.sent = [guard.sent for guard in self._guards]
        self._recent += self.sent, [guard.here for guard in self._guards]
