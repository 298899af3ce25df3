"""Parameters of the arm, in SI units. They are read by :mod:`bioscara.model.loading`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated

from bioscara.arguments import shown
from bioscara.model.validation import (
    NOT_EMPTY,
    NOT_ZERO,
    Before,
    Checked,
    Location,
    Name,
    Problem,
    Restricted,
    Within,
    described,
    not_above,
    outside,
)

JERK_TIME = 0.025
"""Time in which a joint may reach its highest acceleration [s].

A choice: it costs 25 ms per motion, and spreads the step that would ring the column over two
cycles and more.
"""

LOWEST_RATE, HIGHEST_RATE = 20, 10_000
"""Useful range of cycles per second [Hz]: a setpoint must arrive in time, and a joint
that receives nothing for 60 ms stops."""

UNITS = {"j1": "rad", "j2": "m", "j3": "rad", "j4": "rad"}
"""Units of the joints, by name: the second one lifts, the others turn."""
JOINTS = tuple(UNITS)
"""Names of the joints, in the order of their numbers."""
_FARTHEST = {"rad": 4.0 * math.pi, "m": 2.0}
"""Largest position of a joint of this unit: larger ones are probably degrees or millimetres."""
_MOTOR_VELOCITY = 343.0
"""Highest speed of a motor [rad/s]: TRACK carries 3276 rpm."""
_MOTOR_ACCELERATION = 365.0
"""Highest acceleration of a motor [rad/s^2]: the register of its driver ends just above it. More is
clamped; firmware of the existing arms takes a small share of it instead."""
_HOMING_RPM = (1.0, 250.0)
"""Motor speeds that HOME can carry: the original host refuses the bounds themselves."""
_SLOWEST_BELT = 1.0
"""Longest period of a belt [s]: a load with a slower oscillation cannot be positioned."""
_WIDTH_TOLERANCE = 1e-9
"""Rounding of a width that the servo reaches [m]."""
_CARRIAGE = 0.16
"""Shortest upper arm [m]: the lift's carriage extends to there, and the elbow is beyond it."""
Percent = Annotated[int, Within(1, 100, "%")]
BrakingShare = Annotated[float, Within(0.01, 1.0)]


class HomingParameters(Checked):
    """Homing parameters of one joint.

    Attributes:
        velocity: Least speed of the joint towards its end stop [unit/s]; its sign is the direction.
        threshold: Position error that counts as a touch [microsteps of the motor].
        current_percent: Drive current while homing.
        acceleration: Joint acceleration while homing [unit/s^2].
    """

    velocity: Annotated[float, NOT_ZERO]
    threshold: Annotated[int, Within(1, 255, "microsteps")]
    current_percent: Percent
    acceleration: float


def ambiguous_address(digits: str) -> str:
    """Return why an address without 0x cannot be used; nothing if both readings are the same.

    The original reads every address as a hexadecimal number.

    Args:
        digits: The address as it is written, without 0x.
    """
    hexadecimal, decimal = int(digits, 16), int(digits)
    if hexadecimal == decimal:
        return ""
    return (
        f"{digits} is {hexadecimal:#04x} as the original reads it, and {decimal:#04x} as a decimal "
        "number; write one of them with 0x, in quotes where xacro reads it from a YAML file"
    )


class JointParameters(Checked):
    """One joint. ``unit`` is rad or m; every other unit follows from it.

    Attributes:
        name: ``"j1"`` to ``"j4"``.
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

    name: Annotated[str, Restricted(pattern="^j[1-4]$")]
    address: Annotated[int, Within(0x08, 0x77)]
    unit: str
    reduction: Annotated[float, Within(-1e5, 1e5), NOT_ZERO]
    lower: float
    upper: float
    max_velocity: float
    max_acceleration: float
    drive_current_percent: Percent
    hold_current_percent: Percent
    stall_threshold: Annotated[int, Within(0, 255)]
    homing: HomingParameters
    belt_period: Annotated[float, Within(0.0, _SLOWEST_BELT, "s")]

    def problems(self) -> Iterator[Problem]:
        """Yield values that do not suit each other, or the joint."""
        unit, ratio = UNITS[self.name], abs(self.reduction)
        if self.unit != unit:
            yield Problem(f"{shown(self.unit)} is not a valid name; it must be {unit}", ("unit",))
            return
        farthest, speed, second = _FARTHEST[unit], f"{unit}/s", f"{unit}/s^2"
        yield from outside(self.lower, -farthest, farthest, unit, "lower")
        yield from outside(self.upper, -farthest, farthest, unit, "upper")
        yield from not_above(self.upper, self.lower, "upper", others=(("lower",),))
        for key, most, per in (
            ("max_velocity", _MOTOR_VELOCITY, speed),
            ("max_acceleration", _MOTOR_ACCELERATION, second),
        ):
            given, others = getattr(self, key), (("reduction",),)
            yield from outside(given, 1e-6, most / ratio, per, key, others=others)
        homing, fastest, hardest = self.homing, self.max_velocity, self.max_acceleration
        for key, least, most, per in (
            ("velocity", -fastest, fastest, speed),
            ("acceleration", 1e-6, hardest, second),
        ):
            given, others = getattr(homing, key), ((f"max_{key}",),)
            yield from outside(given, least, most, per, "homing", key, others=others)
        motor_rpm = abs(math.degrees(homing.velocity * self.reduction)) / 6.0
        if not _HOMING_RPM[0] < motor_rpm < _HOMING_RPM[1]:
            text = (
                f"{homing.velocity:g} is {motor_rpm:g} rpm of the motor, which must be above "
                f"{_HOMING_RPM[0]:g} and below {_HOMING_RPM[1]:g}"
            )
            yield Problem(text, ("homing", "velocity"), (("reduction",),))

    @property
    def number(self) -> int:
        """1 to 4, as reported by the joint's firmware."""
        return JOINTS.index(self.name) + 1

    @property
    def home_position(self) -> float:
        """Joint position at the end stop that homing touches [unit]."""
        return self.upper if self.homing.velocity > 0.0 else self.lower

    @property
    def max_jerk(self) -> float:
        """Highest jerk [unit/s^3]: the highest acceleration is reached in 25 ms."""
        return self.max_acceleration / JERK_TIME


class PwmOutput(Checked):
    """A PWM output of the computer.

    Attributes:
        device: Name of the device that drives it, from the kernel's device tree.
        channel: Number of the output on that device.
    """

    device: Name
    channel: Annotated[int, Within(0, 15)]


class GripperParameters(Checked):
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

    lower: Annotated[float, Within(0.0, 1.0, "m")]
    upper: Annotated[float, Within(0.0, 1.0, "m")]
    max_velocity: Annotated[float, Within(1e-3, 10.0, "m/s")]
    initial: float
    deg_per_m: Annotated[float, Within(-1e5, 1e5, "deg/m"), NOT_ZERO]
    zero_width: Annotated[float, Within(-1.0, 1.0, "m")]
    frequency: float
    pulse_center: float
    pulse_per_deg: Annotated[float, Within(-1e-3, 1e-3, "s/deg"), NOT_ZERO]
    pulse_lower: Annotated[float, Within(1e-4, 1e-2, "s")]
    pulse_upper: Annotated[float, Within(1e-4, 1e-2, "s")]
    outputs: Annotated[tuple[PwmOutput, ...], NOT_EMPTY]

    def problems(self) -> Iterator[Problem]:
        """Yield values that do not suit each other."""
        limits, ends = (("lower",), ("upper",)), (("pulse_lower",), ("pulse_upper",))
        yield from not_above(self.upper, self.lower, "upper", others=limits[:1])
        yield from outside(self.initial, self.lower, self.upper, "m", "initial", others=limits)
        pulses = self.pulse_lower, self.pulse_upper
        yield from not_above(pulses[1], pulses[0], "pulse_upper", others=ends[:1])
        highest = 0.9 / self.pulse_upper
        yield from outside(self.frequency, 1.0, highest, "Hz", "frequency", others=ends[1:])
        yield from outside(self.pulse_center, *pulses, "s", "pulse_center", others=ends)
        smallest, largest = self.reach
        line = ("deg_per_m",), ("zero_width",), ("pulse_center",), ("pulse_per_deg",), *ends
        for key, limit in (("lower", self.lower), ("upper", self.upper)):
            if not smallest - _WIDTH_TOLERANCE <= limit <= largest + _WIDTH_TOLERANCE:
                text = (
                    f"{limit:g} m is out of the servo's reach: with deg_per_m {self.deg_per_m:g} "
                    f"and zero_width {self.zero_width:g}, pulses of {1e3 * self.pulse_lower:g} .. "
                    f"{1e3 * self.pulse_upper:g} ms give {smallest:.4g} .. {largest:.4g} m; give a "
                    "limit between these, or calibrate anew"
                )
                yield Problem(text, (key,), line)

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest width that the pulses of the servo reach [m]."""
        return self.reach_on(self.deg_per_m, self.zero_width)

    def reach_on(self, deg_per_m: float, zero_width: float) -> tuple[float, float]:
        """Return the smallest and largest width that the pulses reach on another line [m].

        Args:
            deg_per_m: Servo degrees per metre of width.
            zero_width: Width at servo angle zero [m].
        """
        pulses = self.pulse_lower, self.pulse_upper
        angles = [(pulse - self.pulse_center) / self.pulse_per_deg for pulse in pulses]
        ends = [zero_width + angle_deg / deg_per_m for angle_deg in angles]
        return min(ends), max(ends)

    def angle_at(self, width: float) -> float:
        """Return the angle of the servo [deg] at a width [m], beyond the limits too."""
        return self.deg_per_m * (width - self.zero_width)

    def width_at(self, pulse: float) -> float:
        """Return the width at a pulse length [s] in m, beyond the limits too."""
        angle_deg = (pulse - self.pulse_center) / self.pulse_per_deg
        return self.zero_width + angle_deg / self.deg_per_m


class GeometryParameters(Checked):
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

    height: Annotated[float, Within(0.01, 2.0, "m")]
    upper_arm: Annotated[float, Within(_CARRIAGE, 2.0, "m")]
    forearm: Annotated[float, Within(0.01, 2.0, "m")]
    tool_x: Annotated[float, Within(-1.0, 1.0, "m")]
    tool_y: Annotated[float, Within(-1.0, 1.0, "m")]
    tool_z: Annotated[float, Within(-1.0, 1.0, "m")]
    tool_mass: Annotated[float, Within(0.0, 10.0, "kg")]


class UpdateRates(Checked):
    """Cycles of the control loop, by the oldest protocol that a joint speaks.

    Attributes:
        version_1: With protocol version 1 [Hz].
        version_2: With protocol version 2 [Hz].
    """

    version_1: Annotated[int, Within(LOWEST_RATE, HIGHEST_RATE, "Hz")]
    version_2: Annotated[int, Within(LOWEST_RATE, HIGHEST_RATE, "Hz")]


class JointTolerances(Checked):
    """Tolerances of one joint for following a trajectory.

    Attributes:
        trajectory: Tolerance during the motion [unit]; 0 for the following error of a healthy joint
            at its highest speed.
        goal: Tolerance at the end [unit]; 0 is unchecked.
    """

    trajectory: float
    goal: float


class TrajectoryConstraints(Checked):
    """Failure conditions of a trajectory, and its deceleration on failure.

    Attributes:
        stopped_velocity_tolerance: Speed at which a joint counts as at rest [rad/s or m/s]; 0 is
            unchecked.
        goal_time: Delay after the planned time at which the goal may be reached [s]; 0 for no
            limit.
        max_deceleration_on_cancel_share: Share of the highest joint acceleration, above 0 up to 1.
        j1: Tolerances of this joint.
        j2: Tolerances of this joint.
        j3: Tolerances of this joint.
        j4: Tolerances of this joint.
    """

    stopped_velocity_tolerance: Annotated[float, Within(0.0, 10.0)]
    goal_time: Annotated[float, Within(0.0, 3600.0, "s")]
    max_deceleration_on_cancel_share: BrakingShare
    j1: JointTolerances
    j2: JointTolerances
    j3: JointTolerances
    j4: JointTolerances

    @property
    def joints(self) -> tuple[JointTolerances, ...]:
        """Tolerances of each joint, in the order of their numbers."""
        return self.j1, self.j2, self.j3, self.j4


class TrajectorySettings(Checked):
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


class HomingSettings(Checked):
    """Limits of homing, beyond which it fails.

    Attributes:
        timeout: Longest time that one joint may take [s].
        max_travel_share: Largest travel of a joint, as a share of its range; 1 or more.
    """

    timeout: Annotated[float, Within(1.0, 3600.0, "s")]
    max_travel_share: Annotated[float, Within(1.0, 2.0)]


class HoldSettings(Checked):
    """Deceleration of joints to rest.

    Attributes:
        max_deceleration_share: Share of the highest joint acceleration, above 0 up to 1.
    """

    max_deceleration_share: BrakingShare


class GripperSettings(Checked):
    """Conditions for the gripper's arrival and stall.

    Attributes:
        goal_tolerance: Distance to the goal that counts as arrival [m].
        allow_stalling: Whether jaws that stall before their goal have succeeded.
        stall_velocity_threshold: Speed below which they count as at rest [m/s].
        stall_timeout: Time at rest after which they count as stalled [s].
    """

    goal_tolerance: Annotated[float, Within(1e-5, 0.1, "m")]
    allow_stalling: bool
    stall_velocity_threshold: Annotated[float, Within(1e-6, 1.0, "m/s")]
    stall_timeout: Annotated[float, Within(0.01, 60.0, "s")]


class ControllerSettings(Checked):
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


def _named(name: str) -> Before:
    """Return the annotation of a joint whose name is the one of its values in the file."""
    return Before(
        lambda values: {"name": name, **values} if isinstance(values, Mapping) else values
    )


class JointTable(Checked):
    """The joints by name, as files have them."""

    j1: Annotated[JointParameters, _named("j1")]
    j2: Annotated[JointParameters, _named("j2")]
    j3: Annotated[JointParameters, _named("j3")]
    j4: Annotated[JointParameters, _named("j4")]

    @property
    def joints(self) -> tuple[JointParameters, ...]:
        """The joints, in the order of their numbers."""
        return self.j1, self.j2, self.j3, self.j4

    def problems(self) -> Iterator[Problem]:
        """Yield joints of another name, or with the address of another one."""
        owners: dict[int, str] = {}
        for key, joint in zip(JOINTS, self.joints, strict=True):
            if joint.name != key:
                yield Problem(f"{joint.name} must be {key}", (key, "name"))
            owner = owners.setdefault(joint.address, key)
            if owner != key:
                text = f"{joint.address:#04x} is already the address of {owner}"
                yield Problem(text, (key, "address"))


def _joints(given: object) -> tuple[object, ...]:
    return given if isinstance(given, tuple) else JointTable.parsed(given).joints


class ArmParameters(Checked):
    """The whole arm.

    Attributes:
        joints: The joints, in the order of their numbers.
        geometry: Its dimensions.
        gripper: The gripper.
        homing_order: Names of the joints in the order in which they are homed.
        controllers: Parameters of the controllers.
    """

    joints: Annotated[tuple[JointParameters, ...], Before(_joints)]
    geometry: GeometryParameters
    gripper: GripperParameters
    homing_order: tuple[str, ...]
    controllers: ControllerSettings

    def __repr__(self) -> str:
        return f"<ArmParameters of {', '.join(joint.name for joint in self.joints)}>"

    def problems(self) -> Iterator[Problem]:
        """Yield values of one part that do not suit another."""
        if sorted(self.homing_order) != sorted(JOINTS):
            text = f"{described(self.homing_order)} must name each of {', '.join(JOINTS)} once"
            yield Problem(text, ("homing_order",))
        tolerances = self.controllers.joint_trajectory_controller.constraints
        where = "controllers", "joint_trajectory_controller", "constraints"
        for joint, own in zip(self.joints, tolerances.joints, strict=True):
            # A tolerance above the joint's range can never be violated.
            span, name = joint.upper - joint.lower, joint.name
            limits: tuple[Location, ...] = (
                ("joints", name, "lower"),
                ("joints", name, "upper"),
            )
            for key, value in (("trajectory", own.trajectory), ("goal", own.goal)):
                place = *where, name, key
                yield from outside(value, 0.0, span, joint.unit, *place, others=limits)

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
