"""``bioscara run``."""

from __future__ import annotations

from pathlib import Path

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import FINGERS, share, share_scene
from bioscara.errors import InvalidArgumentError


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
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
    share(parser, "--from", help="joint positions at the start of a dry run of a sequence")
    share(parser, "--table")
    share(parser, "--tool", help="name of the tool that is mounted, for a sequence")
    parser.add_argument(
        "--fit",
        action="store_true",
        help="stretch the trajectory in time where it exceeds a speed or acceleration limit",
    )
    share_scene(parser)
    share(parser, "--out")
    share_arm(parser)
    share(parser, "--acknowledge", "--realtime", "--full-speed", "--deg", "--rate", "--priority")


def run(options: Options, output: Output) -> ExitStatus | None:
    """Home the arm and follow the trajectory of a file or carry out its sequence, and report.

    Raises:
        TrajectoryError: The file cannot be read, or its trajectory cannot be executed.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.runs import job, sequence
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
