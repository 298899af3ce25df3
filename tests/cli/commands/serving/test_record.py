"""``bioscara record`` and its description of a file; recording itself is in ``tests/recording``."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.cli.parser import parse
from bioscara.rosbag.recording_file import RecordingFile
from bioscara.rosbag.texts import text_message
from bioscara.rosbag.topics import Topic
from cli.said import Said


@pytest.fixture
def unfinished(tmp_path: Path) -> Path:
    """A recording that was never finished."""
    file = RecordingFile(tmp_path / "left.mcap")
    file.describe("bioscara", {"owner": "left", "arm": "simulated", "number": "1"})
    for number in range(3):
        file.add(Topic.EVENTS, text_message('{"number": 1, "text": "a"}'), number * 10**9 + 10**18)
    file.flush()
    file.abandon()
    with file.path.open("ab") as end:
        end.write(bytes((6, 100)))
    return file.path


def test_recording_is_what_record_does_without_another_word() -> None:
    for words in (["record", "--arm", "left"], ["record", "start", "--arm", "left"]):
        options = parse(words)
        assert (options.action, options.arm, options.out) == ("start", "left", Path("recordings"))
        assert (options.max_size, options.max_time) == (256_000_000, 3600.0)
    options = parse(["record", "--keep", "2g", "--max-size", "1.5M", "--max-time", "60"])
    assert (options.keep, options.max_size, options.max_time) == (2 * 10**9, 1_500_000, 60.0)


def test_a_file_that_is_being_written_is_not_called_unfinished(tmp_path: Path, said: Said) -> None:
    file = RecordingFile(tmp_path / "left.mcap")
    file.add(Topic.EVENTS, text_message('{"number": 1, "text": "a"}'), 1)
    file.flush()
    for word in ("being written", "complete"):
        out = said.output("record info", str(file.path))
        assert f"\n{word}" in out
        assert "recover" not in out
        if word == "being written":
            file.finish()


def test_a_file_is_described_completed_and_exported(
    unfinished: Path, tmp_path: Path, said: Said
) -> None:
    out = said.output("record info", str(unfinished))
    assert "arm left, simulated; file 1" in out
    assert "from 2001-09-09 01:46:40 UTC to 2001-09-09 01:46:42 UTC" in out
    assert "/events: 3 messages, 1.5 Hz" in out
    assert "never finished, and 2 bytes of an incomplete record follow" in out
    assert "3 messages; 2 bytes were no whole record" in said.output(
        "record recover", str(unfinished)
    )
    assert "\ncomplete\n" in said.output("record info", str(unfinished))
    assert "is complete: 3 messages" in said.output("record recover", str(unfinished))
    assert f"wrote {tmp_path}/out/events.csv" in said.output(
        "record export", str(unfinished), "--csv", str(tmp_path / "out")
    )


def test_a_file_that_is_no_recording_is_refused(tmp_path: Path, said: Said) -> None:
    assert "is no recording" in said.refusal("record info", __file__)
