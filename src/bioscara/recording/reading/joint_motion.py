"""The motion in a recording: where the joints were, from the moment all are homed."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bioscara.errors import RecordingError
from bioscara.planning.arrays import Array
from bioscara.recording.content import ArmStatus
from bioscara.recording.reading.json_messages import message_of
from bioscara.recording.reading.sample_table import TIME, sample_tables
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.rosbag.topics import Topic

ROWS_MAX = 20_000
"""Largest number of rows: of longer recordings every second one, every third one and so on."""


class JointMotion(NamedTuple):
    """Samples in which the position of each joint is known.

    Attributes:
        times: Their times, 0 at the first [s], shape (n,).
        positions: Positions of the joints [rad or m], shape (n, joints).
        moving: Names of the operations that use the arm at each, in one text.
        skipped: Time before the first of them [s].
    """

    times: Array
    positions: Array
    moving: tuple[str, ...]
    skipped: float


def read_motion(path: Path, joint_names: Sequence[str]) -> JointMotion:
    """Read where the joints were.

    Args:
        path: The recording.
        joint_names: Names of the joints.

    Raises:
        RecordingError: It cannot be read, is no recording, or the position of a joint was never
            known.
    """
    columns = [f"{name}_position" for name in joint_names]
    tables = []
    for table in sample_tables(path, FileScan()):
        if missing := [name for name in columns if name not in table]:
            raise RecordingError(f"{path} has no {missing[0]}: it is of another arm")
        tables.append(np.column_stack([table[name] for name in (TIME, *columns)]))
    samples = np.concatenate(tables) if tables else np.empty((0, 1 + len(columns)))
    known = samples[~np.isnan(samples).any(axis=1)]
    if not len(known):
        raise RecordingError(
            f"{path} ends before the position of every joint was known: there is no motion to show"
        )
    known = known[:: -(-len(known) // ROWS_MAX)]
    times = known[:, 0]
    moving = _moving(path, times.tolist())
    return JointMotion(times - times[0], known[:, 1:], moving, float(times[0] - samples[0, 0]))


def _moving(path: Path, times: Sequence[float]) -> tuple[str, ...]:
    since, texts = [0.0], [""]
    for message in messages(path, FileScan(), {Topic.STATUS}):
        since.append(message.log_time * 1e-9)
        texts.append(", ".join(message_of(message.data, ArmStatus).moving))
    return tuple([texts[bisect_right(since, moment) - 1] for moment in times])
