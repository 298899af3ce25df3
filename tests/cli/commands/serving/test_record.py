"""``bioscara record`` and its description of a file; recording itself is in ``tests/recording``."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.cli import main
from bioscara.cli.parser import parse
from bioscara.rosbag.recording_file import RecordingFile
from bioscara.rosbag.texts import text_message
from bioscara.rosbag.topics import Topic


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


def test_a_file_that_is_being_written_is_not_called_unfinished(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = RecordingFile(tmp_path / "left.mcap")
    file.add(Topic.EVENTS, text_message('{"number": 1, "text": "a"}'), 1)
    file.flush()
    for word in ("being written", "complete"):
        assert main(["record", "info", str(file.path)]) == 0
        said = capsys.readouterr().out
        assert f"\n{word}" in said
        assert "recover" not in said
        if word == "being written":
            file.finish()


def test_a_file_is_described_completed_and_exported(
    unfinished: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["record", "info", str(unfinished)]) == 0
    said = capsys.readouterr().out
    assert "arm left, simulated; file 1" in said
    assert "from 2001-09-09 01:46:40 UTC to 2001-09-09 01:46:42 UTC" in said
    assert "/events: 3 messages, 1.5 Hz" in said
    assert "never finished, and 2 bytes of an incomplete record follow" in said
    assert main(["record", "recover", str(unfinished)]) == 0
    assert "3 messages; 2 bytes were no whole record" in capsys.readouterr().out
    assert main(["record", "info", str(unfinished)]) == 0
    assert "\ncomplete\n" in capsys.readouterr().out
    assert main(["record", "recover", str(unfinished)]) == 0
    assert "is complete: 3 messages" in capsys.readouterr().out
    assert main(["record", "export", str(unfinished), "--csv", str(tmp_path / "out")]) == 0
    assert f"wrote {tmp_path}/out/events.csv" in capsys.readouterr().out


def test_a_file_that_is_no_recording_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["record", "info", __file__]) == 2
    assert "is no recording" in capsys.readouterr().err
