"""Recordings as tables for other programs, CSV and Parquet files, with their flight records."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TextIO

import msgspec
import numpy as np

from bioscara.api.messages import WorldSample
from bioscara.errors import ConfigurationError, RecordingError
from bioscara.extras import install
from bioscara.files.whole_files import replacing
from bioscara.planning.arrays import Array
from bioscara.recording.reading.flight_records import flight_records, unpack
from bioscara.recording.reading.json_messages import message_of
from bioscara.recording.reading.sample_table import TIME, sample_tables
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.rosbag.cdr import CdrReader
from bioscara.rosbag.topics import Topic

SAMPLES, EVENTS, TRAJECTORIES, BODIES = "samples", "events", "trajectories", "bodies"
"""Names of the tables."""
_EVENT_COLUMNS = ("number", "wall", "time", "what", "text", "client", "goal", "status")
_BODY_COLUMNS = (TIME, "body", "x", "y", "z", "qw", "qx", "qy", "qz", "held")
_POINT_COLUMNS = (TIME, "part", "from_start")
_KINDS = ("position", "velocity", "acceleration")
_WHOLE = ("_quality", "_flags", "_cycle", "_enabled", "_paused", "_stale")
"""Ends of the names of columns whose numbers are whole."""
_TIMES = ("time", "_time", "_stamp")
"""Ends of the names of columns with times."""


class _TableWriter(Protocol):
    """Writes one table, some rows at a time."""

    def write(self, columns: Mapping[str, Any]) -> None:
        """Append rows."""

    def close(self) -> None:
        """Complete the file."""


def export_csv(path: Path, out: Path) -> list[Path]:
    """Write samples, events, trajectories and bodies as CSV files, and attached flight records.

    Args:
        path: The recording.
        out: The folder of the files; made if it is missing.

    Returns:
        The files; there is none for a table without rows. Tables replace former ones, and no
        flight record another file.

    Raises:
        RecordingError: The recording cannot be read, another file has the name of a flight record,
            or a file cannot be written. Former tables are replaced only in the last case.
    """
    return _export(path, out, "csv")


def export_parquet(path: Path, out: Path) -> list[Path]:
    """Write the same as :func:`export_csv` as Parquet files.

    Raises:
        RecordingError: As there.
        ConfigurationError: pyarrow is not installed.
    """
    if find_spec("pyarrow") is None:
        raise ConfigurationError(
            f"Parquet files need pyarrow, not installed here: {install('export')}; or export CSV"
        )
    return _export(path, out, "parquet")


def _export(path: Path, out: Path, kind: str) -> list[Path]:
    scan = FileScan()
    # A recording may be refused while these are read: no table of a former export is replaced then.
    tables: dict[str, Iterable[Mapping[str, Any]]] = {
        SAMPLES: sample_tables(path, FileScan()),
        EVENTS: list(_events(path, scan)),
        TRAJECTORIES: list(_trajectories(path)),
        BODIES: list(_bodies(path)),
    }
    files = []
    try:
        records = flight_records(scan.attachments, out)
        out.mkdir(parents=True, exist_ok=True)
        for name, parts in tables.items():
            rest = iter(parts)
            if (first := next(rest, None)) is None:
                continue
            files.append(out / f"{name}.{kind}")
            with replacing(files[-1]) as partial:
                _write(first, rest, partial, kind)
        files += unpack(records)
    except OSError as error:
        raise RecordingError(f"{out} cannot be written: {error.strerror or error}") from error
    return files


def _write(
    first: Mapping[str, Any], rest: Iterable[Mapping[str, Any]], path: Path, kind: str
) -> None:
    writer: _TableWriter
    writer = _ParquetWriter(path, first) if kind == "parquet" else _CsvWriter(path, first)
    with closing(writer):
        writer.write(first)
        for columns in rest:
            writer.write(columns)


class _CsvWriter:
    """Writes a CSV file; an unknown number is an empty cell."""

    def __init__(self, path: Path, columns: Mapping[str, Any]) -> None:
        self._file: TextIO = path.open("w", encoding="utf-8", newline="")
        self._file.write(",".join(columns) + "\n")

    def write(self, columns: Mapping[str, Any]) -> None:
        if all(isinstance(column, np.ndarray) for column in columns.values()):
            self._write_numbers(columns)
        else:
            rows = zip(*map(_cells, columns.values()), strict=True)
            csv.writer(self._file, lineterminator="\n").writerows(rows)

    def _write_numbers(self, columns: Mapping[str, Array]) -> None:
        # One format for a whole row takes a third of the time of formatting each number.
        row = ",".join(map(_format, columns)) + "\n"
        table = np.column_stack(list(columns.values()))
        text = "".join([row % tuple(values) for values in table.tolist()])
        self._file.write(text.replace("nan", ""))

    def close(self) -> None:
        self._file.close()


def _cells(column: Any) -> list[object]:
    """Return the values of a column, None for unknown and for masked ones."""
    values = column.tolist() if isinstance(column, np.ndarray) else column
    return [None if isinstance(each, float) and math.isnan(each) else each for each in values]


def _format(name: str) -> str:
    if name == TIME or name.endswith(_TIMES):
        return "%.6f"
    return "%.0f" if name.endswith(_WHOLE) else "%.10g"


class _ParquetWriter:
    """Writes a Parquet file; an unknown number is NaN.

    Args:
        path: The file.
        columns: The first rows, which decide on the types.
    """

    def __init__(self, path: Path, columns: Mapping[str, Any]) -> None:
        # Imported here: they are installed by an extra of their own.
        import pyarrow as pa  # noqa: PLC0415
        import pyarrow.parquet as pq  # noqa: PLC0415

        self._table = pa.table
        self._writer = pq.ParquetWriter(path, pa.table(dict(columns)).schema, compression="zstd")

    def write(self, columns: Mapping[str, Any]) -> None:
        self._writer.write_table(self._table(dict(columns)))

    def close(self) -> None:
        self._writer.close()


def _events(path: Path, scan: FileScan) -> Iterator[dict[str, Sequence[object]]]:
    rows = []
    for message in messages(path, scan, {Topic.EVENTS}):
        event = _decoded(CdrReader(message.data).string())
        goal = event.get("goal") or {}
        values = {**event, "goal": goal.get("goal", 0), "status": goal.get("status", "")}
        rows.append([values.get(name) for name in _EVENT_COLUMNS])
    if rows:
        yield dict(zip(_EVENT_COLUMNS, map(list, zip(*rows, strict=True)), strict=True))


def _bodies(path: Path) -> Iterator[dict[str, Sequence[object]]]:
    """Yield where the bodies around a simulated arm are, a row for each that has moved."""
    rows: list[tuple[object, ...]] = []
    for message in messages(path, FileScan(), {Topic.WORLD}):
        sample = message_of(message.data, WorldSample)
        rows += [(message.log_time * 1e-9, *pose, sample.held or "") for pose in sample.poses]
    if rows:
        yield dict(zip(_BODY_COLUMNS, map(list, zip(*rows, strict=True)), strict=True))


def _decoded(text: str) -> dict[str, Any]:
    try:
        value = msgspec.json.decode(text)
    except msgspec.DecodeError as error:
        raise RecordingError(f"an event cannot be read: {error}") from error
    if not isinstance(value, dict):
        raise RecordingError("an event cannot be read: it is no object")
    return value


class _Planned(NamedTuple):
    """A trajectory of a recording.

    Attributes:
        joints: Names of its joints.
        columns: Its points as columns, by name.
    """

    joints: tuple[str, ...]
    columns: dict[str, Any]


def _trajectories(path: Path) -> Iterator[dict[str, Any]]:
    planned, arm = list[_Planned](), tuple[str, ...]()
    for message in messages(path, FileScan(), {Topic.TRAJECTORIES, Topic.JOINT_STATES}):
        of_states = message.channel.topic == Topic.JOINT_STATES
        if of_states and arm:
            continue
        reader = CdrReader(message.data)
        begin, part = reader.stamp(), reader.string()
        if of_states:
            arm = reader.strings()
        elif (each := _planned(reader, begin, part)) is not None:
            planned.append(each)
    # All are read before the first is written: each has joints of its own, in an order of its
    # own, and the rows of a table have the same columns.
    moved = dict.fromkeys([name for each in planned for name in each.joints])
    joints = sorted(moved, key=lambda name: arm.index(name) if name in arm else len(arm))
    names = [*_POINT_COLUMNS, *[f"{joint}_{kind}" for kind in _KINDS for joint in joints]]
    for each in planned:
        # In a Parquet file masked is null, of the type of the numbers.
        absent = np.ma.MaskedArray(np.zeros(len(each.columns[TIME])), mask=True)
        yield {name: each.columns.get(name, absent) for name in names}


def _planned(reader: CdrReader, begin: int, part: str) -> _Planned | None:
    """Return the trajectory of a message after its header; None if it has no points."""
    joints = reader.strings()
    unknown = (float("nan"),) * len(joints)
    rows, after = [], []
    for _ in range(reader.uint32()):
        numbers = [reader.double_values() or unknown for _ in range(4)][: len(_KINDS)]
        if any(len(each) != len(joints) for each in numbers):
            raise RecordingError("a point of a trajectory has not as many values as joints")
        rows.append(numbers)
        after.append(1e-9 * reader.stamp())
    if not rows:
        return None
    from_start, table = np.array(after), np.array(rows)
    first = (1e-9 * begin + from_start, [part] * len(rows), from_start)
    columns: dict[str, Any] = dict(zip(_POINT_COLUMNS, first, strict=True))
    for index, joint in enumerate(joints):
        for number, kind in enumerate(_KINDS):
            columns[f"{joint}_{kind}"] = table[:, number, index]
    return _Planned(joints, columns)
