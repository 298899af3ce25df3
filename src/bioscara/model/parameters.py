"""What the arm's parameters are, in SI units. How they are read: :mod:`bioscara.model.loading`."""

from __future__ import annotations

from dataclasses import dataclass

JERK_TIME = 0.025
"""Time in which a joint may build its highest acceleration up [s].

A choice: it costs 25 ms per motion, and spreads the step that would ring the column over two
cycles and more.
"""

LOWEST_RATE, HIGHEST_RATE = 20, 10_000
"""Cycles per second that make sense [Hz]: a setpoint must come before a joint misses it, and a
joint that hears nothing for 60 ms stops."""


@dataclass(frozen=True, slots=True)
class HomingParameters:
    """How one joint seeks its end stop.

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
        number: 1 to 4, what the joint's firmware says it is.
        address: 7-bit bus address.
        unit: ``"rad"`` or ``"m"``.
        reduction: Motor radians per joint unit; negative where the motor turns against it.
        lower: Lowest position [unit].
        upper: Highest position [unit].
        max_velocity: Highest speed [unit/s].
        max_acceleration: Highest acceleration [unit/s^2].
        drive_current_percent: Motor current in motion.
        hold_current_percent: Motor current at standstill.
        stall_threshold: How far the motor may be off: a stall is a position error above
            512 + 32 x this [microsteps of the motor]; 0 for no detection. Firmware of the
            existing arms takes 10 x this instead.
        homing: How it is homed.
        belt_period: Period in which the load swings behind its belt [s]; 0 where it is rigid.
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
        """Highest jerk [unit/s^3]: the highest acceleration builds up in 25 ms."""
        return self.max_acceleration / JERK_TIME


@dataclass(frozen=True, slots=True)
class PwmOutput:
    """A PWM output of the computer.

    Attributes:
        device: Name of the device that drives it, as the kernel's device tree says.
        channel: Number of the output on that device.
    """

    device: str
    channel: int


@dataclass(frozen=True, slots=True)
class GripperParameters:
    """The parallel gripper and its servo.

    Attributes:
        lower: Smallest width [m].
        upper: Largest width [m].
        max_velocity: Speed of the width that the gripper cannot exceed [m/s].
        initial: Width that is assumed until one was commanded [m].
        deg_per_m: Servo degrees per metre of width; its sign is the direction.
        zero_width: Width at servo angle zero [m].
        frequency: Pulses per second [Hz].
        pulse_center: Pulse at servo angle zero [s].
        pulse_per_deg: Change of the pulse per servo degree [s].
        pulse_lower: Shortest pulse that the servo takes [s].
        pulse_upper: Longest pulse that the servo takes [s].
        outputs: Where the servo may be wired to; the first one that exists is used.
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


@dataclass(frozen=True, slots=True)
class GeometryParameters:
    """How the arm is built; angles and the frame of the wrist as in the arm's description.

    Attributes:
        height: Of the wrist's frame above the base when j2 is at 0 [m].
        upper_arm: From the column's axis to the elbow's [m].
        forearm: From the elbow's axis to the wrist's [m].
        tool_x: Of the point between the finger tips, in the wrist's frame [m].
        tool_y: Likewise [m].
        tool_z: Likewise [m].
        tool_mass: Of the gripper with its jaws, as the description has it [kg]; a record, no motion
            depends on it.
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
class Tolerances:
    """How far one joint may be off a trajectory.

    Attributes:
        trajectory: On the way [unit]; 0 for what a healthy joint trails at its highest speed.
        goal: At the end [unit]; 0 is unchecked.
    """

    trajectory: float
    goal: float


@dataclass(frozen=True, slots=True)
class TrajectoryConstraints:
    """What makes a trajectory fail, and how it ends then.

    Attributes:
        stopped_velocity_tolerance: Speed of every joint that counts as standing [rad/s or m/s]; 0
            is unchecked.
        goal_time: How much later than planned the goal may be reached [s]; 0 waits for ever.
        max_deceleration_on_cancel_share: Of the joint's highest acceleration, above 0 up to 1.
        joints: How far each joint may be off, in the order of their numbers.
    """

    stopped_velocity_tolerance: float
    goal_time: float
    max_deceleration_on_cancel_share: float
    joints: tuple[Tolerances, ...]


@dataclass(frozen=True, slots=True)
class TrajectoryControllerParameters:
    """How trajectories are followed.

    Attributes:
        allow_partial_joints_goal: Whether a goal may leave joints out.
        allow_nonzero_velocity_at_trajectory_end: Whether the last point may be in motion.
        constraints: What makes a goal fail.
    """

    allow_partial_joints_goal: bool
    allow_nonzero_velocity_at_trajectory_end: bool
    constraints: TrajectoryConstraints


@dataclass(frozen=True, slots=True)
class HomingControllerParameters:
    """When homing is given up.

    Attributes:
        timeout: Longest time that one joint may take [s].
        max_travel_share: Farthest that a joint may go, as a share of its range; 1 or more.
    """

    timeout: float
    max_travel_share: float


@dataclass(frozen=True, slots=True)
class HoldControllerParameters:
    """How joints come to rest.

    Attributes:
        max_deceleration_share: Of the joint's highest acceleration, above 0 up to 1.
    """

    max_deceleration_share: float


@dataclass(frozen=True, slots=True)
class GripperControllerParameters:
    """When the gripper has arrived, and when it is held up.

    Attributes:
        goal_tolerance: How near to its goal it has arrived [m].
        allow_stalling: Whether jaws that are held up before their goal have succeeded.
        stall_velocity_threshold: Speed below which they do not move [m/s].
        stall_timeout: How long they do not move when they are held up [s].
    """

    goal_tolerance: float
    allow_stalling: bool
    stall_velocity_threshold: float
    stall_timeout: float


@dataclass(frozen=True, slots=True)
class ControllersParameters:
    """What the controllers do; names are those of ros2_controllers where it has the parameter.

    Attributes:
        update_rate: Cycles per second.
        joint_trajectory_controller: How trajectories are followed.
        homing_controller: When homing is given up.
        hold_controller: How joints come to rest.
        gripper_controller: When the gripper has arrived.
    """

    update_rate: UpdateRates
    joint_trajectory_controller: TrajectoryControllerParameters
    homing_controller: HomingControllerParameters
    hold_controller: HoldControllerParameters
    gripper_controller: GripperControllerParameters


@dataclass(frozen=True, slots=True)
class ArmParameters:
    """The whole arm.

    Attributes:
        joints: The joints, in the order of their numbers.
        geometry: How it is built.
        gripper: The gripper.
        homing_order: Names of the joints in the order in which they are homed.
        controllers: What the controllers do.
    """

    joints: tuple[JointParameters, ...]
    geometry: GeometryParameters
    gripper: GripperParameters
    homing_order: tuple[str, ...]
    controllers: ControllersParameters

    @property
    def belt_periods(self) -> tuple[float, ...]:
        """Periods of the belts, the longest first [s]; at least one, however short."""
        periods = sorted((joint.belt_period for joint in self.joints), reverse=True)
        return tuple(period for period in periods if period > JERK_TIME) or (JERK_TIME,)

    @property
    def stop_time(self) -> float:
        """Least time of a stop that nothing forces to be shorter [s].

        A steady deceleration over the longest period leaves no swing of that belt behind; over the
        shortest one it builds up.
        """
        return self.belt_periods[0] + self.belt_periods[-1]
