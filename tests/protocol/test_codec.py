"""Frames: literal bytes as the joints know them, and the laws of the codec."""

from __future__ import annotations

import math
import struct
from collections import Counter
from functools import partial
from itertools import combinations

import pytest
from hypothesis import given, strategies as st

from bioscara.errors import CorruptFrameError, InvalidArgumentError, LimitError
from bioscara.protocol import (
    READ,
    REGISTERS,
    WRITE,
    Flags,
    Message,
    Register,
    crc8,
)
from bioscara.protocol.codec import TRAILER, field_bounds
from bioscara.protocol.crc import crc8_of_8, crc8_of_10
from bioscara.protocol.rows import Access, Field, Kind

# Code, payload bytes written, payload bytes read: version 1 as existing joints implement it.
VERSION_1 = {
    "PING": (0x0F, 0, 1),
    "SETUP": (0x10, 4, 0),
    "SETRPM": (0x11, 4, 0),
    "GETDRIVERRPM": (0x12, 0, 4),
    "MOVESTEPS": (0x13, 4, 0),
    "MOVEANGLE": (0x14, 4, 0),
    "MOVETOANGLE": (0x15, 4, 0),
    "GETMOTORSTATE": (0x16, 0, 1),
    "RUNCONTINUOUS": (0x17, 1, 0),
    "ANGLEMOVED": (0x18, 0, 4),
    "SETCURRENT": (0x19, 1, 0),
    "SETHOLDCURRENT": (0x1A, 1, 0),
    "SETMAXACCELERATION": (0x1B, 4, 0),
    "SETMAXDECELERATION": (0x1C, 4, 0),
    "SETMAXVELOCITY": (0x1D, 4, 0),
    "ENABLESTALLGUARD": (0x1E, 1, 0),
    "DISABLESTALLGUARD": (0x1F, 1, 0),
    "CLEARSTALL": (0x20, 1, 0),
    "SETBRAKEMODE": (0x22, 1, 0),
    "ENABLEPID": (0x23, 1, 0),
    "DISABLEPID": (0x24, 1, 0),
    "ENABLECLOSEDLOOP": (0x25, 1, 0),
    "DISABLECLOSEDLOOP": (0x26, 1, 0),
    "SETCONTROLTHRESHOLD": (0x27, 4, 0),
    "MOVETOEND": (0x28, 3, 0),
    "STOP": (0x29, 1, 0),
    "GETPIDERROR": (0x2A, 0, 4),
    "CHECKORIENTATION": (0x2B, 4, 0),
    "GETENCODERRPM": (0x2C, 0, 4),
    "HOME": (0x2D, 4, 0),
    "HOMEOFFSET": (0x2E, 4, 4),
}


def _size(fields: tuple[Field, ...]) -> int:
    return struct.calcsize("<" + "".join(field.kind.value for field in fields))


def _messages() -> list[Message]:
    return [*READ.values(), *WRITE.values()]


def _values(message: Message) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(
        *(
            st.floats(*field_bounds(field), width=32)
            if field.kind is Kind.F32
            else st.integers(*(int(b) for b in field_bounds(field)))
            for field in message.definition.written
            if not field.padding and message in WRITE.values()
        )
    )


TRACKED = (WRITE[Register.TRACK], WRITE[Register.TRACKLOAD])
MESSAGES_AND_VALUES = st.sampled_from(_messages()).flatmap(
    lambda message: st.tuples(st.just(message), _values(message))
)


@pytest.mark.parametrize("name", VERSION_1)
def test_version_1_rows_are_those_of_existing_joints(name: str) -> None:
    row = next(row for row in REGISTERS if row.register is Register[name])
    assert (row.register.value, _size(row.written), _size(row.read)) == VERSION_1[name]
    assert row.version == 1


def test_nothing_else_is_version_1() -> None:
    assert {row.register.name for row in REGISTERS if row.version == 1} == {*VERSION_1, "NONE"}


def test_codes_of_version_2_differ_in_at_least_three_bits() -> None:
    codes = [row.register for row in REGISTERS if row.version == 2]
    distances = [(a ^ b).bit_count() for a in codes for b in codes if a != b]
    assert min(distances) >= 3


def test_no_version_1_length_is_a_version_2_length_of_the_same_register() -> None:
    for row in (row for row in REGISTERS if row.version == 1):
        version_1 = {m.request_size for m in _messages() if m.register is row.register}
        version_2 = {size + TRAILER for size in version_1}
        if row.register is Register.SETUP:
            version_1.add(3)  # as documented, without the padding that hosts send
        assert not version_1 & version_2, row.register.name


def test_frames_are_short_enough_for_the_check_byte() -> None:
    for message in _messages():
        assert 1 + message.request_size + TRAILER <= 14
        assert 1 + message.answer_size + TRAILER <= 14


@pytest.mark.parametrize(
    ("message", "values", "frame"),
    [
        (READ[Register.PING], (), "0f"),
        (WRITE[Register.SETUP], (20, 40), "10 14 28 00 00"),
        (WRITE[Register.SETRPM], (-3.0,), "11 00 00 40 c0"),
        (WRITE[Register.MOVESTEPS], (-2,), "13 fe ff ff ff"),
        (WRITE[Register.HOME], (1, 10, 30, 15), "2d 01 0a 1e 0f"),
        (WRITE[Register.MOVETOEND], (0, 40, -64), "28 00 28 c0"),
        (READ[Register.HOMEOFFSET], (), "2e"),
        (WRITE[Register.HOMEOFFSET], (0.5,), "2e 00 00 00 3f"),
        (WRITE[Register.STOP], (0,), "29 00"),
        (WRITE[Register.CLEARSTALL], (), "20 00"),
    ],
)
def test_literal_version_1_requests(message: Message, values: tuple[float], frame: str) -> None:
    assert message.encode_v1(values).hex(" ") == frame


def test_literal_version_2_frames() -> None:
    track = WRITE[Register.TRACK]
    assert track.encode_v2(0x11, 5, (10.0, -12.34)).hex(" ") == "d5 00 00 20 41 85 ff 05 1a"
    body = bytes.fromhex("00 00 20 41 85 ff 20 05")
    answer = body + bytes((crc8(bytes((0x23,)) + body),))
    values, flags = track.decode_v2(0x11, 5, answer)
    assert values == (10.0, pytest.approx(-12.3))
    assert flags == Flags.ARMED
    track = WRITE[Register.TRACKLOAD]
    assert track.encode_v2(0x11, 5, (10.0, -12.34)).hex(" ") == "b4 00 00 20 41 85 ff 05 bb"
    body = bytes.fromhex("00 00 20 41 85 ff 2a 20 05")
    values, flags = track.decode_v2(0x11, 5, body + bytes((crc8(bytes((0x23,)) + body),)))
    assert values == (10.0, pytest.approx(-12.3), 42)
    assert flags == Flags.ARMED


def test_literal_version_1_answers() -> None:
    assert READ[Register.PING].decode_v1(b"O\x0c") == ((0x4F,), Flags.NOTHOMED | Flags.NOTENABLED)
    assert READ[Register.ANGLEMOVED].decode_v1(b"\x00\x00\x34\x42\x00") == ((45.0,), 0)


@given(MESSAGES_AND_VALUES, st.integers(0, 255), st.sampled_from((0x11, 0x12, 0x13, 0x14)))
def test_a_request_carries_exactly_its_values(
    case: tuple[Message, tuple[float, ...]], sequence: int, address: int
) -> None:
    message, values = case
    frame = message.encode_v2(address, sequence, values)
    assert frame[0] == message.register
    assert frame[:-TRAILER] == message.encode_v1(values)
    assert frame[-2] == sequence
    assert crc8(bytes((address << 1,)) + frame) == 0
    if values:
        fields = [field for field in message.definition.written if not field.padding]
        codes = "<" + "".join(field.kind.value for field in fields)
        wire = struct.unpack_from(codes, frame, 1)
        decoded = [raw * field.scale for raw, field in zip(wire, fields, strict=True)]
        for given_value, back, field in zip(values, decoded, fields, strict=True):
            assert back == pytest.approx(
                given_value, abs=field.scale / 2 if field.scale != 1 else 0
            )


def _answer_payload(message: Message) -> st.SearchStrategy[bytes]:
    fields = () if message.answer_size == 1 else message.definition.read
    kinds = {
        Kind.F32: st.floats(width=32, allow_nan=False, allow_infinity=False).map(
            lambda value: struct.pack("<f", value)
        )
    }
    return st.tuples(
        *(
            kinds.get(field.kind, st.binary(min_size=(n := _size((field,))), max_size=n))
            for field in fields
        )
    ).map(b"".join)


ANSWERS = st.sampled_from(_messages()).flatmap(
    lambda message: st.tuples(st.just(message), _answer_payload(message))
)


@given(ANSWERS, st.integers(0, 0x7F), st.integers(0, 255))
def test_an_answer_is_read_back_whole(
    case: tuple[Message, bytes], flags: int, sequence: int
) -> None:
    message, payload = case
    body = payload + bytes((flags, sequence))
    answer = body + bytes((crc8(bytes((0x25,)) + body),))
    decoded = message.decode_v2(0x12, sequence, answer)
    assert decoded.flags == flags
    fields = message.definition.read if payload else ()
    raw = [
        value / field.scale if field.scale != 1 else value
        for value, field in zip(decoded.values, fields, strict=True)
    ]
    whole = [
        round(value) if field.kind is not Kind.F32 else value
        for value, field in zip(raw, fields, strict=True)
    ]
    assert struct.pack("<" + "".join(field.kind.value for field in fields), *whole) == payload


@given(ANSWERS, st.data())
def test_up_to_three_flipped_bits_are_always_noticed(
    case: tuple[Message, bytes], data: st.DataObject
) -> None:
    message, payload = case
    body = payload + bytes((0, 7))
    answer = bytearray(body + bytes((crc8(bytes((0x23,)) + body),)))
    bits = data.draw(
        st.sets(st.integers(0, 8 * len(answer) - 1), min_size=1, max_size=3), label="bits"
    )
    for bit in bits:
        answer[bit // 8] ^= 1 << bit % 8
    try:
        decoded = message.decode_v2(0x11, 7, bytes(answer))
    except CorruptFrameError:
        return
    # A long answer may begin like a refusal; a refusal carries no values and moves nothing.
    assert decoded.values == ()
    assert decoded.flags & Flags.REFUSED


@pytest.mark.parametrize(
    ("register", "values"), [(Register.STOP, 0), (Register.TRACK, 6), (Register.TRACKLOAD, 7)]
)
def test_an_answer_for_another_request_or_joint_is_noticed(register: Register, values: int) -> None:
    body = bytes((*[0] * values, 0, 9))
    answer = body + bytes((crc8(bytes((0x23,)) + body),))
    message = WRITE[register]
    assert message.decode_v2(0x11, 9, answer).flags == 0
    with pytest.raises(CorruptFrameError, match="sequence number 8"):
        message.decode_v2(0x11, 8, answer)
    with pytest.raises(CorruptFrameError):
        message.decode_v2(0x12, 9, answer)


@given(st.binary(min_size=8, max_size=12), st.integers(0, 255))
def test_the_check_byte_of_whole_pairs_is_the_same(data: bytes, seed: int) -> None:
    assert crc8_of_8(data, seed) == crc8(data[:8], seed)
    if len(data) >= 10:
        assert crc8_of_10(data, seed) == crc8(data[:10], seed)


@given(
    st.sampled_from(TRACKED),
    st.floats(width=32, allow_nan=False, allow_infinity=False),
    st.floats(-3276.8, 3276.7),
    st.integers(0, 255),
)
def test_the_fast_request_of_track_is_the_general_one(
    track: Message, position: float, velocity: float, sequence: int
) -> None:
    values = position, velocity
    assert track.encode_v2(0x13, sequence, values) == Message.encode_v2(
        track, 0x13, sequence, values
    )


@given(
    st.sampled_from(TRACKED),
    st.binary(min_size=10, max_size=10),
    st.booleans(),
    st.integers(0, 255),
)
def test_the_fast_answer_of_track_is_the_general_one(
    track: Message, answer: bytes, sealed: bool, sequence: int
) -> None:
    answer = answer[: track.sealed_answer_size]
    if sealed:
        body = answer[:-2] + bytes((sequence,))
        answer = body + bytes((crc8(bytes((0x27,)) + body),))
    outcomes: list[object] = []
    for decode in (track.decode_v2, partial(Message.decode_v2, track)):
        try:
            outcomes.append(decode(0x13, sequence, answer))
        except CorruptFrameError as error:
            outcomes.append(str(error))
    assert outcomes[0] == outcomes[1]


@pytest.mark.parametrize("values", [(), (1.0,), (1.0, 2.0, 3.0)])
def test_track_takes_two_values(values: tuple[float, ...]) -> None:
    with pytest.raises(InvalidArgumentError, match="TRACK takes position, velocity"):
        WRITE[Register.TRACK].encode_v2(0x11, 1, values)


def test_a_refusal_is_read_from_the_start_of_a_longer_answer() -> None:
    body = bytes((Flags.REFUSED | Flags.NOTHOMED, 3))
    answer = body + bytes((crc8(bytes((0x23,)) + body),)) + b"\xff" * 6
    assert WRITE[Register.TRACK].decode_v2(0x11, 3, answer) == ((), Flags.REFUSED | Flags.NOTHOMED)


@pytest.mark.parametrize("size", [0, 1, 4, 6, 32])
def test_answers_of_the_wrong_size_are_refused(size: int) -> None:
    with pytest.raises(CorruptFrameError, match="5 expected"):
        READ[Register.ANGLEMOVED].decode_v1(bytes(size))
    with pytest.raises(CorruptFrameError):
        READ[Register.ANGLEMOVED].decode_v2(0x11, 0, bytes(size))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_that_are_not_finite_stay_off_the_bus_in_both_directions(value: float) -> None:
    for message in (m for m in WRITE.values() if m.definition.written):
        fields = [field for field in message.definition.written if not field.padding]
        for index in range(len(fields)):
            values = [field_bounds(field)[0] for field in fields]
            values[index] = value
            with pytest.raises(InvalidArgumentError, match="not a finite number"):
                message.encode_v1(values)
    with pytest.raises(CorruptFrameError, match="ANGLEMOVED"):
        READ[Register.ANGLEMOVED].decode_v1(struct.pack("<fB", value, 0))


@pytest.mark.parametrize(
    ("register", "values"),
    [
        (Register.SETUP, (101, 20)),
        (Register.SETUP, (-1, 20)),
        (Register.SETBRAKEMODE, (3,)),
        (Register.HOME, (1, 0, 30, 15)),
        (Register.HOME, (1, 251, 30, 15)),
        (Register.HOME, (2, 10, 30, 15)),
        (Register.SETRPM, (1e39,)),
        (Register.WATCHDOG, (9,)),
        (Register.WATCHDOG, (201,)),
        (Register.TRACK, (0.0, 3277.0)),
        (Register.MOVESTEPS, (2**31,)),
    ],
)
def test_values_that_do_not_fit_are_refused_with_the_limit(
    register: Register, values: tuple[float, ...]
) -> None:
    with pytest.raises(LimitError, match=register.name):
        WRITE[register].encode_v1(values)


def test_wrong_values_are_named() -> None:
    with pytest.raises(InvalidArgumentError, match=r"SETUP takes drive_current, hold_current; 1"):
        WRITE[Register.SETUP].encode_v1((20,))
    with pytest.raises(InvalidArgumentError, match=r"20.5 is not a whole number"):
        WRITE[Register.SETUP].encode_v1((20.5, 20))
    with pytest.raises(InvalidArgumentError, match="PING takes no values"):
        READ[Register.PING].encode_v1((1,))


def test_padding_may_be_given_as_the_zeros_of_the_original_driver() -> None:
    padded = 0
    for message in WRITE.values():
        fields = [field for field in message.definition.written if not field.padding]
        zeros = (0,) * (len(message.definition.written) - len(fields))
        if not zeros:
            continue
        padded += 1
        values = (1,) * len(fields)
        assert message.encode_v1(values + zeros) == message.encode_v1(values)
        for wrong in ((*zeros[:-1], 1), (*zeros, 0), (*zeros[:-1], None)):
            with pytest.raises(InvalidArgumentError, match=f"{message.register.name} takes "):
                message.encode_v1((*values, *wrong))  # type: ignore[arg-type]
    assert padded >= 7


def test_version_1_answers_never_set_the_upper_flags() -> None:
    with pytest.raises(CorruptFrameError, match="bits 4"):
        WRITE[Register.STOP].decode_v1(b"\x10")


def test_every_access_has_its_message() -> None:
    for row in REGISTERS:
        readable = row.access in {Access.READ, Access.READ_WRITE}
        writable = row.access in {Access.WRITE, Access.READ_WRITE, Access.EXCHANGE}
        assert (row.register in READ, row.register in WRITE) == (readable, writable)


def test_the_check_byte_detects_the_documented_errors() -> None:
    """The CRC is linear: an error passes where the remainders of its bits cancel out."""
    longest = max(
        size + TRAILER
        for messages in (READ, WRITE)
        for message in messages.values()
        for size in (message.request_size, message.answer_size)
    )
    assert longest == 13
    bits = 8 * longest
    remainders = [crc8((1 << bit).to_bytes(longest, "big")) for bit in range(bits)]
    pairs = Counter(a ^ b for a, b in combinations(remainders, 2))
    assert 0 not in remainders, "one bit"
    assert 0 not in pairs, "two bits"
    assert all(bin(each).count("1") % 2 for each in remainders), "an odd number of bits"
    # Each set of four bits is three pairs of pairs.
    passing = sum(count * (count - 1) // 2 for count in pairs.values()) // 3
    assert passing / math.comb(bits, 4) == pytest.approx(0.0080, abs=5e-5)
    assert {crc8((value,)) for value in range(256)} == set(range(256)), "noise, 1 in 256"
    for first in range(bits - 7):
        burst = remainders[first : first + 8]
        for pattern in range(1, 256):
            left = 0
            for bit in range(8):
                left ^= burst[bit] if pattern >> bit & 1 else 0
            assert left, f"burst {pattern:#x} at bit {first}"
