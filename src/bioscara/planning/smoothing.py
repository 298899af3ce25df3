"""Averages over time, which do not make belts swing.

A load behind a belt swings with a period of its own. An average over that period has nothing at its
frequency: without damping the velocity of the load is itself an average of what was averaged, so
that it is nowhere higher. Averages of averages do so for several periods.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from operator import mul

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

    @property
    def values(self) -> list[Values]:
        """All that is averaged, the oldest first."""
        return [values for _, values in self._parts]

    def ahead(self, values: Array, period: float) -> Array:
        """Return the averages after each of further values, one a period [s], shape (n, k)."""
        counts = [round(lasted / period) for lasted, _ in self._parts]
        counts[-1] = max(counts[-1], 1)
        past = np.repeat(np.array(self.values), counts, axis=0)
        sums = np.cumsum(np.concatenate((past, values)), axis=0)
        averages: Array = (sums[len(past) :] - sums[: len(values)]) / len(past)
        return averages

    @property
    def oldest(self) -> Values:
        """What leaves the average next."""
        return self._parts[0][1]

    def see(self, seen: Callable[[Values], Sequence[float]]) -> None:
        """Take it that the values have been what a function makes of them."""
        known: dict[Values, Values] = {}
        for _, values in self._parts:
            if values not in known:
                known[values] = tuple(seen(values))
        self._parts = deque([(lasted, known[values]) for lasted, values in self._parts])

    def step(self, values: Sequence[float], duration: float) -> Values:
        """Return the average after the values have been these for a duration [s]."""
        window, parts = self._window, self._parts
        parts.append((duration, tuple(values)))
        left = sum([lasted for lasted, _ in parts]) - window
        while left >= parts[0][0]:
            left -= parts.popleft()[0]
        lasted, oldest = parts[0]
        parts[0] = lasted - left, oldest
        weights = [lasted / window for lasted, _ in parts]
        columns = zip(*[each for _, each in parts], strict=True)
        return tuple([sum(map(mul, weights, column)) for column in columns])


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

    def see(self, seen: Callable[[Values], Sequence[float]]) -> None:
        """Take it that the values have been what a function makes of them."""
        for average in self._averages:
            average.see(seen)

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
