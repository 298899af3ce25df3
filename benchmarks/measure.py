"""Timing functions, and the row that a benchmark reports."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """One line of docs/benchmarks.md.

    Attributes:
        what: The measured quantity.
        value: The measurement, with its unit.
        reference: The reference of the comparison: a peer measured in the same run, or a law.
        limit: The limit as written, for example ``"at most 3 times"``.
        holds: Whether the measurement is within the limit.
        used: Part of the limit that is used, for a run that is too short for the limit itself; NaN
            if that is not known.
    """

    what: str
    value: str
    reference: str
    limit: str
    holds: bool
    used: float = math.nan


def medians(
    *functions: Callable[[], object], rounds: int = 31, number: int | Sequence[int] = 1
) -> list[float]:
    """Return the median time of one call of each function [s].

    The functions take turns (A B A B ...), so that a busy or slow computer affects all of them and
    the ratios of the times stay.

    Args:
        *functions: The functions to time.
        rounds: Timings of each function of which the median is taken.
        number: Calls per timing, of all functions or of each.
    """
    numbers = (number,) * len(functions) if isinstance(number, int) else number
    pairs = list(zip(functions, numbers, strict=True))
    turns = [[timed(*pair) for pair in pairs] for _ in range(rounds)]
    return [statistics.median(column) for column in zip(*turns, strict=True)]


def timed(function: Callable[[], object], number: int = 1) -> float:
    """Return the mean time of ``number`` calls [s]."""
    start = time.perf_counter()
    for _ in range(number):
        function()
    return (time.perf_counter() - start) / number


def at_most(what: str, own: float, most: float, peer: float, whose: str, note: str = "") -> Row:
    """Return the row of a time that may be at most ``most`` times another one of the same run.

    Args:
        what: The measured quantity.
        own: Its time [s].
        most: The limit of the ratio.
        peer: The time of the reference [s], measured in turns with ``own``.
        whose: The reference.
        note: Further information, such as other percentiles.
    """
    return Row(
        what,
        f"{duration(own)} ({own / peer:.3g} times)" + (f", {note}" if note else ""),
        f"{whose}: {duration(peer)}",
        f"at most {most:g} times",
        own <= most * peer,
        own / (most * peer),
    )


def duration(time: float) -> str:
    """Return a time [s] as text with three digits and a unit."""
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "us")):
        if time * factor >= 1.0:
            return f"{time * factor:.3g} {unit}"
    return f"{time * 1e9:.3g} ns"
