"""Start the node that drives the arm, its controllers, and programs to look at them.

The launch files of the bringup packages include it. Each of :data:`ARGUMENTS` is an argument of
theirs, or they give it. It declares none, so that ``ros2 launch --show-args`` lists only the
arguments of the launch file itself.

The joint state broadcaster is started first and is active; then come RViz, rqt and the other
controllers, which stay inactive until they are switched on. The end of the node ends everything.
"""

from __future__ import annotations

import atexit
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree

import yaml
from launch import LaunchContext, LaunchDescription
from launch.actions import OpaqueFunction, RegisterEventHandler, Shutdown
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessExit
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {
    "robot_description": "The expanded URDF.",
    "controller_manager_file": "Parameters of the controller manager.",
    "controllers_files": "Parameters of the controllers: files separated by colons.",
    "controllers": "Controllers to load, separated by spaces.",
    "prefix": "Prefix of the joints in the URDF, which the files do not have.",
    "namespace": "Namespace of all nodes, which the files do not have.",
    "use_mock_hardware": "Drive the simulated arm instead of that on /dev/i2c-1.",
    "homed": "Start with homed joints; of the simulated arm only.",
    "arm": "Name of a served arm to drive instead; empty for none.",
    "rviz": "Start RViz.",
    "rviz_config": "Configuration of RViz.",
    "rqt": "Start the sliders for a trajectory.",
}


def generate_launch_description() -> LaunchDescription:
    """Return the action that starts everything."""
    return LaunchDescription([OpaqueFunction(function=bring_up)])


def bring_up(context: LaunchContext) -> list[Any]:
    """Return the actions for the values that the arguments have in a context."""
    # All values are read now: later, those of the files that include this one may be others.
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}

    def chosen(name: str) -> bool:
        return bool(IfCondition(LaunchConfiguration(name)).evaluate(context))

    namespace = f"/{given['namespace'].strip('/')}".rstrip("/")
    # Without a name, which every node of the process would get.
    node = Node(
        package="bioscara_ros",
        executable="controller_manager_node",
        namespace=namespace or None,
        arguments=words_of_node(given, mock=chosen("use_mock_hardware"), homed=chosen("homed")),
        parameters=parameter_files(given, namespace),
        output="both",
        on_exit=Shutdown(reason="the node that drives the arm has ended"),
    )
    broadcaster = spawner("joint_state_broadcaster", namespace)
    later = [spawner(name, namespace, "--inactive") for name in given["controllers"].split()]
    if chosen("rqt"):
        later.insert(0, window("rqt_joint_trajectory_controller", namespace))
    if chosen("rviz"):
        later.insert(0, window("rviz2", namespace, "-d", given["rviz_config"]))
    then = OnProcessExit(target_action=broadcaster, on_exit=later)
    return [node, broadcaster, RegisterEventHandler(then)]


def words_of_node(given: dict[str, str], *, mock: bool, homed: bool) -> list[str]:
    """Return the words by which the node finds its arm."""
    if homed and (given["arm"] or not mock):
        raise RuntimeError(
            "homed:=true is for the simulated arm, whose joints then start as after homing; a real "
            "one has to be homed: give use_mock_hardware:=true, or leave homed out"
        )
    if given["arm"]:
        return ["--arm", given["arm"]]
    if mock:
        return ["--bus", "sim", *(["--homed"] if homed else [])]
    return ["--bus", "linux:1"]


def spawner(controller: str, namespace: str, *words: str) -> Node:
    """Return the action that loads a controller; it waits for the node."""
    return Node(
        package="controller_manager",
        executable="spawner",
        arguments=[controller, "-c", f"{namespace}/controller_manager", *words],
        output="both",
    )


def window(program: str, namespace: str, *words: str) -> Node:
    """Return the action that starts a program with a window, in the package of its name."""
    return Node(
        package=program,
        executable=program,
        namespace=namespace or None,
        arguments=list(words),
        output="log",
    )


def parameter_files(given: dict[str, str], namespace: str) -> list[str]:
    """Write the parameter files of the node into a folder that ends with launch.

    The description is in one, as launch would leave its own file with it behind.
    """
    folder = TemporaryDirectory(prefix="bioscara_")
    atexit.register(folder.cleanup)
    description = {"robot_description": given["robot_description"]}
    contents = [{"controller_manager": {"ros__parameters": description}}]
    joints = unprefixed_joints(given["robot_description"], given["prefix"])
    for path in (given["controller_manager_file"], *given["controllers_files"].split(":")):
        content = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        contents.append(prefixed(content, given["prefix"], joints))
    files = []
    for number, content in enumerate(contents):
        # rclpy takes the section of a node in a namespace only with that.
        sections = {
            name if "*" in name else f"{namespace}/{name.lstrip('/')}": section
            for name, section in content.items()
        }
        files.append(str(Path(folder.name, f"{number}.yaml")))
        Path(files[-1]).write_text(yaml.safe_dump(sections), encoding="utf-8")
    return files


def unprefixed_joints(urdf: str, prefix: str) -> set[str]:
    """Return the names without their prefix of the joints that are controlled in a URDF."""
    root = ElementTree.fromstring(urdf)  # noqa: S314  xacro wrote it on this computer
    names = (joint.attrib["name"] for joint in root.iterfind("ros2_control/joint"))
    return {name.removeprefix(prefix) for name in names if name.startswith(prefix)}


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
