"""Start the arm with its gripper, move_group, and RViz with the panel of MoveIt."""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, GroupAction, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

PACKAGE = "bioscara_arm_gripper_128_moveit_config"
ARGUMENTS = {
    "use_mock_hardware": ("false", "Drive the simulated arm instead of that on /dev/i2c-1."),
    "homed": ("false", "Start with homed joints; of the simulated arm only."),
    "table": ("true", "Have the table in the description."),
    "namespace": ("", "Namespace of all nodes."),
}
"""Default and description of each argument."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the actions that are started with their values."""

    def included(package: str, file: str, **given: str) -> GroupAction:
        source = PathJoinSubstitution([FindPackageShare(package), "launch", file])
        # In a group: the arguments of one file are not for the next.
        return GroupAction(
            [
                IncludeLaunchDescription(
                    PythonLaunchDescriptionSource(source), launch_arguments=given.items()
                )
            ]
        )

    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text)
                for name, (value, text) in ARGUMENTS.items()
            ),
            included("scene_bringup", "scene.py", arm="", rviz="false", rqt="false"),
            included(PACKAGE, "move_group.launch.py"),
            included(PACKAGE, "moveit_rviz.launch.py"),
        ]
    )
