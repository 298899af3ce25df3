"""The motion of a run, read from its folder."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bioscara.errors import ConfigurationError
from bioscara.report.cycles import Phase
from bioscara.report.folder import SAMPLES


class RecordedMotion(NamedTuple):
    """The cycles of a run in which the position of every joint was known.

    Attributes:
        times: Begin of each cycle [s], 0 at the start of the trajectory, or at the first of these
            cycles if the run ended before, shape (n,).
        phases: Part of the run that each cycle belongs to.
        positions: Measured positions [rad or m], shape (n, joints).
        skipped: Time from the first cycle of the run to the first of these [s].
    """

    times: NDArray[np.float64]
    phases: tuple[Phase, ...]
    positions: NDArray[np.float64]
    skipped: float


class _Row(NamedTuple):
    """One line of the samples; a position is None where it was unknown."""

    time: float
    phase: Phase
    trajectory_time: float | None
    positions: tuple[float | None, ...]


def read_run(folder: Path, joint_names: Sequence[str]) -> RecordedMotion:
    """Read the measured positions of a run.

    Args:
        folder: Its folder.
        joint_names: Names of the joints.

    Raises:
        ConfigurationError: The folder is not that of a run, its samples were truncated or changed,
            or the position of a joint was never known.
    """
    path = folder / SAMPLES
    if not path.is_file():
        raise ConfigurationError(f"{folder} has no {SAMPLES}, so it is not the folder of a run")
    first, zero = None, None
    times: list[float] = []
    phases: list[Phase] = []
    positions: list[tuple[float | None, ...]] = []
    for row in _rows(path, joint_names):
        first = row.time if first is None else first
        if zero is None and row.phase is Phase.TRAJECTORY and row.trajectory_time is not None:
            zero = row.time - row.trajectory_time
        if None not in row.positions:
            times.append(row.time)
            phases.append(row.phase)
            positions.append(row.positions)
    if first is None or not times:
        raise ConfigurationError(
            f"{path}: the run ended before the position of every joint was known, so there is no "
            f"motion to show; its report.txt says why it ended"
        )
    shift = times[0] if zero is None else zero
    skipped = times[0] - first
    return RecordedMotion(
        np.array(times) - shift, tuple(phases), np.array(positions, dtype=np.float64), skipped
    )


def _rows(path: Path, joint_names: Sequence[str]) -> Iterator[_Row]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            yield from _parsed(path, file, joint_names)
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not text"
        raise ConfigurationError(
            f"{path} cannot be read: {reason}; name the folder of another run"
        ) from error


def _parsed(path: Path, lines: Iterator[str], joint_names: Sequence[str]) -> Iterator[_Row]:
    """Yield the rows of a samples file.

    Raises:
        ConfigurationError: A line is truncated, or is not one of samples.
    """
    header = _whole(path, 1, next(lines, ""))
    columns = ("time", "phase", "trajectory_time", *(f"{name}_position" for name in joint_names))
    for column in columns:
        if column not in header:
            raise ConfigurationError(
                f"{path}: line 1 names no column {column}, so these are not the samples of a run "
                f"of this arm; name the folder of another run"
            )
    indices = [header.index(column) for column in columns]
    last = float("-inf")
    for number, line in enumerate(lines, 2):
        cells = _whole(path, number, line)
        try:
            if len(cells) != len(header):
                raise ValueError
            time, phase, trajectory_time, *positions = (cells[index] for index in indices)
            row = _Row(
                float(time), Phase(phase), _number(trajectory_time), tuple(map(_number, positions))
            )
            values = [value for value in row[2:3] + row.positions if isinstance(value, float)]
            if not np.isfinite([row.time, *values]).all() or row.time < last:
                raise ValueError
        except ValueError:
            raise ConfigurationError(
                f"{path}, line {number}: not a line of samples, so the file was changed; name the "
                f"folder of another run"
            ) from None
        last = row.time
        yield row


def _whole(path: Path, number: int, line: str) -> list[str]:
    """Return the cells of a line that has its line end."""
    if not line.endswith("\n"):
        raise ConfigurationError(
            f"{path}, line {number}: the line is truncated; "
            + ("name the folder of another run" if number == 1 else "delete it to see the rest")
        )
    return next(csv.reader([line]), [])


def _number(cell: str) -> float | None:
    return float(cell) if cell else None
