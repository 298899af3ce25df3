"""Injected faults: which bytes still arrive, which answers return, and that chance is seeded."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given, strategies as st

from bioscara.bus import Direction, FaultyBus, Transaction, When
from bioscara.clock import SimulatedClock
from bioscara.errors import (
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    InvalidArgumentError,
    LimitError,
    NoAcknowledgeError,
)
from bus.wire import Result, Wire

J1, J2, J3 = 0x11, 0x12, 0x13


def frame(address: int, content: bytes = b"\x18\x01", read: int = 4) -> Transaction:
    return Transaction(address, content, read)


def answer(address: int, read: int = 4) -> bytes:
    return Wire().transfer([frame(address, read=read)])[0]  # type: ignore[return-value]


def faulty(seed: int = 1) -> tuple[FaultyBus, Wire]:
    wire = Wire()
    return FaultyBus(wire, seed), wire


frames = st.lists(
    st.builds(Transaction, st.sampled_from([J1, J2, J3]), st.binary(max_size=8), st.integers(1, 8)),
    max_size=12,
)


@given(frames)
def test_without_faults_all_passes_in_one_call(asked: list[Transaction]) -> None:
    bus, wire = faulty()
    assert bus.transfer(asked) == Wire().transfer(asked)
    assert wire.arrived == asked


def test_off_delivers_nothing_to_that_address_and_all_to_the_others() -> None:
    bus, wire = faulty()
    fault = bus.off(When(address=J2))
    first, second, third = bus.transfer([frame(J1), frame(J2), frame(J3)])
    assert (first, third) == (answer(J1), answer(J3))
    assert isinstance(second, NoAcknowledgeError)
    assert second.address == J2
    assert wire.arrived == [frame(J1), frame(J3)]
    assert fault.hits == 1


@pytest.mark.parametrize(("recognised", "kind"), [(True, BusStuckError), (False, BusTimeoutError)])
def test_stuck_stops_every_address(recognised: bool, kind: type[CommunicationError]) -> None:
    bus, wire = faulty()
    bus.stuck(When(count=2), recognised=recognised)
    results = bus.transfer([frame(J1), frame(J2), frame(J3)])
    assert [type(result) for result in results] == [kind, kind, bytes]
    assert wire.arrived == [frame(J3)]


def test_unavailable_raises_for_the_given_number_of_transfers() -> None:
    bus, wire = faulty()
    bus.unavailable(2)
    for _ in range(2):
        with pytest.raises(BusUnavailableError):
            bus.transfer([frame(J1)])
    assert bus.transfer([frame(J1)]) == [answer(J1)]
    assert wire.arrived == [frame(J1)]


@pytest.mark.parametrize(("direction", "delivered"), [(Direction.OUT, 0), (Direction.BACK, 1)])
def test_lose_drops_before_or_after_delivery(direction: Direction, delivered: int) -> None:
    bus, wire = faulty()
    bus.lose(direction)
    assert isinstance(bus.transfer([frame(J1)])[0], BusTimeoutError)
    assert len(wire.arrived) == delivered


@given(st.binary(min_size=1, max_size=8), st.data())
def test_flip_out_changes_exactly_the_bit_named(content: bytes, data: st.DataObject) -> None:
    bit = data.draw(st.integers(0, 7 + 8 * len(content) - 1))
    bus, wire = faulty()
    bus.flip(Direction.OUT, bit=bit)
    bus.transfer([frame(J1, content, 3)])
    if bit >= 7:
        (got,) = wire.arrived
        changed = int.from_bytes(got.write, "big") ^ int.from_bytes(content, "big")
        assert changed == 1 << (8 * len(content) - 1 - (bit - 7))
        assert (got.address, got.read) == (J1, 3)
        return
    other = J1 ^ (1 << (6 - bit))
    if not 0x08 <= other <= 0x77:
        assert wire.arrived == []
    else:
        assert wire.arrived == [Transaction(other, content, 0), Transaction(J1, b"", 3)]


@given(st.integers(1, 40), st.integers(0, 2**32))
def test_flip_back_changes_the_given_number_of_bits(bits: int, seed: int) -> None:
    bus, wire = faulty(seed)
    bus.flip(Direction.BACK, bits=bits)
    (got,) = bus.transfer([frame(J1)])
    assert isinstance(got, bytes)
    changed = int.from_bytes(got, "big") ^ int.from_bytes(answer(J1), "big")
    assert changed.bit_count() == min(bits, 32)
    assert wire.arrived == [frame(J1)]


def test_flip_of_a_bit_that_the_frame_does_not_have_is_refused() -> None:
    bus, _ = faulty()
    bus.flip(Direction.BACK, bit=32)
    with pytest.raises(InvalidArgumentError, match=r"bits 0 \.\. 31"):
        bus.transfer([frame(J1)])


def test_garbage_keeps_the_length_and_changes_the_rest() -> None:
    bus, wire = faulty()
    bus.garbage()
    (got,) = bus.transfer([frame(J1, read=8)])
    assert isinstance(got, bytes)
    assert len(got) == 8
    assert got != answer(J1, 8)
    assert wire.arrived == [frame(J1, read=8)]


@pytest.mark.parametrize(("filled", "rest"), [(True, b"\xff\xff\xff"), (False, b"")])
def test_truncate_leaves_the_first_bytes(filled: bool, rest: bytes) -> None:
    bus, _ = faulty()
    bus.truncate(1, filled=filled)
    assert bus.transfer([frame(J1)]) == [answer(J1)[:1] + rest]


def test_swap_exchanges_two_joints() -> None:
    bus, wire = faulty()
    bus.swap(J1, J2)
    assert bus.transfer([frame(J1), frame(J2), frame(J3)]) == [answer(J2), answer(J1), answer(J3)]
    assert [t.address for t in wire.arrived] == [J2, J1, J3]


def test_repeat_delivers_again_and_keeps_the_first_answer() -> None:
    bus, wire = faulty()
    bus.repeat(2, When(count=1))
    assert bus.transfer([frame(J1), frame(J2)]) == [answer(J1), answer(J2)]
    assert wire.arrived == [frame(J1)] * 3 + [frame(J2)]


def test_replay_delivers_the_last_frames_again() -> None:
    bus, wire = faulty()
    sent = [frame(J1, bytes((i,))) for i in range(4)]
    bus.transfer(sent[:2])
    bus.replay(3, When(after=1))
    bus.transfer(sent[2:])
    assert wire.arrived == [*sent, *sent[1:4]]


def test_delay_delivers_after_the_given_number_of_others() -> None:
    bus, wire = faulty()
    bus.delay(2, When(first=0x00))
    sent = [frame(J1, bytes((i,))) for i in range(4)]
    results = bus.transfer(sent)
    assert isinstance(results[0], BusTimeoutError)
    assert results[1:] == [answer(J1)] * 3
    assert wire.arrived == [sent[1], sent[2], sent[0], sent[3]]


def test_slow_takes_its_time_up_to_the_timeout() -> None:
    now = [5.0]

    def advance(duration: float) -> None:
        now[0] += duration

    wire = Wire()
    bus = FaultyBus(wire, 1, SimulatedClock(lambda: now[0], advance))
    slow = bus.slow(0.004)
    assert bus.transfer([frame(J1)]) == [answer(J1)]
    assert now[0] == pytest.approx(5.004)
    slow.cancel()
    bus.slow(0.035)
    assert isinstance(bus.transfer([frame(J1)])[0], BusTimeoutError)
    assert now[0] == pytest.approx(5.014)
    assert wire.arrived == [frame(J1)]


def test_slow_without_a_clock_is_refused() -> None:
    with pytest.raises(InvalidArgumentError, match="needs a clock"):
        faulty()[0].slow(0.001)


def test_when_picks_by_first_byte_count_and_start() -> None:
    bus, _ = faulty()
    fault = bus.off(When(first=0x13, after=1, count=2))
    corrupted = [
        isinstance(bus.transfer([frame(J1, bytes((byte,)))])[0], NoAcknowledgeError)
        for byte in (0x13, 0x18, 0x13, 0x18, 0x13, 0x13)
    ]
    assert corrupted == [False, False, True, False, True, False]
    assert fault.hits == 2


@pytest.mark.parametrize(
    ("options", "kind"),
    [
        ({"probability": 1.1}, LimitError),
        ({"probability": -0.1}, LimitError),
        ({"probability": float("nan")}, LimitError),
        ({"count": -1}, InvalidArgumentError),
        ({"after": -1}, InvalidArgumentError),
    ],
)
def test_impossible_conditions_are_refused(
    options: dict[str, float], kind: type[InvalidArgumentError]
) -> None:
    with pytest.raises(kind):
        When(**options)  # type: ignore[arg-type]


def storm(seed: int) -> tuple[list[object], list[Transaction]]:
    bus, wire = faulty(seed)
    bus.off(When(probability=0.2))
    bus.flip(Direction.OUT, When(probability=0.3))
    bus.garbage(When(probability=0.3))
    results: list[object] = []
    for number in range(50):
        for result in bus.transfer([frame(J1, bytes((number,))), frame(J2, b"\x18")]):
            results.append(result if isinstance(result, bytes) else type(result))
    return results, wire.arrived


def test_the_same_seed_corrupts_the_same_transactions() -> None:
    assert storm(7) == storm(7)
    assert storm(7) != storm(8)


def test_an_intermittent_fault_hits_with_its_probability() -> None:
    bus, _ = faulty()
    fault = bus.off(When(probability=0.25))
    bus.transfer([frame(J1)] * 4000)
    assert 900 <= fault.hits <= 1100


@pytest.mark.parametrize("end", ["cancel", "clear"])
def test_an_ended_fault_lets_everything_pass(end: str) -> None:
    bus, _ = faulty()
    fault = bus.off()
    assert isinstance(bus.transfer([frame(J1)])[0], NoAcknowledgeError)
    if end == "cancel":
        fault.cancel()
    else:
        bus.clear()
    assert bus.transfer([frame(J1)]) == [answer(J1)]


def test_a_bus_that_goes_away_within_a_transfer_fails_the_rest_only() -> None:
    class Cut(Wire):
        def transfer(self, transactions: Sequence[Transaction]) -> list[Result]:
            self.unavailable = bool(self.arrived)
            return super().transfer(transactions)

    bus = FaultyBus(Cut(), 1)
    bus.off(When(count=0))
    first, second = bus.transfer([frame(J1), frame(J2)])
    assert first == answer(J1)
    assert isinstance(second, BusUnavailableError)
    with pytest.raises(BusUnavailableError):
        bus.transfer([frame(J1)])


def test_closing_closes_the_bus_below() -> None:
    bus, wire = faulty()
    bus.close()
    assert wire.closed
