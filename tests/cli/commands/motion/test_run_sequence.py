"""``bioscara run`` with a sequence of steps."""

from __future__ import annotations

import csv
import re
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

import bioscara.sim
from bioscara.model import load_parameters
from bioscara.planning import read
from bioscara.sim import SimulatedArm
from cli.said import Said
from programs import wait_for_line
from simulated import NearArm

FILE = """\
schema: 1
title: there
steps:
- {kind: move_joints, positions: {j1: -0.6, j2: 0.2, j3: 1.2, j4: -0.6}}
- kind: move_linear
  pose: {x: 0.5, y: -0.1, z: 0.2, yaw: 0.0}
- {kind: wait, seconds: 0.01}
...
"""


@pytest.fixture
def arm(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> SimulatedArm:
    """The arm of every command, and a sequence in the present folder."""
    arm = NearArm()
    monkeypatch.setattr(bioscara.sim, "SimulatedArm", lambda **_: arm)
    monkeypatch.chdir(tmp_path)
    Path("there.yaml").write_text(FILE)
    return arm


def test_a_sequence_is_carried_out(arm: SimulatedArm, said: Said) -> None:
    out = said.output("run there.yaml")
    assert "sequence: there, 3 steps" in out
    assert "step 2 move_linear of 3" in out
    assert "--pose 0.5000 -0.1000 0.2000 0.0000" in out
    assert arm.position("j2") == pytest.approx(0.2091, abs=2e-3)


def test_a_dry_run_moves_nothing(arm: SimulatedArm, said: Said) -> None:
    before = [arm.position(joint.name) for joint in load_parameters().joints]
    assert [arm.position(joint.name) for joint in load_parameters().joints] == before
    out = said.output("run there.yaml --dry-run")
    assert "2 move_linear  " in out
    assert "total  " in out


@pytest.mark.usefixtures("arm")
@pytest.mark.parametrize(
    ("words", "old", "new", "text"),
    [
        ("--dry-run", "x: 0.5", "x: 2", "step 2: (2, -0.1, 0.2) m, yaw 0 rad cannot be reached"),
        ("", "0.01", "-1", "there.yaml, line 7: steps[2].seconds: -1 s is outside 0 .. 3600 s"),
        ("--fit", "", "", "--fit applies only to trajectories, and there.yaml is a sequence"),
        ("--tool needle", "", "", "there is no tool 'needle'"),
        ("--from 0 0.2 0 0", "", "", "--from applies only to --dry-run"),
        (
            "",
            "title: there",
            "tool: needle",
            "the sequence is for tool needle, the arm has fingers",
        ),
    ],
)
def test_a_sequence_is_refused_before_anything_moves(
    words: str, old: str, new: str, text: str, said: Said
) -> None:
    Path("there.yaml").write_text(FILE.replace(old, new))
    assert text in said.failure(f"run there.yaml {words}")


def test_a_trajectory_has_a_dry_run_too(arm: SimulatedArm, said: Said) -> None:
    Path("a.csv").write_text("time,j1_position,j1_velocity\n0,0.1,0\n2,0.2,0\n")
    # With the duration of the averaged motion, where the other joints stand as homed.
    assert said.output("run a.csv --dry-run") == (
        "trajectory: a.csv, 2.23 s\n"
        "note: held, as not in the trajectory: j2 at +0.3380 m, j3 at +2.6267 rad, "
        "j4 at +3.0107 rad\n"
    )


def test_a_joint_that_the_arm_does_not_have_is_named(arm: SimulatedArm, said: Said) -> None:
    Path("a.csv").write_text("time,j7\n0,0.1\n2,0.2\n")
    assert "no joint 'j7'; the arm has j1, j2, j3, j4" in said.refusal("run a.csv --dry-run")


def test_a_trajectory_of_one_joint_is_reported_as_it_is_carried_out(
    arm: SimulatedArm, said: Said
) -> None:
    Path("a.csv").write_text("time,j1\n0,0.1\n2,0.3\n")
    assert "trajectory: a.csv, 2.00 s\n" in said.output("run a.csv --dry-run")
    assert "duration    trajectory 2.00 s" in said.output("run a.csv --out out")
    with Path("out/samples.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["phase"] == "trajectory"]
    carried_out = read("out/trajectory.csv").trajectory
    assert carried_out.duration == pytest.approx(2.0, abs=1e-3)
    for row in rows:
        expected = carried_out.sample(float(row["trajectory_time"])).positions[0]
        # At 0.12 rad/s the reference of the cycle before, which is compared, is 1.2 mrad behind.
        assert float(row["j1_reference"]) == pytest.approx(expected, abs=1.3e-3)


def test_a_dry_run_shows_the_duration_of_the_slowed_and_averaged_motion(
    arm: SimulatedArm, said: Said
) -> None:
    rows = [f"{0.05 * i},0.5,0.2,{0.6 + 0.1 * (i % 2)},0.3" for i in range(7)]
    header = ",".join(("time", *(f"j{number}_position" for number in range(1, 5))))
    Path("a.csv").write_text("\n".join((header, *rows, "")))
    out = said.output("run a.csv --dry-run")
    shown = re.match(r"trajectory: a.csv, (\d+\.\d+) s\n", out)
    assert shown
    said.output("run a.csv --out out")
    with Path("out/samples.csv").open() as file:
        times = [
            float(row["trajectory_time"]) for row in csv.DictReader(file) if row["trajectory_time"]
        ]
    assert float(shown[1]) > 0.5
    # Until the joints have arrived.
    assert float(shown[1]) <= max(times) + 0.02 < float(shown[1]) + 0.5


@pytest.mark.parametrize("words", ["--tool needle", "--table t.yaml", "--from 0 0.2 0 0"])
def test_options_of_sequences_are_refused_for_a_trajectory(
    words: str, arm: SimulatedArm, said: Said
) -> None:
    Path("a.csv").write_text("time,j1_position,j1_velocity\n0,0.1,0\n2,0.2,0\n")
    assert f"{words.split(maxsplit=1)[0]} applies only to sequences" in said.refusal(
        "run a.csv --dry-run", *words.split()
    )


def test_ctrl_c_ends_a_wait(start: Callable[..., subprocess.Popen[str]], tmp_path: Path) -> None:
    path = tmp_path / "wait.yaml"
    path.write_text("schema: 1\nsteps:\n- {kind: wait, seconds: 3600}\n- {kind: unfold}\n...\n")
    program = start("-m", "bioscara", "run", str(path), stderr=subprocess.PIPE)
    wait_for_line(program, "  watching")
    program.send_signal(signal.SIGINT)
    _, said = program.communicate(timeout=20.0)
    assert program.returncode == 130, said
    assert " s into a rest of 3600 s; all joints were stopped and disabled" in said
