"""What the arm's parameters are, in SI units. How they are read: :mod:`bioscara.model.loading`."""

from __future__ import annotations

from dataclasses import dataclass

JERK_TIME = 0.025
"""Time in which a joint may build its highest acceleration up [s].

A choice: it costs 25 ms per motion, and spreads the step that would ring the column over two
cycles and more.
"""


@dataclass(frozen=True, slots=True)
class HomingParameters:
    """How one joint seeks its end stop.

    Attributes:
        velocity: Joint speed of the touch that counts [unit/s]; its sign is the direction.
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
        stall_threshold: Position error that is a stall [10 microsteps]; 0 for no detection.
        homing: How it is homed.
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
class ArmParameters:
    """The whole arm.

    Attributes:
        joints: The joints, in the order of their numbers.
        geometry: How it is built.
        gripper: The gripper.
        homing_order: Names of the joints in the order in which they are homed.
    """

    joints: tuple[JointParameters, ...]
    geometry: GeometryParameters
    gripper: GripperParameters
    homing_order: tuple[str, ...]
