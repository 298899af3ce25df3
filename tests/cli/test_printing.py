"""Text from outside is escaped on the terminal, in a report and on a page."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.cli import main
from bioscara.errors import BioscaraError, InvalidArgumentError, JointError
from bioscara.printing import printable

EVIL = "\x1b]0;owned\x07\x1b[31m\nbioscara: all is well\r\x9b2J\u202e\udcff.yaml"


@pytest.fixture
def evil(tmp_path: Path) -> Path:
    folder = tmp_path / EVIL.replace("/", "")
    folder.mkdir()
    return folder


def lines(text: str) -> list[str]:
    """Return the printed lines, all of which must be printable."""
    found = text.split("\n")
    assert all(line.isprintable() for line in found), [x for x in found if not x.isprintable()]
    assert not any(line.startswith("bioscara: all is well") for line in found)
    return found


def test_non_printable_characters_are_escaped() -> None:
    assert printable("a pose, 0.3 m, Ü, 漢") == "a pose, 0.3 m, Ü, 漢"
    assert printable("\x1b[31m\n\u202e\ud800\U000e0001") == "\\x1b[31m\\n\\u202e\\ud800\\U000e0001"


@pytest.mark.parametrize("kind", [BioscaraError, InvalidArgumentError, JointError])
def test_errors_are_one_printable_line(kind: type[BioscaraError]) -> None:
    assert str(kind(f"{EVIL}: no such file")).isprintable()


def test_refusals_show_names_of_files_escaped(
    evil: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("missing.yaml", "missing.csv"):
        assert main(["run", str(evil / name)], paced=False) != 0
    assert main(["poses", "list", "--table", str(evil / "poses.yaml")], paced=False) == 2
    told = capsys.readouterr()
    assert "\\x1b[31m" in told.err
    lines(told.out)
    lines(told.err)


def test_file_names_are_escaped_in_output_report_and_page(
    evil: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    trajectory = evil / f"{evil.name}.csv"
    trajectory.write_text("time,j1,j2,j3,j4\n0,0.1,0.2,0.8,0.1\n2,0.2,0.2,0.8,0.1\n")
    out = evil / "out"
    assert main(["run", str(trajectory), "--out", str(out)], paced=False) == 0
    printed = lines(capsys.readouterr().out)
    assert any("wrote" in line and "\\x1b[31m" in line for line in printed)
    for name in ("report.txt", "plot.html"):
        [file] = out.rglob(name)
        text = file.read_text()
        assert "\x1b" not in text
        assert "\u202e" not in text
    assert (out / "plot.png").stat().st_size > 1000
