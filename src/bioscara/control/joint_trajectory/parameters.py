"""Parameters of the joint trajectory controller, with ros2_controllers' names and defaults."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from bioscara.control.joint_trajectory.pid import Gains
from bioscara.control.parameters import Parameters

NotNegative = Annotated[float, Field(ge=0.0)]


class JointConstraints(BaseModel):
    """How far one joint may be off; 0 is unchecked.

    Attributes:
        trajectory: On the way [rad or m].
        goal: At the end [rad or m].
        max_deceleration_on_cancel: For the ramp after a cancel [rad/s^2 or m/s^2].
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    trajectory: NotNegative = 0.0
    goal: NotNegative = 0.0
    max_deceleration_on_cancel: NotNegative = 0.0


class Constraints(BaseModel):
    """What makes a goal fail.

    Attributes:
        stopped_velocity_tolerance: Speed of every joint that counts as standing [rad/s or m/s].
        goal_time: How much later than planned the goal may be reached [s]; 0 waits for ever.
        decelerate_on_cancel: Whether a cancelled goal ends on a ramp.
        joints: Of single joints, by name.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    stopped_velocity_tolerance: NotNegative = 0.01
    goal_time: NotNegative = 0.0
    decelerate_on_cancel: bool = False
    joints: dict[str, JointConstraints] = Field(default_factory=dict)


class JointTrajectoryParameters(Parameters):
    """Parameters of the joint trajectory controller.

    Attributes:
        joints: Names of the joints.
        command_interfaces: What is commanded: position, velocity, or both.
        state_interfaces: What is measured: position, or position and velocity.
        action_monitor_rate: How often results and feedback are told [Hz].
        allow_partial_joints_goal: Whether a goal may leave joints out.
        allow_nonzero_velocity_at_trajectory_end: Whether the last point may be in motion.
        allow_integration_in_goal_trajectories: Whether missing positions and velocities are
            integrated from what is given.
        allow_trajectory_replacement: Whether a new trajectory is spliced into the running one.
        interpolation_method: ``"splines"`` or ``"none"``.
        interpolate_from_desired_state: Whether the way to the first point begins where the joints
            should be, not where they are.
        set_last_command_interface_value_as_state_on_activation: Whether the last commands are
            held after activation, not the measured state.
        cmd_timeout: How long after its end a trajectory is given up [s]; 0 for never.
        initial_scaling_factor: Speed scaling at the begin.
        gains: Of the velocity PID, by joint.
        constraints: What makes a goal fail.
    """

    joints: tuple[str, ...]
    command_interfaces: tuple[Literal["position", "velocity"], ...] = ("position",)
    state_interfaces: tuple[Literal["position", "velocity"], ...] = ("position", "velocity")
    action_monitor_rate: Annotated[float, Field(gt=0.0)] = 20.0
    allow_partial_joints_goal: bool = False
    allow_nonzero_velocity_at_trajectory_end: bool = False
    allow_integration_in_goal_trajectories: bool = False
    allow_trajectory_replacement: bool = True
    interpolation_method: Literal["splines", "none"] = "splines"
    interpolate_from_desired_state: bool = False
    set_last_command_interface_value_as_state_on_activation: bool = True
    cmd_timeout: NotNegative = 0.0
    initial_scaling_factor: NotNegative = 1.0
    gains: dict[str, Gains] = Field(default_factory=dict)
    constraints: Constraints = Constraints()
