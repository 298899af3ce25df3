"""``bioscara plan``."""

from __future__ import annotations

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share, share_scene, share_target


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share(parser, "--from", help="joint positions at the start")
    share_target(parser)
    share_scene(parser)
    share(parser, "--csv", "--plot", "--full-speed", "--deg")


def run(options: Options, output: Output) -> None:
    """Plan a motion and describe it; no arm is needed and nothing moves."""
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.output.angles import angle_unit
    from bioscara.cli.output.plots import require_files, write_files
    from bioscara.cli.target import describe, plan_target, target_planner

    require_files(options)
    parameters = parameters_from(options)
    planner = target_planner(options, parameters)
    plan = plan_target(planner, options)
    output.lines(describe(plan, planner.kinematics, angle_unit(options)))
    output.lines(write_files(options, plan, planner, parameters))
