"""Completion of a recording whose recorder was killed, or whose disk was full."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from mcap.writer import Writer

from bioscara.errors import RecordingError
from bioscara.files.whole_files import replacing
from bioscara.recording.reading.scan import FileScan, StoredMessage, messages
from bioscara.rosbag.recording_file import CHUNK


class Recovery(NamedTuple):
    """Result of a recovery.

    Attributes:
        scan: The content of the file except its messages.
        messages: Number of its messages.
        lost: Size of its incomplete end [byte].
        written: The complete file; None if the given one is complete.
    """

    scan: FileScan
    messages: int
    lost: int
    written: Path | None


def recover(path: Path, out: Path | None = None) -> Recovery:
    """Write all complete chunks of a recording into a file with an index.

    Args:
        path: The recording.
        out: The file to write; None to replace ``path``, unless it is complete.

    Raises:
        RecordingError: It is no recording, it is being written, it cannot be read or written, or
            it is damaged other than at its end and no ``out`` is given.
    """
    with _unused(path):
        size = path.stat().st_size
        scan = FileScan()
        if out is None:
            count = sum(1 for _ in messages(path, scan))
            if scan.complete and not scan.damage:
                return Recovery(scan, count, 0, None)
            if scan.damage:
                raise RecordingError(
                    f"{path} is damaged: {scan.damage[0]}; give --out FILE for what can be read, "
                    "as this file is kept"
                )
        goal, scan = out or path, FileScan()
        try:
            with replacing(goal) as partial, partial.open("wb") as file:
                writer = _Copy(Writer(file, chunk_size=CHUNK), scan)
                for message in messages(path, scan):
                    writer.add(message)
                writer.finish()
        except OSError as error:
            raise RecordingError(
                f"{goal} cannot be written: {error.strerror or error}; {path} is unchanged"
            ) from error
        return Recovery(scan, writer.count, size - scan.size, goal)


class _Copy:
    """Writes the messages that a scan finds."""

    def __init__(self, writer: Writer, scan: FileScan) -> None:
        self._writer, self._scan = writer, scan
        self._schemas = {0: 0}
        self._channels: dict[int, int] = {}
        self._started = False
        self.count = 0

    def add(self, message: StoredMessage) -> None:
        self._start()
        number = self._channels.get(message.channel.id)
        if number is None:
            self._register()
            number = self._channels[message.channel.id]
        self._writer.add_message(
            number, message.log_time, message.data, message.publish_time, message.sequence
        )
        self.count += 1

    def finish(self) -> None:
        self._start()
        self._register()
        for attachment in self._scan.attachments:
            self._writer.add_attachment(
                attachment.create_time,
                attachment.log_time,
                attachment.name,
                attachment.media_type,
                attachment.data,
            )
        for name, values in self._scan.metadata.items():
            self._writer.add_metadata(name, values)
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _start(self) -> None:
        if not self._started:
            self._started = True
            self._writer.start(profile=self._scan.profile)

    def _register(self) -> None:
        for number, schema in self._scan.schemas.items():
            if number not in self._schemas:
                self._schemas[number] = self._writer.register_schema(
                    schema.name, schema.encoding, schema.data
                )
        for number, channel in self._scan.channels.items():
            if number not in self._channels and channel.schema_id in self._schemas:
                self._channels[number] = self._writer.register_channel(
                    channel.topic,
                    channel.message_encoding,
                    self._schemas[channel.schema_id],
                    channel.metadata,
                )


@contextmanager
def _unused(path: Path) -> Iterator[None]:
    """Refuse a file that a recorder writes."""
    try:
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from error
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        raise RecordingError(
            f"{path} is being written; end that recording first, or wait for its next file"
        ) from None
    finally:
        os.close(file)
