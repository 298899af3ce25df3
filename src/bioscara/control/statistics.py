"""How long things took, in memory that does not grow: a few counters per quantity."""

from __future__ import annotations

import math

_UNIT = 1e-6
"""Below this [s] everything falls into one bin."""
_PER_OCTAVE = 16
_OCTAVES = 24
"""From 1 us to 16 s."""
_LAST = _PER_OCTAVE * _OCTAVES - 1


class Histogram:
    """Durations, counted in bins of equal ratio: a percentile is exact to 1/16.

    Attributes:
        count: How many durations there were.
        total: Their sum [s].
        maximum: The longest [s].
    """

    __slots__ = ("_bins", "count", "maximum", "total")

    def __init__(self) -> None:
        self._bins = [0] * (_LAST + 1)
        self.count = 0
        self.total = self.maximum = 0.0

    def add(self, duration: float) -> None:
        """Count a duration [s]."""
        self.count += 1
        self.total += duration
        self.maximum = max(self.maximum, duration)
        if duration < _UNIT:
            self._bins[0] += 1
            return
        share, octave = math.frexp(duration / _UNIT)
        # The share is 0.5 .. 1, the octave of 1 us is number 1.
        index = (octave - 2) * _PER_OCTAVE + int(share * 2 * _PER_OCTAVE)
        self._bins[index if index < _LAST else _LAST] += 1

    def percentile(self, percent: float) -> float:
        """Return the duration [s] that this share of all stays at or below; NaN without any."""
        if not self.count:
            return math.nan
        wanted, seen = self.count * percent / 100.0, 0
        for index, number in enumerate(self._bins):
            seen += number
            if seen >= wanted and seen:
                octave, step = divmod(index, _PER_OCTAVE)
                return min(_UNIT * 2.0**octave * (1.0 + (step + 1) / _PER_OCTAVE), self.maximum)
        return self.maximum

    def __str__(self) -> str:
        shares = (f"{1e6 * self.percentile(percent):.0f}" for percent in (50.0, 99.0, 99.9))
        return f"p50/p99/p99.9 {'/'.join(shares)} us, at most {1e6 * self.maximum:.0f} us"


class Statistics:
    """What a loop's cycles were like since it was made.

    Attributes:
        cycles: How many there were.
        overruns: How many had not ended when the next was due.
        periods: Times from begin to begin.
        late: How much later than scheduled they began.
        read: What reading took.
        update: What controllers and limits took.
        write: What writing took.
    """

    __slots__ = ("cycles", "late", "overruns", "periods", "read", "update", "write")

    def __init__(self) -> None:
        self.cycles = self.overruns = 0
        self.periods, self.late = Histogram(), Histogram()
        self.read, self.update, self.write = Histogram(), Histogram(), Histogram()

    def __str__(self) -> str:
        lines = [f"{self.cycles} cycles, {self.overruns} overruns"]
        lines += [
            f"{name}: {getattr(self, name)}"
            for name in ("periods", "late", "read", "update", "write")
        ]
        return "\n".join(lines)
