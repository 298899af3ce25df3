"""Start the gripper alone."""

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

PACKAGE = "bioscara_gripper_bringup"
ARGUMENTS = {
    "controllers_file": (
        "bioscara_gripper_controllers.yaml",
        "Parameters of the controllers: a file in config/, or a path.",
    ),
    "controller_manager_file": (
        "bioscara_gripper_controller_manager.yaml",
        "Parameters of the controller manager: a file in config/, or a path.",
    ),
    "gripper_description_package": (
        "bioscara_gripper_descriptions",
        "Package with the description, as urdf/scene.xacro.",
    ),
    "gripper_macro": ("bioscara_gripper_128.xacro", "File of the macro that scene.xacro calls."),
    "prefix": ("", "Prefix of links, joints and components."),
    "use_mock_hardware": ("false", "Drive the simulated arm instead of that on /dev/i2c-1."),
    "namespace": ("", "Namespace of all nodes."),
    "robot_controller": ("gripper_controller", "Controller to load."),
    "gui": ("true", "Start RViz."),
}
"""Default and description of each argument."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the shared bringup with their values."""
    package = FindPackageShare(LaunchConfiguration("gripper_description_package"))
    words = [
        part
        for name in ("gripper_macro", "prefix", "use_mock_hardware")
        for part in (f' {name}:="', LaunchConfiguration(name), '"')
    ]
    scene = PathJoinSubstitution([package, "urdf", "scene.xacro"])
    description = Command([FindExecutable(name="xacro"), ' "', scene, '"', *words])
    config = PathJoinSubstitution([FindPackageShare(PACKAGE), "config"])
    bringup = PathJoinSubstitution([FindPackageShare("bioscara_ros"), "launch", "bringup.py"])
    manager, controllers = (
        PathJoinSubstitution([config, LaunchConfiguration(name)])
        for name in ("controller_manager_file", "controllers_file")
    )
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text)
                for name, (value, text) in ARGUMENTS.items()
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(bringup),
                launch_arguments={
                    "robot_description": description,
                    "controller_manager_file": manager,
                    "controllers_files": controllers,
                    "controllers": LaunchConfiguration("robot_controller"),
                    "homed": "false",
                    "arm": "",
                    "rviz": LaunchConfiguration("gui"),
                    "rviz_config": PathJoinSubstitution([package, "rviz", "display.rviz"]),
                    "rqt": "false",
                }.items(),
            ),
        ]
    )
