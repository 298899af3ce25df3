"""The scene as Gazebo reads it: converted by its own library, libsdformat of Debian."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
import yaml

from bioscara.export.model_files import export_model
from bioscara.model import load_parameters
from programs import LIMIT, started
from ros.rig import rig
from ros.share import PACKAGES, scene
from ros_environment import absent

MOVABLE = ["j1", "j2", "j3", "j4", "gripper", "gripper_l_mimic", "gripper_r_mimic"]
LINKS = ["base_link", "link_1", "link_2", "link_3", "link_4", "virtual_gripper", "left_jaw_link",
         "right_jaw_link"]  # fmt: skip
"""Links that are left when those of fixed joints are one."""


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the program that prints a converted description."""
    try:
        listed = subprocess.run(
            ["pkg-config", "--list-all"], check=True, capture_output=True, text=True
        ).stdout
    except FileNotFoundError:
        listed = ""
    names = sorted(line.split()[0] for line in listed.splitlines() if line.startswith("sdformat"))
    if not names:
        absent("no libsdformat: apt install libsdformat-dev pkg-config")
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", names[-1]], check=True, capture_output=True, text=True
    ).stdout.split()
    program = tmp_path_factory.mktemp("judge") / "sdf_model"
    source = Path(__file__).with_name("sdf_model.cpp")
    subprocess.run(["c++", "-std=c++17", str(source), *flags, "-o", str(program)], check=True)
    return program


def converted(judge: Path, folder: Path, urdf: ET.Element) -> dict[str, Any]:
    """Return the library's model of a description, about which it must not complain."""
    file = folder / "scene.urdf"
    file.write_bytes(ET.tostring(urdf))
    done = subprocess.run(
        [judge, file], check=False, capture_output=True, text=True, timeout=60,
        env=os.environ | {"HOME": str(folder)},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("table", ["true", "false"])
def test_gazebo_has_every_link_and_joint_and_drives_the_jaws(
    judge: Path, prefix: Path, tmp_path: Path, table: str
) -> None:
    urdf = scene(prefix, table=table, gazebo="/gazebo")
    model = converted(judge, tmp_path, urdf)
    stands = {"true": ["table"], "false": []}[table]
    assert set(model["links"]) == {*LINKS, *stands}
    fixed = ["base_joint", *(f"{name}_joint" for name in stands)]
    assert set(model["joints"]) == {*MOVABLE, *fixed}
    assert len(LINKS) == len([*MOVABLE, "base_joint"]) == 8
    assert all(link["valid"] for link in model["links"].values())
    masses = [float(tag.attrib["value"]) for tag in urdf.iter("mass")]
    assert sum(link["mass"] for link in model["links"].values()) == pytest.approx(sum(masses))
    bodies = sum(link["bodies"] for link in model["links"].values())
    assert bodies == len(urdf.findall("link/collision"))
    # An engine moves a joint with at most its effort: with none, a jaw is limp.
    for name in MOVABLE:
        joint = model["joints"][name]
        assert joint["effort"] > joint["friction"]
    assert [model["joints"][name]["effort"] for name in MOVABLE[4:]] == [100.0] * 3
    assert all(model["joints"][name]["friction"] > 0.0 for name in MOVABLE[:4])
    assert model["followed"] == {name: f"/gazebo/{name}/position" for name in MOVABLE}


def test_the_arm_alone_with_a_prefix_has_its_own_topics(
    judge: Path, prefix: Path, tmp_path: Path
) -> None:
    urdf = scene(prefix, prefix="left_", gripper_description_package="", gazebo="/left/gazebo")
    model = converted(judge, tmp_path, urdf)
    assert model["followed"] == {
        f"left_{name}": f"/left/gazebo/left_{name}/position" for name in MOVABLE[:4]
    }
    assert converted(judge, tmp_path, scene(prefix))["followed"] == {}


def test_the_exported_description_is_read_without_a_warning(judge: Path, tmp_path: Path) -> None:
    folder = tmp_path / "exported"
    export_model("urdf", folder, load_parameters())
    urdf = ET.parse(folder / "bioscara.urdf").getroot()
    model = converted(judge, tmp_path, urdf)
    assert set(model["links"]) == set(LINKS)
    assert set(model["joints"]) == {*MOVABLE, "base_joint"}
    assert all(link["valid"] for link in model["links"].values())
    assert sum(link["bodies"] for link in model["links"].values()) == 40


@pytest.mark.ros
def test_measured_positions_become_commands_of_gazebos_joints(prefix: Path) -> None:
    text = ET.tostring(scene(prefix), encoding="unicode")
    with rig(8) as site:
        file = site.folder / "joints.yaml"
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": {"robot_description": text}}}))
        words = [site.python, PACKAGES / "scene_bringup/scripts/gazebo_joints"]
        with (
            started([*words, "--ros-args", "--params-file", file], env=site.environment) as program,
            site.clients() as ros,
        ):
            names = {name: f"/gazebo/{name}/position" for name in MOVABLE}
            for topic in names.values():
                ros.do("listen", type="std_msgs/Float64", topic=topic)
            # A joint that is not homed has no position; the order is that of the broadcaster.
            state = {"name": ["gripper", "j1", "j3", "j2"], "position": [0.08, 0.3, -1.0, math.nan]}
            ros.do("publish", type="sensor_msgs/JointState", topic="/joint_states", message=state,
                   times=3, period=0.05)  # fmt: skip
            sent = {
                name: ros.do("heard", topic=names[name])[-1][1]["data"]
                for name in ("j1", "j3", *MOVABLE[4:])
            }
            assert sent == {"j1": 0.3, "j3": -1.0, "gripper": 0.08, "gripper_l_mimic": 0.04,
                            "gripper_r_mimic": -0.04}  # fmt: skip
            for name in ("j2", "j4"):
                assert ros.do("heard", topic=names[name], count=0) == []
            program.send_signal(signal.SIGINT)
            program.send_signal(signal.SIGINT)
            assert program.wait(LIMIT) == 0
