"""Poses that clients teach survive the owner, and no program undoes the changes of another one."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.errors import ConfigurationError, ConflictError
from bioscara.kinematics import Joints, Pose
from bioscara.remote import RemoteRobot
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.poses import NamedPose, TeachTable
from bioscara.robot.workspace.teach_file import load_table, save_table
from bioscara.robot.workspace.tools import Tool, fingers
from bioscara.sim import SimulatedArm
from served import NAME, RawClient, arm_served
from simulated import ARM, NEAR

FINGERS = fingers(ARM)


def pose(name: str, turn: float = 0.1) -> NamedPose:
    return NamedPose(name, Joints(turn, 0.2, 0.8, -0.5))


@pytest.fixture
def arm() -> SimulatedArm:
    return SimulatedArm(seed=2, positions=NEAR)


def names(table: TeachTable) -> list[str]:
    return [each.name for each in table.poses]


def test_what_a_client_teaches_is_there_after_a_restart(arm: SimulatedArm, tmp_path: Path) -> None:
    path = tmp_path / "poses.yaml"
    needle = Tool("needle", Pose(0.05, 0.0, -0.1, 0.0), 0.1)
    bench = Frame("bench", Pose(0.3, -0.1, 0.02, 0.1))
    with arm_served(arm=arm, at=None, table=path), Robot.connect(f"arm:{NAME}") as robot:
        robot.table = robot.table.with_pose(pose("plate")).with_tool(needle).with_frame(bench)
        assert not path.with_name("poses.yaml.bak").exists()
        robot.table = robot.table.with_pose(pose("rack"))
        taught = robot.table
    assert load_table(path, FINGERS) == taught
    with arm_served(arm=arm, at=None, table=path), Robot.connect(f"arm:{NAME}") as robot:
        assert robot.table == taught
        robot.table = robot.table.without_pose("plate")
        assert names(load_table(path, FINGERS)) == ["rack"]
        # An entry that a change removes is not lost.
        assert load_table(path.with_name("poses.yaml.bak"), FINGERS) == taught


def test_poses_that_another_program_saved_are_taken_over_and_never_lost(
    arm: SimulatedArm, tmp_path: Path
) -> None:
    path = tmp_path / "poses.yaml"
    with arm_served(arm=arm, at=None, table=path), Robot.connect(f"arm:{NAME}") as robot:
        robot.table = robot.table.with_pose(pose("plate"))
        # As bioscara poses save does.
        save_table(path, load_table(path, FINGERS).with_pose(pose("gate")))
        with pytest.raises(ConflictError, match="another program has changed the file") as caught:
            robot.table = robot.table.with_pose(pose("rack"))
        with RawClient() as client:
            assert client.request(m.GetWorkspace()).revision == caught.value.revision
        assert names(robot.table) == ["plate", "gate"]
        robot.table = robot.table.with_pose(pose("rack"))
        assert names(load_table(path, FINGERS)) == ["plate", "gate", "rack"]


def test_a_file_that_cannot_be_written_changes_nothing(arm: SimulatedArm, tmp_path: Path) -> None:
    path = tmp_path / "gone" / "poses.yaml"
    with arm_served(arm=arm, at=None, table=path), Robot.connect(f"arm:{NAME}") as robot:
        before = robot.table
        with pytest.raises(ConfigurationError, match=r"poses.yaml: the poses cannot be saved"):
            robot.table = before.with_pose(pose("plate"))
        assert robot.table == before
        path.parent.mkdir()
        robot.table = before.with_pose(pose("plate"))
        path.write_text(path.read_text().replace("plate", "pla  te"))
        with pytest.raises(ConfigurationError, match=r"poses.yaml, line \d+"):
            robot.table = before
        assert names(robot.table) == ["plate"]
        assert "pla  te" in path.read_text()


def test_a_borrowed_table_is_not_saved(arm: SimulatedArm, tmp_path: Path) -> None:
    path = tmp_path / "poses.yaml"
    save_table(path, TeachTable(FINGERS, poses=(pose("plate"),)))
    with arm_served(arm=arm, at=None, table=path), RemoteRobot(NAME) as robot:
        robot.borrow_table(TeachTable(FINGERS, poses=(pose("other"),)))
        assert names(robot.table) == ["other"]
        assert names(load_table(path, FINGERS)) == ["plate"]


def test_an_owner_does_not_begin_with_a_file_that_it_would_replace(
    arm: SimulatedArm, tmp_path: Path
) -> None:
    path = tmp_path / "poses.yaml"
    path.write_text("schema: 1\n")
    with (
        pytest.raises(ConfigurationError, match="truncated"),
        arm_served(arm=arm, at=None, table=path),
    ):
        pass
    assert path.read_text() == "schema: 1\n"


def test_without_a_file_the_table_lasts_as_long_as_the_owner(arm: SimulatedArm) -> None:
    with arm_served(arm=arm, at=None), Robot.connect(f"arm:{NAME}") as robot:
        robot.table = robot.table.with_pose(pose("plate"))
        assert names(robot.table) == ["plate"]
