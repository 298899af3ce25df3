"""Drive an arm that `bioscara serve` owns, together with its other clients."""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    "arm": ("arm", "Name of the served arm."),
    "table": ("true", "Have the table in the description."),
    "namespace": ("", "Namespace of all nodes."),
    "gui": ("true", "Start RViz and sliders."),
}
"""Default and description of each argument."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the bringup of the scene with their values."""
    scene = PathJoinSubstitution([FindPackageShare("scene_bringup"), "launch", "scene.py"])
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text)
                for name, (value, text) in ARGUMENTS.items()
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(scene),
                launch_arguments={
                    "use_mock_hardware": "false",
                    "homed": "false",
                    "rviz": LaunchConfiguration("gui"),
                    "rqt": LaunchConfiguration("gui"),
                }.items(),
            ),
        ]
    )
