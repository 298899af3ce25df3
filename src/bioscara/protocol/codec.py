"""Bytes <-> values, pure functions.

A version 1 frame is ``[register][payload]`` out and ``[payload][flags]`` back. A version 2
frame has a trailer of two bytes, sequence number and CRC-8, in each direction; the CRC covers
the address byte of that direction and all that follows it.

One :class:`Message` is one use of one register: ``READ[r]`` reads it, ``WRITE[r]`` writes it
(or exchanges, for a register of that direction).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import NamedTuple

from bioscara.errors import CorruptFrameError, InvalidArgumentError, LimitError
from bioscara.protocol.crc import crc8
from bioscara.protocol.enums import Flags, Register
from bioscara.protocol.registers import REGISTERS
from bioscara.protocol.rows import Definition, Direction, Field, Kind

TRAILER = 2
"""Bytes that version 2 adds in each direction: sequence number and CRC-8."""

_F32_MAX = (2 - 2**-23) * 2.0**127
_INTEGER_BOUNDS = {
    Kind.U8: (0, 0xFF),
    Kind.I8: (-0x80, 0x7F),
    Kind.U16: (0, 0xFFFF),
    Kind.I16: (-0x8000, 0x7FFF),
    Kind.U32: (0, 0xFFFFFFFF),
    Kind.I32: (-0x80000000, 0x7FFFFFFF),
}


class Answer(NamedTuple):
    """Decoded answer of a joint.

    Attributes:
        values: The payload's values in wire order, in the units of the table.
        flags: State of the joint, see :class:`~bioscara.protocol.enums.Flags`.
    """

    values: tuple[float, ...]
    flags: int


def field_bounds(field: Field) -> tuple[float, float]:
    """Return the lowest and highest value that ``field`` accepts, in its unit."""
    if field.kind is Kind.F32:
        low, high = -_F32_MAX, _F32_MAX
    else:
        low, high = (bound * field.scale for bound in _INTEGER_BOUNDS[field.kind])
    return (
        low if field.lower is None else field.lower,
        high if field.upper is None else field.upper,
    )


class Message:
    """One use of one register, with the sizes of its frames.

    Attributes:
        register: The code.
        definition: The table's row.
        request_size: Bytes of a version 1 request; version 2 adds :data:`TRAILER`.
        answer_size: Bytes of a version 1 answer, flags included; version 2 adds
            :data:`TRAILER`.
    """

    def __init__(
        self, definition: Definition, written: tuple[Field, ...], read: tuple[Field, ...]
    ) -> None:
        self.definition = definition
        self.register = definition.register
        self._fields = tuple(field for field in written if not field.padding)
        self._bounds = tuple(field_bounds(field) for field in self._fields)
        padding = len(written) - len(self._fields)
        codes = "".join(field.kind.value for field in self._fields)
        self._request = struct.Struct(f"<B{codes}{padding}x")
        self._answer = struct.Struct("<" + "".join(field.kind.value for field in read) + "B")
        self._integer = tuple(field.kind is not Kind.F32 for field in self._fields)
        self._scales = tuple(field.scale for field in self._fields)
        self._scaled_answer = tuple(
            (index, field.scale) for index, field in enumerate(read) if field.scale != 1.0
        )
        self.request_size = self._request.size
        self.answer_size = self._answer.size

    def __repr__(self) -> str:
        return f"<Message {self.register.name} {self.request_size} out, {self.answer_size} back>"

    def encode_v1(self, values: Sequence[float] = ()) -> bytes:
        """Return the version 1 request.

        Args:
            values: The payload's values in wire order, without padding, in the table's units.

        Raises:
            InvalidArgumentError: Wrong number of values, or one is not finite.
            LimitError: A value is outside the range of the field.
        """
        count = len(self._fields)
        if len(values) != count:
            names = ", ".join(field.name for field in self._fields) or "no values"
            raise InvalidArgumentError(
                f"{self.register.name} takes {names}; {len(values)} values were given"
            )
        wire: list[float] = []
        for index in range(count):
            value = values[index]
            lower, upper = self._bounds[index]
            if not lower <= value <= upper:
                self._refuse(index, value)
            if self._integer[index]:
                scale = self._scales[index]
                wire.append(round(value / scale) if scale != 1.0 else self._whole(index, value))
            else:
                wire.append(value)
        return self._request.pack(self.register, *wire)

    def encode_v2(self, address: int, sequence: int, values: Sequence[float] = ()) -> bytes:
        """Return the version 2 request to the 7-bit ``address`` with this sequence number.

        Raises:
            InvalidArgumentError: As :meth:`encode_v1`.
        """
        frame = self.encode_v1(values) + bytes((sequence,))
        return frame + bytes((crc8(frame, crc8((address << 1,))),))

    def decode_v1(self, answer: bytes) -> Answer:
        """Return a decoded version 1 answer.

        Raises:
            CorruptFrameError: The answer has the wrong size, a value that is not finite, or
                flag bits that version 1 never sets.
        """
        if len(answer) != self.answer_size:
            raise CorruptFrameError(
                f"{self.register.name}: {len(answer)} bytes answered, {self.answer_size} expected"
            )
        if answer[-1] & 0xF0:
            raise CorruptFrameError(
                f"{self.register.name}: answered flags {answer[-1]:#04x}, bits 4..7 must be zero"
            )
        return self._unpack(answer)

    def decode_v2(self, address: int, sequence: int, answer: bytes) -> Answer:
        """Return a decoded version 2 answer; REFUSED in its flags is left to the caller.

        A joint that refuses a frame answers ``[flags][sequence][crc]`` and then filler; such an
        answer decodes to no values.

        Raises:
            CorruptFrameError: Wrong size, sequence number or check byte, or a value that is
                not finite.
        """
        size = self.answer_size + TRAILER
        if len(answer) != size:
            raise CorruptFrameError(
                f"{self.register.name}: {len(answer)} bytes answered, {size} expected", address
            )
        start = crc8((address << 1 | 1,))
        if crc8(answer, start) == 0 and answer[-2] == sequence:
            return self._unpack(answer[:-TRAILER])
        if crc8(answer[:3], start) == 0 and answer[0] & Flags.REFUSED and answer[1] == sequence:
            return Answer((), answer[0])
        raise CorruptFrameError(
            f"{self.register.name}: answer {answer.hex(' ')} fails its check byte or does not "
            f"carry sequence number {sequence}",
            address,
        )

    def _unpack(self, answer: bytes) -> Answer:
        *values, flags = self._answer.unpack(answer)
        for index, scale in self._scaled_answer:
            values[index] *= scale
        # A NaN or an infinity makes the difference NaN, which no comparison accepts.
        for value in values:
            if not value - value == 0.0:
                raise CorruptFrameError(f"{self.register.name}: answered {value}")
        return Answer(tuple(values), flags)

    def _whole(self, index: int, value: float) -> int:
        whole = int(value)
        if whole != value:
            raise InvalidArgumentError(
                f"{self.register.name} {self._fields[index].name}: {value} is not a whole number"
            )
        return whole

    def _refuse(self, index: int, value: float) -> None:
        field = self._fields[index]
        name = f"{self.register.name} {field.name}"
        if not math.isfinite(value):
            raise InvalidArgumentError(f"{name}: {value} is not a finite number")
        raise LimitError(name, value, *self._bounds[index], field.unit)


READ: dict[Register, Message] = {
    row.register: Message(row, (), row.read)
    for row in REGISTERS
    if row.direction in (Direction.READ, Direction.READ_WRITE)
}
WRITE: dict[Register, Message] = {
    row.register: Message(row, row.written, row.read if row.direction is Direction.EXCHANGE else ())
    for row in REGISTERS
    if row.direction in (Direction.WRITE, Direction.READ_WRITE, Direction.EXCHANGE)
}
