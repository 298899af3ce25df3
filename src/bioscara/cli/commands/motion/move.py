"""``bioscara move``."""

from __future__ import annotations

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.motion import Progress, carry_out, opened_arm, show_position
from bioscara.cli.opened_arm import arrange
from bioscara.cli.options import Options
from bioscara.cli.output.angles import angle_unit
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.output.plots import require_files, write_picture, write_trajectory
from bioscara.cli.target import (
    check_target,
    describe,
    plan_target,
    scene_from,
    target_planner,
)
from bioscara.cli.teach_table import read_table
from bioscara.cli.terminal.keyboard import motion_keys
from bioscara.robot.arm_methods import ArmMethods


def run(options: Options) -> int:
    """Home the arm where necessary, move it to a target and release it.

    Raises:
        BioscaraError: The motion was refused or failed before anything moved.
        OSError: Standard output cannot be written.
    """
    require_files(options)
    parameters, output = parameters_from(options), Output()
    wanted = None if options.arm else target_planner(options, parameters).workspace
    with (
        opened_arm(options, parameters, output) as (robot, cancelled),
        motion_keys(output) as keyboard,
    ):
        if wanted is None:
            # The owner's table and scene apply where no option names others.
            _arrange_owned(robot, options)
        else:
            robot.table, robot.scene, robot.tool = wanted.table, wanted.scene, wanted.tool
        status = carry_out(
            robot,
            cancelled,
            options,
            output,
            lambda progress: _move(robot, options, progress),
            keyboard=keyboard,
        )
        if status is not ExitStatus.OK:
            return status
        show_position(robot, options, output)
    output.check()
    return ExitStatus.OK


def _arrange_owned(robot: ArmMethods, options: Options) -> None:
    table = read_table(options, robot.table.fingers) if options.table else robot.table
    arrange(robot, options, table, scene_from(options), options.tool)
    check_target(robot.plan, options)


def _move(robot: ArmMethods, options: Options, progress: Progress) -> None:
    progress.phase("homing the joints that are not homed")
    robot.home(on_cycle=progress.cycle)
    plan = plan_target(robot.plan, options)
    for line in describe(plan, robot.kinematics, angle_unit(options)):
        progress.note(line)
    if options.csv is not None:
        progress.note(write_trajectory(options.csv, plan.trajectory))
    if options.plot is not None:
        progress.note(write_picture(options.plot, plan, robot.plan, robot.parameters, "move"))
    progress.phase("moving")
    robot.execute(plan, on_cycle=progress.cycle)
