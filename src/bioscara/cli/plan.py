"""``bioscara plan``."""

from __future__ import annotations

from bioscara.cli.arguments import Options
from bioscara.cli.output import Output
from bioscara.cli.pictures import require_drawing, write_pictures
from bioscara.cli.status import Status
from bioscara.cli.target import describe, plan_target
from bioscara.errors import InvalidArgumentError
from bioscara.model import load_parameters
from bioscara.robot import kinematics_of
from bioscara.robot.planner import Planner
from bioscara.robot.teach_file import load_table


def run(options: Options) -> int:
    """Plan a motion and tell about it; no arm is needed and nothing moves.

    Raises:
        BioscaraError: It cannot be planned.
    """
    require_drawing(options)
    parameters, output = load_parameters(), Output()
    kinematics = kinematics_of(parameters)
    problems = kinematics.beyond(options.start)
    if problems:
        raise InvalidArgumentError(f"--from is outside the limits: {'; '.join(problems)}")
    planner = Planner(parameters, lambda: options.start)
    if options.table.exists():
        planner.table = load_table(options.table, planner.tool)
    plan = plan_target(planner, options)
    for line in describe(plan, kinematics):
        output.line(line)
    write_pictures(plan, kinematics, parameters.joints, options, output)
    output.check()
    return Status.OK
