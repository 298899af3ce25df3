"""``--parameters`` and ``$BIOSCARA_PARAMETERS``: the arm that every command uses, and says so."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.arguments import OVERLAY_VARIABLE
from bioscara.cli.runs.job import prepare
from bioscara.errors import ZoneError
from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Box, Scene
from cli.said import Said

LINE = "parameters: mine.yaml changes geometry.tool_x (0.11908 to 0.13)\n"
MOTION = "time,j1,j2,j3,j4\n0.0,0.0,0.2,0.0,0.0\n2.0,0.0,0.21,0.0,0.0\n"
COMMANDS = {
    "demo": [],
    "run": ["motion.csv"],
    "plan": ["--name", "center"],
    "move": ["--name", "center"],
    "joints": [],
    "poses list": [],
    "poses show": ["center"],
    "poses save": ["here", "--joints", "0", "0.2", "0", "0"],
    "poses delete": ["here"],
    "view": [],
    "flash": ["--joint", "1", "--bus", "linux:1"],
}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(OVERLAY_VARIABLE, raising=False)
    (tmp_path / "mine.yaml").write_text("geometry: {tool_x: 0.13}\n")
    (tmp_path / "wrong.yaml").write_text("geometry:\n  tol_x: 0.13\n")
    (tmp_path / "motion.csv").write_text(MOTION)
    return tmp_path


@pytest.mark.parametrize("by", ["option", "environment"])
@pytest.mark.parametrize("command", sorted(COMMANDS.keys() - {"flash"}))
def test_every_command_refuses_a_wrong_overlay_by_file_and_line(
    command: str, by: str, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    words = [*command.split(), *COMMANDS[command]]
    if by == "option":
        words += ["--parameters", "wrong.yaml"]
    else:
        monkeypatch.setenv(OVERLAY_VARIABLE, "wrong.yaml")
    status, out, err = said(*words)
    assert (status, out) == (2, "")
    assert err.startswith(
        "bioscara: wrong.yaml, line 2: geometry.tol_x is not a known parameter; did you mean tool_x"
    )
    assert ("wrong.yaml is named by $BIOSCARA_PARAMETERS" in err) == (by != "option")


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_that_loads_parameters_has_the_option(command: str, said: Said) -> None:
    assert "--parameters FILE" in said.output(f"{command} --help")


def test_a_plan_is_made_for_the_changed_arm_and_says_so(said: Said) -> None:
    words = ["plan", "--joints", "0", "0.2", "0", "0"]
    changed = said.output(*words, "--parameters", "mine.yaml")
    committed = said.output(*words)
    assert changed.startswith(LINE)
    assert "parameters:" not in committed
    assert "to   (0.7336, 0.0000, 0.1909)" in committed
    assert "to   (0.7445, 0.0000, 0.1909)" in changed


def test_the_option_is_preferred_to_the_environment(
    monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    monkeypatch.setenv(OVERLAY_VARIABLE, "wrong.yaml")
    assert said.output("poses list --parameters mine.yaml").startswith(LINE)
    monkeypatch.setenv(OVERLAY_VARIABLE, "")
    assert "parameters:" not in said.output("poses list")


def test_a_run_says_and_reports_what_its_overlay_changes(tmp_path: Path, said: Said) -> None:
    words = ["run", "motion.csv", "--out", "out", "--parameters", "mine.yaml"]
    assert said.output(*words).startswith(LINE)
    reports = [path.read_text() for path in (tmp_path / "out").glob("report.*")]
    assert reports
    assert all("geometry.tool_x (0.11908 to 0.13)" in report for report in reports)


def test_a_file_is_checked_with_the_widths_of_the_changed_gripper(tmp_path: Path) -> None:
    post = Scene((Box("post", (0.7, 0.072, 0.0), (0.75, 0.2, 0.225)),))
    file = tmp_path / "narrow.yaml"
    file.write_text("gripper: {upper: 0.06, initial: 0.05}\n")
    narrow = load_parameters(overlay=file)
    prepare(tmp_path / "motion.csv", "", "", narrow, post)
    with pytest.raises(ZoneError, match="jaws"):
        prepare(tmp_path / "motion.csv", "", "", load_parameters(), post)
