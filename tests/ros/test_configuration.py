"""Names and limits agree between URDF, SRDF, controllers and MoveIt.

The rules of a MoveIt configuration by number: 1 names and links, 2 states and groups, 3 limits,
4 controllers, 5 planners, 6 meshes and collision pairs; those of its launch files, 7, are in
test_launch_files.
"""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from bioscara.control.manager.registry import TYPES
from bioscara.model import load_parameters
from ros.share import MOVEIT, PACKAGES, load, parameters_of, scene

ARM = load_parameters()
JOINTS = [joint.name for joint in ARM.joints]
SRDF = ET.parse(MOVEIT / "config/scene.srdf").getroot()
GROUPS = {group.attrib["name"]: group for group in SRDF.findall("group")}
SEPARATE = ("arm", "gripper")
"""Groups of which each has a controller of its own; arm_gripper is both together."""
LIMITS = load(MOVEIT / "config/joint_limits.yaml")
PIPELINES = {
    path.name.removesuffix("_planning.yaml"): load(path)
    for path in MOVEIT.glob("config/*_planning.yaml")
}
ARM_FILES = [
    PACKAGES / "bioscara_arm_bringup/config" / name
    for name in ("bioscara_controller_manager.yaml", "bioscara_arm_controllers.yaml")
]
GRIPPER_FILES = [
    PACKAGES / "bioscara_gripper_bringup/config" / name
    for name in ("bioscara_gripper_controller_manager.yaml", "bioscara_gripper_controllers.yaml")
]
MANAGER = parameters_of("controller_manager", *ARM_FILES, GRIPPER_FILES[1])
TRAJECTORY = ("velocity_joint_trajectory_controller", "position_joint_trajectory_controller")


@pytest.fixture(scope="module")
def urdf(prefix: Path) -> ET.Element:
    """Return the description of the arm with its gripper."""
    return scene(prefix)


def joints_of(group: ET.Element, urdf: ET.Element) -> list[str]:
    """Return the movable joints of a group, in order."""
    names = [joint.attrib["name"] for joint in group.findall("joint")]
    for part in group.findall("group"):
        names += joints_of(GROUPS[part.attrib["name"]], urdf)
    by_child = {next(each.iter("child")).attrib["link"]: each for each in urdf.findall("joint")}
    for chain in group.findall("chain"):
        found, link = [], chain.attrib["tip_link"]
        while link != chain.attrib["base_link"]:
            joint = by_child[link]
            if joint.attrib["type"] != "fixed":
                found.append(joint.attrib["name"])
            link = next(joint.iter("parent")).attrib["link"]
        names += reversed(found)
    return names


def movable(urdf: ET.Element) -> dict[str, ET.Element]:
    """Return the movable joints of a description."""
    joints = urdf.findall("joint")
    return {each.attrib["name"]: each for each in joints if each.attrib["type"] != "fixed"}


def limit(joint: ET.Element, name: str) -> float:
    return float(next(joint.iter("limit")).attrib[name])


def interfaces(urdf: ET.Element, tag: str) -> set[str]:
    """Return the interfaces of the components, as joint/interface."""
    return {
        f"{joint.attrib['name']}/{part.attrib['name']}"
        for joint in urdf.iterfind("ros2_control/joint")
        for part in joint.findall(tag)
    }


def test_rule_1_every_yaml_file_loads() -> None:
    files = [*PACKAGES.rglob("*.yaml"), *PACKAGES.rglob("*.rviz"), MOVEIT / ".setup_assistant"]
    assert len(files) > 10
    assert [path for path in files if not isinstance(load(path), dict)] == []


def test_rule_1_the_srdf_names_the_robot_and_its_parts(urdf: ET.Element) -> None:
    assert SRDF.attrib["name"] == urdf.attrib["name"] == "scene"
    links = {link.attrib["name"] for link in urdf.findall("link")}
    joints = {joint.attrib["name"] for joint in urdf.findall("joint")}
    for tag in SRDF.iter():
        for name, value in tag.attrib.items():
            if name in {"link1", "link2", "base_link", "tip_link", "parent_link"}:
                assert value in links
            if name == "group":
                assert value in GROUPS
    named = [*SRDF.iter("joint"), *SRDF.iter("passive_joint")]
    assert {tag.attrib["name"] for tag in named} <= joints


def test_rule_1_the_models_frame_is_the_world(urdf: ET.Element) -> None:
    """Without a virtual joint MoveIt takes the root link; with one, its parent frame."""
    assert SRDF.findall("virtual_joint") == []
    children = {next(joint.iter("child")).attrib["link"] for joint in urdf.findall("joint")}
    roots = {link.attrib["name"] for link in urdf.findall("link")} - children
    assert roots == {"world"}


def test_rule_2_states_are_inside_the_limits(urdf: ET.Element) -> None:
    joints = movable(urdf)
    states = SRDF.findall("group_state")
    assert {state.attrib["name"] for state in states} == {
        "center", "open", "close", "close_75", "close_40",
    }  # fmt: skip
    for state in states:
        group = joints_of(GROUPS[state.attrib["group"]], urdf)
        assert [joint.attrib["name"] for joint in state] == group
        for joint in state:
            name, value = joint.attrib["name"], float(joint.attrib["value"])
            assert limit(joints[name], "lower") <= value <= limit(joints[name], "upper")


def test_rule_2_each_movable_joint_is_in_a_group_or_mimics_another(urdf: ET.Element) -> None:
    grouped = [name for group in SEPARATE for name in joints_of(GROUPS[group], urdf)]
    assert joints_of(GROUPS["arm_gripper"], urdf) == grouped
    mimics = {name for name, joint in movable(urdf).items() if joint.find("mimic") is not None}
    passive = {joint.attrib["name"] for joint in SRDF.findall("passive_joint")}
    assert grouped == [*JOINTS, "gripper"]
    assert mimics == passive
    assert {*grouped, *mimics} == set(movable(urdf))


def test_rule_2_the_end_effector_is_not_named_as_its_group() -> None:
    (hand,) = SRDF.findall("end_effector")
    assert hand.attrib["name"] not in GROUPS
    assert hand.attrib["group"] == "gripper"
    assert hand.attrib["parent_link"] == "tool_flange"


def test_rule_3_limits_of_moveit_urdf_and_parameters_agree(urdf: ET.Element) -> None:
    joints, limits = movable(urdf), LIMITS["joint_limits"]
    assert list(limits) == [*JOINTS, "gripper"]
    for joint in ARM.joints:
        ours = limits[joint.name]
        assert 0.0 < ours["max_velocity"] <= limit(joints[joint.name], "velocity")
        assert 0.0 < ours["max_acceleration"] <= joint.max_acceleration
        assert limit(joints[joint.name], "velocity") == joint.max_velocity
        assert limit(joints[joint.name], "lower") == joint.lower
        assert limit(joints[joint.name], "upper") == joint.upper
    assert limits["gripper"]["max_velocity"] <= limit(joints["gripper"], "velocity")
    assert limit(joints["gripper"], "lower") == ARM.gripper.lower
    assert limit(joints["gripper"], "upper") == ARM.gripper.upper
    assert all(each["has_velocity_limits"] is True for each in limits.values())
    assert all(each["has_acceleration_limits"] is True for each in limits.values())
    velocity, acceleration = (LIMITS[f"default_{name}_scaling_factor"] for name in
                              ("velocity", "acceleration"))  # fmt: skip
    shown = load(MOVEIT / "config/moveit.rviz")["Visualization Manager"]["Displays"][1]
    assert shown["Velocity_Scaling_Factor"] == velocity
    assert shown["Acceleration_Scaling_Factor"] == acceleration
    # The lift goes through its range, accelerating and braking, within 35 s.
    lift = ARM.joints[1]
    speed = velocity * lift.max_velocity
    ramps = speed / (acceleration * lift.max_acceleration)
    assert (lift.upper - lift.lower) / speed + ramps < 35.0


def test_rule_3_lines_of_pilz_stay_below_the_reduced_speed() -> None:
    limits = load(MOVEIT / "config/pilz_cartesian_limits.yaml")["cartesian_limits"]
    assert set(limits) == {"max_trans_vel", "max_trans_acc", "max_trans_dec", "max_rot_vel"}
    assert 0.0 < limits["max_trans_vel"] <= 0.25
    assert limits["max_trans_dec"] == -limits["max_trans_acc"]


def test_rule_4_controllers_of_moveit_are_those_that_are_loaded(urdf: ET.Element) -> None:
    config = load(MOVEIT / "config/moveit_controllers.yaml")
    managed = config["moveit_simple_controller_manager"]
    actions = {
        "joint_trajectory_controller/JointTrajectoryController": (
            "FollowJointTrajectory", "follow_joint_trajectory",
        ),
        "parallel_gripper_action_controller/GripperActionController": (
            "ParallelGripperCommand", "gripper_cmd",
        ),
    }  # fmt: skip
    assert managed["controller_names"] == [TRAJECTORY[0], "gripper_controller"]
    assert set(managed) == {"controller_names", *managed["controller_names"]}
    for name in managed["controller_names"]:
        ours = managed[name]
        assert (ours["type"], ours["action_ns"]) == actions[MANAGER[f"{name}.type"]]
        loaded = parameters_of(name, *ARM_FILES, *GRIPPER_FILES)
        assert ours["joints"] == loaded.get("joints", [loaded.get("joint")])
    grouped = {tuple(joints_of(GROUPS[name], urdf)) for name in SEPARATE}
    assert {tuple(managed[name]["joints"]) for name in managed["controller_names"]} == grouped
    execution = config["trajectory_execution"]
    # The arm's limit of speed, which MoveIt does not know, prolongs motions beyond any bound of it.
    assert execution == {"execution_duration_monitoring": False, "allowed_start_tolerance": 0.01}


def test_rule_4_the_interfaces_of_the_controllers_exist(urdf: ET.Element) -> None:
    commands, states = (interfaces(urdf, tag) for tag in ("command_interface", "state_interface"))
    for name in TRAJECTORY:
        values = parameters_of(name, *ARM_FILES)
        for kind, there in (("command_interfaces", commands), ("state_interfaces", states)):
            wanted = {f"{joint}/{each}" for joint in values["joints"] for each in values[kind]}
            assert wanted <= there
    homing = parameters_of("homing_controller", *ARM_FILES)
    for kind, there in (("command_interfaces", commands), ("state_interfaces", states)):
        wanted = {f"{joint}/home" for joint in JOINTS}
        named = {
            f"{name.split('.')[2]}/{each}"
            for name, value in homing.items()
            if name.startswith(f"{kind}.joints.")
            for each in value
        }
        assert named == wanted
        assert named <= there
    gripper = parameters_of("gripper_controller", *GRIPPER_FILES)["joint"]
    assert f"{gripper}/position" in commands
    assert {f"{gripper}/position", f"{gripper}/velocity"} <= states


def test_the_controllers_have_the_gains_and_rules_of_the_existing_arm() -> None:
    assert MANAGER["update_rate"] == ARM.controllers.update_rate.version_1 == 50
    assert MANAGER["defaults.allow_controller_activation_with_inactive_hardware"] is False
    velocity, position = (parameters_of(name, *ARM_FILES) for name in TRAJECTORY)
    for values in (velocity, position):
        assert values["joints"] == JOINTS
        assert values["allow_partial_joints_goal"] is False
        assert values["allow_nonzero_velocity_at_trajectory_end"] is True
    assert (velocity["command_interfaces"], velocity["state_interfaces"]) == (
        ["velocity"], ["position", "velocity"],
    )  # fmt: skip
    assert (position["command_interfaces"], position["state_interfaces"]) == (
        ["position"], ["position"],
    )  # fmt: skip
    for joint in JOINTS:
        gains = {name: velocity[f"gains.{joint}.{name}"] for name in ("p", "i", "d")}
        assert gains == {"p": 5.0, "i": 0.0, "d": 0.0}
        assert velocity[f"gains.{joint}.ff_velocity_scale"] == 1.0
        assert velocity[f"gains.{joint}.antiwindup_strategy"] == "none"


def test_our_controllers_exist_under_the_types_in_the_files() -> None:
    named = {name.removesuffix(".type"): value for name, value in MANAGER.items()
             if name.endswith(".type")}  # fmt: skip
    assert set(named) == {
        "joint_state_broadcaster", *TRAJECTORY, "homing_controller", "gripper_controller",
    }  # fmt: skip
    assert set(named.values()) <= set(TYPES)
    alone = parameters_of("controller_manager", *GRIPPER_FILES)
    assert "joint_state_broadcaster.type" in alone


def test_rule_5_kinematics_and_planners_are_those_of_the_groups() -> None:
    kinematics = load(MOVEIT / "config/kinematics.yaml")
    assert set(kinematics) == {"arm"}
    # Four joints: a pose is found by the least distance to it, in which the yaw counts.
    assert kinematics["arm"]["kinematics_solver"] == "pick_ik/PickIkPlugin"
    assert kinematics["arm"]["mode"] == "global"
    assert kinematics["arm"]["rotation_scale"] > 0.0
    ompl = PIPELINES["ompl"]
    known = set(ompl["planner_configs"])
    for group in GROUPS:
        assert set(ompl[group]["planner_configs"]) <= known
        assert ompl[group]["default_planner_config"] in ompl[group]["planner_configs"]
    assert set(ompl["arm"]["planner_configs"]) == known
    for name in ("gripper", "arm_gripper"):
        assert ompl[name]["planner_configs"] == ["RRTConnect"]
    assert PIPELINES["pilz_industrial_motion_planner"]["default_planner_config"] == "LIN"


def test_rule_5_the_pipelines_have_plugins_and_adapters() -> None:
    assert set(PIPELINES) == {"ompl", "pilz_industrial_motion_planner"}
    for pipeline in PIPELINES.values():
        assert len(pipeline["planning_plugins"]) == 1
        for kind in ("request", "response"):
            for adapter in pipeline[f"{kind}_adapters"]:
                assert adapter.startswith(f"default_planning_{kind}_adapters/")
    timed = "default_planning_response_adapters/AddTimeOptimalParameterization"
    assert PIPELINES["ompl"]["response_adapters"][0] == timed
    sequences = PIPELINES["pilz_industrial_motion_planner"]["capabilities"].split()
    assert sequences == [
        "pilz_industrial_motion_planner/MoveGroupSequenceAction",
        "pilz_industrial_motion_planner/MoveGroupSequenceService",
    ]


def test_rule_6_the_srdf_frees_22_of_28_pairs_and_the_table_from_all_but_the_jaws(
    urdf: ET.Element,
) -> None:
    bodies = [link.attrib["name"] for link in urdf.findall("link[collision]")]
    pairs = {frozenset(pair) for pair in itertools.combinations(bodies, 2)}
    freed = {
        frozenset((tag.attrib["link1"], tag.attrib["link2"]))
        for tag in SRDF.findall("disable_collisions")
    }
    of_table = {pair for pair in pairs if "table" in pair}
    hand = ("grp_base_link", "left_jaw_link", "right_jaw_link")
    assert (len(pairs - of_table), len(freed - of_table)) == (28, 22)
    assert pairs - freed - of_table == {
        frozenset(pair) for pair in itertools.product(("base_link", "link_1"), hand)
    }
    assert of_table - freed == {frozenset(("table", jaw)) for jaw in hand[1:]}


def test_the_test_goals_are_within_the_limits() -> None:
    values = parameters_of(
        "/**",
        PACKAGES / "bioscara_arm_bringup/config/test_goal_publishers_config.yaml",
    )
    goals = [values[f"{name}.positions"] for name in values["goal_names"]]
    for goal, following in zip(goals, goals[1:] + goals[:1], strict=True):
        for joint, at, to in zip(ARM.joints, goal, following, strict=True):
            assert joint.lower < at < joint.upper
            # A message has one point, 4 s after its begin.
            assert abs(to - at) / 4.0 <= 0.5 * joint.max_velocity


def test_our_trajectory_and_gripper_controllers_take_the_parameters() -> None:
    """The homing controller's have another form here, which the node translates."""
    for name, path in ((TRAJECTORY[0], ARM_FILES[1]), (TRAJECTORY[1], ARM_FILES[1]),
                       ("gripper_controller", GRIPPER_FILES[1])):  # fmt: skip
        made = TYPES[MANAGER[f"{name}.type"]]
        parameters: Any = made.PARAMETERS.read(name, load(path)[name]["ros__parameters"])
        if name == TRAJECTORY[0]:
            assert parameters.gains["j4"].p == 5.0
            assert parameters.gains["j4"].ff_velocity_scale == 1.0
