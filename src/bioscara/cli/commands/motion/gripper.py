"""``bioscara gripper``."""

from __future__ import annotations

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.motion import carry_out, opened_arm
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output


def run(options: Options) -> int:
    """Move the jaws of the gripper; a real one holds its width after the command has ended.

    Raises:
        BioscaraError: The motion was refused before the jaws moved.
        OSError: Standard output cannot be written.
    """
    output, parameters = Output(), parameters_from(options)
    ends = {"open": parameters.gripper.upper, "close": parameters.gripper.lower}
    width = ends[options.width] if isinstance(options.width, str) else options.width
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
    output.check()
    return status
