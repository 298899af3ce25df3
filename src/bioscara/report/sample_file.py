"""The samples as CSV: one row per cycle, appended during the run.

Columns: ``time``, ``phase``, ``trajectory_time``, ``bus_time``, ``retries``, ``late``, then for
each joint ``<joint>_time``, ``_reference``, ``_reference_velocity``, ``_position``,
``_velocity``, ``_flags``, ``_quality`` and ``_load``. Units are SI (s, rad or m, rad/s or m/s),
load is in percent, flags are the number as in the protocol; an empty cell is an unknown value.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isnan
from pathlib import Path
from typing import Self

from bioscara.files.whole_files import AppendedFile
from bioscara.report.cycles import CycleRecord, JointRecord

ROW_BYTES = 420
"""Size of a row of four joints [bytes], to estimate in advance whether the disk has room."""


def header(joint_names: Sequence[str]) -> str:
    """Return the first line of the file, without line end."""
    columns = ["time", "phase", "trajectory_time", "bus_time", "retries", "late"]
    columns += [f"{name}_{column}" for name in joint_names for column in JointRecord._fields]
    return ",".join(columns)


def row(cycle: CycleRecord) -> str:
    """Return the line of one cycle, without line end."""
    cells = [
        f"{cycle.start:.6f}",
        cycle.phase.value,
        _cell(cycle.trajectory_time),
        _cell(cycle.bus_time),
        str(cycle.retries),
        _cell(cycle.late),
    ]
    for joint in cycle.joints:
        cells += _joint_cells(joint)
    return ",".join(cells)


class SampleWriter:
    """Appends rows to a file that ends with a complete row after every call, also a failed one.

    Args:
        path: The file; it must not exist.
        joint_names: Names of the joints, for the header.

    Raises:
        OSError: The file cannot be created, or has no room for its header; then there is none.
    """

    def __init__(self, path: Path, joint_names: Sequence[str]) -> None:
        self._file = AppendedFile(path)
        try:
            self._file.write(f"{header(joint_names)}\n".encode())
        except OSError:
            self._file.close()
            path.unlink()
            raise

    def write(self, cycles: Iterable[CycleRecord]) -> None:
        """Append one row per cycle and pass them to the operating system.

        Raises:
            OSError: A row does not fit; the file ends with its last complete row.
        """
        for cycle in cycles:
            self._file.write(f"{row(cycle)}\n".encode())

    def close(self) -> None:
        """Close the file; may be called twice."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _joint_cells(joint: JointRecord) -> list[str]:
    return [
        f"{joint.time:.6f}",
        _cell(joint.reference),
        _cell(joint.reference_velocity),
        _cell(joint.position),
        _cell(joint.velocity),
        str(joint.flags),
        joint.quality.name.lower(),
        _cell(joint.load),
    ]


def _cell(value: float) -> str:
    return "" if isnan(value) else f"{value:.9g}"
