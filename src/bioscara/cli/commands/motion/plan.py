"""``bioscara plan``."""

from __future__ import annotations

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.options import Options
from bioscara.cli.output.angles import angle_unit
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.output.plots import require_files, write_picture, write_trajectory
from bioscara.cli.target import describe, plan_target, target_planner


def run(options: Options) -> int:
    """Plan a motion and describe it; no arm is needed and nothing moves.

    Raises:
        BioscaraError: The motion cannot be planned.
    """
    require_files(options)
    parameters, output = parameters_from(options), Output()
    planner = target_planner(options, parameters)
    plan = plan_target(planner, options)
    for line in describe(plan, planner.kinematics, angle_unit(options)):
        output.line(line)
    if options.csv is not None:
        output.line(write_trajectory(options.csv, plan.trajectory))
    if options.plot is not None:
        output.line(write_picture(options.plot, plan, planner, parameters, "plan"))
    output.check()
    return ExitStatus.OK
