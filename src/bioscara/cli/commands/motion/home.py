"""``bioscara home``."""

from __future__ import annotations

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_arm(parser)
    share(parser, "--acknowledge", "--realtime", "--deg", "--rate", "--priority")


def run(options: Options, output: Output) -> ExitStatus:
    """Home the joints that are not homed, and release the arm; they stay homed."""
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
