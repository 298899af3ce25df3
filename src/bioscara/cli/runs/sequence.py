"""``bioscara run FILE`` with a sequence of steps: carried out, or planned without moving."""

from __future__ import annotations

from collections.abc import Iterator

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.motion import Progress, carry_out, opened_arm, show_position
from bioscara.cli.output.console import ExitStatus, Output, columns, complain
from bioscara.cli.owner_link import served_robot
from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import FINGERS
from bioscara.cli.target import arrange_owned, planner_from, scene_from
from bioscara.cli.teach_table import lookup, read_table
from bioscara.cli.terminal.keyboard import motion_keys
from bioscara.errors import InvalidArgumentError
from bioscara.model import ArmParameters
from bioscara.robot.planner import Planner
from bioscara.robot.sequences.dry_run import Verdict, dry_run
from bioscara.robot.sequences.running import run_sequence
from bioscara.robot.sequences.sequence_file import read_sequence
from bioscara.robot.sequences.steps import StepSequence, require_names


def run(options: Options, output: Output) -> ExitStatus:
    """Home the arm where necessary and carry out the sequence, or plan it with ``--dry-run``.

    Raises:
        BioscaraError: The sequence was refused before anything moved.
    """
    for word, given in (("--fit", options.fit), ("--out", options.out is not None)):
        if given:
            raise InvalidArgumentError(
                f"{word} applies only to trajectories, and {options.file} is a sequence of steps; "
                "leave it out"
            )
    if options.start is not None and not options.dry_run:
        raise InvalidArgumentError(
            "--from applies only to --dry-run: the arm begins where it is; leave it out"
        )
    sequence = read_sequence(options.file)
    return (_plan if options.dry_run else _run)(options, sequence, output)


def _run(options: Options, sequence: StepSequence, output: Output) -> ExitStatus:
    parameters = parameters_from(options)
    wanted = None
    if options.arm is None:
        wanted = _planner(options, parameters)
        require_names(sequence, wanted)
    with (
        opened_arm(options, parameters, output) as (robot, cancelled),
        motion_keys(output) as keyboard,
    ):
        if wanted is not None:
            space = wanted.workspace
            robot.table, robot.scene, robot.tool = space.table, space.scene, space.tool
        else:
            arrange_owned(robot, options)
            require_names(sequence, robot.plan)
        output.line(f"sequence: {sequence.title or options.file}, {len(sequence.steps)} steps")

        def move(progress: Progress) -> None:
            progress.phase("homing the joints that are not homed")
            robot.home(on_cycle=progress.cycle)
            run_sequence(
                robot,
                sequence,
                on_step=lambda run: progress.phase(f"step {run.label} of {len(sequence.steps)}"),
                on_note=lambda note: progress.note(f"note: {note}"),
                on_cycle=progress.cycle,
            )

        status = carry_out(robot, cancelled, options, output, move, keyboard=keyboard)
        if status is ExitStatus.OK:
            show_position(robot, options, output)
    return status


def _planner(options: Options, parameters: ArmParameters) -> Planner:
    planner = planner_from(options, parameters)
    planner.workspace = lookup(options, planner.workspace.with_tool, options.tool)
    return planner


def _plan(options: Options, sequence: StepSequence, output: Output) -> ExitStatus:
    """Print the verdict on each step; nothing moves."""
    if options.arm is None:
        planner = _planner(options, parameters_from(options))
        verdicts = [*dry_run(sequence, planner.workspace, planner.here())]
    else:
        # Of a served arm: its tool, its scene, and from where it is.
        with served_robot(options) as robot:
            planner, space = robot.plan, robot.plan.workspace
            if options.table is not None:
                space = space.with_table(read_table(options, space.table.fingers))
            if options.surroundings is not None:
                space = space.with_scene(scene_from(options))
            if options.tool not in {space.tool.name, FINGERS}:
                space = space.with_tool(options.tool)
            verdicts = [*dry_run(sequence, space, planner.here())]
    output.lines(columns([*_rows(verdicts)]))
    for verdict in verdicts:
        for note in verdict.notes:
            output.line(f"note: {note}")
    refused = verdicts[-1].error
    if refused is not None:
        complain(f"{refused}; nothing moved")
        return ExitStatus.REFUSED
    return ExitStatus.OK


def _rows(verdicts: list[Verdict]) -> Iterator[tuple[str, str]]:
    yield "step", "duration"
    for verdict in verdicts:
        yield verdict.run.label, "refused" if verdict.error else f"{verdict.duration:.2f} s"
    if verdicts[-1].error is None:
        yield "total", f"{sum(verdict.duration for verdict in verdicts):.2f} s"
