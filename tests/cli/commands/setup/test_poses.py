"""``bioscara poses``: saved poses are listed, invalid ones are refused and change nothing."""

from __future__ import annotations

import re
import sys
import threading
from pathlib import Path

import pytest

import bioscara.sim
from bioscara import Robot
from bioscara.bus import Bus
from bioscara.cli import main
from bioscara.kinematics import Joints
from bioscara.model import load_parameters
from bioscara.robot.workspace.teach_file import load_table
from bioscara.robot.workspace.tools import fingers
from bioscara.sim import FirmwareBus, SimulatedArm
from cli.said import Said

PARAMETERS = load_parameters()
JOINTS = ("0.3", "0.1", "0.8", "-0.4")


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path / "poses.yaml"


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (
            "save plate --joints 0 0.1 0 0",
            "a pose plate in poses.yaml already; choose another name, or",
        ),
        ("save center --joints 0 0.1 0 0", "there is a pose center already"),
        ("save a --joints 0 0.1 0 45", "are these degrees?"),
        ("save a --joints 4 0.1 0 0", "j1 at 4.0000 rad, 0.9535 rad beyond its range"),
        ("save a --joints nan 0.1 0 0", "pose a, j1 is nan"),
        ("save a --pose 350 200 100 0", "are these millimetres?"),
        ("save a --pose 0.9 0 0.1 0", "m beyond the reach"),
        ("save a --pose 0.4 0.2 0.1 inf", "pose a, yaw is inf"),
        ("save a --joints 0 0.1 0 0 --tool finger", "did you mean fingers?"),
        ("save a.b --joints 0 0.1 0 0", "pose name 'a.b'"),
        ("save a --bus sim", "j1 is not homed"),
        ("save a --bus nowhere", "nowhere"),
        ("show palte", "did you mean plate?"),
        ("delete center", "center is built in"),
        ("delete none", "no pose 'none'"),
        ("delete plate --table other.yaml", "other.yaml: No such file"),
        ("delete center --table other.yaml", "center is built in"),
        ("list --table .", "directory"),
    ],
)
def test_a_refusal_changes_nothing(words: str, complaint: str, elsewhere: Path, said: Said) -> None:
    assert main(["poses", "save", "plate", "--joints", *JOINTS]) == 0
    before = elsewhere.read_bytes()
    err = said.refusal(f"poses {words}")
    assert complaint in err
    assert elsewhere.read_bytes() == before
    assert [path.name for path in elsewhere.parent.iterdir()] == ["poses.yaml"]


def test_the_current_position_can_be_saved(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One arm: homed and moved by a robot, then read by the command, which leaves it there."""
    near = {"j1": -3.0, "j2": 0.33, "j3": 2.58, "j4": 2.9}
    arm = SimulatedArm(positions=near)
    goal = Joints(-2.9, 0.31, 2.4, 2.7)
    bus = FirmwareBus(arm)
    with Robot(bus, arm.clock, PARAMETERS, "the arm") as robot:
        robot.home()
        robot.move_joints(goal)

    def same_arm(*_: object) -> Bus:
        return FirmwareBus(arm)

    monkeypatch.setattr(bioscara.sim, "BenchBus", same_arm)
    places = [arm.position(name) for name in near]
    assert main(["poses", "save", "here", "--bus", "sim"]) == 0
    assert [arm.position(name) for name in near] == pytest.approx(places, abs=1e-4)
    saved = load_table(elsewhere, fingers(PARAMETERS)).pose("here")
    assert saved.joints == pytest.approx(goal, abs=5e-3)
    assert saved.joints is not None
    place = robot.kinematics.forward(saved.joints)
    assert saved.pose_tool_in_base == pytest.approx(place)


def test_poses_saved_concurrently_are_all_kept(elsewhere: Path) -> None:
    names = [f"p{number}" for number in range(6)]
    words = [["poses", "save", name, "--joints", *JOINTS] for name in names]
    threads = [threading.Thread(target=main, args=(each,)) for each in words]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {pose.name for pose in load_table(elsewhere, fingers(PARAMETERS)).poses} == {*names}


@pytest.mark.parametrize(
    "words", ["plan --name plate", "poses show plate", "plan --name center --tool needle"]
)
def test_an_unknown_name_without_a_file_mentions_the_missing_file(words: str, said: Said) -> None:
    assert "poses.yaml does not exist; name another file with --table" in said.refusal(words)


@pytest.mark.parametrize(
    "words",
    ["poses list", "poses show center", "plan --name center", "move --pose 0.45 -0.2 0.25 0",
     "view --name center", "poses delete plate"],
)  # fmt: skip
def test_a_named_table_that_is_missing_is_an_error(words: str, said: Said) -> None:
    assert "nowhere.yaml" in said.refusal(words, "--table", "nowhere.yaml")
    assert not Path("nowhere.yaml").exists()


def test_a_named_table_is_created_by_saving(said: Said) -> None:
    words = ["poses", "save", "plate", "--joints", "0.3", "0.1", "0.8", "-0.4"]
    assert main([*words, "--table", "new.yaml"]) == 0
    assert "from new.yaml" in said.output("poses show plate --table new.yaml")


@pytest.mark.parametrize("name", ["x" * 300 + ".png", "poses.yaml/a.png"])
@pytest.mark.parametrize(
    "words",
    [
        "plan --name center --table",
        "plan --name center --csv",
        "plan --name center --plot",
        "move --name center --table",
        "poses list --table",
        "poses save a --joints 0 0.1 0 0 --table",
        "poses delete a --table",
    ],
)
def test_an_inaccessible_file_is_named(words: str, name: str, elsewhere: Path, said: Said) -> None:
    elsewhere.write_text("")
    err = said.refusal(words, name)
    assert re.search(
        f"^bioscara: {name}.*(File name too long|Not a directory|there is no folder)", err
    )


def test_a_closed_standard_output_prevents_nothing(
    elsewhere: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdout", None)
    assert main(["poses", "save", "plate", "--joints", *JOINTS]) == 0
    sys.stdout.close()
    assert elsewhere.exists()


def test_the_position_of_an_arm_that_is_not_homed_cannot_be_saved(
    elsewhere: Path, said: Said
) -> None:
    assert "j1 is not homed" in (told := said.refusal("poses save here --bus sim"))
    assert "'bioscara home' homes the arm" in told
    assert not elsewhere.exists()


def test_a_name_of_several_words_is_one_argument(elsewhere: Path, said: Said) -> None:
    assert main(["poses", "save", "plate 1", "--joints", *JOINTS]) == 0
    assert main(["plan", "--name", "plate 1"]) == 0
    assert main(["poses", "delete", "plate 1"]) == 0
