"""Move the arm between the poses of a parameter file, by topic.

It has to be homed, with its trajectory controller active.
"""

from __future__ import annotations

from launch import LaunchDescription
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "bioscara_arm_bringup"


def generate_launch_description() -> LaunchDescription:
    """Return the program that publishes the poses."""
    poses = PathJoinSubstitution(
        [FindPackageShare(PACKAGE), "config", "test_goal_publishers_config.yaml"]
    )
    return LaunchDescription(
        [
            Node(
                package=PACKAGE,
                executable="publisher_joint_trajectory_controller",
                parameters=[poses],
                output="both",
            )
        ]
    )
