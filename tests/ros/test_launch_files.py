"""Rule 7: the launch files, their arguments, and the packages that they declare.

The arguments are those that ROS 2's own launch finds; one launch file is run by it. The others are
run in test_every_launch.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from ros.bringup_controllers import GRIPPER, HOMING, JOINTS, VELOCITY
from ros.launched import launch_environment, launched, listed, moved, states
from ros.rig import rig
from ros.share import INTERFACES, MOVEIT, NAMES, PACKAGES
from ros_environment import ros_environment, ros_python

LISTING = Path(__file__).with_name("launch_arguments.py")

VIEW = {"prefix": "", "use_mock_hardware": "false", "gui": "true", "namespace": ""}
TABLE = {"table": "true"}
CONTROL = {"use_mock_hardware": "false", "homed": "false", "namespace": ""}
RVIZ = {"debug": "False", "rviz_config": "PREFIX/config/moveit.rviz"}
ARGUMENTS: dict[tuple[str, str], dict[str, str]] = {
    ("scene_bringup", "launch/bioscara_arm_gripper128"): {**CONTROL, **TABLE, "gui": "false"},
    ("scene_bringup", "launch/simulated_arm"): {
        "homed": "false", **TABLE, "namespace": "", "gui": "true",
    },
    ("scene_bringup", "launch/served_arm"): {
        "arm": "arm", **TABLE, "namespace": "", "gui": "true",
    },
    ("scene_bringup", "launch/gazebo"): {
        "world": "empty.sdf", "z": "0.32", "homed": "false", **TABLE, "namespace": "",
        "gui": "true",
    },
    ("bioscara_arm_bringup", "bioscara_arm"): {
        "controllers_file": "bioscara_arm_controllers.yaml",
        "controller_manager_file": "bioscara_controller_manager.yaml",
        "arm_description_package": "bioscara_arm_description",
        "arm_macro": "bioscara_arm.xacro",
        "prefix": "", **CONTROL, "robot_controller": VELOCITY, "gui": "true",
    },
    ("bioscara_arm_bringup", "test_joint_trajectory_controller"): {"namespace": ""},
    ("bioscara_gripper_bringup", "bioscara_gripper"): {
        "controllers_file": "bioscara_gripper_controllers.yaml",
        "controller_manager_file": "bioscara_gripper_controller_manager.yaml",
        "gripper_description_package": "bioscara_gripper_descriptions",
        "gripper_macro": "bioscara_gripper_128.xacro",
        "prefix": "", "use_mock_hardware": "false", "namespace": "", "robot_controller": GRIPPER,
        "gui": "true",
    },
    ("bioscara_arm_description", "launch/view"): {**VIEW, "arm_macro": "bioscara_arm.xacro"},
    ("bioscara_gripper_descriptions", "launch/view"): {
        **VIEW, "gripper_macro": "bioscara_gripper_128.xacro",
    },
    ("scene_descriptions", "launch/view"): {
        **VIEW, "arm_description_package": "bioscara_arm_description",
        "arm_macro": "bioscara_arm.xacro",
        "gripper_description_package": "bioscara_gripper_descriptions",
        "gripper_macro": "bioscara_gripper_128.xacro", **TABLE,
    },
    (MOVEIT.name, "launch/complete"): {**CONTROL, **TABLE, **RVIZ},
    (MOVEIT.name, "launch/move_group"): {"namespace": "", **TABLE},
    (MOVEIT.name, "launch/moveit_rviz"): {"namespace": "", **RVIZ},
    (MOVEIT.name, "launch/setup_assistant"): {"debug": "False"},
}  # fmt: skip
"""Arguments with their defaults: those of the existing arm's launch files, and of our own."""


def test_every_launch_file_is_listed_once(prefix: Path) -> None:
    there = [
        (name, path.relative_to(prefix / "share" / name).as_posix().removesuffix(".launch.py"))
        for name in NAMES
        for path in (prefix / "share" / name).rglob("*.launch.py")
    ]
    assert sorted(there) == sorted(ARGUMENTS)
    for name in NAMES:
        files = [Path(file).name for package, file in there if package == name]
        assert len(files) == len(set(files))


def test_rule_7_the_arguments_have_the_names_and_defaults_of_the_original(
    prefix: Path, tmp_path: Path
) -> None:
    """As ``ros2 launch --show-args`` lists them: none that is only for included files."""
    files = [f"{prefix}/share/{package}/{file}.launch.py" for package, file in ARGUMENTS]
    done = subprocess.run(
        [ros_python(), LISTING, *files], check=True,
        env=launch_environment(prefix, tmp_path, ros_environment()),
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    listed = json.loads(done.stdout.replace(f"{prefix}/share/{MOVEIT.name}", "PREFIX"))
    assert dict(zip(ARGUMENTS, listed, strict=True)) == ARGUMENTS


@pytest.mark.ros
@pytest.mark.path
def test_the_simulated_arm_is_launched_homed_and_moves(prefix: Path) -> None:
    with (
        rig(6) as site,
        launched(site, prefix, "scene_bringup", "simulated_arm", homed="true", gui="false") as run,
        site.clients() as ros,
    ):
        run.spawned(4)
        assert listed(run) == states(VELOCITY, HOMING, GRIPPER)
        moved(ros, VELOCITY, JOINTS)


PACKAGE_OF = {
    "default_planning_request_adapters": "moveit_ros_planning",
    "default_planning_response_adapters": "moveit_ros_planning",
    "moveit_rviz_plugin": "moveit_ros_visualization",
    "ompl_interface": "moveit_planners_ompl",
    "yaml": "python3-yaml",
}
"""Packages by their content that has another name."""


def own(name: str) -> set[str]:
    root = ET.parse(PACKAGES / name / "package.xml").getroot()
    return {tag.text or "" for tag in root.findall("exec_depend")}


@pytest.mark.parametrize("name", NAMES)
def test_rule_7_the_packages_that_files_name_are_declared(name: str) -> None:
    used: set[str] = set()
    for path in (PACKAGES / name).glob("launch/*.py"):
        text = path.read_text()
        used |= set(re.findall(r'package="(\w+)"', text))
        used |= set(re.findall(r'FindPackageShare\("(\w+)"\)', text))
        used |= set(re.findall(r'[ (]file\("(\w+)"', text))
        used |= set(re.findall(r"(?::=|\(\s*\")(\w+_descriptions?)\b", text))
        used |= set(re.findall(r'included\(\s*"(\w+)"', text))
        used |= imports(text)
        if 'FindExecutable(name="xacro")' in text:
            used.add("xacro")
    for path in (PACKAGES / name).glob("scripts/*"):
        # Imported in main: the others are those of Python.
        used |= set(re.findall(r"^    (?:from|import) (\w+)", path.read_text(), re.MULTILINE))
    for path in (PACKAGES / name).glob("urdf/*"):
        used |= set(re.findall(r"\$\(find (\w+)\)", path.read_text()))
        used |= set(re.findall(r'default="(\w+_descriptions?)"', path.read_text()))
    for path in (PACKAGES / name).glob("*/*.rviz"):
        used |= set(re.findall(r"Class: (\w+)/", path.read_text()))
    for path in (PACKAGES / name).glob("config/*.yaml"):
        if name == MOVEIT.name:
            used |= set(re.findall(r"(?:- |: )(\w+)/\w+\n", path.read_text()))
    if name == "bioscara_ros":
        # The program of the node is in the distribution of Python.
        for path in (PACKAGES.parent / "src/bioscara/ros").rglob("*.py"):
            used |= imports(path.read_text()) - {"bioscara", "msgspec", "ruamel"}
    assert {PACKAGE_OF.get(each, each) for each in used} - {name} <= own(name)


def imports(text: str) -> set[str]:
    """Return the modules that a program imports, without those of Python itself."""
    lines = r"^ *(?:from (\w+)\S* import |import (\w+)(?: as \w+)?$)"
    found = {name for pair in re.findall(lines, text, re.MULTILINE) for name in pair if name}
    return found - sys.stdlib_module_names


def test_rule_7_what_is_listed_is_known() -> None:
    """Each dependency is a package of ours or one that these files are known to use."""
    known = {
        "ament_index_python", "builtin_interfaces", "control_msgs", "controller_manager",
        "controller_manager_msgs", "diagnostic_msgs", "geometry_msgs", "joint_state_publisher",
        "joint_state_publisher_gui", "launch", "launch_ros", "lifecycle_msgs",
        "moveit_configs_utils", "moveit_planners_ompl", "moveit_ros_move_group",
        "moveit_ros_planning", "moveit_ros_visualization", "moveit_setup_assistant",
        "moveit_simple_controller_manager", "pal_statistics_msgs", "pick_ik",
        "pilz_industrial_motion_planner", "python3-yaml", "rcl_interfaces", "rclpy",
        "robot_state_publisher", "ros_gz_bridge", "ros_gz_sim", "rqt_joint_trajectory_controller",
        "rviz2", "rviz_common", "rviz_default_plugins", "sensor_msgs", "std_msgs", "std_srvs",
        "tf2_msgs", "trajectory_msgs", "visualization_msgs", "xacro",
    }  # fmt: skip
    everything = set().union(*(own(name) for name in NAMES))
    assert everything - {*NAMES, INTERFACES} == known
