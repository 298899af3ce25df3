"""A full disk leaves no empty files behind."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from cli.said import Said
from full_disk import full_after

TRAJECTORY = Path(__file__).parents[1] / "data" / "planned_pilz_ptp.yaml"
GOAL = ["--joints", "0.3", "0.1", "0.8", "-0.4"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


# The header of the samples has 429 bytes, the trajectory is longer. The simulated servo has files
# of some bytes, so that a run needs some room.
@pytest.mark.parametrize(
    ("words", "room"),
    [
        (["plan", *GOAL, "--csv", "a.csv"], 0),
        (["plan", *GOAL, "--csv", "a.csv"], 1000),
        (["plan", *GOAL, "--plot", "a.png"], 1000),
        (["poses", "save", "plate", *GOAL], 0),
        (["poses", "save", "plate", *GOAL], 100),
        (["run", str(TRAJECTORY)], 100),
        (["run", str(TRAJECTORY)], 1000),
        (["run", str(TRAJECTORY), "--out", "some/where"], 100),
        (["run", str(TRAJECTORY), "--out", "some/where"], 1000),
    ],
)
def test_nothing_is_left_of_a_command_that_could_not_write(
    words: list[str], room: int, folder: Path, said: Said
) -> None:
    if "--plot" in words:
        pytest.importorskip("matplotlib")
    with full_after(room):
        assert "File too large" in said.failure(*words)
    assert list(folder.iterdir()) == []


def test_a_folder_that_was_there_stays(folder: Path, said: Said) -> None:
    (folder / "mine").mkdir()
    with full_after(100):
        said.failure("run", str(TRAJECTORY), "--out", "mine")
    assert [each.name for each in folder.iterdir()] == ["mine"]
    assert os.listdir("mine") == []


def test_a_report_that_does_not_fit_leaves_no_part_of_it(folder: Path, said: Said) -> None:
    with full_after(60_000):  # room for the trajectory, and for the beginning of the samples
        status, _, error = said("run", str(TRAJECTORY), "--out", "run")
    assert status == 1
    assert "run/plot.html was not written: File too large" in error
    assert "samples end" in error
    whole = {each.name for each in (folder / "run").iterdir()}
    assert whole == {"samples.csv", "trajectory.csv", "report.txt"}
    assert (folder / "run" / "samples.csv").read_bytes().endswith(b"\n")
