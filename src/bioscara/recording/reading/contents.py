"""The contents of a recording, in words."""

from __future__ import annotations

import time
from collections import Counter
from pathlib import Path

from bioscara.errors import RecordingError
from bioscara.recording.content import METADATA
from bioscara.recording.reading.scan import FileScan, StoredMessage, read_all
from bioscara.robot.connection.evidence_folder import METADATA as FLIGHT_RECORD
from bioscara.rosbag.recording_file import is_being_written

_SECOND = 1e9


class Contents:
    """The messages of a recording, counted.

    Attributes:
        scan: The result of reading it.
        counts: Number of messages, by topic.
        begin: Time of the first message [ns]; 0 if there is none.
        end: Time of the last one [ns].

    Raises:
        RecordingError: It cannot be read, or is no recording.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.counts: Counter[str] = Counter()
        self.begin = self.end = 0
        # Asked for before it is read: it may be finished while it is read.
        self._written = _written(path)
        self.scan: FileScan = read_all(path, self._count)

    def _count(self, message: StoredMessage) -> None:
        self.counts[message.channel.topic] += 1
        self.begin = min(self.begin or message.log_time, message.log_time)
        self.end = max(self.end, message.log_time)

    @property
    def duration(self) -> float:
        """Time from the first to the last message [s]."""
        return (self.end - self.begin) / _SECOND

    def lines(self) -> list[str]:
        """Describe the recording, one item per line."""
        scan, size = self.scan, self._path.stat().st_size
        known = scan.metadata.get(METADATA, {})
        lines = [f"{self._path}: {size / 1e6:.1f} MB, {self.duration:.1f} s"]
        if known:
            lines.append(
                f"arm {known.get('owner')}, {known.get('arm')}; file {known.get('number')} of run "
                f"{known.get('instance', '')[:8]}, software {known.get('software')}"
            )
        if (flight := scan.metadata.get(FLIGHT_RECORD)) is not None:
            software = flight.get("software")
            lines.append(f"flight record of the time before a fault, software {software}")
            lines += [f"{name}: {text}" for name, text in flight.items() if name != "software"]
        if self.begin:
            lines.append(f"from {_moment(self.begin)} to {_moment(self.end)}")
        lines.append(self._state(size - scan.size))
        lines += [f"damaged: {what}" for what in scan.damage]
        span = max(self.duration, 1e-9)
        lines += [
            f"{topic}: {count} messages, {count / span:.1f} Hz"
            for topic, count in sorted(self.counts.items())
        ]
        lines += [f"attachment {each.name}: {len(each.data)} bytes" for each in scan.attachments]
        return lines

    def _state(self, lost: int) -> str:
        if self.scan.complete:
            return "complete"
        if self._written:
            return "being written: the rest follows"
        end = f", and {lost} bytes of an incomplete record follow" if lost else ""
        return f"never finished{end}: 'bioscara record recover {self._path}' completes it"


def _moment(nanoseconds: int) -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(nanoseconds // 10**9))


def _written(path: Path) -> bool:
    try:
        return is_being_written(path)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error
