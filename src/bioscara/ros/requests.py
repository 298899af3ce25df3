"""Values from the messages of ROS, by the names of their fields: no message is imported here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point, Tolerance
from bioscara.errors import GoalRejectedError
from bioscara.ros.arm.control_tags import GRIPPER_JOINT
from bioscara.ros.arm.described_values import check
from bioscara.ros.arm.description import RobotDescription
from bioscara.ros.arm_time import ArmTime


def seconds(time: Any) -> float:
    """Return a ``Time`` or ``Duration`` message in seconds."""
    return float(time.sec + 1e-9 * time.nanosec)


def joint_trajectory(message: Any, description: RobotDescription, time: ArmTime) -> JointTrajectory:
    """Return a ``trajectory_msgs/JointTrajectory``.

    Raises:
        GoalRejectedError: It is beyond a limit of the description.
    """
    stamp = seconds(message.header.stamp)
    trajectory = JointTrajectory(
        tuple(map(description.owners, message.joint_names)),
        tuple(
            Point(
                seconds(point.time_from_start),
                tuple(point.positions),
                tuple(point.velocities),
                tuple(point.accelerations),
                tuple(point.effort),
            )
            for point in message.points
        ),
        time.arms(stamp) if stamp else 0.0,
    )
    return check(trajectory, description.limits)


def trajectory_goal(message: Any, description: RobotDescription, time: ArmTime) -> Goal:
    """Return a goal of ``control_msgs/FollowJointTrajectory``."""

    def tolerances(given: Sequence[Any]) -> tuple[Tolerance, ...]:
        return tuple(
            Tolerance(
                description.owners(each.name), each.position, each.velocity, each.acceleration
            )
            for each in given
        )

    return Goal(
        joint_trajectory(message.trajectory, description, time),
        tolerances(message.path_tolerance),
        tolerances(message.goal_tolerance),
        seconds(message.goal_time_tolerance),
    )


def gripper_goal(message: Any, description: RobotDescription) -> GripperGoal:
    """Return a goal of ``control_msgs/ParallelGripperCommand``.

    Raises:
        GoalRejectedError: It is beyond a limit of the description.
    """
    command = message.command
    if limits := description.limits.get(GRIPPER_JOINT):
        for kind in ("position", "velocity"):
            for value in getattr(command, kind):
                limits.check(kind, value)
    return GripperGoal(tuple(command.position), tuple(command.velocity), tuple(command.effort))


def homing_commands(message: Any, description: RobotDescription) -> list[tuple[str, float]]:
    """Return joints and commands of a ``control_msgs/DynamicInterfaceGroupValues``.

    Raises:
        GoalRejectedError: There is not one value of ``home`` for each group.
    """
    groups, values = message.interface_groups, message.interface_values
    if len(groups) != len(values):
        raise GoalRejectedError(
            f"{len(values)} interface_values for {len(groups)} interface_groups; give one for each"
        )
    commands = []
    for group, each in zip(groups, values, strict=True):
        names, numbers = list(each.interface_names), list(each.values)
        if len(names) != len(numbers):
            raise GoalRejectedError(f"{group}: {len(numbers)} values for {len(names)} interfaces")
        for name, number in zip(names, numbers, strict=True):
            if name not in ("home", f"{group}/home"):
                raise GoalRejectedError(f"{group}: interface {name!r} is not home")
            # Not a number: nothing is commanded, as there.
            if not math.isnan(number):
                commands.append((description.owners(group), number))
    return commands
