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
ARGUMENTS = {
    "controllers_file": (
        "bioscara_arm_controllers.yaml",
        "Parameters of the controllers: a file in config/, or a path.",
    ),
    "controller_manager_file": (
        "bioscara_controller_manager.yaml",
        "Parameters of the controller manager: a file in config/, or a path.",
    ),
    "arm_description_package": (
        "bioscara_arm_description",
        "Package with the description, as urdf/scene.xacro.",
    ),
    "arm_macro": ("bioscara_arm.xacro", "File of the macro that scene.xacro calls."),
    "prefix": ("", "Prefix of links, joints and components."),
    "use_mock_hardware": ("false", "Drive the simulated arm instead of that on /dev/i2c-1."),
    "homed": ("false", "Start with homed joints; of the simulated arm only."),
    "namespace": ("", "Namespace of all nodes."),
    "gui": ("true", "Start RViz and sliders."),
}
"""Default and description of each argument."""
CONTROLLER = DeclareLaunchArgument(
    "robot_controller",
    default_value="velocity_joint_trajectory_controller",
    choices=["velocity_joint_trajectory_controller", "position_joint_trajectory_controller"],
    description="Controller to load.",
)


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the shared bringup with their values."""
    package = FindPackageShare(LaunchConfiguration("arm_description_package"))
    words = [
        part
        for name in ("arm_macro", "prefix", "use_mock_hardware")
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
            CONTROLLER,
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(bringup),
                launch_arguments={
                    "robot_description": description,
                    "controller_manager_file": manager,
                    "controllers_files": controllers,
                    "controllers": [LaunchConfiguration("robot_controller"), " homing_controller"],
                    "arm": "",
                    "rviz": LaunchConfiguration("gui"),
                    "rviz_config": PathJoinSubstitution([package, "rviz", "display.rviz"]),
                    "rqt": LaunchConfiguration("gui"),
                }.items(),
            ),
        ]
    )
