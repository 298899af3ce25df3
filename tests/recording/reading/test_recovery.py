"""The file of a killed recorder is completed: no complete chunk of it is lost."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import assume, given, settings, strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from bioscara.errors import RecordingError
from bioscara.recording.reading.recovery import recover
from bioscara.recording.reading.scan import FileScan, messages
from bioscara.rosbag.recording_file import RecordingFile
from bioscara.rosbag.texts import text_message
from bioscara.rosbag.topics import Topic
from recording.conftest import Made
from recording.served_arm import read

CHUNKS, EACH = 4, 3


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small recording with some chunks, an attachment and metadata."""
    path = tmp_path_factory.mktemp("small") / "small.mcap"
    file = RecordingFile(path)
    file.describe("bioscara", {"owner": "left"})
    file.attach("note.txt", "text/plain", b"a note", 1)
    for chunk in range(CHUNKS):
        for number in range(EACH):
            file.add(Topic.EVENTS, text_message(f"{chunk}.{number}"), 10 * chunk + number)
        file.flush()
    file.finish()
    return path


def _chunk_starts(path: Path) -> list[int]:
    """Return where each chunk begins, by the index as mcap's own reader has it."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return [each.chunk_start_offset for each in summary.chunk_indexes]


def _chunk_ends(path: Path) -> list[int]:
    """Return where each chunk ends, by mcap's own reader."""
    ends = []
    with path.open("rb") as file:
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Chunk):
                ends.append(file.tell())
    return ends


def test_no_complete_chunk_is_lost_wherever_the_file_ends(small: Path, tmp_path: Path) -> None:
    whole, ends, part = small.read_bytes(), _chunk_ends(small), tmp_path / "part.mcap"
    assert len(ends) == CHUNKS
    # The index at the end has no messages: some lengths of it are enough.
    index = range(ends[-1] + 100, len(whole), 97)
    for length in (*range(ends[-1] + 100), *index, len(whole)):
        part.write_bytes(whole[:length])
        scan = FileScan()
        if length < 8:
            with pytest.raises(RecordingError, match="is no recording"):
                list(messages(part, scan))
            continue
        found = len(list(messages(part, scan)))
        assert found == EACH * sum(end <= length for end in ends)
        assert scan.complete == (length == len(whole))
        assert scan.damage == []


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.8, 0.999])
def test_a_file_that_ends_early_is_completed_for_every_reader(
    share: float, small: Path, tmp_path: Path
) -> None:
    whole, part = small.read_bytes(), tmp_path / "part.mcap"
    length = max(8, int(share * len(whole)))
    part.write_bytes(whole[:length])
    found = recover(part)
    expected = EACH * sum(end <= length for end in _chunk_ends(small))
    assert found.messages == expected
    assert [each.message.data for each in read(part)] == [
        f"{index // EACH}.{index % EACH}" for index in range(expected)
    ]
    again = recover(part)
    assert (again.written, again.messages) == (None, expected)


def test_attachments_metadata_and_times_are_kept(made: Made, tmp_path: Path) -> None:
    part = tmp_path / "part.mcap"
    part.write_bytes(made.path.read_bytes()[:-1000])
    before, after = FileScan(), FileScan()
    given = list(messages(part, before))
    recover(part)
    kept = list(messages(part, after))
    assert [(e.channel.topic, *e[1:]) for e in kept] == [(e.channel.topic, *e[1:]) for e in given]
    assert (after.attachments, after.metadata) == (before.attachments, before.metadata)
    assert after.profile == "ros2"
    assert after.complete


def test_a_chunk_with_another_checksum_is_left_out(small: Path, tmp_path: Path) -> None:
    content, path = bytearray(small.read_bytes()), tmp_path / "changed.mcap"
    start = 8  # after the magic bytes: records of a kind, a length and their content
    while content[start] != Opcode.CHUNK:
        start += 9 + int.from_bytes(content[start + 1 : start + 9], "little")
    content[start + 33] ^= 1  # after two times and the size
    path.write_bytes(content)
    scan = FileScan()
    # The first chunk has the channels, without which the others cannot be used: the index, too.
    assert len(list(messages(path, scan))) == (CHUNKS - 1) * EACH
    (damage,) = scan.damage
    assert "crc validation failed in Chunk" in damage


@given(
    chunk=st.integers(1, CHUNKS - 1),
    length=st.integers(0, 2**64 - 1) | st.integers(0, 5000),
    finished=st.booleans(),
)
def test_a_damaged_length_costs_its_chunk_alone(
    small: Path, chunk: int, length: int, finished: bool
) -> None:
    content, starts = bytearray(small.read_bytes()), _chunk_starts(small)
    place = slice(starts[chunk] + 1, starts[chunk] + 9)
    assume(content[place] != length.to_bytes(8, "little"))
    content[place] = length.to_bytes(8, "little")
    # Without its index, as of a killed recorder.
    path = small.with_name("length.mcap")
    path.write_bytes(content if finished else content[: _chunk_ends(small)[-1]])
    scan = FileScan()
    found = [each.log_time // 10 for each in messages(path, scan)]
    others = [each for each in range(CHUNKS) for _ in range(EACH) if each != chunk]
    # Without an index, a part that is missing at the end may never have been written.
    assert found in (others, sorted([*others, *[chunk] * EACH]))
    assert scan.complete == finished
    assert scan.damage or not (finished or chunk < CHUNKS - 1)
    assert [each.name for each in scan.attachments] == ["note.txt"]


@settings(max_examples=200)
@given(st.data())
def test_changed_bytes_raise_only_our_errors(small: Path, data: st.DataObject) -> None:
    content = bytearray(small.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = small.with_name("changed.mcap")
    path.write_bytes(content)
    try:
        found = list(messages(path, FileScan()))
    except RecordingError:
        return
    assert len(found) <= CHUNKS * EACH


def test_a_damaged_file_is_kept_and_the_rest_of_it_written_elsewhere(
    small: Path, tmp_path: Path
) -> None:
    content, ends = bytearray(small.read_bytes()), _chunk_ends(small)
    content[ends[1] - 5] ^= 0xFF
    path, out = tmp_path / "damaged.mcap", tmp_path / "out.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"is damaged: a chunk .* give --out FILE"):
        recover(path)
    assert path.read_bytes() == content
    found = recover(path, out)
    assert found.messages == (CHUNKS - 1) * EACH
    assert [each.message.data[0] for each in read(out)] == list("000222333")


def test_a_file_that_is_being_written_is_left_alone(tmp_path: Path) -> None:
    file = RecordingFile(tmp_path / "live.mcap")
    file.add(Topic.EVENTS, text_message("first"), 1)
    file.flush()
    with pytest.raises(RecordingError, match="is being written"):
        recover(file.path)
    file.add(Topic.EVENTS, text_message("second"), 2)
    file.finish()
    assert recover(file.path).written is None
    assert [each.message.data for each in read(file.path)] == ["first", "second"]


def test_a_file_that_is_none_is_refused(tmp_path: Path) -> None:
    other = tmp_path / "other.mcap"
    other.write_text("time,position\n")
    for path, reason in (
        (other, "is no recording"),
        (tmp_path / "missing.mcap", "No such file"),
        (tmp_path, "cannot be read"),
    ):
        with pytest.raises(RecordingError, match=reason):
            recover(path)
