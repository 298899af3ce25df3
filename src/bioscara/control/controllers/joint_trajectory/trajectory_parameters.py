"""Parameters of the joint trajectory controller, with ros2_controllers' names and defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any, Literal, Self

from bioscara.arguments import shown
from bioscara.control.controllers.joint_trajectory.pid import Gains
from bioscara.control.controllers.parameter_types import Parameters
from bioscara.errors import ConfigurationError
from bioscara.hardware import POSITION, VELOCITY
from bioscara.model.validation import KNOWN_AS, Checked, NotNegative, Positive, parsed

Kind = Literal["position", "velocity"]
CHANGEABLE = frozenset(
    {
        "allow_partial_joints_goal",
        "allow_nonzero_velocity_at_trajectory_end",
        "allow_integration_in_goal_trajectories",
        "allow_trajectory_replacement",
        "cmd_timeout",
        "gains",
        "constraints",
    }
)
"""Parameters that may change after the controller is configured, also while it is active."""


class JointConstraints(Checked):
    """Permitted deviations of one joint; 0 is unchecked.

    Attributes:
        trajectory: Permitted deviation of the joint on the path [rad or m].
        goal: Permitted deviation of the joint at the end [rad or m].
        max_deceleration_on_cancel: Deceleration of the joint on the ramp after a cancel and to a
            pause [rad/s^2 or m/s^2].
    """

    trajectory: NotNegative = 0.0
    goal: NotNegative = 0.0
    max_deceleration_on_cancel: NotNegative = 0.0


class Constraints(Checked):
    """Failure conditions of goals; every other key is the name of a joint, with its constraints.

    Attributes:
        stopped_velocity_tolerance: Speed of every joint that counts as standing [rad/s or m/s].
        stopped_time: Time for which the joints have to stand within their tolerances before a goal
            has succeeded, and to stand before it is cancelled [s]; 0 does not wait for that.
        goal_time: Permitted delay after the planned arrival [s]; 0 waits without limit.
        decelerate_on_cancel: Whether a cancelled goal ends on a ramp, and a pause begins with one.
        least_time_on_cancel: Shortest duration of the ramp of a collision-checked trajectory [s].
            Above 0, scaling changes gradually too.
        joints: Constraints of single joints.
    """

    stopped_velocity_tolerance: NotNegative = 0.01
    stopped_time: NotNegative = 0.1
    goal_time: NotNegative = 0.0
    decelerate_on_cancel: bool = False
    least_time_on_cancel: NotNegative = 0.0
    joints: dict[str, JointConstraints] = field(
        default_factory=dict, metadata={KNOWN_AS: "a group for each joint"}
    )

    @classmethod
    def arranged(cls, values: Mapping[Any, object]) -> Mapping[Any, object]:
        """Move the groups of the joints, which files have under the joints' names."""
        joints = {
            name: group
            for name, group in values.items()
            if isinstance(name, str) and isinstance(group, Mapping | JointConstraints)
        }
        others = {name: value for name, value in values.items() if name not in joints}
        return others | {"joints": parsed(dict[str, JointConstraints], joints)}

    def of(self, joint: str) -> JointConstraints:
        """Return the constraints of one joint, by default none."""
        return self.joints.get(joint, JointConstraints())


class SpeedScaling(Checked):
    """Scaling of the trajectory's time.

    Attributes:
        initial_scaling_factor: Scaling at the begin; 0 pauses.
        state_interface: None of the arm's hardware reports a factor; must stay empty.
        command_interface: Nor does any accept one; must stay empty.
    """

    initial_scaling_factor: NotNegative = 1.0
    state_interface: Literal[""] = ""
    command_interface: Literal[""] = ""


class PositionsUpsampling(Checked):
    """Handling of trajectories without a goal that have positions only.

    Attributes:
        enable: Whether a smooth spline is drawn through their points.
        policy_frequency: Of points without times [Hz]; 0 refuses them.
    """

    enable: bool = False
    policy_frequency: NotNegative = 0.0


class JointTrajectoryParameters(Parameters):
    """Parameters of the joint trajectory controller; those of :data:`CHANGEABLE` may change.

    Attributes:
        joints: Names of the joints.
        command_interfaces: Commanded quantities: position, velocity, or both.
        state_interfaces: Measured quantities: position, or position and velocity.
        action_monitor_rate: How often a gateway reports results and feedback [Hz]; here they are
            known at once.
        allow_partial_joints_goal: Whether a goal may leave joints out.
        allow_nonzero_velocity_at_trajectory_end: Whether the last point may be in motion.
        allow_integration_in_goal_trajectories: Whether missing positions and velocities are
            integrated from the given values.
        allow_trajectory_replacement: Whether a new trajectory is spliced into the running one.
        interpolation_method: ``"splines"`` or ``"none"``.
        interpolate_from_desired_state: Whether the path to the first point begins at the desired
            state of the joints, not at the measured one.
        set_last_command_interface_value_as_state_on_activation: Whether the last commands are
            held after activation, not the measured state.
        cmd_timeout: Time after its end at which a trajectory is given up [s]; 0 for never.
        speed_scaling: Scaling of the trajectory's time.
        positions_upsampling: Handling of points that have positions only.
        gains: Of the velocity PID, by joint.
        constraints: Failure conditions of goals.
    """

    joints: tuple[str, ...]
    command_interfaces: tuple[Kind, ...] = ("position",)
    state_interfaces: tuple[Kind, ...] = ("position", "velocity")
    action_monitor_rate: Positive = 20.0
    allow_partial_joints_goal: bool = False
    allow_nonzero_velocity_at_trajectory_end: bool = False
    allow_integration_in_goal_trajectories: bool = False
    allow_trajectory_replacement: bool = True
    interpolation_method: Literal["splines", "none"] = "splines"
    interpolate_from_desired_state: bool = False
    set_last_command_interface_value_as_state_on_activation: bool = True
    cmd_timeout: NotNegative = 0.0
    speed_scaling: SpeedScaling = field(default_factory=SpeedScaling)
    positions_upsampling: PositionsUpsampling = field(default_factory=PositionsUpsampling)
    gains: dict[str, Gains] = field(default_factory=dict)
    constraints: Constraints = field(default_factory=Constraints)

    @property
    def decelerations(self) -> tuple[float, ...]:
        """Of the joints on a ramp to rest [rad/s^2 or m/s^2]; empty if there are no ramps."""
        each = tuple(self.constraints.of(name).max_deceleration_on_cancel for name in self.joints)
        return each if self.constraints.decelerate_on_cancel and all(each) else ()

    def changed(self, controller: str, values: Mapping[str, object]) -> Self:
        """Return the parameters with other values of some, each of which is replaced as a whole.

        Args:
            controller: Name of the controller, for messages.
            values: By their names, as for :meth:`read`.

        Raises:
            ConfigurationError: One may not change, or a value cannot be used.
        """
        fixed = sorted(values.keys() - CHANGEABLE)
        if fixed:
            raise ConfigurationError(
                f"{controller}: {', '.join(map(shown, fixed))} may not change while it is "
                f"configured; these may: {', '.join(sorted(CHANGEABLE))}"
            )
        given = self.read(controller, {"joints": self.joints, **values})
        parameters = replace(self, **{name: getattr(given, name) for name in values})
        parameters.check(controller)
        return parameters

    def check(self, controller: str) -> None:
        """Check that the parameters are consistent.

        Args:
            controller: Name of the controller, for messages.

        Raises:
            ConfigurationError: They are not.
        """
        joints, kinds, measured = self.joints, self.command_interfaces, self.state_interfaces
        if not joints or len(set(joints)) != len(joints):
            raise ConfigurationError(
                f"{controller}: parameter joints must name at least one joint, none of them twice; "
                f"it is {list(joints)}"
            )
        if kinds not in ((POSITION,), (VELOCITY,), (POSITION, VELOCITY)):
            raise ConfigurationError(
                f"{controller}: command_interfaces {list(kinds)}: it is position, velocity, or "
                "position and velocity"
            )
        if measured not in ((POSITION,), (POSITION, VELOCITY)):
            raise ConfigurationError(
                f"{controller}: state_interfaces {list(measured)}: it is position, or position "
                "and velocity"
            )
        if kinds == (VELOCITY,) and measured != (POSITION, VELOCITY):
            raise ConfigurationError(
                f"{controller}: to command velocity alone, position and velocity must be measured"
            )
        for what, named in (("gains", self.gains), ("constraints", self.constraints.joints)):
            for joint in named:
                if joint not in joints:
                    raise ConfigurationError(
                        f"{controller}: {what}.{joint} is for no joint of it; it has "
                        + ", ".join(joints)
                    )
