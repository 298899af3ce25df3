"""``bioscara gripper``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser, number
from bioscara.cli.shared_arguments import share
from bioscara.errors import InvalidArgumentError, LimitError

if TYPE_CHECKING:
    from bioscara.model import GripperParameters

_ROUNDING_DEG = 0.01
"""Angle beyond a limit that is taken as the limit [deg]: -60 for one of -59.9994."""


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    parser.add_argument(
        "width",
        metavar="WIDTH",
        nargs="?",
        type=lambda word: word if word in {"open", "close"} else number(word),
        help="width between the jaws [m], or open or close for the largest or smallest",
    )
    parser.add_argument(
        "--servo-angle",
        metavar="DEG",
        type=number,
        help="instead of a width: angle of the servo [deg], to mount its horn or measure a width",
    )
    share_arm(parser)
    share(parser, "--acknowledge", "--deg", "--rate", "--priority")


def run(options: Options, output: Output) -> ExitStatus:
    """Move the jaws of the gripper; a real one holds its width after the command has ended."""
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.motion import carry_out, opened_arm

    parameters = parameters_from(options)
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
    return status


def _width(options: Options, gripper: GripperParameters) -> float:
    """Return the width that the options name.

    Raises:
        InvalidArgumentError: Neither or both of width and angle are given, or the width in mm.
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
        width: float = gripper.zero_width + options.servo_angle / gripper.deg_per_m
        return min(max(width, gripper.lower), gripper.upper)
    ends = {"open": gripper.upper, "close": gripper.lower}
    given = float(ends.get(options.width, options.width))
    if gripper.lower <= (metres := 1e-3 * given) <= gripper.upper:
        raise InvalidArgumentError(
            f"a width is in metres, and {given:g} would be millimetres; did you mean bioscara "
            f"gripper {metres:g}?"
        )
    return given
