"""Trajectory files: ROS 2 YAML as ``ros2 topic echo`` writes it, and CSV."""

from __future__ import annotations

import csv
import io
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bioscara.arguments import shown
from bioscara.errors import TrajectoryError
from bioscara.files.whole_files import replacing
from bioscara.planning.files.own_tables import (
    has_motions,
    refuse_folder,
    refuse_other_table,
    refuse_recording,
    trajectory_of_motions,
)
from bioscara.planning.files.ros_message_parser import ITEMS_MAX
from bioscara.planning.files.ros_yaml import decimal, trajectory_of_message
from bioscara.planning.trajectory.trajectory import STEP_MIN, Trajectory

SIZE_MAX = 8 * 2**20
"""Largest YAML file that is read [bytes]."""
CSV_MAX = 32 * 2**20
"""Largest CSV file that is read or written [bytes]: four joints fill a line with at most 13 numbers
of 23 characters, so that :data:`ITEMS_MAX` points always fit."""

_TOP_LEVEL = re.compile(r"^(poses|zones|steps|walls|nests|hotels|stacks|labware):", re.MULTILINE)
_WORLD = re.compile(r"^version: *2\b", re.MULTILINE)
_SUFFIXES = {"position": 0, "velocity": 1, "acceleration": 2}


class TrajectoryFile(NamedTuple):
    """Contents of a trajectory file.

    Attributes:
        trajectory: The motion.
        notes: Sentences on parts left out and unusual properties.
    """

    trajectory: Trajectory
    notes: tuple[str, ...]


def read(path: str | Path) -> TrajectoryFile:
    """Read a trajectory from a file: CSV by its suffix, otherwise YAML.

    Args:
        path: The file.

    Raises:
        TrajectoryError: The file cannot be read or holds no trajectory; the message names the
            file and, if known, the line or point.
    """
    path = Path(path)
    try:
        data = _content(path)
    except TrajectoryError as error:
        raise TrajectoryError(f"{path}: {error}") from error
    return read_content(str(path), data)


def read_content(name: str, data: bytes) -> TrajectoryFile:
    """Read a trajectory from the content of a file, as :func:`read`.

    Args:
        name: Name of the file: its suffix, and how messages name it.
        data: Its content.

    Raises:
        TrajectoryError: It holds no trajectory; the message names the file and, if known, the line
            or point.
    """
    suffix = Path(name).suffix
    try:
        refuse_recording(name, data)
        text = _text(data, _limit(suffix))
        if _is_csv(suffix):
            return TrajectoryFile(_trajectory_of_csv(name, text), ())
        _refuse_other_kind(name, text)
        trajectory, notes = trajectory_of_message(text)
    except TrajectoryError as error:
        raise TrajectoryError(f"{name}: {error}") from error
    return TrajectoryFile(trajectory, notes)


def _is_csv(suffix: str) -> bool:
    return suffix.lower() == ".csv"


def _limit(suffix: str) -> int:
    return CSV_MAX if _is_csv(suffix) else SIZE_MAX


def _refuse_other_kind(path: str, text: str) -> None:
    """Refuse the other files of an arm that are YAML, which no message can be.

    Raises:
        TrajectoryError: It is one of them; names the option to use.
    """
    found = _TOP_LEVEL.search(text)
    if found is None:
        return
    if found[1] == "poses":
        raise TrajectoryError(
            f"is a table of named poses and holds no trajectory; move to one of its poses with "
            f"'bioscara move --name NAME --table {path}'"
        )
    if found[1] == "steps":
        raise TrajectoryError(
            "is a sequence of steps and holds no trajectory; carry it out with 'bioscara run "
            f"{path}'"
        )
    option = "--world" if _WORLD.search(text) else "--scene"
    raise TrajectoryError(
        f"describes surroundings and holds no trajectory; give it as {option} {path}, with a "
        f"trajectory file"
    )


def write_csv(path: str | Path, trajectory: Trajectory) -> None:
    """Write a trajectory as CSV; reading it gives the same trajectory.

    Of points too close in time to be read again, which a planner may produce, the first is
    written. If it fails, an existing file stays as it was.

    Raises:
        TrajectoryError: The file would be too large to be read again; nothing is written.
        OSError: The file cannot be written.
    """
    columns = trajectory.columns()
    rows = np.column_stack(tuple(columns.values())).tolist()
    kept, text = _apart(trajectory.times.tolist()), io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(map(repr, rows[index]) for index in kept)
    data = text.getvalue().encode()
    if len(kept) > ITEMS_MAX or len(data) > CSV_MAX:
        raise TrajectoryError(
            f"{path}: the trajectory takes {len(kept)} points and {len(data) / 2**20:.1f} MiB, a "
            f"file holds {ITEMS_MAX} and {CSV_MAX // 2**20}; split it"
        )
    with replacing(Path(path)) as partial:
        partial.write_bytes(data)


def _apart(times: list[float]) -> list[int]:
    """Return the points to keep, including the first and last, so that none are too close."""
    kept = [0]
    for index, time in enumerate(times[:-1]):
        if min(time - times[kept[-1]], times[-1] - time) >= STEP_MIN:
            kept.append(index)
    return kept if len(times) == 1 else [*kept, len(times) - 1]


def _content(path: Path) -> bytes:
    limit = _limit(path.suffix)
    try:
        if path.is_dir():
            refuse_folder(path)
        with open(path, "rb") as file:
            refuse_recording(str(path), file.peek(16))
            if os.fstat(file.fileno()).st_size > limit:
                raise TrajectoryError(f"is larger than {limit // 2**20} MiB; split it")
            return file.read(limit + 1)
    except FileNotFoundError:
        raise TrajectoryError("does not exist") from None
    except OSError as error:
        raise TrajectoryError(f"cannot be read: {error.strerror}") from error


def _text(data: bytes, limit: int) -> str:
    if not data.strip():
        raise TrajectoryError("is empty")
    if len(data) > limit:
        raise TrajectoryError(f"is larger than {limit // 2**20} MiB; split it")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise TrajectoryError(f"is not text (byte {error.start} is not UTF-8)") from error
    if "\0" in text:
        raise TrajectoryError(f"is not text (byte {text.index(chr(0))} is NUL)")
    return text


def _trajectory_of_csv(name: str, text: str) -> Trajectory:
    if not text.rstrip(" \t").endswith(("\n", "\r")):
        # Only a line end distinguishes 0.12 from a truncated 0.1234.
        raise TrajectoryError(
            "the last line has no line end, so the file may be truncated; if it is whole, end the "
            "line"
        )
    rows = _rows(text)
    header_line, header = next(rows, (1, []))
    header = [cell.strip() for cell in header]
    refuse_other_table(name, header)
    if has_motions(header):
        return trajectory_of_motions(name, header, rows)
    names, columns = _header(header_line, header)
    times: list[float] = []
    tables: tuple[list[list[float]], ...] = ([], [], [])
    for line, cells in rows:
        if len(cells) != len(header):
            raise TrajectoryError(
                f"line {line}: {len(cells)} values, the header names {len(header)} columns"
            )
        if len(times) == ITEMS_MAX:
            raise TrajectoryError(f"line {line}: more than {ITEMS_MAX} points; split the file")
        values = [decimal(cell.strip(), f"line {line}") for cell in cells]
        times.append(values[0])
        for table, indices in zip(tables, columns, strict=True):
            table.append([values[index] for index in indices])
    positions, velocities, accelerations = (
        table if indices else None for table, indices in zip(tables, columns, strict=True)
    )
    return Trajectory(names, times, positions or [], velocities, accelerations)


def _rows(text: str) -> Iterator[tuple[int, list[str]]]:
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        for row in reader:
            if row and not row[0].lstrip().startswith("#"):
                yield reader.line_num, row
    except csv.Error as error:
        raise TrajectoryError(f"line {reader.line_num}: {error}") from error


def _header(line: int, header: list[str]) -> tuple[list[str], tuple[list[int], ...]]:
    if not header or header[0] != "time":
        raise TrajectoryError(
            f"line {line}: the first column must be 'time', then j1_position, ..., and all of "
            f"j1_velocity, ... and j1_acceleration, ... where they are known"
        )
    found: list[dict[str, int]] = [{}, {}, {}]
    for index, column in enumerate(header[1:], 1):
        name, _, suffix = column.rpartition("_")
        if suffix not in _SUFFIXES:
            name, suffix = column, "position"
        if name in found[_SUFFIXES[suffix]]:
            raise TrajectoryError(f"line {line}: column {shown(column)} stands twice")
        found[_SUFFIXES[suffix]][name] = index
    names = list(found[0])
    if not names:
        raise TrajectoryError(f"line {line}: no column with a position")
    for suffix, columns in zip(_SUFFIXES, found, strict=True):
        odd = sorted(set(columns) ^ set(names)) if columns else []
        if odd:
            raise TrajectoryError(f"line {line}: {odd[0]} has no position or no {suffix} column")
    return names, tuple([columns[name] for name in names] if columns else [] for columns in found)
