"""``bioscara gripper``."""

from __future__ import annotations

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.motion import carry_out, opened_arm
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.errors import InvalidArgumentError, LimitError
from bioscara.model import GripperParameters

_ROUNDING_DEG = 0.01
"""Angle beyond a limit that is taken as the limit [deg]: -60 for one of -59.9994."""


def run(options: Options) -> int:
    """Move the jaws of the gripper; a real one holds its width after the command has ended.

    Raises:
        BioscaraError: The motion was refused before the jaws moved.
        OSError: Standard output cannot be written.
    """
    output, parameters = Output(), parameters_from(options)
    width = _width(options, parameters.gripper)
    with opened_arm(options, parameters, output) as (robot, cancelled):
        status = carry_out(
            robot,
            cancelled,
            options,
            output,
            lambda progress: robot.gripper.move(width, on_cycle=progress.cycle),
        )
        if status is ExitStatus.OK:
            output.line(
                f"jaws commanded to {robot.gripper.width:.4f} m; their servo reports no width"
            )
            if options.servo_angle is not None:
                output.line(f"at this width the servo is at {options.servo_angle:g} deg")
    output.check()
    return status


def _width(options: Options, gripper: GripperParameters) -> float:
    """Return the width that the options name.

    Raises:
        InvalidArgumentError: Neither or both of width and angle are given.
        LimitError: At that angle the jaws would be beyond their limits.
    """
    if (options.width is None) == (options.servo_angle is None):
        raise InvalidArgumentError("gripper takes either a WIDTH or --servo-angle DEG")
    if options.servo_angle is not None:
        # The widths within the limits are within the pulses, too, and are stored and checked for
        # collisions: an angle is no other way to move the jaws.
        lower, upper = sorted(map(gripper.angle_at, (gripper.lower, gripper.upper)))
        if not lower - _ROUNDING_DEG <= options.servo_angle <= upper + _ROUNDING_DEG:
            raise LimitError(
                "--servo-angle",
                options.servo_angle,
                round(lower, 2),
                round(upper, 2),
                "deg",
                f"there the jaws are {gripper.lower:g} .. {gripper.upper:g} m apart, their limits",
            )
        width = gripper.zero_width + options.servo_angle / gripper.deg_per_m
        return min(max(width, gripper.lower), gripper.upper)
    if isinstance(options.width, str):
        return {"open": gripper.upper, "close": gripper.lower}[options.width]
    assert options.width is not None  # noqa: S101  for the type checker
    return options.width
