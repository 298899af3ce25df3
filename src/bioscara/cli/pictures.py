"""The files that ``--csv`` and ``--plot`` ask for."""

from __future__ import annotations

from dataclasses import astuple

from bioscara.cli.arguments import Options
from bioscara.cli.output import Output
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Scara
from bioscara.model import JointParameters
from bioscara.planning import write_csv
from bioscara.report.plan_png import ToolBounds, require_matplotlib, write_plan
from bioscara.robot.planner import REDUCED, Plan


def require_drawing(options: Options) -> None:
    """Raise if a picture is wanted and cannot be drawn; to be asked before anything moves.

    Raises:
        InvalidArgumentError: matplotlib is not installed.
    """
    if options.plot is not None:
        require_matplotlib()


def write_pictures(
    plan: Plan, arm: Scara, limits: tuple[JointParameters, ...], options: Options, output: Output
) -> None:
    """Write what was asked for and say so.

    Raises:
        InvalidArgumentError: A file cannot be written.
    """
    try:
        if options.csv is not None:
            write_csv(options.csv, plan.trajectory)
            output.line(f"wrote {options.csv}")
        if options.plot is not None:
            tool = ToolBounds() if options.full_speed else ToolBounds(*astuple(REDUCED))
            write_plan(options.plot, plan.trajectory, arm, limits, tool, str(options.command))
            output.line(f"wrote {options.plot}")
    except OSError as error:
        raise InvalidArgumentError(
            f"{error.filename} cannot be written: {error.strerror or error}"
        ) from error
