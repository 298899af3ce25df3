"""``bioscara plan`` and ``bioscara move``: what they say, write and refuse."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.cli import main
from bioscara.planning import read


def test_a_plan_is_told_written_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["plan", "--pose", "0.45", "-0.2", "0.25", "0", "--csv", "m.csv", "--plot", "m.png"]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "tool at most 250 mm/s" in out
    assert "to   (0.4500, -0.2000, 0.2500) m" in out
    assert (tmp_path / "m.png").read_bytes().startswith(b"\x89PNG")
    trajectory, _ = read(tmp_path / "m.csv")
    assert trajectory.joint_names == ("j1", "j2", "j3", "j4")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--pose", "450", "200", "100", "0"], "millimetres"),
        (["--pose", "0.9", "0", "0.2", "0"], "beyond the reach"),
        (["--pose", "nan", "0", "0.2", "0"], "not finite"),
        (["--joints", "0", "0.5", "0", "0"], "j2"),
        (["--name", "centre"], "did you mean center"),
        (["--pose", "0.45", "0", "0.2", "0", "--speed", "10"], "speed"),
        (["--pose", "0.45", "0", "0.2", "0", "--speed", "0"], "speed"),
        (["--joints", "0", "0.1", "0", "0", "--linear"], "--linear"),
        (["--pose", "0.5", "0", "0.2", "0", "--linear", "--from", "9", "0", "0", "0"], "--from"),
    ],
)
def test_what_cannot_be_planned_is_refused_in_one_line(
    words: list[str],
    complaint: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["plan", *words]) == 2
    err = capsys.readouterr().err
    assert complaint in err
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_an_arm_is_moved_to_a_pose(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["move", "--pose", "0.45", "-0.2", "0.25", "0"], paced=False) == 0
    out = capsys.readouterr().out
    assert out.startswith("arm: simulation, in this process")
    assert "tool at (0.450" in out


def test_a_target_out_of_reach_is_refused_before_homing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["move", "--pose", "0.9", "0", "0.2", "0"], paced=False) == 2
    out, err = capsys.readouterr()
    assert "homing" not in out
    assert "beyond the reach" in err
