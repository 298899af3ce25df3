"""The recording format: written transactions are read back, at any truncation of the file."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given, settings, strategies as st

from bioscara.bus import TraceRecord, Transaction, read_trace
from bioscara.bus.trace import HEADER, encode_record
from bioscara.errors import (
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    InvalidArgumentError,
    NoAcknowledgeError,
)

KINDS = (
    BusStuckError,
    BusTimeoutError,
    BusUnavailableError,
    CommunicationError,
    NoAcknowledgeError,
)
transactions = st.builds(
    Transaction, st.integers(0x08, 0x77), st.binary(max_size=16), st.integers(0, 32)
)
errors = st.builds(
    lambda kind, text: kind(text, 0x11),
    st.sampled_from(KINDS),
    st.text("ab %!=:*-\n\té€\ud800", max_size=20),
)
seconds = st.integers(0, 10**12).map(lambda microseconds: microseconds / 1e6)


@st.composite
def records(draw: st.DrawFn) -> TraceRecord:
    asked = draw(st.lists(transactions, max_size=5))
    if draw(st.booleans()):
        return TraceRecord(draw(seconds), draw(seconds), tuple(asked), (), draw(errors))
    results = [draw(st.one_of(st.binary(max_size=16), errors)) for _ in asked]
    return TraceRecord(draw(seconds), draw(seconds), tuple(asked), tuple(results), None)


def plain(record: TraceRecord) -> tuple[object, ...]:
    """The record with its errors as values that can be compared."""

    def value(result: object) -> object:
        if isinstance(result, Exception):
            return type(result), str(result).encode("utf-8", "replace")
        return result

    return (*record[:3], tuple(value(result) for result in record.results), value(record.raised))


def write(path: Path, written: list[TraceRecord]) -> list[int]:
    """Write a recording; returns where each record ends."""
    content, ends = HEADER, []
    for record in written:
        content += encode_record(*record)
        ends.append(len(content))
    path.write_bytes(content)
    return ends


@given(st.lists(records(), max_size=6))
def test_records_are_read_back_as_they_were_written(written: list[TraceRecord]) -> None:
    with TemporaryDirectory() as folder:
        write(Path(folder) / "bus", written)
        read = list(read_trace(Path(folder) / "bus"))
    assert [plain(record) for record in read] == [plain(record) for record in written]


@settings(max_examples=10)
@given(st.lists(records(), min_size=1, max_size=3))
def test_a_file_cut_at_any_byte_yields_all_records_before_the_cut(
    written: list[TraceRecord],
) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "bus"
        ends = write(path, written)
        content = path.read_bytes()
        for cut in range(len(content) + 1):
            path.write_bytes(content[:cut])
            whole = sum(end <= cut for end in ends)
            assert [plain(record) for record in read_trace(path)] == [
                plain(record) for record in written[:whole]
            ]


ERROR = NoAcknowledgeError("nobody, really", 0x12)
WRITTEN = [
    TraceRecord(1.0, 0.001, (Transaction(0x11, b"\x18", 5),), (b"\x01\x02\x03\x04\x08",), None),
    TraceRecord(1.02, 0.001, (Transaction(0x12, b"\x18", 5),), (ERROR,), None),
    TraceRecord(1.04, 0.0, (), (), None),
]


def test_the_format_is_the_documented_text(tmp_path: Path) -> None:
    write(tmp_path / "bus", WRITTEN)
    lines = (tmp_path / "bus").read_text().splitlines()
    assert lines[0] == "bioscara-bus 1"
    assert lines[1].startswith("1.000000 0.001000 - 11:18:5=0102030408 *")
    assert lines[2].startswith(
        "1.020000 0.001000 - 12:18:5!NoAcknowledgeError:nobody%2C%20really *"
    )


@pytest.mark.parametrize("record", [1, 2, 3])
def test_one_changed_byte_is_reported_with_its_record(tmp_path: Path, record: int) -> None:
    ends = [len(HEADER), *write(tmp_path / "bus", WRITTEN)]
    content = bytearray((tmp_path / "bus").read_bytes())
    for position in range(ends[record - 1], ends[record] - 1):
        changed = content.copy()
        changed[position] ^= 0x01
        (tmp_path / "bus").write_bytes(changed)
        if changed[position] == ord("\n"):
            continue
        with pytest.raises(InvalidArgumentError, match=rf"bus, record {record} is damaged"):
            list(read_trace(tmp_path / "bus"))


@pytest.mark.parametrize("content", [b"hello\n", b"bioscara-bus 2\n", b"\x7fELF\x00\xff", b"\n"])
def test_another_file_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "bus").write_bytes(content)
    with pytest.raises(InvalidArgumentError, match="no bus trace of this version"):
        list(read_trace(tmp_path / "bus"))


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidArgumentError, match="nowhere: No such file"):
        list(read_trace(tmp_path / "nowhere"))
