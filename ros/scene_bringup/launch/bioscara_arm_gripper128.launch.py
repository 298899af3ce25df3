"""Start the arm with its gripper."""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

ARGUMENTS = {
    "use_mock_hardware": ("false", "Drive the simulated arm instead of that on /dev/i2c-1."),
    "homed": ("false", "Start with homed joints; of the simulated arm only."),
    "table": ("true", "Have the table in the description."),
    "namespace": ("", "Namespace of all nodes."),
    "gui": ("false", "Start RViz and sliders."),
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
                    "arm": "",
                    "rviz": LaunchConfiguration("gui"),
                    "rqt": LaunchConfiguration("gui"),
                }.items(),
            ),
        ]
    )
