"""The last seconds at full rate, always in memory, frozen after a fault."""

from __future__ import annotations

import time as wall_clock
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from bioscara.hardware.axis import Axis

SECONDS = 10.0
"""Length of the record [s]."""


class Timing(NamedTuple):
    """Timing of a cycle.

    Attributes:
        late: How much later than scheduled it began [s].
        read: Time that reading took [s].
        update: Time that controllers and limits took [s].
        write: Time that writing took [s].
    """

    late: float
    read: float
    update: float
    write: float


class FlightRecord:
    """A ring of cycles.

    Args:
        axes: The joints whose states and commands are kept.
        rate: Cycles per second [Hz].
    """

    def __init__(self, axes: Sequence[Axis], rate: int) -> None:
        self._handles = tuple(
            (axis, axis.position_command, axis.velocity_command, axis.position, axis.velocity)
            for axis in axes
        )
        self._rows: deque[tuple[float, ...]] = deque(maxlen=max(int(SECONDS * rate), 1))
        self._written = 0

    def __len__(self) -> int:
        return len(self._rows)

    def append(self, time: float, timing: Timing) -> None:
        """Keep a cycle.

        Args:
            time: Its begin [s].
            timing: Its timing.
        """
        row = [time, *timing]
        for axis, position_command, velocity_command, position, velocity in self._handles:
            row += (
                position_command.value,
                velocity_command.value,
                position.value,
                velocity.value,
                axis.stamp,
                axis.sample.flags,
            )
        self._rows.append(tuple(row))
        self._written = wall_clock.time_ns()

    def freeze(self) -> Evidence:
        """Return the cycles kept now; the copy does not change any more."""
        names = tuple([axis.name for axis, *_ in self._handles])
        return Evidence(names, tuple(self._rows), self._written)


@dataclass(frozen=True, slots=True)
class Evidence:
    """A frozen flight record.

    Attributes:
        names: Names of the joints.
        rows: The cycles, oldest first. Each is the time of its begin [s], the fields of its
            :class:`Timing`, then of each joint position command [rad or m], velocity command
            [rad/s or m/s], position, velocity, time of the measurement [s] and flags.
        written: When the newest cycle was kept [ns since 1970]; 0 if there is none.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    written: int
