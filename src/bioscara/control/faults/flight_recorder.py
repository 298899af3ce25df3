"""The last seconds at full rate, always in memory, written after a fault."""

from __future__ import annotations

import csv
import os
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
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

    def freeze(self) -> Evidence:
        """Return the cycles kept now; the copy does not change any more."""
        return Evidence(tuple(self._header()), tuple(self._rows))

    def _header(self) -> list[str]:
        columns = ["time", *Timing._fields]
        for axis, *_ in self._handles:
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


@dataclass(frozen=True, slots=True)
class Evidence:
    """A frozen flight record.

    Attributes:
        columns: Their names.
        rows: The cycles, oldest first.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]

    def write(self, folder: Path, name: str, remarks: Sequence[str]) -> Path:
        """Write it as CSV; the file is whole or does not exist, and no other is replaced.

        Args:
            folder: Destination; created if necessary.
            name: Of the file, without extension; a number is added where it is taken.
            remarks: Sentences for its head, as comment lines.

        Returns:
            The file.

        Raises:
            OSError: It cannot be written.
        """
        folder.mkdir(parents=True, exist_ok=True)
        path, partial = _reserve(folder, name)
        try:
            with partial.open("w", encoding="utf-8", newline="") as file:
                for remark in remarks:
                    file.write("# " + " ".join(remark.split()) + "\n")
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(self.columns)
                for row in self.rows:
                    writer.writerow(f"{value:.9g}" for value in row)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
        return path


def _reserve(folder: Path, name: str) -> tuple[Path, Path]:
    """Return a path that does not exist, and an exclusive partial file to become it.

    Programs of two arms, stopped by one button, request the same name.
    """
    number = 1
    while True:
        path = folder / (f"{name}.csv" if number == 1 else f"{name}-{number}.csv")
        partial = path.with_name(path.name + ".part")
        with suppress(FileExistsError):
            partial.touch(exist_ok=False)
            if not path.exists():
                return path, partial
            partial.unlink()
        number += 1
