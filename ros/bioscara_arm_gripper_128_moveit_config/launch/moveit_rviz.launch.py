"""Start RViz with the panel of MoveIt."""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import PushRosNamespace
from launch_ros.substitutions import FindPackageShare
from moveit_configs_utils import MoveItConfigsBuilder
from moveit_configs_utils.launches import generate_moveit_rviz_launch

PACKAGE = "bioscara_arm_gripper_128_moveit_config"


def generate_launch_description() -> LaunchDescription:
    """Return the program, with the arguments that MoveIt gives it, and a namespace."""
    config = (
        MoveItConfigsBuilder("scene", package_name=PACKAGE)
        .robot_description(
            mappings={"gripper_description_package": "bioscara_gripper_descriptions"}
        )
        .to_moveit_configs()
    )
    program = generate_moveit_rviz_launch(config)
    namespace = PushRosNamespace(LaunchConfiguration("namespace"))
    files = PathJoinSubstitution(
        [FindPackageShare("bioscara_arm_description"), "launch", "temporary_files.py"]
    )
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of move_group."
            ),
            IncludeLaunchDescription(PythonLaunchDescriptionSource(files)),
            GroupAction([namespace, *program.entities]),
        ]
    )
