"""Publish the frames of a description, and show it in RViz with a slider for each joint.

The launch files of the descriptions include it. They give ``package``, that of
``urdf/scene.xacro``, and ``words``, the names of the arguments that it takes; these, ``namespace``
and ``gui`` are arguments of theirs. Like the bringup, it declares none.
"""

from __future__ import annotations

from launch import LaunchContext, LaunchDescription
from launch.actions import IncludeLaunchDescription, OpaqueFunction
from launch.conditions import IfCondition, UnlessCondition
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import (
    Command,
    FindExecutable,
    LaunchConfiguration,
    PathJoinSubstitution,
)
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare


def generate_launch_description() -> LaunchDescription:
    """Return the action that starts everything."""
    files = PathJoinSubstitution(
        [FindPackageShare("bioscara_arm_description"), "launch", "temporary_files.py"]
    )
    return LaunchDescription(
        [
            IncludeLaunchDescription(PythonLaunchDescriptionSource(files)),
            OpaqueFunction(function=show),
        ]
    )


def show(context: LaunchContext) -> list[Node]:
    """Return the programs that publish frames, and RViz, for the values that arguments have."""
    package = FindPackageShare(LaunchConfiguration("package"))
    words = [
        part
        for name in LaunchConfiguration("words").perform(context).split()
        for part in (f' {name}:="', LaunchConfiguration(name), '"')
    ]
    scene = PathJoinSubstitution([package, "urdf", "scene.xacro"])
    description = Command([FindExecutable(name="xacro"), ' "', scene, '"', *words])
    gui = LaunchConfiguration("gui")
    rviz = PathJoinSubstitution([package, "rviz", "display.rviz"])
    described = {"robot_description": ParameterValue(description, value_type=str)}
    common = {"namespace": LaunchConfiguration("namespace")}
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            parameters=[described],
            output="both",
            **common,
        ),
        Node(
            package="joint_state_publisher_gui",
            executable="joint_state_publisher_gui",
            condition=IfCondition(gui),
            **common,
        ),
        Node(
            package="rviz2",
            executable="rviz2",
            arguments=["-d", rviz],
            output="log",
            condition=IfCondition(gui),
            **common,
        ),
        Node(
            package="joint_state_publisher",
            executable="joint_state_publisher",
            condition=UnlessCondition(gui),
            **common,
        ),
    ]
