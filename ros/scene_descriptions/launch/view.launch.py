"""Show the arm with a gripper, with a slider for each joint."""

from __future__ import annotations

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import (
    Command,
    FindExecutable,
    LaunchConfiguration,
    PathJoinSubstitution,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = "scene_descriptions"
ARGUMENTS = [
    DeclareLaunchArgument(
        "prefix", default_value="", description="Prefix of links, joints and components."
    ),
    DeclareLaunchArgument(
        "arm_description_package",
        default_value="bioscara_arm_description",
        description="Package of the arm.",
    ),
    DeclareLaunchArgument(
        "arm_macro", default_value="bioscara_arm.xacro", description="File of the macro of the arm."
    ),
    DeclareLaunchArgument(
        "gripper_description_package",
        default_value="bioscara_gripper_descriptions",
        description="Package of the gripper.",
    ),
    DeclareLaunchArgument(
        "gripper_macro",
        default_value="bioscara_gripper_128.xacro",
        description="File of the macro of the gripper.",
    ),
    DeclareLaunchArgument(
        "use_mock_hardware",
        default_value="false",
        description="Write the plugin of a simulated component.",
    ),
    DeclareLaunchArgument("table", default_value="true", description="Show the table."),
]
"""Those of urdf/scene.xacro."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, the programs that publish frames, and RViz."""
    package = FindPackageShare(PACKAGE)
    gui, namespace = LaunchConfiguration("gui"), LaunchConfiguration("namespace")
    words = [
        part
        for argument in ARGUMENTS
        for part in (f' {argument.name}:="', LaunchConfiguration(argument.name), '"')
    ]
    scene = PathJoinSubstitution([package, "urdf", "scene.xacro"])
    description = Command([FindExecutable(name="xacro"), ' "', scene, '"', *words])
    return LaunchDescription(
        [
            *ARGUMENTS,
            DeclareLaunchArgument(
                "namespace", default_value="", description="Namespace of all nodes."
            ),
            DeclareLaunchArgument(
                "gui", default_value="true", description="Start RViz and sliders for the joints."
            ),
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                parameters=[{"robot_description": ParameterValue(description, value_type=str)}],
                namespace=namespace,
                output="both",
            ),
            Node(
                package="joint_state_publisher_gui",
                executable="joint_state_publisher_gui",
                namespace=namespace,
                condition=IfCondition(gui),
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                namespace=namespace,
                arguments=["-d", PathJoinSubstitution([package, "rviz", "display.rviz"])],
                output="log",
                condition=IfCondition(gui),
            ),
            Node(
                package="joint_state_publisher",
                executable="joint_state_publisher",
                namespace=namespace,
                condition=UnlessCondition(gui),
            ),
        ]
    )
