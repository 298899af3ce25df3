"""Frames between a simulated arm's process and its hosts.

A frame is ``u16 size, u8 kind, u32 sequence`` and ``size`` bytes, little endian. A host sends HELLO
with sequence 0 and gets WELCOME, then REQUESTs numbered from 1, each answered by the REPLY of the
same number. REFUSAL carries a sentence and is the last frame of a connection. A program that only
reads the arm sends no HELLO but LOOKs numbered from 0, each answered by the STATE of the same
number; it uses no bus and is no host.

    HELLO    4s magic, u8 version
    WELCOME  nothing
    REQUEST  f64 begin, f64 starved, u16 count, per transaction u8 address, u8 size, u8 read and
             bytes to write
    REPLY    f64 end, f64 waited, u16 count, per transaction u8 outcome, u8 size and the bytes read
    REFUSAL  text
    LOOK     nothing
    STATE    f64 simulated time, f64 true position of each joint, j1 to j4

``begin`` and ``end`` are times of the machine's monotonic clock [s]: when the transactions begin on
the bus, and when the last one ends. The host waits for the latter, so that the scheduler's delays
of two processes do not make the bus slower. ``starved`` is for how long the host was late since its
last request because it had to wait for a processor [s]; ``waited`` is for how long the arm's time
has stood still since the host's WELCOME, so that such delays do not exist in that time [s].
Everything is bounded: at most 64 transactions of at most 255 bytes each way.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import NamedTuple

from bioscara.bus import Transaction
from bioscara.errors import BusUnavailableError, InvalidArgumentError

TRANSACTIONS_MAX = 64
BYTES_MAX = 255
TEXT_MAX = 1000
_HEADER = struct.Struct("<HBI")
_HELLO = struct.Struct("<4sB")
_MAGIC, _VERSION = b"BSIM", 4
_TIMES = struct.Struct("<dd")
_COUNT = struct.Struct("<H")
_HEAD = struct.Struct("<BBB")
_RESULT = struct.Struct("<BB")
_STATE = struct.Struct("<5d")


class FrameKind(IntEnum):
    """Kind of a frame."""

    HELLO = 1
    WELCOME = 2
    REQUEST = 3
    REPLY = 4
    REFUSAL = 5
    LOOK = 6
    STATE = 7


_SIZE_MAX = {
    FrameKind.HELLO: 128,
    FrameKind.WELCOME: 0,
    FrameKind.REQUEST: _TIMES.size + _COUNT.size + TRANSACTIONS_MAX * (_HEAD.size + BYTES_MAX),
    FrameKind.REPLY: _TIMES.size + _COUNT.size + TRANSACTIONS_MAX * (_RESULT.size + BYTES_MAX),
    FrameKind.REFUSAL: TEXT_MAX,
    FrameKind.LOOK: 0,
    FrameKind.STATE: _STATE.size,
}


class Packet(NamedTuple):
    """One frame.

    Attributes:
        kind: Its kind.
        sequence: Its number; a reply has that of its request.
        body: Its payload.
    """

    kind: FrameKind
    sequence: int
    body: bytes


class ArmState(NamedTuple):
    """True state of a simulated arm, independent of the measurements of its joints.

    Attributes:
        time: Simulated time [s].
        positions: Of j1 to j4 [rad, m, rad, rad].
    """

    time: float
    positions: tuple[float, ...]


def encode_frame(kind: FrameKind, sequence: int, body: bytes = b"") -> bytes:
    """Return the bytes of a frame."""
    return _HEADER.pack(len(body), kind, sequence) + body


def next_frame(buffer: bytearray) -> Packet | None:
    """Remove the first frame from ``buffer`` and return it; None while it is not complete.

    Raises:
        BusUnavailableError: The bytes are not the beginning of a frame.
    """
    if len(buffer) < _HEADER.size:
        return None
    size, kind, sequence = _HEADER.unpack_from(buffer)
    if kind not in FrameKind.__members__.values():
        raise BusUnavailableError(f"frames have a kind from 1 to {len(FrameKind)}, not {kind}")
    if size > _SIZE_MAX[FrameKind(kind)]:
        raise BusUnavailableError(
            f"a {FrameKind(kind).name} of {size} bytes; it has at most {_SIZE_MAX[FrameKind(kind)]}"
        )
    end = _HEADER.size + size
    if len(buffer) < end:
        return None
    body = bytes(buffer[_HEADER.size : end])
    del buffer[:end]
    return Packet(FrameKind(kind), sequence, body)


def expect(frame: Packet, kind: FrameKind, sequence: int) -> bytes:
    """Return the body of ``frame``.

    Raises:
        BusUnavailableError: It is of another kind or has another number.
    """
    if (frame.kind, frame.sequence) != (kind, sequence):
        raise BusUnavailableError(
            f"{frame.kind.name} number {frame.sequence} came where {kind.name} number {sequence} "
            "was due"
        )
    return frame.body


def encode_hello() -> bytes:
    """Return the body of a HELLO."""
    return _HELLO.pack(_MAGIC, _VERSION)


def check_hello(body: bytes) -> None:
    """Check the body of a HELLO.

    Raises:
        BusUnavailableError: It is no host's, or that of another version.
    """
    if len(body) < _HELLO.size:
        raise BusUnavailableError(f"a HELLO of {len(body)} bytes; it has at least {_HELLO.size}")
    magic, version = _HELLO.unpack_from(body)
    if (magic, version) != (_MAGIC, _VERSION):
        raise BusUnavailableError(
            f"the host speaks {magic!r} version {version}, the simulated arm {_MAGIC!r} version "
            f"{_VERSION}; use the same version of bioscara for both"
        )


def encode_request(
    transactions: Sequence[Transaction], begin: float, starved: float = 0.0
) -> bytes:
    """Return the body of the REQUEST for ``transactions``.

    Args:
        transactions: The transactions.
        begin: Time at which they begin [s].
        starved: For how long the host was late for want of a processor [s].

    Raises:
        InvalidArgumentError: More or larger transactions than a frame carries.
    """
    if len(transactions) > TRANSACTIONS_MAX:
        raise InvalidArgumentError(
            f"{len(transactions)} transactions in one transfer; at most {TRANSACTIONS_MAX}"
        )
    parts = [_TIMES.pack(begin, starved), _COUNT.pack(len(transactions))]
    for address, write, read in transactions:
        if len(write) > BYTES_MAX or not 0 <= read <= BYTES_MAX or not 0 <= address <= 0x7F:
            raise InvalidArgumentError(
                f"transaction with {address:#x}: {len(write)} bytes out, {read} back; an address "
                f"is at most 0x7f and at most {BYTES_MAX} bytes go each way"
            )
        parts.append(_HEAD.pack(address, len(write), read) + write)
    return b"".join(parts)


def decode_request(body: bytes) -> tuple[list[Transaction], float, float]:
    """Return the transactions of a REQUEST, their begin, and how long the host was starved [s].

    Raises:
        BusUnavailableError: It is not one.
    """
    reader = _BodyParser(body)
    begin, starved = reader.times()
    (count,) = reader.unpack(_COUNT)
    if count > TRANSACTIONS_MAX:
        raise BusUnavailableError(f"{count} transactions at once; at most {TRANSACTIONS_MAX}")
    transactions = []
    for _ in range(count):
        address, size, read = reader.unpack(_HEAD)
        if address > 0x7F:
            raise BusUnavailableError(f"address {address:#x}; an address is at most 0x7f")
        transactions.append(Transaction(address, reader.take(size), read))
    reader.end()
    return transactions, begin, starved


def encode_reply(results: Sequence[bytes | int], end: float, waited: float = 0.0) -> bytes:
    """Return the body of the REPLY that carries ``results``.

    Args:
        results: Bytes read, or the number of an outcome.
        end: Time at which the last transaction ends [s].
        waited: For how long the arm's time has stood still since the host's WELCOME [s].
    """
    parts = [_TIMES.pack(end, waited), _COUNT.pack(len(results))]
    for result in results:
        if isinstance(result, bytes):
            parts.append(_RESULT.pack(0, len(result)) + result)
        else:
            parts.append(_RESULT.pack(result, 0))
    return b"".join(parts)


def decode_reply(body: bytes, count: int) -> tuple[list[bytes | int], float, float]:
    """Return the results of a REPLY to ``count`` transactions, their end, and the wait [s].

    Raises:
        BusUnavailableError: It is not one.
    """
    reader = _BodyParser(body)
    end, waited = reader.times()
    (answered,) = reader.unpack(_COUNT)
    if answered != count:
        raise BusUnavailableError(f"{answered} results for {count} transactions")
    results: list[bytes | int] = []
    for _ in range(count):
        outcome, size = reader.unpack(_RESULT)
        read = reader.take(size)
        results.append(outcome or read)
    reader.end()
    return results, end, waited


def encode_state(state: ArmState) -> bytes:
    """Return the body of the STATE that carries ``state``."""
    return _STATE.pack(state.time, *state.positions)


def decode_state(body: bytes) -> ArmState:
    """Return the state in a STATE.

    Raises:
        BusUnavailableError: It is not one.
    """
    if len(body) != _STATE.size:
        raise BusUnavailableError(f"a STATE of {len(body)} bytes; it has {_STATE.size}")
    time, *positions = _STATE.unpack(body)
    return ArmState(time, tuple(positions))


class _BodyParser:
    """Sequential parser of a frame's body."""

    def __init__(self, body: bytes) -> None:
        self._body, self._at = body, 0

    def take(self, size: int) -> bytes:
        part = self._body[self._at : self._at + size]
        if len(part) < size:
            raise BusUnavailableError(f"a frame of {len(self._body)} bytes ends too early")
        self._at += size
        return part

    def times(self) -> tuple[float, float]:
        first, second = _TIMES.unpack(self.take(_TIMES.size))
        if not (math.isfinite(first) and math.isfinite(second)):
            raise BusUnavailableError(f"a frame with the times {first} and {second}")
        return first, second

    def unpack(self, form: struct.Struct) -> tuple[int, ...]:
        return form.unpack(self.take(form.size))

    def end(self) -> None:
        if self._at < len(self._body):
            raise BusUnavailableError(f"a frame of {len(self._body)} bytes continues after its end")
