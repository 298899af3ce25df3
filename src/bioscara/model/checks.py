"""Checks of the arm's values, independent of the file format."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from bioscara.model.parameters import GripperParameters, HomingParameters, JointParameters
from bioscara.model.section import Section

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
_WIDTH_TOLERANCE = 1e-9
"""Rounding of a width that was computed from a pulse [m]."""
_HOMING_RPM = (1.0, 250.0)
"""Motor speeds that HOME can carry: the original host refuses the bounds themselves."""


def check_joint(name: str, section: Section, homing: Section) -> JointParameters:
    """Return the parameters of one joint.

    Args:
        name: One of :data:`JOINTS`.
        section: Section of its values.
        homing: Section of its homing values.

    Raises:
        ConfigurationError: A value is missing or invalid.
    """
    unit = UNITS[name]
    reduction = section.nonzero("reduction", 1e5)
    farthest, fastest = _FARTHEST[unit], _MOTOR_VELOCITY / abs(reduction)
    hardest = _MOTOR_ACCELERATION / abs(reduction)
    lower = section.number("lower", -farthest, farthest, unit)
    max_velocity = section.number("max_velocity", 1e-6, fastest, f"{unit}/s")
    max_acceleration = section.number("max_acceleration", 1e-6, hardest, f"{unit}/s^2")
    velocity = homing.nonzero("velocity", max_velocity, f"{unit}/s")
    _check_homing_speed(homing, velocity, reduction)
    return JointParameters(
        name=name,
        number=JOINTS.index(name) + 1,
        address=section.whole("address", 0x08, 0x77),
        unit=unit,
        reduction=reduction,
        lower=lower,
        upper=section.above("upper", lower, farthest, unit),
        max_velocity=max_velocity,
        max_acceleration=max_acceleration,
        drive_current_percent=section.whole("drive_current_percent", 1, 100, "%"),
        hold_current_percent=section.whole("hold_current_percent", 1, 100, "%"),
        stall_threshold=section.whole("stall_threshold", 0, 255),
        homing=HomingParameters(
            velocity=velocity,
            threshold=homing.whole("threshold", 1, 255, "microsteps"),
            current_percent=homing.whole("current_percent", 1, 100, "%"),
            acceleration=homing.number("acceleration", 1e-6, max_acceleration, f"{unit}/s^2"),
        ),
    )


def _check_homing_speed(section: Section, velocity: float, reduction: float) -> None:
    motor_rpm = abs(math.degrees(velocity * reduction)) / 6.0
    if not _HOMING_RPM[0] < motor_rpm < _HOMING_RPM[1]:
        raise section.error(
            f"{section.name('velocity')}: {velocity:g} is {motor_rpm:g} rpm of the motor, which "
            f"must be above {_HOMING_RPM[0]:g} and below {_HOMING_RPM[1]:g}",
            "velocity",
        )


def check_addresses(joints: Iterable[tuple[JointParameters, Section]]) -> None:
    """Raise if two joints have the same address.

    Args:
        joints: The joints, and the sections of their values.

    Raises:
        ConfigurationError: Two have the same; the message names both.
    """
    owners: dict[int, str] = {}
    for joint, section in joints:
        owner = owners.setdefault(joint.address, joint.name)
        if owner != joint.name:
            raise section.error(
                f"{section.name('address')}: {joint.address:#04x} is already the address of "
                f"{owner}",
                "address",
            )


class Jaws(NamedTuple):
    """Limits of a gripper's jaws; fields as in ``GripperParameters``."""

    lower: float
    upper: float
    initial: float
    deg_per_m: float
    zero_width: float


def check_jaws(section: Section) -> Jaws:
    """Return the limits of the gripper's jaws.

    Raises:
        ConfigurationError: A value is missing or invalid.
    """
    lower = section.number("lower", 0.0, 1.0, "m")
    upper = section.above("upper", lower, 1.0)
    return Jaws(
        lower=lower,
        upper=upper,
        initial=section.number("initial", lower, upper, "m"),
        deg_per_m=section.nonzero("deg_per_m", 1e5, "deg/m"),
        zero_width=section.number("zero_width", -1.0, 1.0, "m"),
    )


def check_reach(section: Section, gripper: GripperParameters) -> GripperParameters:
    """Return the parameters of a gripper whose servo reaches the limits of its jaws.

    Args:
        section: Section of the limits and of the calibration.
        gripper: The parameters.

    Raises:
        ConfigurationError: It does not; names the limit and what the calibration reaches.
    """
    smallest, largest = gripper.reach
    for key, limit in (("lower", gripper.lower), ("upper", gripper.upper)):
        if not smallest - _WIDTH_TOLERANCE <= limit <= largest + _WIDTH_TOLERANCE:
            raise section.error(
                f"{section.name(key)}: {limit:g} m is out of the servo's reach: with "
                f"{section.name('deg_per_m')} {gripper.deg_per_m:g} and "
                f"{section.name('zero_width')} {gripper.zero_width:g}, pulses of "
                f"{1e3 * gripper.pulse_lower:g} .. {1e3 * gripper.pulse_upper:g} ms give "
                f"{smallest:.4g} .. {largest:.4g} m; give a limit between these, or calibrate anew",
                key,
            )
    return gripper
