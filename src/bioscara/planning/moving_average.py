"""Averages over time, which do not make belts swing.

A load behind a belt swings with a period of its own. An average over that period has nothing at its
frequency: without damping the velocity of the load is itself an average of what was averaged, so
that it is nowhere higher. Averages of averages do so for several periods.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from bioscara.planning.collision.shapes import Array

Values = tuple[float, float, float, float]
"""One for each joint, or for each velocity of the tool."""


class Average:
    """The average of four values over the last while.

    It is the difference of two integrals, each of which is the sum of the same numbers in the same
    order: its rounding does not grow. Four values are written out, for a stream of commands is
    averaged in every cycle.

    Args:
        window: How long that is [s]; above 0.
        values: What they were until now.
    """

    def __init__(self, window: float, values: Sequence[float]) -> None:
        self._window = window
        self.fill(values)

    def fill(self, values: Sequence[float]) -> None:
        """Take it that the values have been these for long."""
        a, b, c, d = values
        window, zero = self._window, (0.0, 0.0, 0.0, 0.0)
        # Each part: how long it lasted, its values, and their integrals up to its beginning.
        self._parts: deque[tuple[float, Values, Values]] = deque([(window, (a, b, c, d), zero)])
        self._integrals = (window * a, window * b, window * c, window * d)
        self._gone = 0.0

    def ahead(self, values: Array, period: float) -> Array:
        """Return the averages after each of further values, one a period [s], shape (n, 4)."""
        counts = [round(lasted / period) for lasted, _, _ in self._parts]
        counts[0] = round((self._parts[0][0] - self._gone) / period)
        counts[-1] = max(counts[-1], 1)
        past = np.repeat(np.array([each for _, each, _ in self._parts]), counts, axis=0)
        sums = np.concatenate((past, values)).cumsum(axis=0)
        averages: Array = (sums[len(past) :] - sums[: len(values)]) / len(past)
        return averages

    @property
    def oldest(self) -> Values:
        """What leaves the average next."""
        return self._parts[0][1]

    def step(self, values: Values, duration: float) -> Values:
        """Return the average after the values have been these for a duration [s]."""
        parts, window, before = self._parts, self._window, self._integrals
        parts.append((duration, values, before))
        p, q, r, s = values
        a, b, c, d = before
        a, b, c, d = a + duration * p, b + duration * q, c + duration * r, d + duration * s
        self._integrals = a, b, c, d
        gone = self._gone + duration
        while gone >= parts[0][0]:
            gone -= parts.popleft()[0]
        self._gone = gone
        _, (p, q, r, s), (w, x, y, z) = parts[0]
        return (
            (a - w - gone * p) / window,
            (b - x - gone * q) / window,
            (c - y - gone * r) / window,
            (d - z - gone * s) / window,
        )


class Smoothed:
    """Averages of averages.

    Args:
        windows: Over how long each is taken [s].
        values: What was averaged until now.
    """

    def __init__(self, windows: Sequence[float], values: Sequence[float]) -> None:
        self._averages = [Average(window, values) for window in windows]

    @property
    def oldest(self) -> Sequence[float]:
        """What leaves the first average next; empty where there is none."""
        return self._averages[0].oldest if self._averages else ()

    def fill(self, values: Sequence[float]) -> None:
        """Take it that the values have been these for long."""
        for average in self._averages:
            average.fill(values)

    def step(self, values: Values, duration: float) -> Values:
        """Return the average after the values have been these for a duration [s]."""
        for average in self._averages:
            values = average.step(values, duration)
        return values

    def ahead(self, values: Array, period: float) -> Array:
        """Return the averages after each of further values, one a period [s], shape (n, 4)."""
        for average in self._averages:
            values = average.ahead(values, period)
        return values
