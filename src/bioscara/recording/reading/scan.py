"""Reading of a recording from its begin to its end, also of one that was never finished.

A record counts if all of it is there, and a chunk if its checksum fits as well. After a damaged
record reading goes on at the next one that the index at the end of the file names. That is missing
where the recorder was killed: then it goes on at the next bytes that begin as a chunk does.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, Metadata, Schema
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC
from zstandard import ZstdError

from bioscara.errors import RecordingError
from bioscara.recording.reading.index import RECORD, index_records

_MESSAGE = struct.Struct("<HIQQ")
_CHUNK_MAX = 256 << 20
"""Largest chunk, uncompressed, that is read [byte]: others write chunks of some MB."""
_KNOWN = frozenset(Opcode)
_PLACE = struct.Struct("<QQ")
_INDEXES: dict[int, int] = {
    Opcode.CHUNK_INDEX: 16,
    Opcode.ATTACHMENT_INDEX: 0,
    Opcode.METADATA_INDEX: 0,
}
"""Where a record of the index has the place and the length of the record that it names."""
_CHUNK = re.compile(rb"\x06.{36}(?:\x04\0\0\0zstd|\x03\0\0\0lz4)", re.DOTALL)
"""Begin of a chunk: length, times, size and checksum, then the name of its compression."""
_CHUNK_HEAD = 64
_BLOCK = 1 << 20
UNREADABLE = (
    McapError,
    CRCValidationError,
    ZstdError,
    struct.error,
    UnicodeError,
    ValueError,
    OverflowError,
    MemoryError,
)
"""Exceptions of the library for bytes that are no record."""


class StoredMessage(NamedTuple):
    """A message as it is in the file.

    Attributes:
        channel: Its channel.
        log_time: Time at which it is shown [ns].
        publish_time: Time that it is about [ns].
        sequence: Its number; 0 if it has none.
        data: The message.
    """

    channel: Channel
    log_time: int
    publish_time: int
    sequence: int
    data: bytes


@dataclass(slots=True)
class FileScan:
    """The content of a file as far as it was read, except its messages.

    Attributes:
        profile: Its profile; ``"ros2"`` for our recordings.
        schemas: Schemas by number.
        channels: Channels by number.
        metadata: Metadata by name.
        attachments: In their order.
        complete: Whether the file was finished.
        size: Size up to the end of the last complete record [byte].
        damage: The unusable parts, other than a missing end.
    """

    profile: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: list[Attachment] = field(default_factory=list)
    complete: bool = False
    size: int = 0
    damage: list[str] = field(default_factory=list)


def messages(
    path: Path, scan: FileScan, topics: Collection[str] | None = None
) -> Iterator[StoredMessage]:
    """Yield the messages of a file, in their order, and fill ``scan`` with all else.

    Args:
        path: The file.
        scan: Takes the rest of the content; a new one.
        topics: Topics whose messages are wanted; None for all.

    Raises:
        RecordingError: It cannot be read, or is no MCAP file.
    """
    try:
        with path.open("rb") as file:
            if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
                raise RecordingError(f"{path} is no recording: it does not begin as MCAP files do")
            scan.size = len(MCAP0_MAGIC)
            yield from _Reader(file, path.stat().st_size, scan, topics).messages()
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error


class _Reader:
    def __init__(
        self, file: BinaryIO, size: int, scan: FileScan, topics: Collection[str] | None
    ) -> None:
        self._file, self._size, self._scan, self._topics = file, size, scan, topics
        self._index: dict[int, int] | None = None
        """Begin and end of the records that the index names; None while it was not needed."""

    def messages(self) -> Iterator[StoredMessage]:
        scan = self._scan
        for at, opcode, payload in self._records():
            try:
                if opcode == Opcode.CHUNK:
                    yield from self._chunk(payload)
                elif opcode == Opcode.MESSAGE:
                    yield from self._message(payload, 0, len(payload))
                elif opcode == Opcode.FOOTER:
                    scan.complete = self._file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
                    return
                else:
                    self._take(opcode, payload)
            except UNREADABLE as error:
                name = Opcode(opcode).name.lower()
                scan.damage.append(f"a {name} before byte {scan.size} cannot be read: {error}")
                named = self._named().get(at, scan.size)
                if named != scan.size or not self._begins_record(scan.size):
                    self._resume(at, scan.size)

    def _records(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield begin, opcode and content of each complete record of the file."""
        scan = self._scan
        while True:
            at = scan.size
            self._file.seek(at)
            head = self._file.read(RECORD.size)
            if len(head) < RECORD.size:
                return
            opcode, length = RECORD.unpack(head)
            if self._index is not None and at in self._index:
                length = self._index[at] - at - RECORD.size
            end = at + RECORD.size + length
            # The file may grow during the scan. No more than its size is read: a damaged length
            # would be allocated at once.
            payload = self._file.read(length) if length <= self._size else b""
            if len(payload) < length or (opcode not in _KNOWN and not self._begins_record(end)):
                # An incomplete last record, a damaged length, or no record at all.
                if self._resume(at, end):
                    scan.damage.append(f"the record at byte {at} has no usable length")
                    continue
                if opcode not in _KNOWN:
                    scan.damage.append(f"there are no records from byte {at} on")
                return
            scan.size = end
            if opcode in _KNOWN:
                yield at, opcode, payload

    def _begins_record(self, at: int) -> bool:
        """Return whether a record that fits into the file may begin at a byte, or it ends there."""
        self._file.seek(at)
        head = self._file.read(RECORD.size)
        if len(head) < RECORD.size:
            return not head
        opcode, length = RECORD.unpack(head)
        return opcode in _KNOWN and at + RECORD.size + length <= self._size

    def _resume(self, at: int, end: int) -> bool:
        """Go on after the damaged record between two bytes; return False if there is no record.

        The record is read once more if the index has another end of it.
        """
        index = self._named()
        following = next((each for each in sorted(index) if each > at), None)
        if index.get(at, end) != end:
            following = at
        elif not index:
            following = self._next_chunk(at + 1)
        if following is None:
            return False
        self._scan.size = following
        return True

    def _named(self) -> dict[int, int]:
        """Return begin and end of the records that the index names, and of its first one."""
        if self._index is None:
            self._index, scan = {}, self._scan
            for at, opcode, content in index_records(self._file, self._size):
                if not self._index:
                    self._index[at] = at + RECORD.size + len(content)
                try:
                    if opcode in _INDEXES:
                        begin, length = _PLACE.unpack_from(content, _INDEXES[opcode])
                        if RECORD.size <= length <= self._size - begin:
                            self._index[begin] = begin + length
                    elif opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
                        # They are in the first chunk, too, which may be the damaged one.
                        self._take(opcode, content)
                except UNREADABLE as error:
                    scan.damage.append(f"the index cannot be read: {error}")
        return self._index

    def _next_chunk(self, begin: int) -> int | None:
        """Return the first byte that may begin a chunk; None if there is none."""
        self._file.seek(begin)
        rest = b""
        while block := self._file.read(_BLOCK):
            rest += block
            if (found := _CHUNK.search(rest)) is not None:
                return begin + found.start()
            kept = rest[-_CHUNK_HEAD:]
            begin += len(rest) - len(kept)
            rest = kept
        return None

    def _chunk(self, payload: bytes) -> Iterator[StoredMessage]:
        content = BytesIO(payload)
        chunk = Chunk.read(ReadDataStream(content))
        if content.tell() != len(payload):
            raise ValueError("it is longer than its content")
        if chunk.uncompressed_size > _CHUNK_MAX:
            raise ValueError(f"it would have {chunk.uncompressed_size} bytes")
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
        data = stream.read(length)
        offset = 0
        while offset < length:
            opcode, size = RECORD.unpack_from(data, offset)
            offset += RECORD.size
            if size > length - offset:
                raise ValueError("a record in it is longer than the chunk")
            if opcode == Opcode.MESSAGE:
                yield from self._message(data, offset, size)
            else:
                self._take(opcode, data[offset : offset + size])
            offset += size

    def _message(self, data: bytes, offset: int, size: int) -> Iterator[StoredMessage]:
        number, sequence, log_time, publish_time = _MESSAGE.unpack_from(data, offset)
        channel = self._scan.channels.get(number)
        if channel is None:
            raise ValueError(f"nothing describes channel {number}")
        if self._topics is None or channel.topic in self._topics:
            body = data[offset + _MESSAGE.size : offset + size]
            yield StoredMessage(channel, log_time, publish_time, sequence, body)

    def _take(self, opcode: int, payload: bytes) -> None:
        scan, stream = self._scan, ReadDataStream(BytesIO(payload))
        match opcode:
            case Opcode.HEADER:
                scan.profile = Header.read(stream).profile
            case Opcode.SCHEMA:
                schema = Schema.read(stream)
                scan.schemas[schema.id] = schema
            case Opcode.CHANNEL:
                channel = Channel.read(stream)
                scan.channels[channel.id] = channel
            case Opcode.METADATA:
                metadata = Metadata.read(stream)
                scan.metadata[metadata.name] = metadata.metadata
            case Opcode.ATTACHMENT:
                attachment = Attachment.read(stream)
                if attachment not in scan.attachments:
                    scan.attachments.append(attachment)


def read_all(path: Path, take: Callable[[StoredMessage], object]) -> FileScan:
    """Give each message of a file to a function; return all else.

    Args:
        path: The file.
        take: Receives the messages, in their order.

    Raises:
        RecordingError: It cannot be read, or is no MCAP file.
    """
    scan = FileScan()
    for message in messages(path, scan):
        take(message)
    return scan
