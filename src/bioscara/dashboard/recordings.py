"""The recordings of an arm, and the samples of one, thinned out for plots."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np

from bioscara.errors import InvalidArgumentError, RecordingError
from bioscara.files.regular_file import McapFile
from bioscara.planning.arrays import Array, Index
from bioscara.recording.content import GRIPPER
from bioscara.recording.reading.extent import Extent, extent_of
from bioscara.recording.reading.sample_table import TIME, sample_tables
from bioscara.recording.reading.scan import FileScan
from bioscara.recording.writing.folder import RecordingFolder
from bioscara.rosbag.recording_file import is_being_written

FEWEST, MOST = 2, 20_000
"""Range of the number of samples that can be asked for."""
_POSITION = "_position"
_MOST_KNOWN = 1024
"""Files whose extent is remembered."""


class RecordingEntry(msgspec.Struct, frozen=True):
    """A recording.

    Attributes:
        name: Name of its file.
        size: [byte].
        begin: Time of its first message, in seconds since 1970; null if it is not known.
        end: That of its last one; null while it is written, or where its recorder was killed.
        complete: Whether it was finished; one that was not can be replayed all the same.
        writing: Whether a recorder writes it.
    """

    name: str
    size: int
    begin: float | None
    end: float | None
    complete: bool
    writing: bool


class RecordedSamples(msgspec.Struct, frozen=True):
    """Some samples of a recording; an unknown number is null.

    Attributes:
        begin: Time of the first one, in seconds since 1970.
        times: Their times after that [s].
        joint_names: The joints.
        positions: For each sample one for each joint [rad or m].
        velocities: Likewise [rad/s or m/s].
        commands: Commanded positions, likewise [rad or m].
        widths: Width of the jaws at each sample [m].
        total: Number of samples in the file; of more than were asked for, every second one is
            left out, or more.
    """

    begin: float
    times: list[float]
    joint_names: tuple[str, ...]
    positions: list[list[float]]
    velocities: list[list[float]]
    commands: list[list[float]]
    widths: list[float]
    total: int


def recordings(folder: Path, arm: str) -> list[RecordingEntry]:
    """Return the recordings of an arm, newest first; a file deleted meanwhile is left out.

    Args:
        folder: Their folder.
        arm: Name of its owner.
    """
    found = []
    for path in reversed(RecordingFolder(folder, arm, 0).files()):
        try:
            status = path.stat()
            extent = _extent(path, status.st_size, status.st_mtime_ns)
            writing = not extent.complete and is_being_written(path)
        except (RecordingError, OSError):
            continue
        found.append(RecordingEntry(path.name, *extent, writing))
    return found


def recording_of(folder: Path, arm: str, name: str) -> McapFile | None:
    """Return the file of a name of the list; None if there is none."""
    files = RecordingFolder(folder, arm, 0).files()
    return next((path for path in files if path.name == name and path.is_one()), None)


@lru_cache(_MOST_KNOWN)
def _extent(path: Path, size: int, changed: int) -> Extent:  # noqa: ARG001  both of the cache
    return extent_of(path)


def recorded_samples(path: Path, count: int) -> RecordedSamples:
    """Return evenly chosen samples of a recording.

    Args:
        path: The recording.
        count: Largest number of samples, within :data:`FEWEST` and :data:`MOST`.

    Raises:
        InvalidArgumentError: The number is outside that range.
        RecordingError: It cannot be read, is no recording, or has no samples.
    """
    if not FEWEST <= count <= MOST:
        raise InvalidArgumentError(f"count: {count} is outside {FEWEST} .. {MOST}")
    kept = _Kept(count)
    for table in sample_tables(path, FileScan()):
        kept.add(table)
    names = tuple(
        column.removesuffix(_POSITION)
        for column in kept.columns
        if column.endswith(_POSITION) and column != f"{GRIPPER}{_POSITION}"
    )
    if not kept.total or not names:
        raise RecordingError(f"{path.name} has no samples of joints")
    times = kept.column(TIME)
    positions, velocities, commands = (
        np.column_stack([kept.column(f"{name}_{kind}") for name in names]).tolist()
        for kind in ("position", "velocity", "command")
    )
    return RecordedSamples(
        float(times[0]),
        (times - times[0]).tolist(),
        names,
        positions,
        velocities,
        commands,
        kept.column(f"{GRIPPER}{_POSITION}").tolist(),
        kept.total,
    )


class _Kept:
    """Rows of a table of unknown length: every one, then every second one, then every fourth."""

    def __init__(self, count: int) -> None:
        self._count, self._step, self.total = count, 1, 0
        self._parts: list[tuple[Index, Mapping[str, Array]]] = []
        self.columns: tuple[str, ...] = ()

    def add(self, table: Mapping[str, Array]) -> None:
        """Take the next rows."""
        self.columns = self.columns or tuple(table)
        rows: Index = self.total + np.arange(len(table[TIME]))
        self.total += len(rows)
        self._parts.append((rows, table))
        self._thin()
        while sum(len(rows) for rows, _ in self._parts) > self._count:
            self._step *= 2
            self._thin()

    def column(self, name: str) -> Array:
        """Return a column of the kept rows; unknown where it is missing."""
        parts = [
            table.get(name, np.full(len(rows), np.nan)) for rows, table in self._parts if len(rows)
        ]
        joined: Array = np.concatenate(parts)
        return joined

    def _thin(self) -> None:
        thinned: list[tuple[Index, Mapping[str, Array]]] = []
        for rows, table in self._parts:
            chosen = rows % self._step == 0
            if not chosen.all():
                kept = {name: column[chosen] for name, column in table.items()}
                thinned.append((rows[chosen], kept))
            else:
                thinned.append((rows, table))
        self._parts = thinned
