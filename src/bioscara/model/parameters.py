"""Parameters of the arm, in SI units. They are read by :mod:`bioscara.model.loading`."""

from __future__ import annotations

from dataclasses import dataclass

JERK_TIME = 0.025
"""Time in which a joint may reach its highest acceleration [s].

A choice: it costs 25 ms per motion, and spreads the step that would ring the column over two
cycles and more.
"""

LOWEST_RATE, HIGHEST_RATE = 20, 10_000
"""Useful range of cycles per second [Hz]: a setpoint must arrive in time, and a joint
that receives nothing for 60 ms stops."""


@dataclass(frozen=True, slots=True)
class HomingParameters:
    """Homing parameters of one joint.

    Attributes:
        velocity: Least speed of the joint towards its end stop [unit/s]; its sign is the direction.
        threshold: Position error that counts as a touch [microsteps of the motor].
        current_percent: Drive current while homing.
        acceleration: Joint acceleration while homing [unit/s^2].
    """

    velocity: float
    threshold: int
    current_percent: int
    acceleration: float


@dataclass(frozen=True, slots=True)
class JointParameters:
    """One joint. ``unit`` is rad or m; every other unit follows from it.

    Attributes:
        name: ``"j1"`` to ``"j4"``.
        number: 1 to 4, as reported by the joint's firmware.
        address: 7-bit bus address.
        unit: ``"rad"`` or ``"m"``.
        reduction: Motor radians per joint unit; negative where the motor turns in the opposite
            direction.
        lower: Lowest position [unit].
        upper: Highest position [unit].
        max_velocity: Highest speed [unit/s].
        max_acceleration: Highest acceleration [unit/s^2].
        drive_current_percent: Motor current in motion.
        hold_current_percent: Motor current at standstill.
        stall_threshold: Threshold of the motor's position error: a stall is a position error above
            512 + 32 x this [microsteps of the motor]; 0 for no detection. Firmware of the
            existing arms uses 10 x this instead.
        homing: Its homing parameters.
        belt_period: Period of the load's oscillation on its belt [s]; 0 for a rigid drive.
    """

    name: str
    number: int
    address: int
    unit: str
    reduction: float
    lower: float
    upper: float
    max_velocity: float
    max_acceleration: float
    drive_current_percent: int
    hold_current_percent: int
    stall_threshold: int
    homing: HomingParameters
    belt_period: float = 0.0

    @property
    def home_position(self) -> float:
        """Joint position at the end stop that homing touches [unit]."""
        return self.upper if self.homing.velocity > 0.0 else self.lower

    @property
    def max_jerk(self) -> float:
        """Highest jerk [unit/s^3]: the highest acceleration is reached in 25 ms."""
        return self.max_acceleration / JERK_TIME


@dataclass(frozen=True, slots=True)
class PwmOutput:
    """A PWM output of the computer.

    Attributes:
        device: Name of the device that drives it, from the kernel's device tree.
        channel: Number of the output on that device.
    """

    device: str
    channel: int


@dataclass(frozen=True, slots=True)
class GripperParameters:
    """The parallel gripper and its servo.

    Attributes:
        lower: Smallest width [m]; the servo reaches it.
        upper: Largest width [m]; likewise.
        max_velocity: Speed of the width that the gripper cannot exceed [m/s].
        initial: Width that is assumed until one is commanded [m].
        deg_per_m: Servo degrees per metre of width; its sign is the direction.
        zero_width: Width at servo angle zero [m].
        frequency: Pulses per second [Hz].
        pulse_center: Pulse length at servo angle zero [s].
        pulse_per_deg: Change of the pulse length per servo degree [s].
        pulse_lower: Shortest pulse that the servo accepts [s].
        pulse_upper: Longest pulse that the servo accepts [s].
        outputs: Candidate outputs of the servo; the first one that exists is used.
    """

    lower: float
    upper: float
    max_velocity: float
    initial: float
    deg_per_m: float
    zero_width: float
    frequency: float
    pulse_center: float
    pulse_per_deg: float
    pulse_lower: float
    pulse_upper: float
    outputs: tuple[PwmOutput, ...]

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest width that the pulses of the servo reach [m]."""
        ends = self.width_at(self.pulse_lower), self.width_at(self.pulse_upper)
        return min(ends), max(ends)

    def width_at(self, pulse: float) -> float:
        """Return the width at a pulse length [s] in m, beyond the limits too."""
        angle_deg = (pulse - self.pulse_center) / self.pulse_per_deg
        return self.zero_width + angle_deg / self.deg_per_m


@dataclass(frozen=True, slots=True)
class GeometryParameters:
    """Dimensions of the arm; angles and the frame of the wrist as in the arm's description.

    Attributes:
        height: Height of the wrist's frame above the base when j2 is at 0 [m].
        upper_arm: Distance from the column's axis to the elbow's [m].
        forearm: Distance from the elbow's axis to the wrist's [m].
        tool_x: x of the point between the finger tips, in the wrist's frame [m].
        tool_y: y of that point [m].
        tool_z: z of that point [m].
        tool_mass: Mass of the gripper with its jaws, as in the description [kg]; a record, no
            motion depends on it.
    """

    height: float
    upper_arm: float
    forearm: float
    tool_x: float
    tool_y: float
    tool_z: float
    tool_mass: float


@dataclass(frozen=True, slots=True)
class UpdateRates:
    """Cycles of the control loop, by the oldest protocol that a joint speaks.

    Attributes:
        version_1: With protocol version 1 [Hz].
        version_2: With protocol version 2 [Hz].
    """

    version_1: int
    version_2: int


@dataclass(frozen=True, slots=True)
class JointTolerances:
    """Tolerances of one joint for following a trajectory.

    Attributes:
        trajectory: Tolerance during the motion [unit]; 0 for the following error of a healthy joint
            at its highest speed.
        goal: Tolerance at the end [unit]; 0 is unchecked.
    """

    trajectory: float
    goal: float


@dataclass(frozen=True, slots=True)
class TrajectoryConstraints:
    """Failure conditions of a trajectory, and its deceleration on failure.

    Attributes:
        stopped_velocity_tolerance: Speed at which a joint counts as at rest [rad/s or m/s]; 0 is
            unchecked.
        goal_time: Delay after the planned time at which the goal may be reached [s]; 0 for no
            limit.
        max_deceleration_on_cancel_share: Share of the highest joint acceleration, above 0 up to 1.
        joints: Tolerances of each joint, in the order of their numbers.
    """

    stopped_velocity_tolerance: float
    goal_time: float
    max_deceleration_on_cancel_share: float
    joints: tuple[JointTolerances, ...]


@dataclass(frozen=True, slots=True)
class TrajectorySettings:
    """How trajectories are followed.

    Attributes:
        allow_partial_joints_goal: Whether a goal may omit joints.
        allow_nonzero_velocity_at_trajectory_end: Whether the last point may have a nonzero
            velocity.
        constraints: Failure conditions of a goal.
    """

    allow_partial_joints_goal: bool
    allow_nonzero_velocity_at_trajectory_end: bool
    constraints: TrajectoryConstraints


@dataclass(frozen=True, slots=True)
class HomingSettings:
    """Limits of homing, beyond which it fails.

    Attributes:
        timeout: Longest time that one joint may take [s].
        max_travel_share: Largest travel of a joint, as a share of its range; 1 or more.
    """

    timeout: float
    max_travel_share: float


@dataclass(frozen=True, slots=True)
class HoldSettings:
    """Deceleration of joints to rest.

    Attributes:
        max_deceleration_share: Share of the highest joint acceleration, above 0 up to 1.
    """

    max_deceleration_share: float


@dataclass(frozen=True, slots=True)
class GripperSettings:
    """Conditions for the gripper's arrival and stall.

    Attributes:
        goal_tolerance: Distance to the goal that counts as arrival [m].
        allow_stalling: Whether jaws that stall before their goal have succeeded.
        stall_velocity_threshold: Speed below which they count as at rest [m/s].
        stall_timeout: Time at rest after which they count as stalled [s].
    """

    goal_tolerance: float
    allow_stalling: bool
    stall_velocity_threshold: float
    stall_timeout: float


@dataclass(frozen=True, slots=True)
class ControllerSettings:
    """Parameters of the controllers, named as in ros2_controllers where it has the parameter.

    Attributes:
        update_rate: Cycles per second.
        joint_trajectory_controller: Following of trajectories.
        homing_controller: Limits of homing.
        hold_controller: Deceleration of joints to rest.
        gripper_controller: Conditions for the gripper's arrival and stall.
    """

    update_rate: UpdateRates
    joint_trajectory_controller: TrajectorySettings
    homing_controller: HomingSettings
    hold_controller: HoldSettings
    gripper_controller: GripperSettings


@dataclass(frozen=True, slots=True)
class ArmParameters:
    """The whole arm.

    Attributes:
        joints: The joints, in the order of their numbers.
        geometry: Its dimensions.
        gripper: The gripper.
        homing_order: Names of the joints in the order in which they are homed.
        controllers: Parameters of the controllers.
    """

    joints: tuple[JointParameters, ...]
    geometry: GeometryParameters
    gripper: GripperParameters
    homing_order: tuple[str, ...]
    controllers: ControllerSettings

    @property
    def belt_periods(self) -> tuple[float, ...]:
        """Periods of the belts, the longest first [s]; always at least one, even if very short."""
        periods = sorted((joint.belt_period for joint in self.joints), reverse=True)
        return tuple(period for period in periods if period > JERK_TIME) or (JERK_TIME,)

    @property
    def stop_time(self) -> float:
        """Minimum duration of a stop that need not be shorter [s].

        A constant deceleration over the longest period leaves no residual oscillation of that belt;
        it builds up over the shortest one.
        """
        return self.belt_periods[0] + self.belt_periods[-1]
