"""Timing functions, and the row that a benchmark reports."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """One line of docs/benchmarks.md.

    Attributes:
        what: The measured quantity.
        value: The measurement, with its unit.
        reference: The reference of the comparison: a peer measured in the same run, or a law.
        limit: The limit as written, for example ``"at most 40 us"``.
        holds: Whether the measurement is within the limit.
    """

    what: str
    value: str
    reference: str
    limit: str
    holds: bool


def seconds(function: Callable[[], object], repeat: int = 7, number: int = 1) -> float:
    """Return the median time of one call of ``function`` [s].

    Args:
        function: The function to time.
        repeat: Number of timings of which the median is taken.
        number: Calls per timing.
    """
    return statistics.median(timings(function, repeat, number))


def timings(function: Callable[[], object], repeat: int, number: int = 1) -> list[float]:
    """Return ``repeat`` timings of one call [s], each the mean of ``number`` calls."""
    clock = time.perf_counter
    result = []
    for _ in range(repeat):
        start = clock()
        for _ in range(number):
            function()
        result.append((clock() - start) / number)
    return result
