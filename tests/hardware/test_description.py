"""The ros2_control tags become the hardware, or one clear error."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bioscara.errors import ConfigurationError
from bioscara.hardware import ArmHardware
from bioscara.hardware.ros2_control_tags import SIZE_MAX, Urdf, read_arm, read_gripper
from bioscara.hardware.urdf_joints import joints_of
from bioscara.model import load_parameters
from bioscara.model.urdf import URDF
from bioscara.sim import FirmwareBus, SimulatedArm

TEXT = URDF.read_text()
PARAMETERS = load_parameters()


def read(text: str) -> None:
    urdf = Urdf(text, "arm.urdf")
    read_arm(urdf)
    read_gripper(urdf, PARAMETERS.gripper)


JOINTS = tuple(replace(joint, belt_period=0.0) for joint in PARAMETERS.joints)
"""Parameters as hardware uses them: the periods of the belts are for planning alone."""


def test_the_shipped_urdf_says_what_the_parameters_say() -> None:
    urdf = Urdf.load(URDF)
    assert read_arm(urdf).joints == JOINTS
    assert read_gripper(urdf, PARAMETERS.gripper).parameters == PARAMETERS.gripper


def test_joints_come_in_the_order_of_their_numbers_for_any_order_in_the_file() -> None:
    begin, end = TEXT.index('    <joint name="j1">'), TEXT.index('    <joint name="j2">')
    text = TEXT[:begin] + TEXT[end:]
    cut = text.index("  </ros2_control>")
    urdf = Urdf(text[:cut] + TEXT[begin:end] + text[cut:], "arm.urdf")
    assert read_arm(urdf).joints == JOINTS


def test_an_arm_from_a_description_has_three_interfaces_of_each_kind_per_joint() -> None:
    arm = SimulatedArm()
    hardware = ArmHardware.from_description(Urdf.load(URDF), FirmwareBus(arm), arm.clock)
    kinds = [f"j{n}/{kind}" for n in range(1, 5) for kind in ("position", "velocity", "home")]
    assert list(hardware.states) == list(hardware.commands) == kinds
    assert (hardware.name, hardware.kind) == ("bioscara_arm", "system")


def param(name: str, value: str) -> str:
    return f'<param name="{name}">{value}</param>'


WRONG = [
    # old, new, text of the message; the first occurrence is that of j1 or the gripper.
    ("    <joint name=\"j1\">\n      <param",
     "    <gpio name=\"home\"/>\n    <joint name=\"j1\">\n      <param",
     "<gpio> is not read; every interface is one of a joint, home too"),
    (param("hold_current", "20"), param("hold_current", "300"),
     "j1: hold_current: 300 is outside 1 .. 100 %"),
    (param("drive_current", "20"), param("drive_current", "-1"), "j1: drive_current: -1 is outs"),
    (param("stall_threshold", "6"), param("stall_threshold", "256"),
     "j1: stall_threshold: 256 is outside 0 .. 255"),
    (param("stall_threshold", "6"), param("stall_threshold", "6.5"),
     "j1: stall_threshold: 6.5 is not a whole number"),
    (param("homing_threshold", "30"), param("homing_threshold", "256"),
     "j1: homing_threshold: 256 is outside 1 .. 255 microsteps"),
    (param("homing_current", "15"), param("homing_current", "0"), "outside 1 .. 100 %"),
    (param("homing_speed", "-0.03"), param("homing_speed", "0"), "j1: homing_speed: it must not"),
    (param("homing_speed", "-0.03"), param("homing_speed", "0.9"), "300.803 rpm of the motor"),
    (param("homing_acceleration", "0.01"), param("homing_acceleration", "0"), "is outside"),
    (param("i2c_address", "0x11"), param("i2c_address", "0x1111"), "i2c_address: 4369 is outside"),
    (param("i2c_address", "0x11"), param("i2c_address", "11"),
     "j1: i2c_address: 11 is 0x11 as the original reads it, and 0x0b as a decimal number; write "),
    (param("i2c_address", "0x11"), param("i2c_address", "+017"), "is 0x17 as the original reads"),
    (param("homing_speed", "-0.03"), '<param name="homing"><param name="speed">1</param></param>',
     "j1: the values of homing are params of the joint here, not nested in one; write homing_spe"),
    (param("i2c_address", "0x12"), param("i2c_address", "0x11"),
     "j2: i2c_address: 0x11 is already the address of j1"),
    (param("reduction", "35.0"), param("reduction", "0"), "j1: reduction: it must not be zero"),
    (param("reduction", "35.0"), param("reduction", "nan"), "j1: reduction: nan is outside"),
    (param("reduction", "35.0"), param("reduction", "1_0"), "'1_0' is not a number"),
    (param("reduction", "35.0"), param("reduction", ""), "'' is not a number"),
    (param("reduction", "35.0"), param("reducton", "35.0"), "did you mean reduction?"),
    (param("reduction", "35.0"), "", "j1: reduction is missing"),
    (param("max", "3.04647"), param("max", "-4"), "j1: max: -4 must be above -3.04647"),
    (param("max_velocity", "1.0"), param("max_velocity", "inf"), "j1: max_velocity: inf is outs"),
    (param("max", "3.04647"), param("max", "3") * 2, "j1: max is there twice"),
    ('<command_interface name="home"/>', "",
     "j1: command_interface home is missing; it has exactly position, velocity, home"),
    ('<state_interface name="home"/>', "", "j1: state_interface home is missing"),
    ('<command_interface name="home"/>', '<command_interface name="effort"/>',
     "command_interface effort is not known"),
    ('<state_interface name="velocity"/>', '<state_interface name="velocty"/>',
     "did you mean velocity?"),
    ('<command_interface name="home"/>', '<command_interface name="position"/>',
     "command_interface position is there twice"),
    ('<command_interface name="home"/>', '<comand_interface name="home"/>',
     "did you mean command_interface?"),
    ('<command_interface name="home"/>',
     '<command_interface name="home"><param name="min">0</param></command_interface>',
     "has nested tags"),
    ('    <joint name="j1">', '    <joint name="j5">', "j5 is not a joint of the arm"),
    ('    <joint name="j2">', '    <joint name="j1">', "joint j1 is there twice"),
    ('<joint name="j1" type="revolute">', '<joint name="j1" type="continuous">',
     "j1: type 'continuous' is not one of revolute, prismatic"),
    ('<joint name="j1" type="revolute">', '<joint name="j1" type="prismatic">',
     "j1: its type goes with m, not rad"),
    ('<joint name="j1" type="revolute">', '<joint name="j9" type="revolute">',
     "j1: the robot has 0 joints of that name"),
    ('name="bioscara_arm"', 'name="bioscara_ram"', "did you mean bioscara_ram?"),
    ('name="bioscara_gripper_128"', 'name="bioscara_arm"', "there are 2 <ros2_control>"),
    (param("init_pos", "0.08"), param("init_pos", "0.2"),
     "gripper: init_pos: 0.2 is outside 0.04 .. 0.112 m"),
    (param("max", "0.112"), param("max", "0.12"),
     "gripper: max: 0.12 m is out of the servo's reach: with deg_per_m 3333.3"),
    (param("offset", "0.058"), "", "gripper: offset is missing"),
    (param("reduction", "3333.3"), param("reduction", "0"), "gripper: reduction: it must not be"),
    ('<robot name="bioscara">', '<robot name="bioscara"><oops>', "not XML"),
    ('<?xml version="1.0"?>', "<!DOCTYPE robot>", "no document type"),
    ('<?xml version="1.0"?>', '<!DOCTYPE robot [<!ENTITY a "b">]>', "no document type"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "complaint"), WRONG)
def test_a_wrong_value_of_the_description_is_named(old: str, new: str, complaint: str) -> None:
    assert old in TEXT
    with pytest.raises(ConfigurationError) as caught:
        read(TEXT.replace(old, new, 1))
    assert complaint in str(caught.value)
    assert str(caught.value).startswith("arm.urdf, line ")


def test_a_missing_joint_is_named() -> None:
    begin, end = TEXT.index('    <joint name="j3">'), TEXT.index('    <joint name="j4">')
    with pytest.raises(ConfigurationError, match="bioscara_arm: joint j3 is missing"):
        read(TEXT[:begin] + TEXT[end:])


def test_a_description_without_hardware_is_refused() -> None:
    with pytest.raises(ConfigurationError, match="named bioscara_arm; known here: none"):
        read('<robot name="bioscara"/>')


def test_files_that_are_no_urdf_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    with pytest.raises(ConfigurationError, match="No such file"):
        Urdf.load(file)
    for content, complaint in (
        (b"\xff\xfe", "not a text file"),
        (b"", "not XML"),
        (b"<sdf/>", "is not <robot>"),
        (b" " * (SIZE_MAX + 1), "at most"),
    ):
        file.write_bytes(content)
        with pytest.raises(ConfigurationError, match=complaint):
            Urdf.load(file)


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_a_damaged_file_is_refused_or_reads_as_an_arm(data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(TEXT) - 1))
    size = data.draw(st.integers(0, 20))
    text = TEXT[:at] + data.draw(st.text(max_size=4)) + TEXT[at + size :]
    with suppress(ConfigurationError):
        read(text)


@pytest.mark.parametrize(
    ("old", "new", "complaint"),
    [
        (
            '<link name="base_link">',
            '<link name="lonely"/><link name="base_link">',
            "2 links have no",
        ),
        ('type="prismatic"', 'type="planar"', "type 'planar' is not one of"),
        (
            '<parent link="world"/>',
            '<parent link="link_1"/>',
            "joint base_joint has no parent in the tree",
        ),
        ('<axis xyz="0 0 1"/>', "", "joint j1 has no <axis>"),
    ],
)
def test_a_description_that_is_not_a_tree_is_refused(old: str, new: str, complaint: str) -> None:
    assert old in TEXT
    with pytest.raises(ConfigurationError, match=complaint):
        joints_of(Urdf(TEXT.replace(old, new, 1), "arm.urdf"))
