"""A sequence is carried out on an arm that another process owns, as on one of this process."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara import Robot, load_table, run_sequence
from bioscara.cli import main
from robot.sequences.samples import EACH_KIND, TABLE
from served import HALF, NAME, arm_served


def test_a_sequence_is_carried_out_on_a_served_arm(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    poses, file = tmp_path / "poses.yaml", tmp_path / "each.yaml"
    poses.write_text(TABLE)
    with arm_served():
        with Robot.connect(f"arm:{NAME}") as robot:
            robot.table = load_table(poses, robot.table.fingers)
            seen: list[str] = []
            run_sequence(robot, EACH_KIND, on_step=lambda run: seen.append(run.label))
            assert robot.pose == pytest.approx((0.5, -0.1, 0.2, 0.0), abs=2e-3)
            assert len(seen) == 15
            robot.move_joints(HALF)
        file.write_text(
            "schema: 1\nsteps:\n- {kind: move_named, name: gate}\n"
            "- {kind: wait, seconds: 0.1}\n...\n"
        )
        assert main(["run", str(file), "--arm", NAME, "--dry-run"]) == 0
        assert "1 move_named" in capsys.readouterr().out
        assert main(["run", str(file), "--arm", NAME]) == 0
        assert "--joints 0.0000 0.2000 1.2000 -0.6000" in capsys.readouterr().out
