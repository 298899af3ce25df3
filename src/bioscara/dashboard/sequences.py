"""Sequences of steps that a person edits on the page: YAML, Python, and a dry run."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from bioscara.api import messages as m
from bioscara.api.failures import failure_of
from bioscara.api.values import trajectory_value, workspace_of
from bioscara.errors import InvalidArgumentError, NotHomedError
from bioscara.kinematics import Joints
from bioscara.model import ArmParameters
from bioscara.model.yaml_file import SIZE_MAX
from bioscara.printing import printable
from bioscara.robot import tasks
from bioscara.robot.sequences.dry_run import Verdict, dry_run, joined
from bioscara.robot.sequences.script import to_script
from bioscara.robot.sequences.sequence_file import sequence_of_text, text_of_sequence
from bioscara.robot.sequences.steps import sequence_of, values_of
from bioscara.robot.workspace.workspace import Workspace

BODY_MAX = SIZE_MAX
"""Longest file, or sequence in JSON [byte]."""
_NAME_MAX = 100
"""Characters of a file's name that messages have."""


class SequenceText(msgspec.Struct, frozen=True):
    """A sequence as text.

    Attributes:
        text: YAML that ``bioscara run`` takes, or a Python program.
    """

    text: str


class StepVerdict(msgspec.Struct, frozen=True):
    """What planning says of a step, or of several that blends join.

    Attributes:
        first: Index of the first step.
        number: Number of the steps.
        label: Their numbers, from 1, and kinds.
        duration: How long they take [s]; null if they are refused.
        notes: Notes on the plan.
        failure: Why they are refused, or null.
        task: The task of an owner that carries them out; null if they are refused.
    """

    first: int
    number: int
    label: str
    duration: float | None
    notes: tuple[str, ...]
    failure: m.FailureValue | None
    task: tasks.ArmTask | None


class DryRun(msgspec.Struct, frozen=True):
    """A sequence that was planned from where the arm is.

    Attributes:
        verdicts: On each step, up to the first one that is refused.
        duration: Of the steps that are not refused [s].
        trajectory: Their motions with the rests between them, for a picture; null without motion.
    """

    verdicts: tuple[StepVerdict, ...]
    duration: float
    trajectory: m.TrajectoryValue | None


def read(name: str, data: bytes) -> dict[str, object]:
    """Return the values of a sequence in a file.

    Args:
        name: Name of the file, for messages.
        data: Its content.

    Raises:
        ConfigurationError: It is no sequence; the message names the line.
    """
    shown = printable(name)[:_NAME_MAX]
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        text = f"{shown}: not a text file: byte {error.start} is not UTF-8"
        raise InvalidArgumentError(text) from error
    return values_of(sequence_of_text(text, shown))


def written(values: object) -> SequenceText:
    """Return a sequence, of JSON, as the text of a file; errors as :func:`dry_run_of`."""
    return SequenceText(text_of_sequence(sequence_of(values)))


def scripted(values: object, first: int = 0, last: int | None = None) -> SequenceText:
    """Return a sequence, of JSON, as a Python program; see :func:`dry_run_of`."""
    return SequenceText(to_script(sequence_of(values), first, last))


def dry_run_of(
    values: object,
    parameters: ArmParameters,
    workspace: m.WorkspaceState,
    joints: Sequence[float | None],
    first: int = 0,
    last: int | None = None,
) -> DryRun:
    """Plan a sequence from where the arm is; nothing moves.

    Args:
        values: The sequence, of JSON.
        parameters: Parameters of the arm.
        workspace: Its tool, scene and load.
        joints: j1 to j4 [rad, m, rad, rad]; None where a position is unknown.
        first: Index of the step to begin with.
        last: Index of the step to end before; None for all.

    Raises:
        ConfigurationError: It is no sequence; the message names the step.
        NotHomedError: A position is unknown.
        InvalidArgumentError: It is for another tool.
    """
    sequence = sequence_of(values)
    known = [joint for joint in joints if joint is not None]
    if len(known) != len(parameters.joints):
        raise NotHomedError("the steps cannot be planned: the arm is not homed; home() it")
    space: Workspace = workspace_of(parameters, workspace)
    verdicts = [*dry_run(sequence, space, Joints(*known), first=first, last=last)]
    whole = joined(verdicts)
    return DryRun(
        tuple(map(_verdict, verdicts)),
        sum(each.duration for each in verdicts if each.error is None),
        None if whole is None else trajectory_value(whole),
    )


def _verdict(verdict: Verdict) -> StepVerdict:
    run, refused = verdict.run, verdict.error is not None
    return StepVerdict(
        run.first,
        len(run.steps),
        run.label,
        None if refused else verdict.duration,
        verdict.notes,
        None if verdict.error is None else failure_of(verdict.error),
        None if refused else verdict.task,
    )
