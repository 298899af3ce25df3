"""Rule 7: each package, program, file and argument in a launch file exists or is declared.

Run with a stand-in for ``launch`` and ``launch_ros``: see launch_stand_in.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from ros.launch_stand_in import Launch, MoveItConfigs, Started
from ros.share import INTERFACES, MOVEIT, NAMES, PACKAGES, parameters_of

JTC = "velocity_joint_trajectory_controller"
ARGUMENTS: dict[tuple[str, str], dict[str, str]] = {
    ("scene_bringup", "launch/bioscara_arm_gripper128"): {
        "use_mock_hardware": "false", "gui": "false",
    },
    ("scene_bringup", "launch/simulated_arm"): {"gui": "true"},
    ("scene_bringup", "launch/served_arm"): {"arm": "arm", "gui": "true"},
    ("bioscara_arm_bringup", "bioscara_arm"): {
        "controllers_file": "bioscara_arm_controllers.yaml",
        "controller_manager_file": "bioscara_controller_manager.yaml",
        "arm_description_package": "bioscara_arm_description",
        "arm_macro": "bioscara_arm.xacro",
        "prefix": "", "use_mock_hardware": "false", "robot_controller": JTC, "gui": "true",
    },
    ("bioscara_arm_bringup", "test_joint_trajectory_controller"): {},
    ("bioscara_gripper_bringup", "bioscara_gripper"): {
        "controllers_file": "bioscara_gripper_controllers.yaml",
        "controller_manager_file": "bioscara_gripper_controller_manager.yaml",
        "gripper_description_package": "bioscara_gripper_descriptions",
        "gripper_macro": "bioscara_gripper_128.xacro",
        "prefix": "", "use_mock_hardware": "false", "robot_controller": "gripper_controller",
        "gui": "true",
    },
    ("bioscara_arm_description", "launch/view"): {
        "prefix": "", "arm_macro": "bioscara_arm.xacro", "use_mock_hardware": "false",
        "gui": "true",
    },
    ("bioscara_gripper_descriptions", "launch/view"): {
        "prefix": "", "gripper_macro": "bioscara_gripper_128.xacro", "use_mock_hardware": "false",
        "gui": "true",
    },
    ("scene_descriptions", "launch/view"): {
        "prefix": "", "arm_description_package": "bioscara_arm_description",
        "arm_macro": "bioscara_arm.xacro",
        "gripper_description_package": "bioscara_gripper_descriptions",
        "gripper_macro": "bioscara_gripper_128.xacro", "use_mock_hardware": "false", "gui": "true",
    },
    ("bioscara_arm_gripper_128_moveit_config", "launch/move_group"): {},
    ("bioscara_arm_gripper_128_moveit_config", "launch/moveit_rviz"): {},
    ("bioscara_arm_gripper_128_moveit_config", "launch/setup_assistant"): {},
}  # fmt: skip
"""Arguments with their defaults: those of the existing arm's launch files, and of our own."""
BRINGUPS = [
    ("scene_bringup", "launch/bioscara_arm_gripper128"),
    ("bioscara_arm_bringup", "bioscara_arm"),
    ("bioscara_gripper_bringup", "bioscara_gripper"),
]
LaunchFile = Callable[..., Launch]


@pytest.fixture
def launch(prefix: Path) -> LaunchFile:
    """Return a function that launches a file of a package."""

    def run(package: str, file: str, **given: str) -> Launch:
        return Launch(prefix, prefix / "share" / package / f"{file}.launch.py", given)

    return run


def node_of(launched: Launch) -> Started:
    (node,) = (each for each in launched.started if each.package == "bioscara_ros")
    return node


def files_of(node: Started) -> list[Path]:
    return [Path(each) for each in node.parameters if isinstance(each, str)]


def description_of(node: Started) -> ET.Element:
    (given,) = (each for each in node.parameters if isinstance(each, dict))
    return ET.fromstring(given["robot_description"])


def test_every_launch_file_is_listed_once(prefix: Path) -> None:
    there = [
        (name, place.removesuffix(".launch.py"))
        for name in NAMES
        for place in launch_files(prefix / "share" / name)
    ]
    # That of Gazebo includes files of other packages, which the stand-in does not have.
    others = [("bioscara_ros", "launch/bringup"), ("scene_bringup", "launch/gazebo")]
    assert sorted(there) == sorted([*ARGUMENTS, *others])
    for name in NAMES:
        files = [Path(file).name for package, file in there if package == name]
        assert len(files) == len(set(files))


def launch_files(share: Path) -> list[str]:
    """Return the launch files of a package, by their places below its share folder."""
    folders = [share, share / "launch"]
    found = [path for folder in folders for path in folder.glob("*.launch.py")]
    return [path.relative_to(share).as_posix() for path in found]


@pytest.mark.parametrize(("package", "file"), ARGUMENTS, ids=map("/".join, ARGUMENTS))
def test_rule_7_the_arguments_have_the_names_and_defaults_of_the_original(
    launch: LaunchFile, package: str, file: str
) -> None:
    assert launch(package, file).arguments == ARGUMENTS[package, file]


@pytest.mark.parametrize(("package", "file"), ARGUMENTS, ids=map("/".join, ARGUMENTS))
def test_rule_7_programs_files_and_dependencies_exist(
    launch: LaunchFile, prefix: Path, package: str, file: str
) -> None:
    given = ({}, {"gui": "false"}, {"gui": "true", "use_mock_hardware": "true"})
    for arguments in given:
        for each in launch(package, file, **arguments).started:
            assert each.name is None
            if each.package in NAMES:
                program = prefix / "lib" / each.package / each.executable
                assert program.stat().st_mode & 0o111
            paths = [word for word in (*each.arguments, *each.parameters)
                     if isinstance(word, str) and word.startswith("/")]  # fmt: skip
            for path in paths:
                assert Path(path).is_file() or path == "/controller_manager"


def own(name: str) -> set[str]:
    root = ET.parse(PACKAGES / name / "package.xml").getroot()
    return {tag.text or "" for tag in root.findall("exec_depend")}


@pytest.mark.parametrize("name", NAMES)
def test_rule_7_the_packages_that_files_name_are_declared(name: str) -> None:
    imported = {"yaml": "python3-yaml"}
    standard = {"__future__", "os", "typing", "xml", "tempfile", "collections", "contextlib"}
    used: set[str] = set()
    for path in (PACKAGES / name).glob("launch/*.py"):
        text = path.read_text()
        used |= set(re.findall(r'package="(\w+)"', text))
        used |= set(re.findall(r'FindPackageShare\("(\w+)"\)', text))
        used |= set(re.findall(r'[ (]file\("(\w+)"', text))
        used |= set(re.findall(r"(?::=|default_value=\")(\w+_descriptions?)\b", text))
        modules = re.findall(r"^(?:from|import) (\w+)", text, re.MULTILINE)
        used |= {imported.get(module, module) for module in modules if module not in standard}
        if 'FindExecutable(name="xacro")' in text:
            used.add("xacro")
    for path in (PACKAGES / name).glob("scripts/*"):
        # Imported in main: the others are those of Python.
        used |= set(re.findall(r"^    (?:from|import) (\w+)", path.read_text(), re.MULTILINE))
    for path in (PACKAGES / name).glob("urdf/*"):
        used |= set(re.findall(r"\$\(find (\w+)\)", path.read_text()))
        used |= set(re.findall(r'default="(\w+_descriptions?)"', path.read_text()))
    assert used - {name} <= own(name)


def test_rule_7_what_is_listed_is_known() -> None:
    """Each dependency is a package of ours or one that these files are known to use."""
    known = {
        "ament_index_python", "builtin_interfaces", "control_msgs", "controller_manager",
        "controller_manager_msgs", "diagnostic_msgs", "joint_state_publisher",
        "joint_state_publisher_gui", "launch", "launch_ros", "moveit_configs_utils",
        "moveit_planners_ompl", "moveit_ros_move_group", "moveit_ros_visualization",
        "moveit_setup_assistant", "moveit_simple_controller_manager", "pal_statistics_msgs",
        "pick_ik", "pilz_industrial_motion_planner", "python3-yaml", "rclpy",
        "robot_state_publisher", "ros_gz_bridge", "ros_gz_sim", "rqt_joint_trajectory_controller",
        "rviz2", "sensor_msgs", "std_msgs", "tf2_msgs", "trajectory_msgs", "xacro",
    }  # fmt: skip
    everything = set().union(*(own(name) for name in NAMES))
    assert everything - {*NAMES, INTERFACES} == known


@pytest.mark.parametrize(
    ("given", "words"),
    [({}, ["--bus", "linux:1"]), ({"use_mock_hardware": "true"}, ["--bus", "sim"])],
    ids=["real", "simulated"],
)
@pytest.mark.parametrize(("package", "file"), BRINGUPS, ids=map("/".join, BRINGUPS))
def test_the_node_drives_the_arm_that_was_chosen(
    launch: LaunchFile, package: str, file: str, given: dict[str, str], words: list[str]
) -> None:
    node = node_of(launch(package, file, **given))
    assert (node.executable, node.arguments) == ("controller_manager_node", words)
    # Its own nodes keep their names, and its end does not leave the others running.
    assert (node.name, node.ends, node.output) == (None, True, "both")
    plugins = {plugin.text for plugin in description_of(node).iter("plugin")}
    assert ("mock_components/GenericSystem" in plugins) == bool(given)


def test_the_simulated_and_the_served_arm(launch: LaunchFile) -> None:
    simulated = launch("scene_bringup", "launch/simulated_arm")
    assert node_of(simulated).arguments == ["--bus", "sim"]
    assert "rviz2" in {each.package for each in simulated.started}
    assert node_of(launch("scene_bringup", "launch/served_arm")).arguments == ["--arm", "arm"]
    left = launch("scene_bringup", "launch/served_arm", arm="left", gui="false")
    assert node_of(left).arguments == ["--arm", "left"]
    assert "rviz2" not in {each.package for each in left.started}


def test_parameters_come_in_the_order_manager_arm_gripper(launch: LaunchFile) -> None:
    node = node_of(launch("scene_bringup", "launch/bioscara_arm_gripper128"))
    assert isinstance(node.parameters[0], dict)
    assert [path.name for path in files_of(node)] == [
        "bioscara_controller_manager.yaml",
        "bioscara_arm_controllers.yaml",
        "bioscara_gripper_controllers.yaml",
    ]
    assert description_of(node).attrib["name"] == "scene"


@pytest.mark.parametrize(
    ("package", "file", "controllers", "gui", "always"),
    [
        (*BRINGUPS[0], [JTC, "homing_controller", "gripper_controller"],
         {"rviz2", "rqt_joint_trajectory_controller"}, set()),
        (*BRINGUPS[1], [JTC, "homing_controller"], {"rviz2"},
         {"rqt_joint_trajectory_controller"}),
        (*BRINGUPS[2], ["gripper_controller"], {"rviz2"}, set()),
    ],
)  # fmt: skip
def test_the_broadcaster_comes_first_and_the_others_stay_inactive(
    launch: LaunchFile, package: str, file: str, controllers: list[str], gui: set[str],
    always: set[str],
) -> None:  # fmt: skip
    for shown in ("true", "false"):
        node, broadcaster, *later = launch(package, file, gui=shown).started
        assert node.after == broadcaster.after == ""
        assert (broadcaster.package, broadcaster.executable) == ("controller_manager", "spawner")
        assert broadcaster.arguments == ["joint_state_broadcaster", "-c", "/controller_manager"]
        assert {each.after for each in later} == {"spawner joint_state_broadcaster"}
        spawned = [each.arguments for each in later if each.executable == "spawner"]
        assert spawned == [
            [name, "-c", "/controller_manager", "--inactive"] for name in controllers
        ]
        windows = {each.executable for each in later if each.executable != "spawner"}
        assert windows == (gui | always if shown == "true" else always)


def test_the_arm_takes_one_of_two_controllers(launch: LaunchFile) -> None:
    other = "position_joint_trajectory_controller"
    started = launch(*BRINGUPS[1], robot_controller=other).started
    assert [other, "-c", "/controller_manager", "--inactive"] in [
        each.arguments for each in started
    ]
    with pytest.raises(ValueError, match="robot_controller is gripper_controller, not one of"):
        launch(*BRINGUPS[1], robot_controller="gripper_controller")


def test_controllers_may_come_from_a_file_elsewhere(launch: LaunchFile, tmp_path: Path) -> None:
    own_file = tmp_path / "own.yaml"
    own_file.write_text("controller_manager: {ros__parameters: {}}\n")
    node = node_of(launch(*BRINGUPS[1], controllers_file=str(own_file)))
    assert files_of(node)[1] == own_file


@pytest.mark.parametrize(("package", "file"), BRINGUPS[1:], ids=map("/".join, BRINGUPS[1:]))
def test_a_prefix_reaches_description_components_and_controllers(
    launch: LaunchFile, package: str, file: str
) -> None:
    plain, node = (node_of(launch(package, file, prefix=each)) for each in ("", "left_"))
    root = description_of(node)
    controlled = {joint.attrib["name"] for joint in root.iterfind("ros2_control/joint")}
    assert all(name.startswith("left_") for name in controlled)
    (component,) = (each.attrib["name"] for each in root.iterfind("ros2_control"))
    assert component.startswith("left_bioscara_")
    before, after = ([yaml.safe_load(path.read_text()) for path in files_of(each)]
                     for each in (plain, node))  # fmt: skip

    def names(value: Any) -> list[str]:
        if isinstance(value, dict):
            return [text for pair in value.items() for each in pair for text in names(each)]
        if isinstance(value, list):
            return [text for each in value for text in names(each)]
        return [value] if isinstance(value, str) else []

    unprefixed = {name.removeprefix("left_") for name in controlled}
    wanted = [f"left_{name}" if name in unprefixed else name for name in names(before)]
    assert sorted(names(after)) == sorted(wanted)
    assert wanted != names(before)
    controllers = {"bioscara_arm": JTC, "bioscara_gripper": "gripper_controller"}
    values = parameters_of(controllers[file], *files_of(node))
    joints = values.get("joints", [values.get("joint")])
    assert set(joints) == controlled
    if file == "bioscara_arm":
        assert values["gains.left_j3.p"] == 5.0
        homing = parameters_of("homing_controller", *files_of(node))
        assert homing["command_interfaces.joints.left_j1.interfaces"] == ["home"]


def test_moveit_has_the_description_and_does_not_publish_it(launch: LaunchFile) -> None:
    """The topic robot_description is the node's: the original's move_group overwrote it."""
    (move_group,) = launch(MOVEIT.name, "launch/move_group").started
    assert (move_group.package, move_group.executable) == ("moveit_ros_move_group", "move_group")
    (config,) = move_group.parameters
    assert isinstance(config, MoveItConfigs)
    assert config.calls["robot"] == "scene"
    assert config.calls["package"] == MOVEIT.name
    assert config.calls["robot_description"]["mappings"] == {
        "gripper_description_package": "bioscara_gripper_descriptions"
    }
    assert config.calls["planning_scene_monitor"] == {
        "publish_robot_description": False, "publish_robot_description_semantic": True,
    }  # fmt: skip
    pipelines = config.calls["planning_pipelines"]
    files = {path.name.removesuffix("_planning.yaml") for path in MOVEIT.glob("config/*_planning*")}
    assert set(pipelines["pipelines"]) == files
    assert pipelines["default_planning_pipeline"] == "ompl"


def test_the_task_constructor_is_used_where_it_is_installed(
    launch: LaunchFile, prefix: Path
) -> None:
    package = prefix / "share/moveit_task_constructor_capabilities"
    package.mkdir()
    try:
        (move_group,) = launch(MOVEIT.name, "launch/move_group").started
    finally:
        package.rmdir()
    assert move_group.parameters[1:] == [
        {"capabilities": "move_group/ExecuteTaskSolutionCapability"}
    ]


@pytest.mark.parametrize("kind", ["moveit_rviz", "setup_assistant"])
def test_moveit_writes_its_own_launch_descriptions(launch: LaunchFile, kind: str) -> None:
    """They have the arguments debug and, for RViz, rviz_config: config/moveit.rviz by default."""
    (generated,) = launch(MOVEIT.name, f"launch/{kind}").generated
    assert generated.kind == kind
    assert generated.config.calls["package"] == MOVEIT.name
    assert (MOVEIT / "config/moveit.rviz").is_file()


@pytest.mark.parametrize(
    "package", ["bioscara_arm_description", "bioscara_gripper_descriptions", "scene_descriptions"]
)
def test_view_shows_sliders_or_publishes_without_a_window(launch: LaunchFile, package: str) -> None:
    shown = launch(package, "launch/view", prefix="left_", use_mock_hardware="true")
    assert [each.executable for each in shown.started] == [
        "robot_state_publisher", "joint_state_publisher_gui", "rviz2",
    ]  # fmt: skip
    (given,) = shown.started[0].parameters
    root = ET.fromstring(given["robot_description"])
    assert root.findall("link[@name='left_tool']") or package == "bioscara_arm_description"
    assert {each.text for each in root.iter("plugin")} == {"mock_components/GenericSystem"}
    hidden = launch(package, "launch/view", gui="false").started
    assert [each.executable for each in hidden] == [
        "robot_state_publisher", "joint_state_publisher",
    ]  # fmt: skip
