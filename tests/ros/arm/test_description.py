"""Names of a description and those of the owner."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from trimesh.transformations import quaternion_about_axis, quaternion_multiply

from bioscara.errors import ConfigurationError
from bioscara.hardware import Urdf
from bioscara.hardware.link_frames import LinkFrames
from bioscara.kinematics import Joints
from bioscara.model import load_parameters
from bioscara.model.urdf import URDF
from bioscara.robot.workspace.workspace import Workspace
from bioscara.ros.arm.description import RobotDescription
from entries import entry
from ros.descriptions import LEFT, renamed
from ros.share import expand

TEXT = URDF.read_text()


def test_rule_42_the_description_of_the_arm_has_both_components_under_their_names() -> None:
    description = RobotDescription(URDF.read_text())
    assert [each.name for each in description.components] == [
        "bioscara_arm",
        "bioscara_gripper_128",
    ]
    assert list(description.joints) == ["j1", "j2", "j3", "j4", "gripper"]


def test_names_with_a_prefix_are_translated_both_ways() -> None:
    description = RobotDescription(renamed({**LEFT, "gripper": "left_grip"}))
    assert description.owners("left_j2/velocity") == "j2/velocity"
    assert description.described("gripper/position") == "left_grip/position"
    assert description.owners("other/position") == "other/position"
    assert description.has("j1/home")
    given = {"left_j1": {"interfaces": ["left_j1/home", 3]}, "p": "left_j3"}
    assert description.owners_value(given) == {"j1": {"interfaces": ["j1/home", 3]}, "p": "j3"}


def test_a_description_without_gripper_has_no_interface_of_it() -> None:
    description = RobotDescription(renamed({}, "bioscara_arm"))
    assert not description.has("gripper/position")
    assert description.component_of(["gripper/position"]) is None
    found = description.component_of(["j1/home"])
    assert found is not None
    assert found.name == "bioscara_arm"


def param(name: str, value: str) -> str:
    return f'<param name="{name}">{value}</param>'


ARM, JAWS = ('<ros2_control name="bioscara_arm" type="system">',
             '<ros2_control name="bioscara_gripper_128" type="system">')  # fmt: skip
PLUGIN = "<plugin>bioscara/ArmHardware</plugin>"
HOMED = '<command_interface name="home"/>'
J1 = '    <joint name="j1">\n      <param'
BELT = JAWS.replace("bioscara_gripper_128", "conveyor")
UNREAD = [
    # Kind, old, new, text of the message; the first occurrence is that of j1 or the gripper.
    ("gpio", J1, '<gpio name="home"/>' + J1,
     "<gpio> is not read; every interface is one of a joint, home too"),
    ("foreign", J1, '<sensor name="force"/>' + J1, "bioscara_arm: <sensor> is not read"),
    ("foreign", J1, '<xacro:joint_control name="j1"/>' + J1, "<xacro:joint_control> is not read"),
    ("foreign", JAWS, BELT + "<joint name='belt'/></ros2_control>" + JAWS,
     "belt: <param> reduction is missing"),
    ("foreign", JAWS, BELT + "<joint name='a'/><joint name='b'/></ros2_control>" + JAWS,
     "hardware component conveyor has the joints a, b; it is an arm with j1, j2, j3, j4, all"),
    ("foreign", '    <joint name="j1">', '    <joint name="j5">', "has the joints j5, j2, j3, j4"),
    ("foreign", '    <joint name="j1">', '    <joint name="left_j1">', "the same prefix or none"),
    ("foreign", 'type="system"', 'type="sensor"', "type 'sensor' is not one of system, actuator"),
    ("foreign", '<joint name="j1" type="revolute">', '<joint name="j1" type="prismatic">',
     "j1: type 'prismatic' is not revolute: its position is in rad"),
    ("unknown", param("reduction", "35.0"), param("reducton", "35.0"),
     "j1: <param> reducton is not known; did you mean reduction?"),
    ("unknown", HOMED, '<command_interface name="effort"/>',
     "j1: <command_interface> effort is not known; known here: position, velocity, home"),
    ("unknown", HOMED, '<comand_interface name="home"/>', "did you mean command_interface?"),
    ("unknown", '<state_interface name="velocity"/>', '<state_interface name="velocty"/>',
     "j1: <state_interface> velocty is not known; did you mean velocity?"),
    ("unknown", ARM, ARM.replace(">", ' rw_rate="10">'),
     "<ros2_control> rw_rate is not read; its attributes are name, type"),
    ("unknown", '    <joint name="j1">', '    <joint name="j1" mimic="false">', "<joint> mimic is"),
    ("unknown", HOMED, HOMED.replace("/>", ' data_type="bool"/>'), "data_type is not read"),
    ("unknown", PLUGIN, PLUGIN.replace(">", ' version="2">', 1), "<plugin> version is not read"),
    ("unknown", PLUGIN, PLUGIN + param("bus", "1"), "<param> of <hardware> is not read"),
    ("missing", param("reduction", "35.0"), "",
     "j1: <param> reduction is missing; it has each of i2c_address, reduction, min"),
    ("missing", param("homing_acceleration", "0.01"), "", "<param> homing_acceleration is missing"),
    ("missing", param("offset", "0.058"), "", "gripper: <param> offset is missing"),
    ("missing", HOMED, "", "j1: <command_interface> home is missing"),
    ("missing", '<state_interface name="home"/>', "", "j1: <state_interface> home is missing"),
    ("missing", PLUGIN, "", "bioscara_arm: <hardware> does not name one <plugin>"),
    ("missing", PLUGIN, "<plugin/>", "bioscara_arm: <hardware> does not name one <plugin>"),
    ("missing", 'name="i2c_address"', "", "<param> has no name"),
    ("missing", '<joint name="j1" type="revolute">', '<joint name="j9" type="revolute">',
     "j1: the robot has 0 joints of that name"),
    ("nested", param("homing_speed", "-0.03"),
     f'<param name="homing">{param("speed", "-0.03")}{param("threshold", "30")}</param>',
     "j1: <param> homing: its values are params of the joint here, not nested in one; write "),
    ("nested", "35.0</param>", "35.0<b/></param>", "j1: <b> in reduction is nested, and not read"),
    ("nested", HOMED, f'<command_interface name="home">{param("min", "0")}</command_interface>',
     "j1: <param> in home is nested, and not read"),
    ("nested", '<state_interface name="position"/>',
     f'<state_interface name="position">{param("initial_value", "0")}</state_interface>',
     "j1: <param> in position is nested, and not read"),
    ("nested", '<command_interface name="position"/>',
     f'<command_interface name="position">{param("initial_value", "0")}</command_interface>',
     "<param> initial_value of a command interface is not read; it has a <param> min and"),
    ("nested", ARM, "<link name='box'>" + ARM + "</ros2_control></link>" + ARM,
     "<ros2_control> is inside of another tag"),
    ("nested", ARM, ARM + ARM + "</ros2_control>", "<ros2_control> is inside of another tag"),
    ("twice", param("max", "3.04647"), 2 * param("max", "3.04647"), "j1: <param> max is there twi"),
    ("twice", HOMED, '<command_interface name="position"/>', "position is there twice"),
    ("twice", '<command_interface name="position"/>',
     f'<command_interface name="position">{2 * param("min", "0")}</command_interface>',
     "<param> min of a command interface is not read"),
    ("twice", '    <joint name="j2">', '    <joint name="j1">', "joint j1 is there twice"),
    ("twice", "<hardware>", "<hardware/><hardware>", "bioscara_arm: 2 <hardware>; it has one"),
    ("twice", 'name="bioscara_gripper_128"', 'name="bioscara_arm"',
     "two <ros2_control> tags are named bioscara_arm"),
]  # fmt: skip


@pytest.mark.parametrize("kind", sorted({kind for kind, *_ in UNREAD}))
def test_a_tag_that_would_have_no_effect_is_refused_with_its_line(kind: str) -> None:
    """See decisions 0021 and 0033."""
    for _, old, new, complaint in (row for row in UNREAD if row[0] == kind):
        with entry(f"{old} -> {new}"):
            assert old in TEXT
            with pytest.raises(ConfigurationError) as caught:
                RobotDescription(TEXT.replace(old, new, 1))
            assert complaint in str(caught.value)
            assert re.match(r"robot_description, line \d+: ", str(caught.value))


def test_the_line_is_that_of_the_tag() -> None:
    number = 1 + TEXT[: TEXT.index(HOMED)].count("\n")
    with pytest.raises(ConfigurationError, match=f"line {number}: j1: <command_interface> effort"):
        RobotDescription(TEXT.replace('_interface name="home"/>', '_interface name="effort"/>', 1))


def test_each_tag_of_each_joint_is_required_once_under_its_name() -> None:
    lines = TEXT.splitlines(keepends=True)
    begin = next(number for number, line in enumerate(lines) if "<ros2_control" in line)
    found = [
        (number, match[1])
        for number, line in enumerate(lines)
        if number > begin and (match := re.search(r'<(?:param|\w+_interface) name="(\w+)"', line))
    ]
    assert len(found) == 4 * (13 + 6) + 5 + 3
    for number, name in found:
        line = lines[number]
        for changed in ("", 2 * line, line.replace(f'"{name}"', f'"{name}x"')):
            text = "".join((*lines[:number], changed, *lines[number + 1 :]))
            refused = pytest.raises(ConfigurationError, match=rf"line \d+: .*{name}")
            with entry(changed or f"without {line}"), refused:
                RobotDescription(text)


def test_a_second_arm_is_refused() -> None:
    """One node is for one arm; two with the same gripper, too."""
    root, other = ET.fromstring(TEXT), ET.fromstring(renamed(LEFT, "bioscara_arm"))
    root.extend(each for each in other if each.attrib.get("name", "").startswith("left_"))
    with pytest.raises(
        ConfigurationError, match=r"line \d+: two <ros2_control> tags have the same"
    ):
        RobotDescription(ET.tostring(root, encoding="unicode"))


def test_a_description_without_hardware_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"line 1: there is no <ros2_control>"):
        RobotDescription("<robot name='r'/>")


def test_names_may_have_quotes() -> None:
    description = RobotDescription(renamed({"gripper": "le\"ft's"}))
    assert description.compare(load_parameters()) == []
    assert description.owners("le\"ft's/position") == "gripper/position"


def test_text_that_is_no_description_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="not XML"):
        RobotDescription("no xml")


def placed(frames: LinkFrames, positions: dict[str, float], link: str) -> list[float]:
    """Return position and yaw of a link in the root, from the transforms."""
    pending = {each.child: each for each in (*frames.fixed, *frames.at(positions))}
    place, turn = np.zeros(3), np.eye(3)
    while link in pending:
        x, y, z, w = pending[link].rotation
        matrix = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        place = np.array(pending[link].translation) + matrix @ place
        turn = matrix @ turn
        link = pending[link].parent
    return [*place, math.atan2(turn[1, 0], turn[0, 0])]


@pytest.mark.parametrize("joints", [Joints(0.3, 0.2, 0.8, -0.5), Joints(-1.2, 0.05, 2.0, 2.5)])
def test_the_frames_agree_with_the_kinematics(joints: Joints) -> None:
    description = RobotDescription(URDF.read_text())
    frames = LinkFrames(description.urdf)
    positions = dict(zip(("j1", "j2", "j3", "j4"), joints, strict=True)) | {"gripper": 0.05}
    pose = Workspace.of(load_parameters()).kinematics.forward(joints)
    x, y, z, _ = placed(frames, positions, "tool")
    assert (x, y, z) == pytest.approx(pose[:3], abs=2e-4)


def test_angles_turn_about_the_fixed_axes_x_then_y_then_z() -> None:
    joint = (
        '<joint name="a" type="revolute"><parent link="b"/><child link="c"/>'
        '<origin xyz="1 2 3" rpy="0.3 -0.4 0.5"/><axis xyz="2 0 0"/></joint>'
    )
    frames = LinkFrames(Urdf(f"<robot name='r'>{joint}</robot>", "robot_description"))
    (still,), (turned,) = frames.at({"a": 0.0}), frames.at({"a": 0.7})
    assert still.translation == turned.translation == (1.0, 2.0, 3.0)
    # Of another implementation, as x, y, z, w.
    x, y, z, a = (quaternion_about_axis(angle, axis) for axis, angle in (
        ((1, 0, 0), 0.3), ((0, 1, 0), -0.4), ((0, 0, 1), 0.5), ((1, 0, 0), 0.7),
    ))  # fmt: skip
    placed = quaternion_multiply(z, quaternion_multiply(y, x))
    for rotation, wanted in (
        (still.rotation, placed),
        (turned.rotation, quaternion_multiply(placed, a)),
    ):
        w, *xyz = wanted
        assert rotation == pytest.approx((*xyz, w))


def test_jaws_that_follow_the_gripper_have_frames_of_it() -> None:
    frames = LinkFrames(RobotDescription(URDF.read_text()).urdf)
    moved = {each.child: each for each in frames.at({"gripper": 0.04})}
    still = {each.child: each for each in frames.at({"gripper": 0.0})}
    assert moved.keys() == still.keys()
    assert len(moved) >= 2
    assert all(moved[name].translation != still[name].translation for name in moved)


def test_a_link_whose_position_is_unknown_has_no_frame() -> None:
    frames = LinkFrames(RobotDescription(URDF.read_text()).urdf)
    assert frames.at({"j1": math.nan, "j2": 0.1}) == frames.at({"j2": 0.1})
    assert len(frames.at({"j2": 0.1})) == 1


@pytest.mark.parametrize(
    ("joint", "complaint"),
    [
        ('<joint name="a" type="floating"/>', "a: type 'floating' is not one of fixed"),
        ('<joint name="a" type="fixed"><parent link="b"/></joint>', "joint a has no <child>"),
        (
            '<joint name="a" type="fixed"><parent link="b"/><child link="c"/>'
            '<origin xyz="1 2"/></joint>',
            "'1 2' are not three numbers",
        ),
    ],
)
def test_a_joint_that_cannot_be_placed_is_refused(joint: str, complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        LinkFrames(Urdf(f"<robot name='r'>{joint}</robot>", "robot_description"))


def test_a_prefixed_xacro_is_understood(prefix: Path) -> None:
    path = prefix / "share/bioscara_arm_description/urdf/scene.xacro"
    text = ET.tostring(expand(path, prefix="left_"), encoding="unicode")
    description = RobotDescription(text)
    assert description.components[0].name == "left_bioscara_arm"
    assert description.owners("left_j4") == "j4"
