"""``bioscara run``."""

from __future__ import annotations

from pathlib import Path

from bioscara.cli.arm_arguments import add_parameters
from bioscara.cli.motion_arguments import (
    FINGERS,
    add_motion,
    add_report,
    add_scene,
    add_start,
    add_table,
    add_tool,
)
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.errors import InvalidArgumentError


def arguments(parser: Parser) -> None:
    """Add the arguments of the command."""
    add_parameters(parser)
    parser.add_argument(
        "file",
        metavar="FILE",
        type=Path,
        help="ROS 2 trajectory as YAML (as 'ros2 topic echo' writes it) or CSV, or a sequence of "
        "steps as YAML",
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="check or plan it and print the duration of each step; nothing moves",
    )
    add_start(parser, "joint positions at the start of a dry run of a sequence")
    add_table(parser)
    add_tool(parser, "name of the tool that is mounted, for a sequence")
    parser.add_argument(
        "--fit",
        action="store_true",
        help="stretch the trajectory in time where it exceeds a speed or acceleration limit",
    )
    add_scene(parser)
    add_report(parser)
    add_motion(parser)


def run(options: Options, output: Output) -> ExitStatus | None:
    """Home the arm and follow the trajectory of a file or carry out its sequence, and report.

    Raises:
        TrajectoryError: The file cannot be read, or its trajectory cannot be executed.
        BioscaraError: The run was refused or failed otherwise before anything moved.
    """
    from bioscara.cli import job, sequence
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.target import scene_from
    from bioscara.robot.sequences.sequence_file import is_sequence

    if is_sequence(options.file):
        return sequence.run(options, output)
    for word, given in (
        ("--tool", options.tool != FINGERS),
        ("--table", options.table is not None),
        ("--from", options.start is not None),
    ):
        if given:
            raise InvalidArgumentError(
                f"{word} applies only to sequences of steps, and {options.file} is a trajectory; "
                "leave it out"
            )
    parameters = parameters_from(options)
    prepared = job.prepare(
        options.file,
        options.file.stem,
        str(options.file),
        parameters,
        scene_from(options),
        fit=options.fit,
        full_speed=options.full_speed,
    )
    if options.dry_run:
        job.describe(prepared, parameters, options, output)
        return None
    return job.run_job(prepared, parameters, options, output)
