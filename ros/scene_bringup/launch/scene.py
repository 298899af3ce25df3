"""Start the arm with its gripper, by the shared bringup.

The launch files that include it have ``use_mock_hardware``, ``homed``, ``arm``, ``table``,
``namespace``, ``rviz`` and ``rqt``, or give them; like the bringup, it declares none.
"""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import (
    Command,
    FindExecutable,
    LaunchConfiguration,
    PathJoinSubstitution,
)
from launch_ros.substitutions import FindPackageShare

CONTROLLERS = "velocity_joint_trajectory_controller homing_controller gripper_controller"


def generate_launch_description() -> LaunchDescription:
    """Return the shared bringup with the description and the controllers of the scene."""

    def file(package: str, *parts: str) -> PathJoinSubstitution:
        return PathJoinSubstitution([FindPackageShare(package), *parts])

    description = Command(
        [
            FindExecutable(name="xacro"),
            ' "',
            file("scene_descriptions", "urdf", "scene.xacro"),
            '" gripper_description_package:=bioscara_gripper_descriptions use_mock_hardware:="',
            LaunchConfiguration("use_mock_hardware"),
            '" table:="',
            LaunchConfiguration("table"),
            '"',
        ]
    )
    controllers = [
        file("bioscara_arm_bringup", "config", "bioscara_arm_controllers.yaml"),
        ":",
        file("bioscara_gripper_bringup", "config", "bioscara_gripper_controllers.yaml"),
    ]
    manager = file("bioscara_arm_bringup", "config", "bioscara_controller_manager.yaml")
    return LaunchDescription(
        [
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(file("bioscara_ros", "launch", "bringup.py")),
                launch_arguments={
                    "robot_description": description,
                    "controller_manager_file": manager,
                    "controllers_files": controllers,
                    "controllers": CONTROLLERS,
                    "prefix": "",
                    "rviz_config": file("scene_descriptions", "rviz", "display.rviz"),
                }.items(),
            ),
        ]
    )
