"""Values from messages of ROS, which have the fields that they have there."""

from __future__ import annotations

import math
from types import SimpleNamespace as Message
from typing import Any

import pytest

from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory import JointTrajectory, Point, Tolerance
from bioscara.errors import GoalRejectedError
from bioscara.ros import requests
from bioscara.ros.arm.description import RobotDescription
from bioscara.ros.arm_time import ArmTime
from ros.descriptions import LEFT, renamed

DESCRIPTION = RobotDescription(renamed(LEFT, "bioscara_arm"))


def at(seconds: float) -> Message:
    whole, rest = divmod(round(seconds * 1e9), 10**9)
    return Message(sec=whole, nanosec=rest)


def arm_time(simulated: float | None = None) -> ArmTime:
    time = ArmTime(lambda: simulated)
    time.update(100.0, 1_700_000_000.0)
    return time


def trajectory(stamp: float = 0.0) -> Message:
    point = Message(
        positions=[0.1, 0.2],
        velocities=[],
        accelerations=[],
        effort=[],
        time_from_start=at(1.25),
    )
    return Message(
        header=Message(stamp=at(stamp)), joint_names=["left_j1", "left_j2"], points=[point]
    )


def test_a_trajectory_has_the_names_and_times_of_the_arm() -> None:
    found = requests.joint_trajectory(trajectory(), DESCRIPTION, arm_time())
    assert found == JointTrajectory(("j1", "j2"), (Point(1.25, (0.1, 0.2)),), 0.0)


def test_rule_05_a_stamp_is_converted_to_the_clock_of_the_arm() -> None:
    found = requests.joint_trajectory(trajectory(1_700_000_002.5), DESCRIPTION, arm_time())
    assert found.stamp == pytest.approx(102.5, abs=1e-6)


def test_with_simulated_time_stamps_are_those_of_the_clock_of_ros() -> None:
    time = arm_time(simulated=7.0)
    assert time.arms(8.0) == pytest.approx(101.0)
    assert time.ros(101.0) == pytest.approx(8.0)


def test_a_goal_has_its_tolerances() -> None:
    tolerance = Message(name="left_j2", position=0.1, velocity=-1.0, acceleration=0.0)
    message = Message(
        trajectory=trajectory(),
        path_tolerance=[tolerance],
        goal_tolerance=[],
        goal_time_tolerance=at(0.5),
    )
    goal = requests.trajectory_goal(message, DESCRIPTION, arm_time())
    assert goal.path_tolerance == (Tolerance("j2", 0.1, -1.0, 0.0),)
    assert goal.goal_time_tolerance == 0.5
    assert not goal.collision_checked


def test_a_gripper_goal_has_the_values_of_the_message() -> None:
    command = Message(position=[0.05], velocity=[], effort=[3.0])
    goal = requests.gripper_goal(Message(command=command), DESCRIPTION)
    assert goal == GripperGoal((0.05,), (), (3.0,))


def homing(groups: list[str], *values: dict[str, float]) -> Any:
    return Message(
        interface_groups=groups,
        interface_values=[
            Message(interface_names=list(each), values=list(each.values())) for each in values
        ],
    )


def test_homing_commands_are_those_of_the_panel() -> None:
    message = homing(["left_j1", "left_j3"], {"home": -1.0}, {"home": math.nan})
    assert requests.homing_commands(message, DESCRIPTION) == [("j1", -1.0)]


@pytest.mark.parametrize(
    ("message", "complaint"),
    [
        (homing(["left_j1"]), "0 interface_values for 1 interface_groups"),
        (homing(["left_j1"], {"position": 1.0}), "interface 'position' is not home"),
    ],
)
def test_other_commands_are_refused(message: Any, complaint: str) -> None:
    with pytest.raises(GoalRejectedError, match=complaint):
        requests.homing_commands(message, DESCRIPTION)


def test_a_negative_duration_is_negative() -> None:
    assert requests.seconds(Message(sec=-1, nanosec=500_000_000)) == -0.5
