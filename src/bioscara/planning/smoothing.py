"""Averages over time, which do not make belts swing.

A load behind a belt swings with a period of its own. An average over that period has nothing at its
frequency: without damping the velocity of the load is itself an average of what was averaged, so
that it is nowhere higher. Averages of averages do so for several periods.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import accumulate
from operator import add

import numpy as np

from bioscara.planning.shapes import Array

Values = tuple[float, ...]


class Average:
    """The average of some values over the last while.

    Args:
        window: How long that is [s]; above 0.
        values: What they were until now.
    """

    def __init__(self, window: float, values: Sequence[float]) -> None:
        self._window = window
        self.fill(values)

    def fill(self, values: Sequence[float]) -> None:
        """Take it that the values have been these for long."""
        self._parts = deque([(self._window, tuple(values))])
        self._gone = 0.0
        self._add_up()

    def _add_up(self) -> None:
        """Sum up all parts anew, so that no difference of sums is ever kept.

        The sums are those of the parts that were there, from each to the youngest of them; what
        came since has a sum of its own.
        """
        rows = [(lasted, *[lasted * value for value in each]) for lasted, each in self._parts]
        rows.reverse()
        self._sums = list(accumulate(rows, lambda one, other: tuple(map(add, one, other))))
        self._since, self._lasted = [0.0] * (len(rows[0]) - 1), 0.0

    def ahead(self, values: Array, period: float) -> Array:
        """Return the averages after each of further values, one a period [s], shape (n, k)."""
        counts = [round(lasted / period) for lasted, _ in self._parts]
        counts[0] = round((self._parts[0][0] - self._gone) / period)
        counts[-1] = max(counts[-1], 1)
        past = np.repeat(np.array([each for _, each in self._parts]), counts, axis=0)
        sums = np.concatenate((past, values)).cumsum(axis=0)
        averages: Array = (sums[len(past) :] - sums[: len(values)]) / len(past)
        return averages

    @property
    def oldest(self) -> Values:
        """What leaves the average next."""
        return self._parts[0][1]

    def step(self, values: Sequence[float], duration: float) -> Values:
        """Return the average after the values have been these for a duration [s]."""
        window, parts, sums = self._window, self._parts, self._sums
        parts.append((duration, tuple(values)))
        self._lasted += duration
        since = [a + duration * b for a, b in zip(self._since, values, strict=True)]
        self._since = since
        gone = sums[-1][0] + self._lasted - window
        while gone >= parts[0][0]:
            parts.popleft()
            sums.pop()
            if not sums:
                self._add_up()
                sums, since = self._sums, self._since
            gone = sums[-1][0] + self._lasted - window
        self._gone = gone
        columns = zip(sums[-1][1:], since, parts[0][1], strict=True)
        return tuple([(a + b - gone * c) / window for a, b, c in columns])


class Smoothed:
    """Averages of averages.

    Args:
        windows: Over how long each is taken [s].
        values: What was averaged until now.
    """

    def __init__(self, windows: Sequence[float], values: Sequence[float]) -> None:
        self._averages = [Average(window, values) for window in windows]

    @property
    def oldest(self) -> Values:
        """What leaves the first average next; empty where there is none."""
        return self._averages[0].oldest if self._averages else ()

    def fill(self, values: Sequence[float]) -> None:
        """Take it that the values have been these for long."""
        for average in self._averages:
            average.fill(values)

    def step(self, values: Sequence[float], duration: float) -> Values:
        """Return the average after the values have been these for a duration [s]."""
        for average in self._averages:
            values = average.step(values, duration)
        return tuple(values)

    def ahead(self, values: Array, period: float) -> Array:
        """Return the averages after each of further values, one a period [s], shape (n, k)."""
        for average in self._averages:
            values = average.ahead(values, period)
        return values
