"""Begin and end of a recording from the index at its end, without reading its messages."""

from __future__ import annotations

import os
import struct
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Footer, Statistics
from mcap.writer import MCAP0_MAGIC

from bioscara.errors import RecordingError

_RECORD = struct.Struct("<BQ")
_END = _RECORD.size + 20 + len(MCAP0_MAGIC)
"""Size of the last record of a finished file, with the bytes after it [byte]."""
_INDEX_MAX = 32 << 20
"""Largest index that is read [byte]."""
_SECOND = 1e-9


class Extent(NamedTuple):
    """Size and times of a recording.

    Attributes:
        size: [byte].
        begin: Time of its first message, in seconds since 1970; None if it is not known.
        end: That of its last one.
        complete: Whether it was finished.
    """

    size: int
    begin: float | None
    end: float | None
    complete: bool


def extent_of(path: Path) -> Extent:
    """Return the extent of a recording.

    The times are unknown where it was not finished: it has no index then, or is still written.

    Args:
        path: The recording.

    Raises:
        RecordingError: It cannot be read.
    """
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            found = _statistics(file, size)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error
    if found is None:
        return Extent(size, None, None, complete=False)
    if not found.message_count:
        return Extent(size, None, None, complete=True)
    begin, end = found.message_start_time * _SECOND, found.message_end_time * _SECOND
    return Extent(size, begin, end, complete=True)


def _statistics(file: BinaryIO, size: int) -> Statistics | None:
    """Return the statistics of a finished file; None for another one."""
    if size < _END:
        return None
    file.seek(size - _END)
    last = file.read(_END)
    opcode, length = _RECORD.unpack_from(last)
    if opcode != Opcode.FOOTER or length != 20 or not last.endswith(MCAP0_MAGIC):
        return None
    begin = Footer.read(ReadDataStream(BytesIO(last[_RECORD.size :]))).summary_start
    if not 0 < begin <= size - _END or size - begin > _INDEX_MAX:
        return None
    file.seek(begin)
    index = file.read(size - _END - begin)
    offset = 0
    while offset + _RECORD.size <= len(index):
        opcode, length = _RECORD.unpack_from(index, offset)
        offset += _RECORD.size
        if opcode == Opcode.STATISTICS:
            content = BytesIO(index[offset : offset + length])
            try:
                found: Statistics = Statistics.read(ReadDataStream(content))
                return found
            except (McapError, struct.error, ValueError):
                return None
        offset += length
    return None
