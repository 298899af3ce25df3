"""The parameters of the four types of controllers of ros2_controllers, and of the original's.

Names, types and defaults are those of the files `*_parameters.yaml` of their repositories, at:

- ros2_controllers, master 94e74de35f9d04f313aca8f29df66c3a76004aa7 (after 6.9.0),
  kilted 0f8eb14e1a7301dd351c0b9cca51a30c86e079ee, jazzy ed360c97d6e9e74cb884e3e39a949d987cd15c11;
- DALSA-Lab/ros2_control-single_trigger_controller, main 2912ade218d16e703fed559094628e616878a1df.
"""

from __future__ import annotations

import math
from typing import NamedTuple

TRAJECTORY = "joint_trajectory_controller/JointTrajectoryController"
BROADCASTER = "joint_state_broadcaster/JointStateBroadcaster"
FORWARD = "forward_command_controller/ForwardCommandController"
GRIPPER = "parallel_gripper_action_controller/GripperActionController"
HOMING = "single_trigger_controller/SingleTriggerController"
Value = str | float | bool | list[str]
TAKEN, IDLE = "", "without effect"
"""A value that has its effect, and one that is accepted without; others are refused."""


class Parameter(NamedTuple):
    """A parameter upstream, and the result of two values of it.

    Attributes:
        name: Its name; that of a joint is j1, and of a GPIO g1.
        default: Its default upstream; None where it is required.
        with_default: TAKEN, IDLE, or the reason why the default is refused, as a regular
            expression.
        other: Another value that it may have upstream.
        with_other: Likewise of that.
        only: Branches that have it so; empty for all.
    """

    name: str
    default: Value | None
    with_default: str
    other: Value
    with_other: str
    only: str = ""


_NO_INTERFACE = "it must be ''"
_KINDS = "it must be 'position' or 'velocity'"
_RENAMED = "interfaces keep their names"
_HOME = r"not \[home\]"
_NO_GPIO = r"give joints: NAME: interfaces: \[home\]"
_POSITIONS = "takes positions alone"
UPSTREAM: dict[str, tuple[Parameter, ...]] = {
    TRAJECTORY: (
        Parameter("joints", [], "at least one joint", ["j2", "j1"], TAKEN),
        Parameter("command_joints", [], TAKEN, ["j1"], "are the commanded ones"),
        Parameter("command_interfaces", [], "it is position, velocity", ["effort"], _KINDS),
        Parameter("state_interfaces", [], "it is position, or", ["acceleration"], _KINDS),
        Parameter("speed_scaling.initial_scaling_factor", 1.0, TAKEN, 0.5, TAKEN),
        Parameter("speed_scaling.state_interface", "", TAKEN, "a/b", _NO_INTERFACE),
        Parameter("speed_scaling.command_interface", "", TAKEN, "a/b", _NO_INTERFACE),
        Parameter("allow_partial_joints_goal", False, TAKEN, True, TAKEN),
        Parameter("allow_trajectory_replacement", True, TAKEN, False, TAKEN, "master"),
        Parameter("open_loop_control", False, TAKEN, True, "interpolate_from_desired", "jazzy"),
        Parameter("interpolate_from_desired_state", False, TAKEN, True, TAKEN),
        Parameter("allow_integration_in_goal_trajectories", False, TAKEN, True, TAKEN),
        Parameter(
            "set_last_command_interface_value_as_state_on_activation", True, TAKEN, False, TAKEN
        ),
        Parameter("action_monitor_rate", 20.0, TAKEN, 0.1, TAKEN),
        Parameter("interpolation_method", "splines", TAKEN, "none", TAKEN),
        Parameter("positions_upsampling.enable", False, TAKEN, True, TAKEN, "master"),
        Parameter("positions_upsampling.policy_frequency", 0.0, TAKEN, 10.0, TAKEN, "master"),
        Parameter("allow_nonzero_velocity_at_trajectory_end", False, TAKEN, True, TAKEN),
        Parameter("cmd_timeout", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("gains.j1.p", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("gains.j1.i", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("gains.j1.d", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("gains.j1.ff_velocity_scale", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("gains.j1.u_clamp_max", math.inf, TAKEN, 1.0, TAKEN),
        Parameter("gains.j1.u_clamp_min", -math.inf, TAKEN, -1.0, TAKEN),
        Parameter("gains.j1.i_clamp", math.inf, "i_clamp_max and", 1.0, "i_clamp_max and", "jazzy"),
        Parameter("gains.j1.i_clamp_max", math.inf, TAKEN, 1.0, TAKEN),
        Parameter("gains.j1.i_clamp_min", -math.inf, TAKEN, -1.0, TAKEN),
        Parameter(
            "gains.j1.antiwindup_strategy", "none", TAKEN, "back_calculation", TAKEN,
            "kilted master",
        ),
        Parameter(
            "gains.j1.antiwindup_strategy", "legacy", "it must be 'none'",
            "conditional_integration", TAKEN, "jazzy",
        ),
        Parameter("gains.j1.tracking_time_constant", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("gains.j1.error_deadband", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("constraints.stopped_velocity_tolerance", 0.01, TAKEN, 0.0, TAKEN),
        Parameter("constraints.goal_time", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("constraints.decelerate_on_cancel", False, TAKEN, True, TAKEN),
        Parameter("constraints.j1.trajectory", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("constraints.j1.goal", 0.0, TAKEN, 1.0, TAKEN),
        Parameter("constraints.j1.max_deceleration_on_cancel", 0.0, TAKEN, 1.0, TAKEN),
    ),
    BROADCASTER: (
        Parameter("use_local_topics", False, TAKEN, True, TAKEN),
        Parameter("joints", [], TAKEN, ["j1"], TAKEN),
        Parameter("extra_joints", [], TAKEN, ["wheel"], TAKEN),
        Parameter("interfaces", [], TAKEN, ["torque"], "is none of position, velocity"),
        Parameter("map_interface_to_joint_state.position", "position", TAKEN, "home", _RENAMED),
        Parameter("map_interface_to_joint_state.velocity", "velocity", TAKEN, "home", _RENAMED),
        Parameter("map_interface_to_joint_state.effort", "effort", TAKEN, "home", _RENAMED),
        Parameter("use_urdf_to_filter", True, IDLE, False, IDLE),
        Parameter("frame_id", "base_link", TAKEN, "world", TAKEN),
        Parameter("publish_dynamic_joint_states", True, TAKEN, False, TAKEN, "jazzy kilted"),
    ),
    FORWARD: (
        Parameter("joints", None, "is missing", ["j1"], TAKEN, "kilted master"),
        Parameter("joints", [], "names none", ["j2", "j1"], TAKEN, "jazzy"),
        Parameter("interface_name", None, "is missing", "velocity", TAKEN, "kilted master"),
        Parameter("interface_name", "", _KINDS, "effort", _KINDS, "jazzy"),
    ),
    GRIPPER: (
        Parameter("action_monitor_rate", 20.0, IDLE, 0.1, IDLE),
        Parameter("joint", None, "is missing", "gripper", TAKEN),
        Parameter(
            "state_interfaces", ["position", "velocity"], TAKEN, ["position"], "and velocity"
        ),
        Parameter("goal_tolerance", 0.01, TAKEN, 0.005, TAKEN),
        Parameter("allow_stalling", False, TAKEN, True, TAKEN),
        Parameter("stall_velocity_threshold", 0.001, TAKEN, 0.01, TAKEN),
        Parameter("stall_timeout", 1.0, TAKEN, 0.0, "must be above 0"),
        Parameter("max_effort_interface", "", TAKEN, "gripper/effort", _POSITIONS),
        Parameter("max_effort", 10.0, IDLE, 5.0, IDLE),
        Parameter("max_velocity_interface", "", TAKEN, "gripper/velocity", _POSITIONS),
        Parameter("max_velocity", 0.1, IDLE, 0.05, IDLE),
    ),
    HOMING: (
        Parameter("gpios", [], TAKEN, ["g1"], "the arm has no GPIOs"),
        Parameter("joints", [], TAKEN, ["j1"], TAKEN),
        Parameter("command_interfaces.gpios.g1.interfaces", [], _NO_GPIO, ["home"], _NO_GPIO),
        Parameter("command_interfaces.joints.j1.interfaces", [], _HOME, ["home"], TAKEN),
        Parameter("state_interfaces.gpios.g1.interfaces", [], _NO_GPIO, ["home"], _NO_GPIO),
        Parameter("state_interfaces.joints.j1.interfaces", [], _HOME, ["home"], IDLE),
    ),
}  # fmt: skip
"""Parameters of each type."""
NEEDED: dict[str, dict[str, Value]] = {
    TRAJECTORY: {
        "joints": ["j1", "j2"],
        "command_interfaces": ["velocity"],
        "state_interfaces": ["position", "velocity"],
    },
    BROADCASTER: {},
    FORWARD: {"joints": ["j1"], "interface_name": "position"},
    GRIPPER: {"joint": "gripper"},
    HOMING: {"command_interfaces.joints.j1.interfaces": ["home"]},
}
"""The parameters that a controller of each type needs."""
OURS: dict[str, set[str]] = {
    TRAJECTORY: {"constraints.stopped_time", "constraints.least_time_on_cancel"},
    BROADCASTER: set(),
    FORWARD: set(),
    GRIPPER: {"velocity_limit", "limits"},
    HOMING: {"timeout", "max_travel"},
}
"""Parameters that upstream does not have; all controllers have two more."""
