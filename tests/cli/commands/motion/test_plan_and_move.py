"""``bioscara plan`` and ``bioscara move``: output, files and refusals."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import bioscara.sim
from bioscara import Robot
from bioscara.bus import Bus
from bioscara.model import load_parameters
from bioscara.planning import read
from bioscara.sim import FirmwareBus, SimulatedArm
from cli.said import Said

PARAMETERS = load_parameters()
REACHED = ["--pose", "0.45", "-0.2", "0.25", "0"]
TABLE = """\
schema: 1
tools:
  needle: {x: 0.0, y: 0.0, z: -0.2, yaw: 0.0, mass: 0.1}
poses:
  prick:
    pose: {x: 0.4, y: 0.2, z: 0.1, yaw: 0.0}
    tool: needle
  far:
    joints: {j1: 4.0, j2: 0.2, j3: 0.0, j4: 0.0}
...
"""
SCENE = """\
version: 1
table_height: null
margin: 0.005
zones:
  - {name: post, keep: out, shape: cylinder, x: 0.45, y: -0.2, radius: 0.02, low: 0.0, high: 0.6}
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with poses, and a scene with an obstacle at ``REACHED``."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "poses.yaml").write_text(TABLE)
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


@pytest.fixture
def arm(monkeypatch: pytest.MonkeyPatch) -> SimulatedArm:
    """The arm of every command."""
    arm = SimulatedArm()
    monkeypatch.setattr(bioscara.sim, "SimulatedArm", lambda **_: arm)
    return arm


def places(arm: SimulatedArm) -> list[float]:
    return [arm.position(limit.name) for limit in PARAMETERS.joints]


def test_a_plan_is_described_written_and_drawn(tmp_path: Path, said: Said) -> None:
    words = ["plan", "--pose", "0.45", "-0.2", "0.25", "0", "--csv", "m.csv", "--plot", "m.png"]
    out = said.output(*words)
    assert re.match(r"duration \d\.\d{3} s, tool at most \d+ mm/s\n", out)
    assert "to   (0.4500, -0.2000, 0.2500) m" in out
    assert (tmp_path / "m.png").read_bytes().startswith(b"\x89PNG")
    trajectory, _ = read(tmp_path / "m.csv")
    assert trajectory.joint_names == ("j1", "j2", "j3", "j4")


def test_a_value_that_rounds_to_zero_has_no_sign(said: Said) -> None:
    out = said.output("plan --joints -0.00001 0.2 0 -0.0001")
    assert "to   (0.7336, 0.0000, 0.1909) m, yaw 0.0 deg\nj1 to +0.0000 rad" in out


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--pose", "0.9", "0", "0.2", "0"], "beyond the reach"),
        (["--pose", "0.45", "0", "0.2", "0", "--velocity-scaling", "10"], "--velocity-scaling"),
        (["--joints", "0", "0.1", "0", "0", "--linear"], "--linear"),
        (["--pose", "0.5", "0", "0.2", "0", "--linear", "--from", "9", "0", "0", "0"], "--from"),
    ],
)
def test_an_impossible_plan_is_refused_in_one_line(
    words: list[str], complaint: str, folder: Path, said: Said
) -> None:
    before = sorted(folder.iterdir())
    err = said.refusal("plan", *words)
    assert complaint in err
    assert sorted(folder.iterdir()) == before


def test_a_line_can_be_planned_from_the_default_start(said: Said) -> None:
    assert "to   (0.6340, 0.0000, 0.2000) m" in said.output("plan --pose 0.634 0 0.2 0 --linear")


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("--pose 0.9 0 0.2 0", "beyond the reach"),
        ("--pose 0.45 -0.2 0.25 90", "--pose, yaw: 90 rad .*are these degrees?"),
        ("--pose 450 -200 250 0", "--pose, x: 450 m .*are these millimetres?"),
        (
            "--pose 0.45 -0.2 0.25 0 --velocity-scaling 10",
            "--velocity-scaling 10.0 is outside 0.001",
        ),
        ("--pose 0.45 -0.2 0.25 0 --velocity-scaling 0", "--velocity-scaling 0.0 is outside 0.001"),
        (
            "--pose 0.45 -0.2 0.25 0 --velocity-scaling nan",
            "--velocity-scaling is nan, which is not a finite number",
        ),
        ("--pose 0.45 -0.2 0.25 0 --via nan 0 0.2", "--via, x is nan"),
        ("--pose 0.45 -0.2 0.25 0 --via 600 100 200", "--via, x: 600 m .*are these millimetres?"),
        ("--pose 0.45 -0.2 0.25 0 --via 0.6 0.6 0.2", "--via .* beyond the tool's reach"),
        ("--pose 0.45 -0.2 0.25 0 --via 0.5 0 0.9", "--via .*j2 at"),
        ("--pose 0.45 -0.2 0.25 0 --via 0.45 -0.2 0.25", "--via is where --pose is"),
        ("--pose 0.45 -0.2 0.25 0 --via 0.5 0 0.2 --linear", "exclude one another"),
        ("--pose 0.45 -0.2 0.25 0 --tool neddle", "did you mean needle?"),
        ("--pose 0.45 -0.2 0.25 0 --scene scene.yaml", "too near to post at the target"),
        ("--pose 0.45 -0.2 0.25 0 --csv nowhere/a.csv", "there is no folder nowhere"),
        ("--joints 0 0.2 0 0 --linear", "need a --pose"),
        ("--joints 0 0.2 0 0 --via 0.5 0 0.2", "need a --pose"),
        ("--joints 0 200 0 0", "--joints, j2: 200 m .*are these millimetres?"),
        ("--joints nan 0.2 0 0", "--joints, j1 is nan"),
        ("--joints -0.6 0.4 1.2 -0.6", "--joints: j2 at 0.4000 m"),
        ("--name center --linear", "need a --pose"),
        ("--name centre", "did you mean center?"),
        ("--name far", "pose far: j1 at 4.0000 rad"),
        ("--name prick", "prick was taught with tool needle.*; give --tool needle once that is"),
    ],
)
def test_an_always_invalid_target_is_refused_before_connecting(
    words: str, complaint: str, arm: SimulatedArm, said: Said
) -> None:
    before = places(arm)
    err = said.refusal(f"move {words}")
    assert re.search(complaint, err)
    assert places(arm) == before


BETWEEN = SCENE.replace("x: 0.45, y: -0.2", "x: 0.28, y: -0.35")


def test_a_refusal_after_homing_is_a_failure(folder: Path, arm: SimulatedArm, said: Said) -> None:
    """The target is free, the post stands between it and the arm's position after homing."""
    (folder / "between.yaml").write_text(BETWEEN)
    words = ["move", "--joints", "0", "0.2", "0.3", "0", "--scene", "between.yaml"]
    status, out, err = said(*words)
    assert status == 1
    assert "homing" in out
    assert re.search(r"comes too near to post from .* s on", err)
    assert err.endswith("; all joints were stopped and disabled\n")
    assert len(err.splitlines()) == 1


def test_a_file_that_cannot_be_written_after_homing_is_a_failure(folder: Path, said: Said) -> None:
    (folder / "full.csv").symlink_to("/dev/full")
    assert "full.csv cannot be written: No space left" in said.failure(
        "move", *REACHED, "--csv", "full.csv", status=1
    )


def test_an_unwritable_file_is_a_refusal_if_nothing_was_homed(
    folder: Path, monkeypatch: pytest.MonkeyPatch, said: Said
) -> None:
    arm = SimulatedArm()
    with Robot(FirmwareBus(arm), arm.clock, PARAMETERS, "the arm") as robot:
        robot.home()
    before = places(arm)

    def same_arm(*_: object) -> Bus:
        return FirmwareBus(arm)

    monkeypatch.setattr(bioscara.sim, "BenchBus", same_arm)
    (folder / "between.yaml").write_text(BETWEEN)
    words = ["move", "--joints", "0", "0.2", "0.3", "0", "--scene", "between.yaml"]
    assert "comes too near to post from" in said.failure(*words)
    assert places(arm) == pytest.approx(before, abs=1e-3)


@pytest.mark.parametrize("command", ["plan", "move"])
def test_a_pose_of_another_tool_is_reached_with_that_tool(command: str, said: Said) -> None:
    assert "to   (0.4000, 0.2000, 0.1000) m, yaw 0.0 deg" in said.output(
        command, "--name", "prick", "--tool", "needle"
    )
