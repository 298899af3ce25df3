"""``bioscara plan``."""

from __future__ import annotations

from bioscara.cli.arm_arguments import add_parameters
from bioscara.cli.motion_arguments import (
    add_degrees,
    add_full_speed,
    add_planned_files,
    add_start,
    add_target,
)
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser


def arguments(parser: Parser) -> None:
    """Add the arguments of the command."""
    add_parameters(parser)
    add_start(parser, "joint positions at the start")
    add_target(parser)
    add_planned_files(parser)
    add_full_speed(parser)
    add_degrees(parser)


def run(options: Options, output: Output) -> None:
    """Plan a motion and describe it; no arm is needed and nothing moves.

    Raises:
        BioscaraError: The motion cannot be planned.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.output.angles import angle_unit
    from bioscara.cli.output.plots import require_files, write_files
    from bioscara.cli.target import describe, plan_target, target_planner

    require_files(options)
    parameters = parameters_from(options)
    planner = target_planner(options, parameters)
    plan = plan_target(planner, options)
    for line in describe(plan, planner.kinematics, angle_unit(options)):
        output.line(line)
    for line in write_files(options, plan, planner, parameters):
        output.line(line)
