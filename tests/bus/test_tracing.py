"""Recording and replay: the wire is not disturbed and the same run replays to the same answers."""

from __future__ import annotations

import logging
import resource
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from bioscara.bus import ReplayBus, TracingBus, Transaction, read_trace
from bioscara.errors import (
    BusUnavailableError,
    InvalidArgumentError,
    NoAcknowledgeError,
    ReplayError,
)
from bus.wire import ABSENT, Wire


class Ticks:
    """A clock that moves 1 ms each time it is read."""

    def __init__(self) -> None:
        self.time = 0.0

    def now(self) -> float:
        self.time += 0.001
        return self.time

    def sleep_until(self, deadline: float) -> None:
        raise AssertionError(f"a recorder never waits until {deadline}")


POSITION = Transaction(0x11, b"\x18", 5)
STOP = Transaction(0x12, b"\x29\x00", 1)
TO_NO_DEVICE = Transaction(ABSENT, b"\x18", 5)

transfers = st.lists(
    st.lists(
        st.builds(
            Transaction,
            st.sampled_from([0x11, 0x12, ABSENT]),
            st.binary(max_size=8),
            st.integers(0, 8),
        ),
        max_size=4,
    ),
    max_size=5,
)


def plain(results: Sequence[Any]) -> list[object]:
    return [
        result if isinstance(result, bytes) else (type(result), str(result), result.address)
        for result in results
    ]


@settings(max_examples=50)
@given(transfers)
def test_a_replay_answers_as_the_wire_did(asked: list[list[Transaction]]) -> None:
    with TemporaryDirectory() as folder:
        with TracingBus(Wire(), Path(folder) / "bus", Ticks()) as bus:
            recorded = [plain(bus.transfer(transactions)) for transactions in asked]
        direct = Wire()
        assert recorded == [plain(direct.transfer(transactions)) for transactions in asked]
        with ReplayBus(Path(folder) / "bus") as replay:
            assert [plain(replay.transfer(transactions)) for transactions in asked] == recorded


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    path = tmp_path / "bus"
    wire = Wire()
    with TracingBus(wire, path, Ticks()) as bus:
        bus.transfer([POSITION, STOP])
        bus.transfer([TO_NO_DEVICE])
        wire.unavailable = True
        with pytest.raises(BusUnavailableError):
            bus.transfer([POSITION])
    assert wire.closed
    return path


def test_records_carry_time_requests_and_outcomes(recorded: Path) -> None:
    first, second, third = read_trace(recorded)
    assert (first.start, first.duration) == (pytest.approx(0.001), pytest.approx(0.001))
    assert first.transactions == (POSITION, STOP)
    assert first.results == tuple(Wire().transfer([POSITION, STOP]))
    assert isinstance(second.results[0], NoAcknowledgeError)
    assert isinstance(third.raised, BusUnavailableError)


def test_a_replay_raises_what_was_raised_and_says_where_it_ends(recorded: Path) -> None:
    with ReplayBus(recorded) as replay:
        replay.transfer([POSITION, STOP])
        replay.transfer([TO_NO_DEVICE])
        with pytest.raises(BusUnavailableError, match="the wire is cut"):
            replay.transfer([POSITION])
        with pytest.raises(ReplayError, match="ends after 3 records") as caught:
            replay.transfer([POSITION])
    assert caught.value.record == 4


@pytest.mark.parametrize(
    ("asked", "part"),
    [
        ([POSITION, POSITION], "transaction 2 differs: recorded 0x12 write 2900, read 1, now 0x11"),
        ([STOP, STOP], "transaction 1 differs"),
        ([POSITION], "transaction 2 differs: recorded 0x12 write 2900, read 1, now none"),
        ([POSITION, STOP, STOP], "transaction 3 differs: recorded none, now 0x12"),
        ([POSITION, STOP._replace(read=2)], "now 0x12 write 2900, read 2"),
    ],
)
def test_another_request_is_refused_with_record_and_transaction(
    recorded: Path, asked: list[Transaction], part: str
) -> None:
    with ReplayBus(recorded) as replay, pytest.raises(ReplayError) as caught:
        replay.transfer(asked)
    assert "record 1" in str(caught.value)
    assert part in str(caught.value)
    assert caught.value.record == 1


def test_a_closed_replay_is_unavailable(recorded: Path) -> None:
    replay = ReplayBus(recorded)
    replay.close()
    replay.close()
    with pytest.raises(BusUnavailableError):
        replay.transfer([POSITION, STOP])


def test_each_record_is_in_the_file_when_its_transfer_returns(tmp_path: Path) -> None:
    with TracingBus(Wire(), tmp_path / "bus", Ticks()) as bus:
        for count in range(1, 4):
            bus.transfer([POSITION])
            assert len(list(read_trace(tmp_path / "bus"))) == count
        bus.sync()


def test_an_existing_file_is_never_overwritten(recorded: Path) -> None:
    before = recorded.read_bytes()
    with pytest.raises(InvalidArgumentError, match="File exists"):
        TracingBus(Wire(), recorded, Ticks())
    assert recorded.read_bytes() == before


def test_a_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidArgumentError, match="cannot be created: No such file"):
        TracingBus(Wire(), tmp_path / "none" / "bus", Ticks())


@contextmanager
def disk_of(size: int) -> Iterator[None]:
    """No file may grow beyond ``size`` bytes; not even the file that receives the results."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_a_full_disk_ends_the_recording_not_the_run(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    wire = Wire()
    with (
        caplog.at_level(logging.ERROR),
        TracingBus(wire, tmp_path / "bus", Ticks()) as bus,
    ):
        with disk_of(200):
            results = [bus.transfer([POSITION]) for _ in range(10)]
        assert results == [Wire().transfer([POSITION])] * 10
        assert bus.failure is not None
        bus.sync()
    assert len(wire.arrived) == 10
    assert [record.levelname for record in caplog.records] == ["ERROR"]
    assert "ended early: File too large" in caplog.text
    kept = list(read_trace(tmp_path / "bus"))
    assert kept
    assert all(record.transactions == (POSITION,) for record in kept)
