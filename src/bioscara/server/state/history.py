"""The last ten minutes of an arm: a row for each control cycle, and fewer for a plot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from mmap import mmap
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bioscara.api.messages import History, StateSample
from bioscara.errors import InvalidArgumentError, LimitError
from bioscara.planning.arrays import Array

Rows = NDArray[np.float32]
"""One row of numbers for each cycle."""

Number = TypeVar("Number", bound=np.generic)

DURATION = 600.0
"""Time that is kept [s]."""
FEWEST, MOST = 2, 5000
"""Range of the number of points in an answer."""
_SLACK = 2.0
"""Time whose rows may be overwritten while the others are read [s]."""
_DIGITS = 7
"""Decimals in an answer: 0.1 um, 0.1 urad and 0.1 us. Single precision has no more."""
_PER_JOINT = 5
"""Columns of a joint: position, velocity, command, error, load."""


class StateHistory:
    """A ring of rows, written by the control loop and read by any thread.

    The memory is taken once, and a row is written in place. The row of a cycle is complete before
    it is counted, and the oldest rows, which may be overwritten during a reading, are not read:
    no lock can make the loop wait.

    Args:
        names: The joints.
        rate: Control cycles per second [Hz].
        memory: Memory of :meth:`size` bytes, which other processes may read; None for own memory.
    """

    def __init__(self, names: Sequence[str], rate: int, memory: mmap | None = None) -> None:
        self._names, self._joints = tuple(names), len(names)
        self._kept = round(DURATION * rate)
        self._size, columns = _shape(self._joints, rate)
        block = bytearray(self.size(self._joints, rate)) if memory is None else memory
        self._counted = np.frombuffer(block, np.int64, 1)
        self._times: Array = np.frombuffer(block, np.float64, self._size, 8)
        rows = np.frombuffer(block, np.float32, self._size * columns, 8 + 8 * self._size)
        self._rows = rows.reshape(self._size, columns)
        self._unknown = (math.nan,) * self._joints

    @staticmethod
    def size(joints: int, rate: int) -> int:
        """Return the memory of a history [byte].

        Args:
            joints: Number of joints.
            rate: Control cycles per second [Hz].
        """
        rows, columns = _shape(joints, rate)
        return 8 + 8 * rows + 4 * rows * columns

    @property
    def _count(self) -> int:
        return int(self._counted[0])

    def add(self, sample: StateSample) -> None:
        """Add the state at the end of a cycle; takes some microseconds."""
        row = self._count % self._size
        commands, positions, unknown = sample.commands, sample.positions, self._unknown
        # A joint without power follows nothing.
        errors = (
            [command - here for command, here in zip(commands, positions, strict=True)]
            if sample.enabled
            else unknown
        )
        self._times[row] = sample.time
        self._rows[row] = (
            *positions, *sample.velocities, *commands, *errors, *(sample.loads or unknown),
            sample.late, sample.bus_time,
        )  # fmt: skip
        self._counted[0] += 1

    def between(self, begin: float, end: float | None, points: int) -> History:
        """Return the rows of a time, at most so many.

        Args:
            begin: First time, on the arm's clock [s].
            end: Last time [s]; None for now.
            points: Largest number of points. Where there are more rows, each two points have the
                smallest and the largest value of each quantity among the rows that they replace.

        Raises:
            InvalidArgumentError: The times are none.
            LimitError: The number of points is outside its range.
        """
        if math.isnan(begin) or (end is not None and not end >= begin):
            raise InvalidArgumentError(f"the history from {begin:g} to {end} s: end before begin")
        if not FEWEST <= points <= MOST:
            raise LimitError("points of the history", points, FEWEST, MOST, "")
        count = self._count
        first = max(count - self._kept, 0)
        times = self._part(self._times, first, count)
        oldest = float(times[0]) if len(times) else math.nan
        low = int(np.searchsorted(times, begin, "left"))
        high = len(times) if end is None else int(np.searchsorted(times, end, "right"))
        rows = self._part(self._rows, first + low, first + max(high, low))
        return self._answer(oldest, *_thinned(times[low:high], rows, points))

    def _part(self, ring: NDArray[Number], first: int, last: int) -> NDArray[Number]:
        """Return a copy of some rows, by their numbers since the first one."""
        begin, end = first % self._size, last % self._size
        if begin < end or first == last:
            return ring[begin:end].copy()
        return np.concatenate((ring[begin:], ring[:end]))

    def _answer(self, oldest: float, times: Array, values: Rows) -> History:
        columns = [
            tuple(column) for column in np.round(values.T.astype(np.float64), _DIGITS).tolist()
        ]
        count = self._joints
        groups = [
            tuple(columns[index * count : (index + 1) * count]) for index in range(_PER_JOINT)
        ]
        positions, velocities, commands, errors, loads = groups
        known = not np.isnan(values[:, 4 * count : 5 * count]).all()
        return History(
            oldest=oldest,
            time=tuple(np.round(times, _DIGITS).tolist()),
            names=self._names,
            positions=positions,
            velocities=velocities,
            commands=commands,
            errors=errors,
            loads=loads if known else None,
            late=columns[-2],
            bus_time=columns[-1],
        )


def _shape(joints: int, rate: int) -> tuple[int, int]:
    """Return the numbers of rows and columns."""
    return round(DURATION * rate) + round(_SLACK * rate), _PER_JOINT * joints + 2


def _thinned(times: Array, rows: Rows, points: int) -> tuple[Array, Rows]:
    """Return at most so many rows, in which no smallest and no largest value is lost.

    Args:
        times: Time of each row [s].
        rows: The rows.
        points: Largest number of rows.
    """
    count, columns = rows.shape
    if count <= points:
        return times, rows
    size = math.ceil(count / (points // 2))
    groups = math.ceil(count / size)
    thin = np.empty((2 * groups, columns), dtype=rows.dtype)
    padded = np.full(groups * size, np.nan, dtype=rows.dtype)
    table, index = padded.reshape(groups, size), np.arange(groups)
    # One column after the other: the interpreter is free for the control loop in between.
    for column in range(columns):
        padded[:count] = rows[:, column]
        unknown = np.isnan(table)
        low = np.where(unknown, np.inf, table).argmin(axis=1)
        high = np.where(unknown, -np.inf, table).argmax(axis=1)
        # In the order in which they occurred, so that a rise stays a rise.
        thin[0::2, column] = table[index, np.minimum(low, high)]
        thin[1::2, column] = table[index, np.maximum(low, high)]
    begins = np.arange(0, count, size)
    ends = np.minimum(begins + size, count) - 1
    moments = np.empty(2 * groups)
    moments[0::2], moments[1::2] = times[begins], times[ends]
    # A last group of one row is one point.
    used = 2 * groups - (begins[-1] == ends[-1])
    return moments[:used], thin[:used]
