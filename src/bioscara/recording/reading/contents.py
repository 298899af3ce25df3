"""The contents of a recording, in words."""

from __future__ import annotations

import time
from collections import Counter
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, Metadata, MetadataIndex, Statistics
from mcap.writer import MCAP0_MAGIC

from bioscara.errors import RecordingError
from bioscara.recording.content import METADATA
from bioscara.recording.reading.index import RECORD, index_records
from bioscara.recording.reading.scan import UNREADABLE, StoredMessage, read_all
from bioscara.robot.connection.evidence_folder import METADATA as FLIGHT_RECORD
from bioscara.rosbag.recording_file import is_being_written

_SECOND = 1e9


class Contents:
    """The messages of a recording, counted: by the index of a finished one, else by reading it all.

    Attributes:
        counts: Number of messages, by topic.
        begin: Time of the first message [ns]; 0 if there is none.
        end: Time of the last one [ns].
        metadata: Metadata by name.
        attachments: Name and size of each attachment [byte], in their order.
        complete: Whether the file was finished; its messages are not checked then.
        damage: The unusable parts that were found.

    Raises:
        RecordingError: It cannot be read, or is no recording.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.counts: Counter[str] = Counter()
        self.begin = self.end = 0
        # Asked for before it is read: it may be finished while it is read.
        self._written = _written(path)
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: list[tuple[str, int]] = []
        self.complete, self.damage = self._read_index(), list[str]()
        self._size = path.stat().st_size
        if not self.complete:
            self._read_all()

    def _read_all(self) -> None:
        scan = read_all(self._path, self._count)
        self.metadata = scan.metadata
        self.attachments = [(each.name, len(each.data)) for each in scan.attachments]
        self.complete, self.damage, self._size = scan.complete, scan.damage, scan.size

    def _read_index(self) -> bool:
        """Return whether the file has an index with the numbers of its messages, and take these."""
        found: Statistics | None = None
        topics, attachments, metadata = dict[int, str](), list[tuple[str, int]](), list[Metadata]()
        try:
            with self._path.open("rb") as file:
                if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                    return False
                size = self._path.stat().st_size
                for _, opcode, content in list(index_records(file, size)):
                    stream = ReadDataStream(BytesIO(content))
                    match opcode:
                        case Opcode.STATISTICS:
                            found = Statistics.read(stream)
                        case Opcode.CHANNEL:
                            channel = Channel.read(stream)
                            topics[channel.id] = channel.topic
                        case Opcode.ATTACHMENT_INDEX:
                            index = AttachmentIndex.read(stream)
                            attachments.append((index.name, index.data_size))
                        case Opcode.METADATA_INDEX:
                            file.seek(MetadataIndex.read(stream).offset + RECORD.size)
                            metadata.append(Metadata.read(ReadDataStream(file)))
            if found is None:
                return False
            counts = {topics[key]: count for key, count in found.channel_message_counts.items()}
        except OSError as error:
            raise RecordingError(
                f"{self._path} cannot be read: {error.strerror or error}"
            ) from error
        except (*UNREADABLE, KeyError):
            return False
        self.counts.update(counts)
        self.begin, self.end = found.message_start_time, found.message_end_time
        self.attachments = attachments
        self.metadata = {each.name: each.metadata for each in metadata}
        return True

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
        size = self._path.stat().st_size
        known = self.metadata.get(METADATA, {})
        lines = [f"{self._path}: {size / 1e6:.1f} MB, {self.duration:.1f} s"]
        if known:
            lines.append(
                f"arm {known.get('owner')}, {known.get('arm')}; file {known.get('number')} of run "
                f"{known.get('instance', '')[:8]}, software {known.get('software')}"
            )
        if (flight := self.metadata.get(FLIGHT_RECORD)) is not None:
            software = flight.get("software")
            lines.append(f"flight record of the time before a fault, software {software}")
            lines += [f"{name}: {text}" for name, text in flight.items() if name != "software"]
        if self.begin:
            lines.append(f"from {_moment(self.begin)} to {_moment(self.end)}")
        lines.append(self._state(size - self._size))
        lines += [f"damaged: {what}" for what in self.damage]
        span = max(self.duration, 1e-9)
        lines += [
            f"{topic}: {count} messages, {count / span:.1f} Hz"
            for topic, count in sorted(self.counts.items())
        ]
        lines += [f"attachment {name}: {length} bytes" for name, length in self.attachments]
        return lines

    def _state(self, lost: int) -> str:
        if self.complete:
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
