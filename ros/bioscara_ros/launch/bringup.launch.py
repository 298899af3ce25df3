"""Start the node that drives the arm, its controllers, and programs to look at them.

The launch files of the bringup packages include it; only its arguments differ between them.

The joint state broadcaster is started first and is active; then come RViz, rqt and the other
controllers, which stay inactive until they are switched on. The end of the node ends everything.
"""

from __future__ import annotations

import tempfile
from typing import Any
from xml.etree import ElementTree

import yaml
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    OpaqueFunction,
    RegisterEventHandler,
    Shutdown,
)
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessExit
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

MANAGER = "/controller_manager"


def generate_launch_description() -> LaunchDescription:
    """Return the arguments, and the actions that follow from their values."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("robot_description", description="The expanded URDF."),
            DeclareLaunchArgument(
                "controller_manager_file", description="Parameters of the controller manager."
            ),
            DeclareLaunchArgument(
                "controllers_files",
                description="Parameters of the controllers: files separated by colons.",
            ),
            DeclareLaunchArgument(
                "controllers", description="Controllers to load, separated by spaces."
            ),
            DeclareLaunchArgument(
                "prefix",
                default_value="",
                description="Prefix of the joints in the URDF, which the files do not have.",
            ),
            DeclareLaunchArgument(
                "use_mock_hardware",
                default_value="false",
                description="Drive the simulated arm instead of that on /dev/i2c-1.",
            ),
            DeclareLaunchArgument(
                "arm",
                default_value="",
                description="Name of a served arm to drive, instead of a bus.",
            ),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz."),
            DeclareLaunchArgument(
                "rviz_config", default_value="", description="Configuration of RViz."
            ),
            DeclareLaunchArgument(
                "rqt", default_value="false", description="Start the sliders for a trajectory."
            ),
            OpaqueFunction(function=bring_up),
        ]
    )


def bring_up(context: LaunchContext) -> list[Any]:
    """Return the actions for the values that the arguments have in a context."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    prefix, urdf = value("prefix"), value("robot_description")
    files = [value("controller_manager_file"), *value("controllers_files").split(":")]
    if prefix:
        joints = unprefixed_joints(urdf, prefix)
        files = [prefixed_file(path, prefix, joints) for path in files]
    if value("arm"):
        where = ["--arm", value("arm")]
    elif IfCondition(LaunchConfiguration("use_mock_hardware")).evaluate(context):
        where = ["--bus", "sim"]
    else:
        where = ["--bus", "linux:1"]
    # Without a name, which every node of the process would get.
    node = Node(
        package="bioscara_ros",
        executable="controller_manager_node",
        arguments=where,
        parameters=[{"robot_description": ParameterValue(urdf, value_type=str)}, *files],
        output="both",
        on_exit=Shutdown(reason="the node that drives the arm has ended"),
    )
    broadcaster = spawner("joint_state_broadcaster")
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", value("rviz_config")],
        output="log",
        condition=IfCondition(LaunchConfiguration("rviz")),
    )
    rqt = Node(
        package="rqt_joint_trajectory_controller",
        executable="rqt_joint_trajectory_controller",
        output="log",
        condition=IfCondition(LaunchConfiguration("rqt")),
    )
    others = [spawner(name, "--inactive") for name in value("controllers").split()]
    then = OnProcessExit(target_action=broadcaster, on_exit=[rviz, rqt, *others])
    return [node, broadcaster, RegisterEventHandler(then)]


def spawner(controller: str, *words: str) -> Node:
    """Return the action that loads a controller; it waits for the node."""
    return Node(
        package="controller_manager",
        executable="spawner",
        arguments=[controller, "-c", MANAGER, *words],
        output="both",
    )


def unprefixed_joints(urdf: str, prefix: str) -> set[str]:
    """Return the names without their prefix of the joints that are controlled in a URDF."""
    root = ElementTree.fromstring(urdf)  # noqa: S314  xacro wrote it on this computer
    names = (joint.attrib["name"] for joint in root.iterfind("ros2_control/joint"))
    return {name.removeprefix(prefix) for name in names if name.startswith(prefix)}


def prefixed_file(path: str, prefix: str, joints: set[str]) -> str:
    """Write parameters in which each joint has the prefix, and return the new file."""
    with open(path, encoding="utf-8") as file:
        parameters = yaml.safe_load(file)
    with tempfile.NamedTemporaryFile(
        "w", encoding="utf-8", prefix="bioscara_", suffix=".yaml", delete=False
    ) as copy:
        yaml.safe_dump(prefixed(parameters, prefix, joints), copy)
    return copy.name


def prefixed(value: Any, prefix: str, joints: set[str]) -> Any:
    """Return a value of a parameter file with the prefix before each joint in it."""
    if isinstance(value, dict):
        return {
            prefixed(key, prefix, joints): prefixed(each, prefix, joints)
            for key, each in value.items()
        }
    if isinstance(value, list):
        return [prefixed(each, prefix, joints) for each in value]
    # "j1", or an interface of it, as "j1/position".
    if isinstance(value, str) and value.partition("/")[0] in joints:
        return prefix + value
    return value
