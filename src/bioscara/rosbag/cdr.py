"""Messages of ROS 2 as CDR, little endian, as its middleware encodes them."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence

from bioscara.errors import RecordingError

_HEADER = b"\x00\x01\x00\x00"
"""Encapsulation: plain CDR, little endian."""
_UINT32, _STAMP = struct.Struct("<I"), struct.Struct("<iI")
_SECOND = 1_000_000_000


class CdrMessage:
    """A message that grows field by field; each is aligned to its size.

    Attributes:
        data: The bytes so far, with the encapsulation header.
    """

    __slots__ = ("data",)

    def __init__(self) -> None:
        self.data = bytearray(_HEADER)

    def align(self, size: int) -> int:
        """Pad to a multiple of ``size``; return the offset of the field that follows."""
        self.data += bytes(-(len(self.data) - len(_HEADER)) % size)
        return len(self.data)

    def byte(self, value: int) -> None:
        """Add a uint8."""
        self.data.append(value)

    def uint32(self, value: int) -> int:
        """Add a uint32; return its offset."""
        offset = self.align(4)
        self.data += _UINT32.pack(value)
        return offset

    def stamp(self, nanoseconds: int) -> int:
        """Add a time, or a duration, in s and ns; return its offset."""
        offset = self.align(4)
        self.data += _STAMP.pack(*divmod(nanoseconds, _SECOND))
        return offset

    def string(self, text: str) -> None:
        """Add a string."""
        encoded = text.encode()
        self.uint32(len(encoded) + 1)
        self.data += encoded + b"\x00"

    def strings(self, texts: Sequence[str]) -> None:
        """Add a sequence of strings."""
        self.uint32(len(texts))
        for text in texts:
            self.string(text)

    def doubles(self, values: Iterable[float]) -> int:
        """Add float64 fields, without a length; return the offset of the first."""
        given = tuple(values)
        offset = self.align(8)
        self.data += struct.pack(f"<{len(given)}d", *given)
        return offset

    def floats(self, values: Iterable[float]) -> None:
        """Add float32 fields, without a length."""
        given = tuple(values)
        self.align(4)
        self.data += struct.pack(f"<{len(given)}f", *given)

    def double_sequence(self, values: Sequence[float]) -> int:
        """Add a sequence of float64; return the offset of the first."""
        self.uint32(len(values))
        return self.doubles(values) if values else len(self.data)

    def header(self, frame: str) -> int:
        """Add a std_msgs/Header with the time 0; return the offset of its time."""
        offset = self.stamp(0)
        self.string(frame)
        return offset


def put_stamp(data: bytearray, offset: int, nanoseconds: int) -> None:
    """Replace a time in s and ns."""
    _STAMP.pack_into(data, offset, *divmod(nanoseconds, _SECOND))


class CdrReader:
    """Reads a message field by field.

    Attributes:
        offset: Where the next field begins, before it is aligned.

    Raises:
        RecordingError: A field is longer than the message, here and in the methods.
    """

    __slots__ = ("_data", "offset")

    def __init__(self, data: bytes) -> None:
        if data[:2] != _HEADER[:2]:
            raise RecordingError("a message is not encoded as CDR, little endian")
        self._data, self.offset = data, len(_HEADER)

    def align(self, size: int, length: int) -> int:
        """Skip to a multiple of ``size``, and ``length`` bytes from there; return their offset."""
        begin = self.offset + (-(self.offset - len(_HEADER)) % size)
        self.offset = begin + length
        if self.offset > len(self._data):
            raise RecordingError("a message is shorter than its fields")
        return begin

    def uint32(self) -> int:
        """Return a uint32."""
        value: int = _UINT32.unpack_from(self._data, self.align(4, 4))[0]
        return value

    def stamp(self) -> int:
        """Return a time or duration [ns]."""
        seconds, nanoseconds = _STAMP.unpack_from(self._data, self.align(4, 8))
        return int(seconds) * _SECOND + int(nanoseconds)

    def string(self) -> str:
        """Return a string."""
        length = self.uint32()
        begin = self.align(1, length)
        return self._data[begin : begin + max(length - 1, 0)].decode(errors="replace")

    def strings(self) -> tuple[str, ...]:
        """Return a sequence of strings."""
        return tuple([self.string() for _ in range(self.uint32())])

    def doubles(self) -> tuple[int, int]:
        """Skip a sequence of float64; return the offset of the first, and their number."""
        count = self.uint32()
        return (self.align(8, 8 * count) if count else self.offset), count

    def double_values(self) -> tuple[float, ...]:
        """Return a sequence of float64."""
        begin, count = self.doubles()
        return struct.unpack_from(f"<{count}d", self._data, begin)
