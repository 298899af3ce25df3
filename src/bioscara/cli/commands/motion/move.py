"""``bioscara move``."""

from __future__ import annotations

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share, share_scene, share_target


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_target(parser)
    share_scene(parser)
    share(parser, "--csv", "--plot")
    share_arm(parser)
    share(parser, "--acknowledge", "--realtime", "--full-speed", "--deg", "--rate", "--priority")


def run(options: Options, output: Output) -> ExitStatus:
    """Home the arm where necessary, move it to a target and release it."""
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.motion import Progress, carry_out, opened_arm, show_position
    from bioscara.cli.output.angles import angle_unit
    from bioscara.cli.output.plots import require_files, write_files
    from bioscara.cli.target import (
        arrange_owned,
        check_target,
        describe,
        plan_target,
        target_planner,
    )
    from bioscara.cli.terminal.keyboard import motion_keys

    require_files(options)
    parameters = parameters_from(options)
    wanted = None if options.arm else target_planner(options, parameters).workspace
    with (
        opened_arm(options, parameters, output) as (robot, cancelled),
        motion_keys(output) as keyboard,
    ):
        if wanted is None:
            arrange_owned(robot, options)
            check_target(robot.plan, options)
        else:
            robot.table, robot.scene, robot.tool = wanted.table, wanted.scene, wanted.tool

        def move(progress: Progress) -> None:
            progress.phase("homing the joints that are not homed")
            robot.home(on_cycle=progress.cycle)
            plan = plan_target(robot.plan, options)
            for line in describe(plan, robot.kinematics, angle_unit(options)):
                progress.note(line)
            for line in write_files(options, plan, robot.plan, robot.parameters):
                progress.note(line)
            progress.phase("moving")
            robot.execute(plan, on_cycle=progress.cycle)

        status = carry_out(robot, cancelled, options, output, move, keyboard=keyboard)
        if status is ExitStatus.OK:
            show_position(robot, options, output)
    return status
