"""The index at the end of a finished recording."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from io import BytesIO
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Footer
from mcap.writer import MCAP0_MAGIC

RECORD = struct.Struct("<BQ")
"""Begin of each record: its opcode, and the length of its content [byte]."""
_END = RECORD.size + 20 + len(MCAP0_MAGIC)
"""Size of the last record of a finished file, with the bytes after it [byte]."""
_INDEX_MAX = 32 << 20
"""Largest index that is read [byte]."""


def index_records(file: BinaryIO, size: int) -> Iterator[tuple[int, int, bytes]]:
    """Yield begin, opcode and content of each record of the index; none if the file has no index.

    Args:
        file: The file; its position changes.
        size: Its size [byte].
    """
    if size < _END:
        return
    file.seek(size - _END)
    last = file.read(_END)
    opcode, length = RECORD.unpack_from(last)
    if opcode != Opcode.FOOTER or length != 20 or not last.endswith(MCAP0_MAGIC):
        return
    begin = Footer.read(ReadDataStream(BytesIO(last[RECORD.size :]))).summary_start
    if not 0 < begin <= size - _END or size - begin > _INDEX_MAX:
        return
    file.seek(begin)
    index = file.read(size - _END - begin)
    offset = 0
    while offset + RECORD.size <= len(index):
        opcode, length = RECORD.unpack_from(index, offset)
        offset += RECORD.size
        if length > len(index) - offset:
            return
        yield begin + offset - RECORD.size, opcode, index[offset : offset + length]
        offset += length
