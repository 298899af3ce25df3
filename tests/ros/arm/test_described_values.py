"""Values of a description against the parameters with which the owner drives the arm."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from bioscara.errors import ConfigurationError, GoalRejectedError
from bioscara.model import ArmParameters, load_parameters
from bioscara.model.urdf import URDF, urdf_of
from bioscara.ros import requests
from bioscara.ros.arm.description import RobotDescription
from bioscara.ros.arm_time import ArmTime

SHIPPED = load_parameters()
TIME = ArmTime(lambda: None)


def calibrated(**changes: float) -> ArmParameters:
    """Return the parameters of an arm with another j1."""
    return replace(SHIPPED, joints=(replace(SHIPPED.joints[0], **changes), *SHIPPED.joints[1:]))


def changed(pattern: str, text: str) -> RobotDescription:
    """Return the shipped description with another text at a pattern's first place."""
    found, count = re.subn(pattern, text, URDF.read_text(), count=1, flags=re.DOTALL)
    assert count == 1
    return RobotDescription(found)


def goal(joint: str, *points: tuple[float, float], speed: float = 0.0) -> SimpleNamespace:
    """Return a message with points of one joint, each a time and a position."""
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0)),
        joint_names=[joint],
        points=[
            SimpleNamespace(
                time_from_start=SimpleNamespace(sec=0, nanosec=round(1e9 * time)),
                positions=[position],
                velocities=[speed],
                accelerations=[],
                effort=[],
            )
            for time, position in points
        ],
    )


def test_the_shipped_values_contradict_no_calibration() -> None:
    other = calibrated(reduction=34.8, lower=-2.9, upper=3.1, max_velocity=0.8, stall_threshold=9)
    for used in (SHIPPED, other):
        description = RobotDescription(URDF.read_text())
        assert description.compare(used) == []
        assert description.limits == {}


def test_the_description_of_a_calibrated_arm_agrees_with_it_alone() -> None:
    used = calibrated(reduction=34.8)
    assert RobotDescription(urdf_of(used)).compare(used) == []
    with pytest.raises(
        ConfigurationError,
        match=r"line \d+: j1: <param> reduction is 34\.8, and 35 in the parameters of the arm",
    ):
        RobotDescription(urdf_of(used)).compare(SHIPPED)


@pytest.mark.parametrize(
    ("pattern", "text", "complaint"),
    [
        ("0x13", "0x23", r"j3: <param> i2c_address is 0x23, and 0x13 in"),
        (r"(name=\"offset\">)0\.058", r"\g<1>0.06", r"gripper: <param> offset is 0\.06, and 0\.05"),
        (r"(\"stall_threshold\">)6", r"\1six", r"j1: <param> stall_threshold is six, and 6 in"),
    ],
)
def test_other_values_are_refused_with_both(pattern: str, text: str, complaint: str) -> None:
    with pytest.raises(ConfigurationError, match=complaint):
        changed(pattern, text).compare(SHIPPED)


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        (r"(lower=\")-3.04647(\" upper=\")3.04647", r"\1-2.0\g<2>3.04647"),
        (r"(<param name=\"min\">)-3.04647", r"\1-2.0"),
        (
            r"(<command_interface name=\"position\")/>",
            r'\1><param name="min">-2.0</param></command_interface>',
        ),
    ],
)
def test_a_narrower_limit_applies_to_goals(pattern: str, text: str) -> None:
    description = changed(pattern, text)
    (warning,) = description.compare(SHIPPED)
    assert re.search(r"j1: <.*> \w*( \w+)* is -2\.0, narrower than the -3\.04647 of", warning)
    requests.joint_trajectory(goal("j1", (1.0, -1.9)), description, TIME)
    requests.joint_trajectory(goal("j3", (1.0, -2.1)), description, TIME)
    with pytest.raises(GoalRejectedError, match=r"j1: position -2\.1 is outside -2 \.\. inf"):
        requests.joint_trajectory(goal("j1", (1.0, -1.9), (2.0, -2.1)), description, TIME)
    # Of an owner whose own limit is narrower still, that one applies.
    (warning,) = description.compare(calibrated(lower=-1.5))
    assert "the -1.5 of the arm's parameters applies" in warning
    assert description.limits == {}


def test_a_slower_limit_applies_to_points_and_between_them() -> None:
    description = changed(r"velocity=\"1\.0\"", 'velocity="0.5"')
    assert len(description.compare(SHIPPED)) == 1
    requests.joint_trajectory(goal("j1", (1.0, 0.0), (2.0, 0.5), speed=0.5), description, TIME)
    for given in (goal("j1", (1.0, 0.0), speed=0.6), goal("j1", (1.0, 0.0), (2.0, 0.6))):
        with pytest.raises(GoalRejectedError, match=r"j1: velocity 0\.6 is outside -0\.5 \.\. 0"):
            requests.joint_trajectory(given, description, TIME)


def test_a_narrower_limit_of_the_gripper_applies_to_its_goals() -> None:
    description = changed(r"(\"max\">)0\.112", r"\g<1>0.1")
    assert len(description.compare(SHIPPED)) == 1

    def width(metres: float) -> SimpleNamespace:
        return SimpleNamespace(command=SimpleNamespace(position=[metres], velocity=[], effort=[]))

    assert requests.gripper_goal(width(0.1), description).position == (0.1,)
    with pytest.raises(GoalRejectedError, match=r"gripper: position 0\.11 is outside -inf \.\. 0"):
        requests.gripper_goal(width(0.11), description)


def test_a_node_without_a_description_names_the_robot_as_moveit_does() -> None:
    from bioscara.cli.commands.serving.ros import own_description  # noqa: PLC0415

    packages = Path(__file__).parents[3] / "ros"
    srdf = packages / "bioscara_arm_gripper_128_moveit_config/config/scene.srdf"
    (name,) = re.findall(r"<robot name=\"(\w+)\"", srdf.read_text())
    assert re.findall(r"<robot .*?name=\"(\w+)\"", own_description()) == [name]
