"""The last seconds at full rate, always in memory, written when something went wrong."""

from __future__ import annotations

import csv
import os
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from bioscara.hardware.axis import Axis

SECONDS = 10.0
"""How much of the past is kept [s]."""


class Timing(NamedTuple):
    """What a cycle cost.

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
        self._axes = tuple(axes)
        self._rows: deque[tuple[float, ...]] = deque(maxlen=max(int(SECONDS * rate), 1))

    def __len__(self) -> int:
        return len(self._rows)

    def append(self, time: float, timing: Timing) -> None:
        """Keep a cycle.

        Args:
            time: Its begin [s].
            timing: What it cost.
        """
        row = [time, *timing]
        for axis in self._axes:
            row += (
                axis.position_command.value,
                axis.velocity_command.value,
                axis.position.value,
                axis.velocity.value,
                axis.stamp,
                float(axis.sample.flags),
            )
        self._rows.append(tuple(row))

    def write(self, path: Path, remarks: Sequence[str]) -> None:
        """Write the ring as CSV; the file is whole or does not exist.

        Args:
            path: The file, replaced if it exists.
            remarks: Sentences for its head, as comment lines.

        Raises:
            OSError: It cannot be written.
        """
        partial = path.with_name(path.name + ".part")
        with partial.open("w", encoding="utf-8", newline="") as file:
            for remark in remarks:
                file.write("# " + " ".join(remark.split()) + "\n")
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(self._header())
            for row in tuple(self._rows):
                writer.writerow(f"{value:.9g}" for value in row)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)

    def _header(self) -> list[str]:
        columns = ["time", *Timing._fields]
        for axis in self._axes:
            columns += [
                f"{axis.name}_{what}"
                for what in (
                    "position_command",
                    "velocity_command",
                    "position",
                    "velocity",
                    "stamp",
                    "flags",
                )
            ]
        return columns
