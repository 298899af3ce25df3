"""Drive an arm that `bioscara serve` owns, together with its other clients."""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the bringup of the scene with their values."""
    scene = PathJoinSubstitution([FindPackageShare("scene_bringup"), "launch", "scene.py"])
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "arm", default_value="arm", description="Name of the served arm."
            ),
            DeclareLaunchArgument(
                "table", default_value="true", description="Have the table in the description."
            ),
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of all nodes."
            ),
            DeclareLaunchArgument(
                "gui", default_value="true", description="Start RViz and sliders."
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(scene),
                launch_arguments={
                    "use_mock_hardware": "false",
                    "homed": "false",
                    "arm": LaunchConfiguration("arm"),
                    "table": LaunchConfiguration("table"),
                    "namespace": LaunchConfiguration("namespace"),
                    "rviz": LaunchConfiguration("gui"),
                    "rqt": LaunchConfiguration("gui"),
                }.items(),
            ),
        ]
    )
