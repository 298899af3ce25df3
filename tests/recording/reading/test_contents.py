"""The description of a recording, by its index or by all of its records."""

from __future__ import annotations

from pathlib import Path

from bioscara.recording.reading.contents import Contents
from bioscara.recording.reading.extent import extent_of
from recording.conftest import Made


def described(path: Path) -> list[str]:
    """Return the lines below those with name and state of the file."""
    return [line for line in Contents(path).lines()[1:] if line != "complete"]


def test_the_index_tells_what_all_records_tell(made: Made, tmp_path: Path) -> None:
    whole, path = made.path.read_bytes(), tmp_path / "other.mcap"
    assert extent_of(made.path).complete
    # Without its last byte the file has no index, and all of it is read.
    path.write_bytes(whole[:-1])
    unfinished = described(path)
    assert any("never finished" in line for line in unfinished)
    lines = described(made.path)
    assert lines == [line for line in unfinished if "never finished" not in line]
    assert any(line.startswith("/joint_states: ") for line in lines)
    assert any(line.startswith("attachment ") for line in lines)
    assert lines[0].startswith("arm left, ")


def test_a_finished_file_is_described_without_reading_its_messages(
    made: Made, tmp_path: Path
) -> None:
    content, path = bytearray(made.path.read_bytes()), tmp_path / "other.mcap"
    third = len(content) // 3
    content[third : third + 1000] = bytes(1000)
    path.write_bytes(content)
    assert described(path) == described(made.path)


def test_an_index_that_cannot_be_read_is_not_needed(made: Made, tmp_path: Path) -> None:
    content, path = bytearray(made.path.read_bytes()), tmp_path / "other.mcap"
    topic = content.rindex(b"/joint_states")
    content[topic : topic + 2] = b"\xff\xff"
    path.write_bytes(content)
    assert "/joint_states" in Contents(path).counts
