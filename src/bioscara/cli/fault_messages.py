"""What stopped the arm before this run: nothing moves until a person has taken note of it."""

from __future__ import annotations

import shlex
from collections.abc import Callable

from bioscara.cli.arguments import Options
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import FaultedError
from bioscara.robot import Robot


def require_noted(robot: Robot, options: Options) -> None:
    """Refuse to go on with faults that nobody took note of with ``--acknowledge``.

    Args:
        robot: Just connected.
        options: What was asked for.

    Raises:
        FaultedError: There are some; names them, what to do and the command to go on.
    """
    if options.acknowledge or not robot.faults:
        return
    sources: dict[FaultKind, list[str]] = {}
    for fault in robot.faults:
        sources.setdefault(fault.kind, []).append(fault.source)
    told = "; ".join(
        f"{kind.name} ({', '.join(names)}): {kind.action}" for kind, names in sources.items()
    )
    command = shlex.join(("bioscara", *options.words, "--acknowledge"))
    raise FaultedError(
        f"the arm stopped before this run and nothing moves until you have seen to it: {told}; "
        f"then go on with: {command}"
    )


def the_way_on(robot: Robot) -> str:
    """Return what goes behind the cause of a failure if that latched a fault; else nothing."""
    return "; then go on with --acknowledge" if robot.faults else ""


def acknowledge(robot: Robot, tell: Callable[[str], None]) -> None:
    """Acknowledge and recover from what stopped the arm before, if anything did; nothing moves.

    Args:
        robot: Just connected.
        tell: Takes a sentence for each fault.

    Raises:
        FaultedError: The evidence cannot be written; the faults stay.
        BioscaraError: A joint does not answer.
    """
    if not robot.faults:
        return
    try:
        faults = robot.acknowledge()
    except OSError as error:
        raise FaultedError(
            f"the arm stopped before this run, and the evidence of it cannot be written: "
            f"{error.filename}: {error.strerror or error}; nothing moves"
        ) from error
    for fault in faults:
        tell(f"acknowledged: {fault}")
    tell(f"evidence: {faults[0].evidence}")
    robot.recover()
