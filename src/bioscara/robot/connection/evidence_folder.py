"""The folder with the flight records of faults, as files that the commands for recordings read."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import msgspec
import numpy as np

from bioscara.control.faults.flight_recorder import Evidence, Timing
from bioscara.control.faults.kinds import ArmFault
from bioscara.printing import printable
from bioscara.rosbag.joint_states import (
    ARM,
    dynamic_joint_states,
    joint_states,
    rounded_rows,
    rounded_time_rows,
)
from bioscara.rosbag.recording_file import RecordingFile
from bioscara.rosbag.texts import LogLevel, log_message, text_message
from bioscara.rosbag.topics import Topic
from bioscara.version import __version__

METADATA = "bioscara_flight_record"
"""Name of the metadata of a flight record."""
SUFFIX = ".mcap"
_TOPICS = (
    Topic.JOINT_STATES,
    Topic.JOINT_COMMANDS,
    Topic.DYNAMIC_JOINT_STATES,
    Topic.EVENTS,
    Topic.LOG,
)
_JOINT_INTERFACES = ("position", "velocity", "flags", "stamp")
_JOINT_FIELDS = 6
"""Numbers of each joint in a row of the record."""
_CHUNK = 1 << 20
"""Size of a chunk [byte]: with one for the whole record it is written in half the time."""
_SECOND = 1e9


class EvidenceFolder:
    """Writes flight records into a folder.

    Args:
        path: The folder; made with the first file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    def write(self, evidence: Evidence, name: str, faults: Sequence[ArmFault]) -> Path:
        """Write a flight record; the file is whole or does not exist, and no other is replaced.

        Args:
            evidence: The record.
            name: Name of the file, without extension; a number is added where it is taken.
            faults: The faults until its end, first cause first.

        Returns:
            The file.

        Raises:
            OSError: It cannot be written.
        """
        self._path.mkdir(parents=True, exist_ok=True)
        path, file = self._reserve(name)
        try:
            _fill(file, evidence, faults)
            file.finish()
            file.path.replace(path)
        except BaseException:
            file.abandon()
            file.path.unlink(missing_ok=True)
            raise
        return path

    def _reserve(self, name: str) -> tuple[Path, RecordingFile]:
        """Return a path that does not exist, and an exclusive partial file to become it.

        Programs of two arms, stopped by one button, request the same name.
        """
        number = 1
        while True:
            path = self._path / f"{name}{'' if number == 1 else f'-{number}'}{SUFFIX}"
            number += 1
            if path.exists():
                continue
            with suppress(FileExistsError):
                file = RecordingFile(path.with_name(path.name + ".part"), _TOPICS, _CHUNK)
                if not path.exists():
                    return path, file
                file.abandon()
                file.path.unlink()


def _fill(file: RecordingFile, evidence: Evidence, faults: Sequence[ArmFault]) -> None:
    rows = evidence.rows
    # The times of the arm's clock stay together: only the newest one is compared with the wall.
    ahead = evidence.written - round(rows[-1][0] * _SECOND) if rows else 0
    begin = round(rows[0][0] * _SECOND) + ahead if rows else 0
    texts = [printable(" ".join(str(fault).split())) for fault in faults]
    file.describe(
        METADATA,
        {
            "software": __version__,
            **{f"fault {number}": text for number, text in enumerate(texts, 1)},
        },
    )
    for number, (fault, text) in enumerate(zip(faults, texts, strict=True), 1):
        stamp = round(fault.time * _SECOND) + ahead
        # Within the record, so that a player shows no empty time.
        shown = min(max(stamp, begin), evidence.written)
        # As the owner of a served arm words its events.
        event = {
            "kind": "event",
            "number": number,
            "time": fault.time,
            "wall": stamp / _SECOND,
            "what": "fault",
            "text": text,
        }
        data = text_message(msgspec.json.encode(event).decode())
        file.add(Topic.EVENTS, data, shown, stamp)
        source = printable(fault.source)
        entry = log_message(
            stamp, LogLevel.ERROR, source, text, file="fault", function="", line=number
        )
        file.add(Topic.LOG, entry, shown, stamp)
    _add_cycles(file, evidence, ahead)


def _add_cycles(file: RecordingFile, evidence: Evidence, ahead: int) -> None:
    names, count, first = evidence.names, len(evidence.names), 1 + len(Timing._fields)
    rows = np.array(evidence.rows, np.float64).reshape(-1, first + _JOINT_FIELDS * count)
    arm, joints = rows[:, :first], rows[:, first:].reshape(-1, count, _JOINT_FIELDS)
    stamps = [round(time * _SECOND) + ahead for time in rows[:, 0].tolist()]
    goals, speeds, positions, velocities = np.moveaxis(rounded_rows(joints[..., :4]), 2, 0)
    measured, flags = rounded_time_rows(joints[..., 4]), joints[..., 5]
    interfaces = np.stack((positions, velocities, flags, measured), axis=2)
    dynamic = dynamic_joint_states(
        {**dict.fromkeys(names, _JOINT_INTERFACES), ARM: ("time", *Timing._fields)}
    )
    values = [*np.moveaxis(interfaces, 1, 0), rounded_time_rows(arm)]
    pairs = joint_states(names, velocities=True)
    topics = {
        Topic.JOINT_STATES: pairs.filled_rows(stamps, (positions, velocities)),
        # Before the commands: it begins a row where samples are read as a table.
        Topic.DYNAMIC_JOINT_STATES: dynamic.filled_rows(stamps, values),
        Topic.JOINT_COMMANDS: pairs.filled_rows(stamps, (goals, speeds)),
    }
    for stamp, *messages in zip(stamps, *topics.values(), strict=True):
        for topic, data in zip(topics, messages, strict=True):
            file.add(topic, data, stamp)
