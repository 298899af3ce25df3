"""``bioscara home``."""

from __future__ import annotations

from bioscara.cli.arm_arguments import add_parameters
from bioscara.cli.motion_arguments import add_motion
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser


def arguments(parser: Parser) -> None:
    """Add the arguments of the command."""
    add_parameters(parser)
    add_motion(parser, full_speed=False)


def run(options: Options, output: Output) -> ExitStatus:
    """Home the joints that are not homed, and release the arm; they stay homed.

    Raises:
        BioscaraError: Homing was refused or failed before anything moved.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.motion import Progress, carry_out, opened_arm, show_position

    status = ExitStatus.OK
    with opened_arm(options, parameters_from(options), output) as (robot, cancelled):

        def home(progress: Progress) -> None:
            progress.phase("homing " + ", ".join(robot.parameters.homing_order))
            robot.home(on_cycle=progress.cycle)

        if robot.is_homed:
            output.line("all joints are homed already")
        else:
            status = carry_out(robot, cancelled, options, output, home)
        if status is ExitStatus.OK:
            show_position(robot, options, output)
    return status
