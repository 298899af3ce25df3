"""Start Gazebo with a model of the arm that follows the simulated arm.

The simulated arm is that of simulated_arm.launch.py: its joints run the firmware, and all clients
of ROS command it. Gazebo adds the world around it, and its clock.
"""

from __future__ import annotations

import os
from typing import Any
from xml.etree import ElementTree

from ament_index_python.packages import get_package_share_directory
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    AppendEnvironmentVariable,
    DeclareLaunchArgument,
    IncludeLaunchDescription,
    OpaqueFunction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import Command, FindExecutable, LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

MESHES = ("bioscara_arm_description", "bioscara_gripper_descriptions")
"""Packages with the meshes, which Gazebo finds by its own path."""
ARGUMENTS = {
    "world": ("empty.sdf", "World: a file of Gazebo."),
    "z": ("0.32", "Height of the table's top in the world [m]."),
    "table": ("true", "Set the arm on a table."),
    "homed": ("false", "Start with homed joints."),
    "namespace": ("", "Namespace of all nodes."),
    "gui": ("true", "Show Gazebo's window; or only simulate."),
}
"""Default and description of each argument."""


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the actions that follow from their values."""
    shares = (get_package_share_directory(package) for package in MESHES)
    # Mostly it is one folder.
    folders = dict.fromkeys(os.path.dirname(share) for share in shares)
    return LaunchDescription(
        [
            *(
                DeclareLaunchArgument(name, default_value=value, description=text)
                for name, (value, text) in ARGUMENTS.items()
            ),
            _include("bioscara_arm_description", "temporary_files.py"),
            *(AppendEnvironmentVariable("GZ_SIM_RESOURCE_PATH", each) for each in folders),
            OpaqueFunction(function=bring_up),
        ]
    )


def bring_up(context: LaunchContext) -> list[Any]:
    """Return the actions for the values that the arguments have in a context."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    namespace, options = value("namespace").strip("/"), value("world")
    topics = f"/{namespace}/gazebo" if namespace else "/gazebo"
    urdf = Command(
        [FindExecutable(name="xacro"), ' "', _file("scene_descriptions", "urdf", "scene.xacro"),
         '" gripper_description_package:=bioscara_gripper_descriptions table:=', value("table"),
         " gazebo:=", topics]
    ).perform(context)  # fmt: skip
    described = {"robot_description": ParameterValue(urdf, value_type=str)}
    if value("gui") in ("false", "False", "0"):
        options += " -s"
    # Gazebo's topics have the names of ROS; "]" is from ROS to Gazebo, "[" the other way.
    bridged = ["/clock@rosgraph_msgs/msg/Clock[gz.msgs.Clock"] + [
        f"{topics}/{joint}/position@std_msgs/msg/Float64]gz.msgs.Double"
        for joint in movable_joints(urdf)
    ]
    return [
        _include(
            "ros_gz_sim", "gz_sim.launch.py",
            gz_args=f"-r {options}", on_exit_shutdown="true",
        ),
        Node(
            package="ros_gz_sim",
            executable="create",
            arguments=["-name", namespace or "scene", "-param", "robot_description",
                       "-z", value("z")],
            parameters=[described],
            output="both",
        ),
        Node(package="ros_gz_bridge", executable="parameter_bridge", arguments=bridged),
        Node(
            package="scene_bringup",
            executable="gazebo_joints",
            namespace=namespace,
            parameters=[described],
            output="both",
        ),
        # At the end: its values of the arguments hold for all later actions.
        _include(
            "scene_bringup", "simulated_arm.launch.py",
            gui="false", homed=value("homed"), table=value("table"), namespace=namespace,
        ),
    ]  # fmt: skip


def movable_joints(urdf: str) -> list[str]:
    """Return the names of the joints of a description that are not fixed."""
    root = ElementTree.fromstring(urdf)  # noqa: S314  xacro wrote it on this computer
    return [tag.attrib["name"] for tag in root.findall("joint") if tag.attrib["type"] != "fixed"]


def _file(package: str, *parts: str) -> str:
    return os.path.join(get_package_share_directory(package), *parts)


def _include(package: str, name: str, **arguments: str) -> IncludeLaunchDescription:
    source = PythonLaunchDescriptionSource(_file(package, "launch", name))
    return IncludeLaunchDescription(source, launch_arguments=arguments.items())
