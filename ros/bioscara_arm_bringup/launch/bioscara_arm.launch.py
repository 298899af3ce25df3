"""Start the arm without a gripper."""

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

PACKAGE = "bioscara_arm_bringup"
ARGUMENTS = [
    DeclareLaunchArgument(
        "controllers_file",
        default_value="bioscara_arm_controllers.yaml",
        description="Parameters of the controllers: a file in config/, or a path.",
    ),
    DeclareLaunchArgument(
        "controller_manager_file",
        default_value="bioscara_controller_manager.yaml",
        description="Parameters of the controller manager: a file in config/, or a path.",
    ),
    DeclareLaunchArgument(
        "arm_description_package",
        default_value="bioscara_arm_description",
        description="Package with the description, as urdf/scene.xacro.",
    ),
    DeclareLaunchArgument(
        "arm_macro",
        default_value="bioscara_arm.xacro",
        description="File of the macro that scene.xacro calls.",
    ),
    DeclareLaunchArgument(
        "prefix", default_value="", description="Prefix of links, joints and components."
    ),
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
    DeclareLaunchArgument("namespace", default_value="", description="Namespace of all nodes."),
    DeclareLaunchArgument(
        "robot_controller",
        default_value="velocity_joint_trajectory_controller",
        choices=["velocity_joint_trajectory_controller", "position_joint_trajectory_controller"],
        description="Controller to load.",
    ),
    DeclareLaunchArgument("gui", default_value="true", description="Start RViz."),
]


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the shared bringup with their values."""
    package = FindPackageShare(LaunchConfiguration("arm_description_package"))
    description = Command(
        [
            FindExecutable(name="xacro"),
            ' "',
            PathJoinSubstitution([package, "urdf", "scene.xacro"]),
            '" arm_macro:="',
            LaunchConfiguration("arm_macro"),
            '" prefix:="',
            LaunchConfiguration("prefix"),
            '" use_mock_hardware:="',
            LaunchConfiguration("use_mock_hardware"),
            '"',
        ]
    )
    config = PathJoinSubstitution([FindPackageShare(PACKAGE), "config"])
    bringup = PathJoinSubstitution([FindPackageShare("bioscara_ros"), "launch", "bringup.py"])
    return LaunchDescription(
        [
            *ARGUMENTS,
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(bringup),
                launch_arguments={
                    "robot_description": description,
                    "controller_manager_file": PathJoinSubstitution(
                        [config, LaunchConfiguration("controller_manager_file")]
                    ),
                    "controllers_files": PathJoinSubstitution(
                        [config, LaunchConfiguration("controllers_file")]
                    ),
                    "controllers": [LaunchConfiguration("robot_controller"), " homing_controller"],
                    "prefix": LaunchConfiguration("prefix"),
                    "namespace": LaunchConfiguration("namespace"),
                    "use_mock_hardware": LaunchConfiguration("use_mock_hardware"),
                    "homed": LaunchConfiguration("homed"),
                    "arm": "",
                    "rviz": LaunchConfiguration("gui"),
                    "rviz_config": PathJoinSubstitution([package, "rviz", "display.rviz"]),
                    "rqt": "true",
                }.items(),
            ),
        ]
    )
