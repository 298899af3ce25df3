"""The law of :class:`bioscara.bus.Bus`, over every bus in front of the compiled firmware."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from bioscara.bus import Bus, FaultyBus, ReplayBus, TracingBus, Transaction
from bioscara.clock import MonotonicClock
from bioscara.errors import (
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    NoAcknowledgeError,
)
from bioscara.protocol import MAGIC, READ, TRAILER, WRITE, Register
from contract.arms import open_arm
from contract.preload import PreloadedBus

ADDRESSES = (0x11, 0x12, 0x13, 0x14)
ABSENT = 0x20
PING = READ[Register.PING]
HELLO = READ[Register.HELLO]
READ_OFFSET = READ[Register.HOMEOFFSET]
WRITE_OFFSET = WRITE[Register.HOMEOFFSET]


def ping(address: int) -> Transaction:
    return Transaction(address, PING.encode_v1(), PING.answer_size)


def hello(address: int, sequence: int) -> Transaction:
    return Transaction(address, HELLO.encode_v2(address, sequence), HELLO.answer_size + TRAILER)


def read_offset(address: int) -> Transaction:
    return Transaction(address, READ_OFFSET.encode_v1(), READ_OFFSET.answer_size)


def write_offset(address: int, value: float) -> Transaction:
    return Transaction(address, WRITE_OFFSET.encode_v1((value,)), WRITE_OFFSET.answer_size)


def answered(result: bytes | CommunicationError) -> bytes:
    assert isinstance(result, bytes), result
    return result


def test_each_address_answers_for_itself_and_in_order(bus: Bus) -> None:
    order = (0x13, 0x11, 0x14, 0x12, 0x11)
    results = bus.transfer([hello(address, 40 + n) for n, address in enumerate(order)])
    for n, (address, result) in enumerate(zip(order, results, strict=True)):
        values = HELLO.decode_v2(address, 40 + n, answered(result)).values
        assert values[0] == MAGIC
        assert values[4] == address - 0x10


def test_one_that_fails_does_not_keep_the_others(bus: Bus) -> None:
    order = (ABSENT, 0x11, ABSENT, 0x12, ABSENT)
    results = bus.transfer([ping(address) for address in order])
    assert len(results) == len(order)
    for address, result in zip(order, results, strict=True):
        if address == ABSENT:
            assert isinstance(result, NoAcknowledgeError)
            assert result.address == ABSENT
        else:
            assert PING.decode_v1(answered(result)).values == (ord("O"),)


def test_a_transaction_reads_the_value_that_the_one_before_wrote(bus: Bus) -> None:
    values = {address: address / 7.0 for address in ADDRESSES}
    asked = []
    for address, value in values.items():
        asked += [write_offset(address, value), read_offset(address)]
    results = [answered(result) for result in bus.transfer(asked)]
    for value, result in zip(values.values(), results[1::2], strict=True):
        assert READ_OFFSET.decode_v1(result).values == (
            struct.unpack("<f", struct.pack("<f", value))[0],
        )


def test_a_bare_write_returns_nothing_and_is_carried_out(bus: Bus) -> None:
    frame = write_offset(0x12, 1.5).write
    written, read = bus.transfer([Transaction(0x12, frame, 0), read_offset(0x12)])
    assert written == b""
    assert READ_OFFSET.decode_v1(answered(read)).values == (1.5,)


@pytest.mark.parametrize("size", [1, 2, 32])
def test_a_bare_read_returns_as_many_bytes_as_asked(bus: Bus, size: int) -> None:
    _, read = bus.transfer([ping(0x11), Transaction(0x11, b"", size)])
    assert len(answered(read)) == size


def test_a_read_beyond_the_answer_is_filled(bus: Bus) -> None:
    (result,) = bus.transfer([Transaction(0x11, PING.encode_v1(), 16)])
    assert answered(result)[:1] == b"O"
    assert answered(result)[2:] == b"\xff" * 14


def test_a_short_read_returns_the_first_bytes(bus: Bus) -> None:
    whole, short = bus.transfer([read_offset(0x13), read_offset(0x13)._replace(read=2)])
    assert answered(short) == answered(whole)[:2]


def test_nothing_asked_nothing_returned(bus: Bus) -> None:
    assert bus.transfer([]) == []


def test_many_transactions_in_one_transfer(bus: Bus) -> None:
    results = bus.transfer([ping(ADDRESSES[n % 4]) for n in range(200)])
    assert len(results) == 200
    assert {answered(result)[:1] for result in results} == {b"O"}


@settings(
    max_examples=60,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.lists(
        st.builds(
            Transaction,
            st.sampled_from((*ADDRESSES, ABSENT)),
            # Registers that no version knows: the joints refuse them with any payload.
            st.binary(max_size=31).map(lambda rest: b"\x7f" + rest),
            st.integers(0, 32),
        ),
        max_size=6,
    )
)
def test_noise_gets_bytes_of_the_size_asked_or_an_error(bus: Bus, noise: list[Transaction]) -> None:
    results = bus.transfer(noise)
    assert len(results) == len(noise)
    for transaction, result in zip(noise, results, strict=True):
        if isinstance(result, bytes):
            assert len(result) == transaction.read
        else:
            assert result.address == transaction.address
    assert answered(bus.transfer([ping(0x11)])[0])[:1] == b"O"


def test_closing_is_idempotent_and_final(bus: Bus) -> None:
    with bus:
        bus.transfer([ping(0x11)])
    bus.close()
    with pytest.raises(BusUnavailableError):
        bus.transfer([ping(0x11)])


def test_a_bus_may_be_closed_before_it_was_used(bus: Bus) -> None:
    bus.close()
    with pytest.raises(BusUnavailableError):
        bus.transfer([ping(0x11)])


def test_a_line_held_low_in_front_of_the_joints_ends_as_a_stuck_bus(
    open_linux: Callable[..., PreloadedBus],
) -> None:
    wire = FaultyBus(open_arm(), 1)
    bus = open_linux("pi4", wire)
    held = wire.stuck(recognised=False)
    asked = [ping(address) for address in ADDRESSES]
    assert {type(result) for result in bus.transfer(asked)} == {BusTimeoutError}
    assert {type(result) for result in bus.transfer(asked)} == {BusStuckError}
    held.cancel()
    assert {answered(result)[:1] for result in bus.transfer(asked)} == {b"O"}


def test_a_recorded_run_replays_to_the_same_bytes(bus: Bus, tmp_path: Path) -> None:
    run = [
        [hello(address, 7) for address in ADDRESSES],
        [write_offset(0x11, 0.25), ping(ABSENT)],
        [read_offset(0x11)],
    ]
    with TracingBus(bus, tmp_path / "bus", MonotonicClock()) as recording:
        recorded = [recording.transfer(transactions) for transactions in run]
    with ReplayBus(tmp_path / "bus") as replay:
        for transactions, results in zip(run, recorded, strict=True):
            replayed = replay.transfer(transactions)
            assert [str(result) for result in replayed] == [str(result) for result in results]
