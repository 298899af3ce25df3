"""Statistics of durations and rates, in constant memory."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Iterable
from time import monotonic, perf_counter
from typing import NamedTuple

import numpy as np

_UNIT = 1e-6
"""Durations below this [s] fall into one bin."""
_PER_OCTAVE = 16
_OCTAVES = 24
"""From 1 us to 16 s."""
_LAST = _PER_OCTAVE * _OCTAVES - 1
_BATCH, _LARGE_BATCH = 64, 256
"""Values that a spread and a histogram collect before they are counted: all histograms of a loop
are counted in the same cycle, which must be less than one in 100."""
READ, UPDATE, WRITE = range(3)
"""Steps of a manager's cycle, in this order."""


class Histogram:
    """Durations, counted in bins of equal ratio: a percentile is exact to 1/16.

    One thread adds, any may ask.
    """

    __slots__ = ("_bins", "_maximum", "_new", "_settling")

    def __init__(self) -> None:
        self._settling = threading.Lock()
        self._new: list[float] = []
        self._bins = np.zeros(_LAST + 1, np.int64)
        self._maximum = 0.0

    def add(self, duration: float) -> None:
        """Count a duration [s]."""
        # Counting them in batches takes a fifth of the time.
        new = self._new
        new.append(duration)
        if len(new) >= _LARGE_BATCH:
            self._settle()

    @property
    def maximum(self) -> float:
        """The longest duration [s]; 0 without any."""
        self._settle()
        return self._maximum

    def percentile(self, percent: float) -> float:
        """Return the duration [s] that this percentage does not exceed; NaN without any."""
        self._settle()
        seen = self._bins.cumsum()
        if not seen[-1]:
            return math.nan
        wanted = max(seen[-1] * percent / 100.0, 1)
        octave, step = divmod(int(np.searchsorted(seen, wanted)), _PER_OCTAVE)
        return min(_UNIT * 2.0**octave * (1.0 + (step + 1) / _PER_OCTAVE), self._maximum)

    def _settle(self) -> None:
        with self._settling:
            new, self._new = self._new, []
            if not new:
                return
            share, octave = np.frexp(np.array(new) / _UNIT)
            # The share is 0.5 .. 1, the octave of 1 us is number 1.
            bins = (octave - 2) * _PER_OCTAVE + (share * 2 * _PER_OCTAVE).astype(np.int64)
            # Another array: a percentile may be computed from the former one.
            self._bins = self._bins + np.bincount(bins.clip(0, _LAST), minlength=_LAST + 1)
            self._maximum = max(*new, self._maximum)

    def __str__(self) -> str:
        shares = (f"{1e6 * self.percentile(percent):.0f}" for percent in (50.0, 99.0, 99.9))
        return f"p50/p99/p99.9 {'/'.join(shares)} us, at most {1e6 * self.maximum:.0f} us"


class SpreadSummary(NamedTuple):
    """Summary of a quantity; the names are those of ROS.

    Attributes:
        average: The mean of its values.
        min: The lowest.
        max: The highest.
        standard_deviation: Of all values, not estimated from a sample.
        sample_count: How many there were.
        current_value: The last one.
    """

    average: float
    min: float
    max: float
    standard_deviation: float
    sample_count: int
    current_value: float


class Spread:
    """Running statistics of a quantity without its values: as much as ROS reports.

    One thread adds, any may ask.
    """

    __slots__ = (
        "_average",
        "_count",
        "_last",
        "_maximum",
        "_minimum",
        "_new",
        "_settling",
        "_squares",
    )

    def __init__(self) -> None:
        self._settling = threading.Lock()
        self._new: list[float] = []
        self._count = 0
        self._average = self._squares = 0.0
        self._last = self._minimum = self._maximum = math.nan

    def add(self, value: float) -> None:
        """Add a value, which is finite."""
        # Summing them in batches takes a fifth of the time.
        new = self._new
        new.append(value)
        if len(new) >= _BATCH:
            self._settle()

    def summary(self) -> SpreadSummary:
        """Return a summary of the values; its statistics are NaN without any."""
        self._settle()
        deviation = math.sqrt(self._squares / self._count) if self._count else math.nan
        average = self._average if self._count else math.nan
        return SpreadSummary(
            average, self._minimum, self._maximum, deviation, self._count, self._last
        )

    def _settle(self) -> None:
        with self._settling:
            new, self._new = self._new, []
            if not new:
                return
            number, average = len(new), math.fsum(new) / len(new)
            # Sums of squares about two averages, joined: about zero small deviations would be lost.
            apart, count = average - self._average, self._count + number
            self._squares += math.dist(new, (average,) * number) ** 2
            self._squares += apart * apart * self._count * number / count
            self._average += apart * number / count
            self._count, self._last = count, new[-1]
            # NaN, as long as there is none yet, loses against any number that comes first.
            self._minimum = min(*new, self._minimum)
            self._maximum = max(*new, self._maximum)


class UpdateStatistics:
    """Statistics of a controller's updates since it was activated last.

    Attributes:
        execution_time: Their computing time [s].
        periodicity: How often they came, in real time [Hz].
    """

    __slots__ = ("_began", "execution_time", "periodicity")

    def __init__(self) -> None:
        self.execution_time, self.periodicity = Spread(), Spread()
        self._began = math.nan

    def forget(self) -> None:
        """Forget how often they came so far: those of a simulation need not be in real time."""
        self.periodicity = Spread()

    def begin(self, since: float) -> None:
        """Note that an update begins.

        Args:
            since: When cycles began after the last pause, by the clock of :func:`perf_counter` [s].
        """
        former, self._began = self._began, perf_counter()
        if since < former < self._began:
            self.periodicity.add(1.0 / (self._began - former))

    def end(self) -> None:
        """Note that it has ended without an error."""
        self.execution_time.add(perf_counter() - self._began)


class ManagerStatistics:
    """Statistics of a manager's cycles since it was created.

    Attributes:
        periodicity: How often they came, in real time, since :meth:`forget` [Hz].
        read: Duration of reading [s], by component.
        write: Duration of writing [s], by component.
        timing: Durations of the steps of the last cycle [s], at :data:`READ`, :data:`UPDATE` and
            :data:`WRITE`.
        since: When cycles began after the last pause, by the clock of :func:`perf_counter` [s].
    """

    __slots__ = ("_began", "periodicity", "read", "since", "timing", "write")

    def __init__(self, components: Iterable[str]) -> None:
        names = tuple(components)
        self.periodicity = Spread()
        self.read = {name: Spread() for name in names}
        self.write = {name: Spread() for name in names}
        self.timing = [0.0, 0.0, 0.0]
        self._began, self.since = math.nan, -math.inf

    def restart(self) -> None:
        """Start again after a pause without cycles, which is no period."""
        self.since = perf_counter()

    def forget(self) -> None:
        """Forget how often they came so far; as :meth:`UpdateStatistics.forget`."""
        self.periodicity = Spread()

    def begin(self) -> None:
        """Note that a cycle begins."""
        former, self._began = self._began, perf_counter()
        if self.since < former < self._began:
            self.periodicity.add(1.0 / (self._began - former))

    def timed(
        self, step: int, work: Callable[[float, float], object], time: float, period: float
    ) -> None:
        """Carry out a step of the cycle, and note how long it took.

        Args:
            step: :data:`READ`, :data:`UPDATE` or :data:`WRITE`.
            work: The step.
            time: Its first argument [s].
            period: Its second one [s].
        """
        begin = perf_counter()
        work(time, period)
        self.timing[step] = perf_counter() - begin


class CycleStatistics:
    """Statistics of a loop's cycles since it was created.

    Attributes:
        cycles: How many there were.
        overruns: How many had not ended when the next was due, also in real time alone.
        periods: Times from begin to begin.
        late: How much later than scheduled they began, in real time if that is later.
        read: Durations of reading.
        update: Durations of controllers and limits.
        write: Durations of writing.
    """

    __slots__ = ("_begun", "cycles", "late", "overruns", "periods", "read", "update", "write")

    def __init__(self) -> None:
        self.cycles = self.overruns = 0
        self.periods, self.late = Histogram(), Histogram()
        self.read, self.update, self.write = Histogram(), Histogram(), Histogram()
        self._begun: deque[float] = deque()

    def note_begin(self) -> None:
        """Note that a cycle has begun."""
        begun, now = self._begun, monotonic()
        begun.append(now)
        while begun[0] <= now - 1.0:
            begun.popleft()

    @property
    def rate(self) -> int:
        """Cycles of the last second of real time [Hz]; 0 if none has begun for so long."""
        begun = self._begun
        return len(begun) if begun and begun[-1] > monotonic() - 1.0 else 0

    def __str__(self) -> str:
        lines = [f"{self.cycles} cycles, {self.overruns} overruns"]
        lines += [
            f"{name}: {getattr(self, name)}"
            for name in ("periods", "late", "read", "update", "write")
        ]
        return "\n".join(lines)
