"""Move the arm between the poses of a parameter file, by topic.

It has to be homed, with its trajectory controller active.
"""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = "bioscara_arm_bringup"


def generate_launch_description() -> LaunchDescription:
    """Return the argument, and the program that publishes the poses."""
    poses = PathJoinSubstitution(
        [FindPackageShare(PACKAGE), "config", "test_goal_publishers_config.yaml"]
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of the controller's node."
            ),
            Node(
                package=PACKAGE,
                executable="publisher_joint_trajectory_controller",
                namespace=LaunchConfiguration("namespace"),
                parameters=[poses],
                output="both",
            ),
        ]
    )
