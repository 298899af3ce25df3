"""Every launch file with its arguments, run by ROS 2's own launch; ``make test-all`` runs this.

Each that starts controllers is asked by ``ros2 control``, and carries out a goal.
"""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import yaml

from bioscara.model.urdf import URDF
from ros.bringup_controllers import (
    BROADCASTER,
    GRIP,
    GRIPPER,
    HOMING,
    JOINTS,
    POSITION,
    VELOCITY,
    ended,
    energise,
    follow,
    goal,
    point,
)
from ros.launched import launched, listed, moved, positions, states
from ros.rig import CONFIGS, SUCCEEDED, Rig, rig
from ros.share import MOVEIT, PACKAGES
from served import HALF, NAME

pytestmark = pytest.mark.ros
DESCRIPTIONS = ["bioscara_arm_description", "bioscara_gripper_descriptions", "scene_descriptions"]
BRINGUPS = [
    ("scene_bringup", "bioscara_arm_gripper128"),
    ("bioscara_arm_bringup", "bioscara_arm"),
    ("bioscara_gripper_bringup", "bioscara_gripper"),
    (MOVEIT.name, "complete"),
]
"""Launch files that can drive a real arm."""


@pytest.fixture
def site() -> Iterator[Rig]:
    with rig(7) as made:
        yield made


def description(texts: list[str], node: str = "/**") -> ET.Element:
    """Return the description in the parameters of a program."""
    (text,) = (
        content[node]["ros__parameters"]["robot_description"]
        for content in map(yaml.full_load, texts)
        if "robot_description" in content.get(node, {}).get("ros__parameters", {})
    )
    return ET.fromstring(text)


def test_the_arm_with_its_gripper_in_a_namespace(site: Rig, prefix: Path) -> None:
    given = {"use_mock_hardware": "true", "homed": "true", "gui": "true", "namespace": "left"}
    with (
        launched(site, prefix, "scene_bringup", "bioscara_arm_gripper128", **given) as run,
        site.clients() as ros,
    ):
        run.spawned(4)
        ros.namespace = "/left"
        expected = states(VELOCITY, HOMING, GRIPPER)
        assert listed(run, "/left/controller_manager") == expected
        shown = run.recorded("rviz2", "rqt_joint_trajectory_controller")
        config = prefix / "share/scene_descriptions/rviz/display.rviz"
        assert shown["rviz2"][0] == ["-d", str(config), "--ros-args", "-r", "__ns:=/left"]
        moved(ros, VELOCITY, JOINTS)
        # Another launch file, at the same time: the arm does not stand where it begins.
        with launched(
            site, prefix, "bioscara_arm_bringup", "test_joint_trajectory_controller",
            namespace="left",
        ) as poses:  # fmt: skip
            poses.says("not started: j1 is at")


def test_the_arm_alone_with_a_prefix_and_files_of_ones_own(
    site: Rig, prefix: Path, tmp_path: Path
) -> None:
    own = tmp_path / "own"
    shutil.copytree(PACKAGES / "bioscara_arm_description", own / "share/own_description")
    urdf = own / "share/own_description/urdf"
    (urdf / "bioscara_arm.xacro").rename(urdf / "own.xacro")
    shutil.copytree(prefix / "share/ament_index", own / "share/ament_index")
    (own / "share/ament_index/resource_index/packages/own_description").touch()
    text = (PACKAGES / "bioscara_arm_bringup/config/bioscara_arm_controllers.yaml").read_text()
    controllers, manager = tmp_path / "controllers.yaml", tmp_path / "manager.yaml"
    controllers.write_text(text.replace("allow_partial_joints_goal: false",
                                        "allow_partial_joints_goal: true"))  # fmt: skip
    assert controllers.read_text() != text
    text = (PACKAGES / "bioscara_arm_bringup/config/bioscara_controller_manager.yaml").read_text()
    manager.write_text(text.replace("update_rate: 50", "update_rate: 40"))
    given = {
        "prefix": "left_", "namespace": "/lab/left/", "use_mock_hardware": "true", "homed": "true",
        "robot_controller": POSITION, "gui": "false", "controllers_file": str(controllers),
        "controller_manager_file": str(manager), "arm_description_package": "own_description",
        "arm_macro": "own.xacro",
    }  # fmt: skip
    joints = [f"left_{joint}" for joint in JOINTS]
    with (
        launched(
            site, prefix, "bioscara_arm_bringup", "bioscara_arm", packages=own, **given
        ) as run,
        site.clients() as ros,
    ):
        run.spawned(3)
        ros.namespace = "/lab/left"
        assert listed(run, "/lab/left/controller_manager") == states(POSITION, HOMING)
        # Without RViz there are no sliders: the original had them always.
        assert not (run.folder / "record").exists()
        moved(ros, POSITION, joints, "left_bioscara_arm")
        rates = {each["update_rate"] for each in ros.manager("list_controllers")["controller"]}
        assert rates == {40}
        # Of the file of one's own: a goal may leave joints out.
        (first,) = positions(ros, joints[:1])
        sent = goal(point(first, at=1.0), joints=joints[:1])
        assert ended(ros, follow(ros, POSITION, sent))["status"] == SUCCEEDED


def test_the_gripper_alone_with_a_prefix(site: Rig, prefix: Path) -> None:
    given = {"prefix": "left_", "use_mock_hardware": "true", "gui": "true"}
    with (
        launched(site, prefix, "bioscara_gripper_bringup", "bioscara_gripper", **given) as run,
        site.clients() as ros,
    ):
        run.spawned(2)
        assert listed(run) == states(GRIPPER)
        assert set(run.recorded("rviz2")) == {"rviz2"}
        energise(ros, "left_bioscara_gripper_128")
        assert ros.switch([GRIPPER])["ok"]
        command = {"name": ["left_gripper"], "position": [0.08]}
        number = ros.do("goal", type=GRIP, name=f"/{GRIPPER}/gripper_cmd",
                        goal={"command": command})  # fmt: skip
        assert ended(ros, number)["status"] == SUCCEEDED


def test_an_arm_that_another_process_owns(site: Rig, prefix: Path) -> None:
    with (
        site.owner(*HALF),
        launched(site, prefix, "scene_bringup", "served_arm", arm=NAME, gui="false") as run,
        site.clients() as ros,
    ):
        run.spawned(4)
        assert listed(run) == states(VELOCITY, HOMING, GRIPPER)
        moved(ros, VELOCITY, JOINTS)
        assert not (run.folder / "record").exists()


def test_the_arm_with_moveit(site: Rig, prefix: Path) -> None:
    given = {"use_mock_hardware": "true", "homed": "true", "namespace": "left", "debug": "false",
             "table": "false"}  # fmt: skip
    with (
        launched(site, prefix, MOVEIT.name, "complete", **given) as run,
        site.clients() as ros,
    ):
        run.spawned(4)
        ros.namespace = "/left"
        assert listed(run, "/left/controller_manager") == states(VELOCITY, HOMING, GRIPPER)
        shown = run.recorded("move_group", "rviz2")
        assert set(shown) == {"move_group", "rviz2"}
        config = prefix / "share" / MOVEIT.name / "config/moveit.rviz"
        words, texts = shown["rviz2"]
        assert words[:2] == ["-d", str(config)]
        for name, (given_words, _) in shown.items():
            assert "__ns:=/left" in given_words, name
        assert any("robot_description_kinematics" in text for text in texts)
        model = description(shown["move_group"][1])
        assert model.find("link[@name='table']") is None
        moved(ros, VELOCITY, JOINTS)


def test_move_group_has_the_description_and_does_not_publish_it(site: Rig, prefix: Path) -> None:
    """The topic robot_description is the node's: the original's move_group overwrote it."""
    with launched(site, prefix, MOVEIT.name, "move_group") as run:
        _, texts = run.recorded("move_group")["move_group"]
    (parameters,) = (yaml.full_load(text)["/**"]["ros__parameters"] for text in texts)
    model = ET.fromstring(parameters["robot_description"])
    assert model.attrib["name"] == "scene"
    assert model.find("link[@name='table']") is not None
    assert ET.fromstring(parameters["robot_description_semantic"]).attrib["name"] == "scene"
    assert not parameters["publish_robot_description"]
    assert parameters["publish_robot_description_semantic"]
    files = {path.name.removesuffix("_planning.yaml") for path in MOVEIT.glob("config/*_planning*")}
    assert set(parameters["planning_pipelines"]) == files
    assert parameters["default_planning_pipeline"] == "ompl"
    assert "capabilities" not in parameters


def test_the_task_constructor_is_used_where_it_is_installed(
    site: Rig, prefix: Path, tmp_path: Path
) -> None:
    name = "moveit_task_constructor_capabilities"
    marker = tmp_path / "share/ament_index/resource_index/packages" / name
    marker.parent.mkdir(parents=True)
    marker.touch()
    (tmp_path / "share" / name).mkdir()
    with launched(site, prefix, MOVEIT.name, "move_group", packages=tmp_path) as run:
        _, texts = run.recorded("move_group")["move_group"]
    given = yaml.full_load(texts[-1])["/**"]["ros__parameters"]
    assert given == {"capabilities": "move_group/ExecuteTaskSolutionCapability"}


def test_the_windows_of_moveit(site: Rig, prefix: Path) -> None:
    given: dict[str, Any] = {"rviz_config": "mine.rviz", "namespace": "left", "debug": "false"}
    with (
        launched(site, prefix, MOVEIT.name, "moveit_rviz", **given) as rviz,
        launched(site, prefix, MOVEIT.name, "setup_assistant", debug="false") as assistant,
    ):
        words, _ = rviz.recorded("rviz2")["rviz2"]
        assert words[:2] == ["-d", "mine.rviz"]
        words, _ = assistant.recorded("moveit_setup_assistant")["moveit_setup_assistant"]
        assert words[0] == f"--config_pkg={prefix / 'share' / MOVEIT.name}"


@pytest.mark.parametrize("package", DESCRIPTIONS)
def test_view_shows_sliders_or_publishes_without_a_window(
    site: Rig, prefix: Path, package: str
) -> None:
    given = {"prefix": "left_", "use_mock_hardware": "true", "namespace": "lab"}
    gripper = package == "bioscara_gripper_descriptions"
    macro = {} if gripper else {"arm_macro": "bioscara_arm.xacro"}
    with (
        launched(site, prefix, package, "view", **given) as shown,
        launched(site, prefix, package, "view", gui="false", **macro) as hidden,
    ):
        programs = shown.recorded("robot_state_publisher", "joint_state_publisher_gui", "rviz2")
        assert len(programs) == 3
        assert all("__ns:=/lab" in words for words, _ in programs.values())
        root = description(programs["robot_state_publisher"][1])
        assert root.findall("link[@name='left_tool']") or package == "bioscara_arm_description"
        assert {each.text for each in root.iter("plugin")} == {"mock_components/GenericSystem"}
        programs = hidden.recorded("robot_state_publisher", "joint_state_publisher")
        assert len(programs) == 2


DICTIONARY = """
from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch_ros.actions import Node

FILES = {files}

def generate_launch_description():
    spawners = [
        Node(package="controller_manager", executable="spawner", arguments=[name, "--inactive"])
        for name in ("joint_state_broadcaster", "velocity_joint_trajectory_controller",
                     "homing_controller", "gripper_controller")
    ]
    shared = get_package_share_directory("bioscara_arm_description") + "/launch/"
    return LaunchDescription([
        IncludeLaunchDescription(shared + "temporary_files.py"),
        Node(package="bioscara_ros", executable="controller_manager_node",
             arguments=["--bus", "sim"], output="screen",
             parameters=[{{"robot_description": {urdf!r}, "of_others": {{"gain": 1.0}}}}, *FILES]),
        *spawners,
    ])
"""


def test_a_launch_file_of_ones_own_gives_the_description_to_all_nodes(
    site: Rig, prefix: Path, tmp_path: Path
) -> None:
    """launch writes a dictionary of parameters below ``/**``: each controller's node has it."""
    file = tmp_path / "own.launch.py"
    text = DICTIONARY.format(files=[str(path) for path in CONFIGS], urdf=URDF.read_text())
    file.write_text(text)
    with launched(site, prefix, "", str(tmp_path / "own")) as run:
        run.spawned(4)
        assert listed(run) == dict.fromkeys((BROADCASTER, VELOCITY, HOMING, GRIPPER), "inactive")
        assert f"[{VELOCITY}]: of_others.gain: ignored" in run.log
        assert "robot_description: ignored" not in run.log


def test_a_real_arm_cannot_start_homed(site: Rig, prefix: Path) -> None:
    with ExitStack() as running:
        for package, file in BRINGUPS:
            if file == "bioscara_gripper":
                continue  # there is nothing to home
            run = running.enter_context(launched(site, prefix, package, file, ends=1, homed="true"))
            run.says("homed:=true is for the simulated arm")
            assert "process started" not in run.log


@pytest.mark.skipif(Path("/dev/i2c-1").exists(), reason="this computer has a bus, and an arm on it")
def test_without_a_bus_everything_ends_and_the_reason_is_printed(site: Rig, prefix: Path) -> None:
    with ExitStack() as running:
        runs = [
            running.enter_context(launched(site, prefix, package, file, ends=0))
            for package, file in BRINGUPS
        ]
        for run in runs:
            run.says("/dev/i2c-1 does not exist")


def test_an_argument_that_has_choices_takes_no_other(site: Rig, prefix: Path) -> None:
    given = {"robot_controller": GRIPPER, "use_mock_hardware": "true"}
    with launched(site, prefix, "bioscara_arm_bringup", "bioscara_arm", ends=1, **given) as run:
        run.says("Valid options are: ['velocity_joint_trajectory_controller'")


def test_a_model_in_gazebo_follows_the_simulated_arm(site: Rig, prefix: Path) -> None:
    given = {"homed": "true", "gui": "false", "table": "false", "z": "0.5", "namespace": "left"}
    joints = [*JOINTS, "gripper", "gripper_l_mimic", "gripper_r_mimic"]
    with (
        launched(site, prefix, "scene_bringup", "gazebo", **given) as run,
        site.clients() as ros,
    ):
        run.spawned(4)
        ros.namespace = "/left"
        shown = run.recorded("gz_sim", "create", "parameter_bridge")
        assert shown["gz_sim"][0] == ["-r empty.sdf -s", "true", f"{prefix}/share"]
        words, texts = shown["create"]
        assert words[:6] == ["-name", "left", "-param", "robot_description", "-z", "0.5"]
        model = description(texts)
        assert model.find("link[@name='table']") is None
        topics = [topic.text for topic in model.iter("topic")]
        assert topics == [f"/left/gazebo/{joint}/position" for joint in joints]
        clock, *bridged = shown["parameter_bridge"][0][:8]
        assert clock == "/clock@rosgraph_msgs/msg/Clock[gz.msgs.Clock"
        assert bridged == [f"{topic}@std_msgs/msg/Float64]gz.msgs.Double" for topic in topics]
        for topic in topics:
            ros.do("listen", type="std_msgs/Float64", topic=topic)
        moved(ros, VELOCITY, JOINTS)
        at = positions(ros, JOINTS)
        sent = [ros.do("heard", topic=topic)[-1][1]["data"] for topic in topics[:4]]
        assert sent == pytest.approx(at, abs=2e-3)
