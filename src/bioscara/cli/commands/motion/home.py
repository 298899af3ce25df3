"""``bioscara home``."""

from __future__ import annotations

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.motion import Progress, carry_out, opened_arm, show_position
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output


def run(options: Options) -> int:
    """Home the joints that are not homed, and release the arm; they stay homed.

    Raises:
        BioscaraError: Homing was refused or failed before anything moved.
        OSError: Standard output cannot be written.
    """
    output = Output()
    with opened_arm(options, parameters_from(options), output) as (robot, cancelled):
        if robot.is_homed:
            output.line("all joints are homed already")

        def home(progress: Progress) -> None:
            progress.phase("homing " + ", ".join(robot.parameters.homing_order))
            robot.home(on_cycle=progress.cycle)

        if not robot.is_homed:
            status = carry_out(robot, cancelled, options, output, home)
            if status is not ExitStatus.OK:
                return status
        show_position(robot, options, output)
    output.check()
    return ExitStatus.OK
