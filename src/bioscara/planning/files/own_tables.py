"""Tables and recordings that this project writes, where a trajectory is asked for.

The motions of a recording, as ``bioscara record export`` writes them, are read; of the others the
error names the command that fits.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from bioscara.errors import TrajectoryError
from bioscara.planning.arrays import Array
from bioscara.planning.files.ros_yaml import decimal
from bioscara.planning.trajectory.trajectory import Trajectory

_MCAP = b"\x89MCAP0\r\n"
_PARQUET, _SQLITE = b"PAR1", b"SQLite format 3\0"
_MOTIONS = ("time", "part", "from_start")
"""First columns of the table of motions."""
_APART = 0.005
"""Least time between two points [s]: recordings have 32 bits of a number, and nearer ones would
differ by more than a smooth curve has."""
_KINDS = ("position", "velocity", "acceleration")

Row = tuple[int, list[str]]
"""Number of the line, and its cells."""


def refuse_recording(name: str, data: bytes) -> None:
    """Refuse a recording, or a table that is no text, by its first bytes.

    Raises:
        TrajectoryError: It is one.
    """
    if data.startswith(_MCAP):
        raise TrajectoryError(
            f"is a recording; 'bioscara record export {name} --csv DIR' writes its motions to "
            "DIR/trajectories.csv, which 'bioscara run' takes, and 'bioscara record replay "
            f"{name}' shows them"
        )
    if data.startswith(_PARQUET):
        raise TrajectoryError(
            "is a table as other programs read it; 'bioscara record export RECORDING --csv DIR' "
            "writes motions that 'bioscara run' takes"
        )
    if data.startswith(_SQLITE):
        raise TrajectoryError(
            "is a recording of 'ros2 bag'; play it, and write its motion meanwhile: 'ros2 topic "
            "echo --once --full-length /display_planned_path > plan.yaml'"
        )


def refuse_folder(path: Path) -> None:
    """Refuse a folder; that of a run has its motion.

    Raises:
        TrajectoryError: Always.
    """
    motion = path / "trajectory.csv"
    if motion.is_file():
        raise TrajectoryError(f"is the folder of a run; its motion: 'bioscara run {motion}'")
    raise TrajectoryError("is a folder; name a trajectory file")


def refuse_other_table(name: str, header: Sequence[str]) -> None:
    """Refuse a table of samples or events by its first line.

    Raises:
        TrajectoryError: It is one.
    """
    beside = Path(name).parent
    if "trajectory_time" in header:
        raise TrajectoryError(
            "has the samples of a run, as they were measured; the motion is beside it: 'bioscara "
            f"run {beside / 'trajectory.csv'}'"
        )
    if "arm_cycle" in header or header[:2] == ["number", "wall"]:
        raise TrajectoryError(
            "is a table of a recording without motions; these are beside it: 'bioscara run "
            f"{beside / 'trajectories.csv'}'"
        )


def has_motions(header: Sequence[str]) -> bool:
    """Return whether a table is that of the motions of a recording."""
    return tuple(header[: len(_MOTIONS)]) == _MOTIONS


def trajectory_of_motions(name: str, header: Sequence[str], rows: Iterable[Row]) -> Trajectory:
    """Return the motion in a table of motions, its parts one after the other.

    Raises:
        TrajectoryError: It holds several motions, or none.
    """
    goals: dict[str, dict[str, list[Row]]] = {}
    for line, cells in rows:
        if len(cells) != len(header):
            raise TrajectoryError(
                f"line {line}: {len(cells)} values, the header names {len(header)} columns"
            )
        part = cells[1]
        goals.setdefault(part.partition(",")[0], {}).setdefault(part, []).append((line, cells))
    if len(goals) != 1:
        found = ", ".join(goals) or "none"
        last = next(reversed(goals), "")
        remedy = f"""; keep one: grep -e ^time -e '"{last},' {name} > one.csv""" if goals else ""
        raise TrajectoryError(f"holds {len(goals)} motions ({found}); run takes one{remedy}")
    (parts,) = goals.values()
    return _joined(header, [_part(rows) for rows in parts.values()])


def _part(rows: Sequence[Row]) -> Array:
    """Return the numbers of a part, from the time since its start on; NaN where there are none."""
    table = np.array(
        [
            [decimal(cell, f"line {line}") if cell else np.nan for cell in cells[2:]]
            for line, cells in rows
        ]
    )
    kept = [0]
    for index, time in enumerate(table[:-1, 0]):
        if min(time - table[kept[-1], 0], table[-1, 0] - time) >= _APART:
            kept.append(index)
    return table[[*kept, len(table) - 1] if len(table) > 1 else kept]


def _joined(header: Sequence[str], parts: Sequence[Array]) -> Trajectory:
    table = parts[0]
    for part in parts[1:]:
        later = part[1:].copy()  # The point that two parts share is that of the first.
        later[:, 0] += table[-1, 0]
        table = np.vstack((table, later))
    columns = dict(zip(header[2:], table.T, strict=True))
    joints = [
        column.removesuffix("_position")
        for column, values in columns.items()
        if column.endswith("_position") and not np.isnan(values).any()
    ]
    given = [[columns.get(f"{joint}_{kind}") for joint in joints] for kind in _KINDS]
    positions, velocities, accelerations = (
        None
        if any(values is None or np.isnan(values).any() for values in each)
        else np.column_stack([values for values in each if values is not None])
        for each in given
    )
    if not joints or positions is None:
        raise TrajectoryError("no joint has a position in each row")
    return Trajectory(joints, columns["from_start"], positions, velocities, accelerations)
