"""Names of a description and those of the owner."""

from __future__ import annotations

import math
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
from ros.share import expand

SYSTEM = '<ros2_control name="{name}" type="system">{joints}</ros2_control>'


def described(*components: tuple[str, str]) -> RobotDescription:
    tags = [
        SYSTEM.format(name=name, joints="".join(f'<joint name="{j}"/>' for j in joints.split()))
        for name, joints in components
    ]
    return RobotDescription(f"<robot name='r'>{''.join(tags)}</robot>")


def test_rule_42_the_description_of_the_arm_has_both_components_under_their_names() -> None:
    description = RobotDescription(URDF.read_text())
    assert [each.name for each in description.components] == [
        "bioscara_arm",
        "bioscara_gripper_128",
    ]
    assert list(description.joints) == ["j1", "j2", "j3", "j4", "gripper"]


def test_names_with_a_prefix_are_translated_both_ways() -> None:
    description = described(("left_arm", "left_j2 left_j1 left_j3 left_j4"), ("jaws", "left_grip"))
    assert description.owners("left_j2/velocity") == "j2/velocity"
    assert description.described("gripper/position") == "left_grip/position"
    assert description.owners("other/position") == "other/position"
    assert description.has("j1/home")
    given = {"left_j1": {"interfaces": ["left_j1/home", 3]}, "p": "left_j3"}
    assert description.owners_value(given) == {"j1": {"interfaces": ["j1/home", 3]}, "p": "j3"}


def test_a_description_without_gripper_has_no_interface_of_it() -> None:
    description = described(("arm", "j1 j2 j3 j4"))
    assert not description.has("gripper/position")
    assert description.component_of(["gripper/position"]) is None
    found = description.component_of(["j1/home"])
    assert found is not None
    assert found.name == "arm"


@pytest.mark.parametrize(
    ("components", "complaint"),
    [
        ((), "there is no <ros2_control>"),
        ((("arm", "j1 j2 j3"),), "component arm has the joints j1, j2, j3; it is an arm with j1"),
        ((("arm", ""),), "component arm has the joints .none."),
        ((("arm", "a_j1 a_j2 a_j3 b_j4"),), "all with the same prefix"),
        ((("one", "grip"), ("two", "other")), "two <ros2_control> tags have the same joints"),
    ],
)
def test_a_description_of_something_else_is_refused(
    components: tuple[tuple[str, str], ...], complaint: str
) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        described(*components)


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
