"""Start the arm with its gripper, move_group, and RViz with the panel of MoveIt."""

from __future__ import annotations

from typing import Any

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

PACKAGE = "bioscara_arm_gripper_128_moveit_config"


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the actions that are started with their values."""

    def included(package: str, file: str, **arguments: Any) -> GroupAction:
        source = PathJoinSubstitution([FindPackageShare(package), "launch", file])
        given = {"namespace": LaunchConfiguration("namespace"), **arguments}
        # In a group: the arguments of one file are not those of the next.
        return GroupAction(
            [
                IncludeLaunchDescription(
                    PythonLaunchDescriptionSource(source), launch_arguments=given.items()
                )
            ]
        )

    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "use_mock_hardware",
                default_value="false",
                description="Drive the simulated arm instead of that on /dev/i2c-1.",
            ),
            DeclareLaunchArgument(
                "homed",
                default_value="false",
                description="Start with homed joints; of the simulated arm only.",
            ),
            DeclareLaunchArgument(
                "table", default_value="true", description="Have the table in the description."
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of all nodes."
            ),
            included(
                "scene_bringup",
                "scene.py",
                use_mock_hardware=LaunchConfiguration("use_mock_hardware"),
                homed=LaunchConfiguration("homed"),
                table=LaunchConfiguration("table"),
                arm="",
                rviz="false",
                rqt="false",
            ),
            included(PACKAGE, "move_group.launch.py", table=LaunchConfiguration("table")),
            included(PACKAGE, "moveit_rviz.launch.py"),
        ]
    )
