"""Show the arm with a gripper, with a slider for each joint."""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare

PACKAGE = "scene_descriptions"
SCENE = {
    "prefix": ("", "Prefix of links, joints and components."),
    "arm_description_package": ("bioscara_arm_description", "Package of the arm."),
    "arm_macro": ("bioscara_arm.xacro", "File of the macro of the arm."),
    "gripper_description_package": ("bioscara_gripper_descriptions", "Package of the gripper."),
    "gripper_macro": ("bioscara_gripper_128.xacro", "File of the macro of the gripper."),
    "use_mock_hardware": ("false", "Write the plugin of a simulated component."),
    "table": ("true", "Show the table."),
}
"""Arguments of urdf/scene.xacro: default and description of each argument."""
ARGUMENTS = {
    **SCENE,
    "namespace": ("", "Namespace of all nodes."),
    "gui": ("true", "Start RViz and sliders for the joints."),
}


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the shared file that shows a description with their values."""
    show = PathJoinSubstitution([FindPackageShare("bioscara_arm_description"), "launch", "show.py"])
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text)
                for name, (value, text) in ARGUMENTS.items()
            ),
            IncludeLaunchDescription(
                PythonLaunchDescriptionSource(show),
                launch_arguments={"package": PACKAGE, "words": " ".join(SCENE)}.items(),
            ),
        ]
    )
