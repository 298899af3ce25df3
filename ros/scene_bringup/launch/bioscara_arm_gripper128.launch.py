"""Start the arm with its gripper."""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
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
    """Return the arguments, and the shared bringup with their values."""

    def file(package: str, *parts: str) -> PathJoinSubstitution:
        return PathJoinSubstitution([FindPackageShare(package), *parts])

    description = Command(
        [
            FindExecutable(name="xacro"),
            ' "',
            file("scene_descriptions", "urdf", "scene.xacro"),
            '" gripper_description_package:=bioscara_gripper_descriptions use_mock_hardware:="',
            LaunchConfiguration("use_mock_hardware"),
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
            DeclareLaunchArgument(
                "use_mock_hardware",
                default_value="false",
                description="Drive the simulated arm instead of that on /dev/i2c-1.",
            ),
            DeclareLaunchArgument(
                "gui", default_value="false", description="Start RViz and sliders."
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(file("bioscara_ros", "launch", "bringup.launch.py")),
                launch_arguments={
                    "robot_description": description,
                    "controller_manager_file": manager,
                    "controllers_files": controllers,
                    "controllers": CONTROLLERS,
                    "use_mock_hardware": LaunchConfiguration("use_mock_hardware"),
                    "rviz": LaunchConfiguration("gui"),
                    "rviz_config": file("scene_descriptions", "rviz", "display.rviz"),
                    "rqt": LaunchConfiguration("gui"),
                }.items(),
            ),
        ]
    )
