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
from mcap.records import Statistics

from bioscara.errors import RecordingError
from bioscara.recording.reading.index import index_records

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
    for _, opcode, content in index_records(file, size):
        if opcode == Opcode.STATISTICS:
            try:
                found: Statistics = Statistics.read(ReadDataStream(BytesIO(content)))
                return found
            except (McapError, struct.error, ValueError):
                return None
    return None
