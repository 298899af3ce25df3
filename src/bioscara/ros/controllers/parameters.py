"""Parameters of nodes, as the owner's controllers take them."""

from __future__ import annotations

import array
from collections.abc import Callable, Mapping
from typing import Any

from bioscara.arguments import shown
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.joint_state_broadcaster import JointStateBroadcaster
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.manager.diagnostics import default_thresholds
from bioscara.errors import ConfigurationError
from bioscara.hardware import HOME, POSITION, VELOCITY
from bioscara.model.parameters import JOINTS
from bioscara.ros.arm.control_tags import GRIPPER_JOINT
from bioscara.ros.arm.description import RobotDescription

OF_NODES = frozenset(
    {
        "robot_description",
        "use_sim_time",
        "start_type_description_service",
        "qos_overrides",
        "type",
        "params_file",
        "node_options_args",
        "thread_priority",
        "cpu_affinity",
        "lock_memory",
        "async_parameters",
        "is_async",
    }
)
"""Parameters of nodes and of threads, and of all nodes of a launch file: no controller has them."""
_OF_BROADCASTER = frozenset(
    {
        "frame_id",
        "use_local_topics",
        "use_urdf_to_filter",
        "publish_dynamic_joint_states",
        "interfaces",
        "map_interface_to_joint_state",
    }
)
"""Parameters of the broadcaster that concern its messages only."""
_PUBLISHED = (POSITION, VELOCITY, "effort", HOME)
"""Interfaces in its messages; no joint has an effort, which is NaN."""

_FIXED: dict[str, tuple[Any, str]] = {
    "enforce_command_limits": (True, "limits always apply"),
    "handle_exceptions": (True, "a controller that fails is always deactivated"),
    "overruns.manage": (True, "missed cycles are always left out"),
    "overruns.print_warnings": (True, "overruns are always reported"),
    "defaults.allow_controller_activation_with_inactive_hardware": (
        False,
        "commands for hardware that is not active are always refused",
    ),
    "defaults.deactivate_controllers_on_hardware_self_deactivate": (
        True,
        "hardware that goes down always takes its controllers along",
    ),
}
"""Parameters of ros2_control's manager with the only value that they can have here, and why."""
_OF_OWNER = {
    "hardware_components_initial_state": "nothing is energised by a start; set the state by the "
    "service",
    "thread_priority": "bioscara serve has the option --priority",
    "cpu_affinity": "taskset chooses the processors of bioscara serve",
    "lock_memory": "bioscara serve --priority locks the memory",
    "shutdown_on_initial_state_failure": "the initial state is not set by the start",
}
"""Parameters that have no effect, and those that have one."""


THRESHOLD = "diagnostics.threshold."
"""Begin of the names of the thresholds of diagnostics among the parameters of the manager."""
STRICTNESS = "defaults.switch_controller.strictness"
"""Parameter of the manager: how switches are carried out whose requests do not say it."""
STRICTNESSES = ("strict", "best_effort")
"""Its values; the first is the default."""


def without_effect(flat: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each parameter of the manager that requests an unsupported function.

    Args:
        flat: Parameters of the manager, with dots in their names.
    """
    found = [
        f"{name} {value!r} has no effect: {_FIXED[name][1]}"
        for name, value in flat.items()
        if name in _FIXED and value != _FIXED[name][0]
    ]
    strictness = flat.get(STRICTNESS, STRICTNESSES[0])
    if strictness not in STRICTNESSES:
        found.append(f"{STRICTNESS} {strictness!r} is none of {', '.join(STRICTNESSES)}")
    known = {THRESHOLD + name for name in default_thresholds(1)}
    found += [
        f"{name} has no effect: there is no such threshold here; docs/ros2.md lists them"
        for name in flat
        if name.startswith("diagnostics.") and name not in known
    ]
    groups = dict.fromkeys(name.partition(".")[0] for name in flat)
    found += [f"{name} has no effect: {_OF_OWNER[name]}" for name in groups if name in _OF_OWNER]
    return found


def nested(flat: Mapping[str, Any]) -> dict[str, Any]:
    """Return parameters in groups, from names with dots; arrays become lists.

    Raises:
        ConfigurationError: A name is that of a value and of a group.
    """
    tree: dict[str, Any] = {}
    for name, value in flat.items():
        *groups, last = name.split(".")
        branch = tree
        for group in groups:
            branch = branch.setdefault(group, {})
            if not isinstance(branch, dict):
                raise ConfigurationError(f"parameter {name}: {group} has a value already")
        if isinstance(branch.get(last), dict):
            raise ConfigurationError(f"parameter {name} is also a group of parameters")
        branch[last] = list(value) if isinstance(value, list | tuple | array.array) else value
    return tree


def for_owner(kind: str, flat: Mapping[str, Any], description: RobotDescription) -> dict[str, Any]:
    """Return the parameters of a controller, as the owner of the arm takes them.

    Args:
        kind: Type of the controller.
        flat: Parameters of its node, with dots in their names.
        description: The description with the names of joints.

    Raises:
        ConfigurationError: One asks for something that does not exist here.
    """
    values = nested({name: value for name, value in flat.items() if value is not None})
    values = description.owners_value(values)
    asynchronous = values.get("is_async", False)
    for name in OF_NODES & values.keys():
        del values[name]
    if asynchronous:
        raise ConfigurationError(
            "is_async: there are no asynchronous controllers here; leave it out"
        )
    arranged = _ARRANGED.get(kind)
    return values if arranged is None else arranged(values)


def _trajectory(values: dict[str, Any]) -> dict[str, Any]:
    commanded = values.pop("command_joints", None)
    if commanded and commanded != values.get("joints"):
        raise ConfigurationError(
            f"command_joints {commanded}: the measured joints are the commanded ones here; leave "
            "it out"
        )
    # Not used by ros2_controllers any more; older files have it.
    values.pop("state_publish_rate", None)
    if values.pop("open_loop_control", False):
        raise ConfigurationError(
            "open_loop_control: leave it out; interpolate_from_desired_state replaces it"
        )
    gains = values.get("gains")
    for joint, group in gains.items() if isinstance(gains, dict) else ():
        if isinstance(group, dict) and "i_clamp" in group:
            raise ConfigurationError(
                f"gains.{joint}.i_clamp: leave it out; i_clamp_max and i_clamp_min replace it"
            )
    return values


def _gripper(values: dict[str, Any]) -> dict[str, Any]:
    measured = values.pop("state_interfaces", [POSITION, VELOCITY])
    if not isinstance(measured, list) or sorted(map(str, measured)) != [POSITION, VELOCITY]:
        raise ConfigurationError(
            f"state_interfaces {shown(measured)}: position and velocity are measured; leave it out"
        )
    for name in ("max_effort_interface", "max_velocity_interface"):
        if values.get(name):
            raise ConfigurationError(
                f"{name} {shown(values[name])}: the gripper takes positions alone; leave it out"
            )
    return values


def _homing(values: dict[str, Any]) -> dict[str, Any]:
    if values.get("max_travel") and not values.get("joints"):
        raise ConfigurationError(
            f"max_travel {values['max_travel']} is of joints in no known order; give joints, too"
        )
    if gpios := values.pop("gpios", None):
        raise ConfigurationError(f"gpios {shown(gpios)}: the arm has no GPIOs; leave it out")
    if values.get("joints") == []:
        # The default there; those of the interfaces count.
        del values["joints"]
    for which in ("command_interfaces", "state_interfaces"):
        section = values.get(which)
        if isinstance(section, dict) and isinstance(section.get("joints"), dict):
            # As the arm has them: files give them in no order.
            values[which] = {**section, "joints": dict(sorted(section["joints"].items()))}
    return values


def _broadcaster(values: dict[str, Any]) -> dict[str, Any]:
    renamed = values.get("map_interface_to_joint_state", {})
    if not isinstance(renamed, dict) or any(name != given for name, given in renamed.items()):
        raise ConfigurationError(
            f"map_interface_to_joint_state {renamed}: interfaces keep their names; leave it out"
        )
    kinds = values.get("interfaces") or ()
    for kind in kinds if isinstance(kinds, list | tuple) else (kinds,):
        if kind not in _PUBLISHED:
            raise ConfigurationError(
                f"interfaces: {shown(kind)} is none of {', '.join(_PUBLISHED)}; name some of these"
            )
    kept = {name: value for name, value in values.items() if name not in _OF_BROADCASTER}
    given, known = kept.pop("joints", None) or JOINTS, (*JOINTS, GRIPPER_JOINT)
    for joint in given:
        if joint not in known:
            raise ConfigurationError(
                f"joints: {shown(joint)} is none of {', '.join(known)}; name some of these"
            )
    # The gripper is published where it has a position, and must not be required.
    return {**kept, "joints": [joint for joint in given if joint in JOINTS] or list(JOINTS)}


_ARRANGED: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    JointTrajectoryController.TYPE: _trajectory,
    GripperActionController.TYPE: _gripper,
    HomingController.TYPE: _homing,
    JointStateBroadcaster.TYPE: _broadcaster,
}
"""How the parameters of each type are arranged; others are passed on."""
ALSO_KNOWN: dict[str, frozenset[str]] = {
    GripperActionController.TYPE: frozenset({"state_interfaces"}),
    HomingController.TYPE: frozenset({"command_interfaces", "gpios", "state_interfaces"}),
    JointStateBroadcaster.TYPE: _OF_BROADCASTER,
    JointTrajectoryController.TYPE: frozenset(
        {"command_joints", "open_loop_control", "state_publish_rate"}
    ),
}
"""Names of parameters that only files of ROS have, by the type of the controller."""
