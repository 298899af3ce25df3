"""Times of the arm's clock as times since 1970."""

from __future__ import annotations

import time
from collections.abc import Callable

_SECOND = 1e9
_SAME_PACE = 1e-2
"""Difference of the paces of two clocks below which they count as the same."""


class WallClock:
    """Adds to the arm's times what the wall clock was ahead when the recording began.

    Times that belong together stay together: a step of the wall clock while a file is written
    changes nothing in it. A simulation that is faster than real time stays in its own time.

    Args:
        now: The present time on the arm's clock [s].
        wall: Returns the time since 1970 [ns].
        steady: Returns the time on a clock that is never set [s].
    """

    def __init__(
        self,
        now: float,
        wall: Callable[[], int] = time.time_ns,
        steady: Callable[[], float] = time.monotonic,
    ) -> None:
        self._wall, self._steady = wall, steady
        self._begin, self._begun = now, steady()
        self._ahead = wall() - round(now * _SECOND)

    def stamp(self, moment: float) -> int:
        """Return a time of the arm's clock [s] in ns since 1970."""
        return round(moment * _SECOND) + self._ahead

    def renew(self, now: float) -> None:
        """Follow the wall clock from now on, for the next file; a fast simulation does not.

        Args:
            now: The present time on the arm's clock [s].
        """
        passed = self._steady() - self._begun
        if abs(now - self._begin - passed) <= _SAME_PACE * passed:
            self._ahead = self._wall() - round(now * _SECOND)
