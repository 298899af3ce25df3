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
from bioscara.protocol.crc import crc8, crc8_of_8, crc8_of_10
from bioscara.protocol.enums import Flags, Register
from bioscara.protocol.registers import REGISTERS, VELOCITY_STEP_RPM
from bioscara.protocol.rows import Access, Definition, Field, Kind

TRAILER = 2
"""Bytes that version 2 adds in each direction: sequence number and CRC-8."""

_BYTE = tuple(bytes((value,)) for value in range(256))
_SEED = tuple(crc8((byte,)) for byte in range(256))
"""Check byte of each address byte, with which the check byte of a frame begins."""
_REFUSED = int(Flags.REFUSED)
_new = tuple.__new__

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
        answer_size: Bytes of a version 1 answer, flags included.
        sealed_answer_size: Bytes of a version 2 answer.
    """

    def __init__(
        self, definition: Definition, written: tuple[Field, ...], read: tuple[Field, ...]
    ) -> None:
        self.definition = definition
        self.register = definition.register
        self._code = int(definition.register)
        self._fields = tuple(field for field in written if not field.padding)
        # Bounds and value of one step of each field; a float has no steps.
        self._encodings = tuple(
            (*field_bounds(field), 0.0 if field.kind is Kind.F32 else field.scale)
            for field in self._fields
        )
        self._padding = len(written) - len(self._fields)
        request = f"<B{''.join(field.kind.value for field in self._fields)}{self._padding}x"
        answer = f"<{''.join(field.kind.value for field in read)}B"
        self._request, self._sealed_request = struct.Struct(request), struct.Struct(request + "B")
        self._answer, self._sealed_answer = struct.Struct(answer), struct.Struct(answer + "BB")
        self._floats = tuple(i for i, field in enumerate(read) if field.kind is Kind.F32)
        self._scaled = tuple((i, field.scale) for i, field in enumerate(read) if field.scale != 1.0)
        self.request_size = self._request.size
        self.answer_size = self._answer.size
        self.sealed_answer_size = self._sealed_answer.size

    def __repr__(self) -> str:
        return f"<Message {self.register.name} {self.request_size} out, {self.answer_size} back>"

    def encode_v1(self, values: Sequence[float] = ()) -> bytes:
        """Return the version 1 request.

        Args:
            values: The payload's values in wire order, in the table's units; padding is left out,
                or given as zeros.

        Raises:
            InvalidArgumentError: Wrong number of values, or one is not finite.
            LimitError: A value is outside the range of the field.
        """
        return self._request.pack(self._code, *self._wire(values))

    def encode_v2(self, address: int, sequence: int, values: Sequence[float] = ()) -> bytes:
        """Return the version 2 request to the 7-bit ``address`` with this sequence number.

        Raises:
            InvalidArgumentError: As :meth:`encode_v1`.
        """
        frame = self._sealed_request.pack(self._code, *self._wire(values), sequence)
        return frame + _BYTE[crc8(frame, _SEED[address << 1])]

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
        return self._values(self._answer.unpack(answer))

    def decode_v2(self, address: int, sequence: int, answer: bytes) -> Answer:
        """Return a decoded version 2 answer; REFUSED in its flags is left to the caller.

        A joint that refuses a frame answers ``[flags][sequence][crc]`` and then filler; such an
        answer decodes to no values.

        Raises:
            CorruptFrameError: Wrong size, sequence number or check byte, or a value that is
                not finite.
        """
        if len(answer) != self.sealed_answer_size:
            raise CorruptFrameError(
                f"{self.register.name}: {len(answer)} bytes answered, "
                f"{self.sealed_answer_size} expected",
                address,
            )
        seed = _SEED[address << 1 | 1]
        if answer[-2] == sequence and crc8(answer, seed) == 0:
            return self._values(self._sealed_answer.unpack(answer)[:-TRAILER])
        if answer[1] == sequence and answer[0] & _REFUSED and crc8(answer[:3], seed) == 0:
            return Answer((), answer[0])
        raise CorruptFrameError(
            f"{self.register.name}: answer {answer.hex(' ')} fails its check byte or does not "
            f"carry sequence number {sequence}",
            address,
        )

    def _wire(self, values: Sequence[float]) -> list[float]:
        """Return the numbers to pack for these values."""
        if len(values) != len(self._encodings):
            values = self._without_zeros(values)
        wire: list[float] = []
        for value, (lower, upper, step) in zip(values, self._encodings, strict=True):
            if not lower <= value <= upper:
                self._refuse(len(wire), value)
            if step == 0.0:
                wire.append(value)
            elif step == 1.0:
                wire.append(self._whole(len(wire), value))
            else:
                wire.append(round(value / step))
        return wire

    def _without_zeros(self, values: Sequence[float]) -> Sequence[float]:
        """Return the values without the zeros that the original driver gives for padding.

        Raises:
            InvalidArgumentError: There are too many or too few, or one of these is not zero.
        """
        known = len(self._encodings)
        if len(values) == known + self._padding and all(value == 0 for value in values[known:]):
            return values[:known]
        names = ", ".join(field.name for field in self._fields) or "no values"
        raise InvalidArgumentError(
            f"{self.register.name} takes {names}; {len(values)} values were given"
        )

    def _values(self, unpacked: tuple[float, ...]) -> Answer:
        """Return the answer that consists of these numbers; the last one is the flags."""
        for index in self._floats:
            value = unpacked[index]
            # A NaN or an infinity makes the difference NaN, which no comparison accepts.
            if not value - value == 0.0:
                raise CorruptFrameError(f"{self.register.name}: answered {value}")
        flags = int(unpacked[-1])
        if not self._scaled:
            return Answer(unpacked[:-1], flags)
        values = list(unpacked[:-1])
        for index, scale in self._scaled:
            values[index] *= scale
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
        raise LimitError(name, value, *field_bounds(field), field.unit)


class _Track(Message):
    """TRACK, which each joint gets in every cycle: the same frames in a third of the time.

    Values and answers that are not accepted are left to the general methods, which raise.
    """

    def encode_v2(self, address: int, sequence: int, values: Sequence[float] = ()) -> bytes:
        """Return the request; as :meth:`Message.encode_v2`."""
        (lowest, highest, _), (slowest, fastest, step) = self._encodings
        try:
            position, velocity = values
        except ValueError:
            return super().encode_v2(address, sequence, values)
        if not (lowest <= position <= highest and slowest <= velocity <= fastest):
            return super().encode_v2(address, sequence, values)
        frame: bytes = self._sealed_request.pack(
            self._code, position, round(velocity / step), sequence
        )
        return frame + _BYTE[crc8_of_8(frame, _SEED[address << 1])]

    def decode_v2(self, address: int, sequence: int, answer: bytes) -> Answer:
        """Return the decoded answer; as :meth:`Message.decode_v2`."""
        if len(answer) == self.sealed_answer_size:
            position, velocity, flags, echo, check = self._sealed_answer.unpack(answer)
            if (
                check == crc8_of_8(answer, _SEED[address << 1 | 1])
                and echo == sequence
                and position - position == 0.0
            ):
                # Answer(...) takes twice as long.
                return _new(Answer, ((position, velocity * VELOCITY_STEP_RPM), flags))
        return super().decode_v2(address, sequence, answer)


class _TrackLoad(_Track):
    """TRACKLOAD, likewise: one byte more in the answer."""

    def decode_v2(self, address: int, sequence: int, answer: bytes) -> Answer:
        """Return the decoded answer; as :meth:`Message.decode_v2`."""
        if len(answer) == self.sealed_answer_size:
            position, velocity, load, flags, echo, _ = self._sealed_answer.unpack(answer)
            if (
                # Of a frame with its check byte it is zero.
                crc8_of_10(answer, _SEED[address << 1 | 1]) == 0
                and echo == sequence
                and position - position == 0.0
            ):
                return _new(Answer, ((position, velocity * VELOCITY_STEP_RPM, load), flags))
        return Message.decode_v2(self, address, sequence, answer)


READ: dict[Register, Message] = {
    row.register: Message(row, (), row.read)
    for row in REGISTERS
    if row.access in (Access.READ, Access.READ_WRITE)
}
_CLASSES = {Register.TRACK: _Track, Register.TRACKLOAD: _TrackLoad}
WRITE: dict[Register, Message] = {
    row.register: _CLASSES.get(row.register, Message)(
        row, row.written, row.read if row.access is Access.EXCHANGE else ()
    )
    for row in REGISTERS
    if row.access in (Access.WRITE, Access.READ_WRITE, Access.EXCHANGE)
}
