"""Faults from before this run: nothing moves until a person has acknowledged them."""

from __future__ import annotations

import shlex
from collections.abc import Callable

from bioscara.cli.arguments import Options
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import FaultedError
from bioscara.robot import Robot


def require_noted(robot: Robot, options: Options) -> None:
    """Raise if there are faults, unless ``--acknowledge`` is given.

    Args:
        robot: A robot that was just connected.
        options: Parsed options.

    Raises:
        FaultedError: There are faults; names them, what to do and the command to continue.
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
    """Return the advice appended to a failure's cause if a fault is latched; else nothing."""
    return "; then go on with --acknowledge" if robot.faults else ""


def acknowledge(robot: Robot, tell: Callable[[str], None]) -> None:
    """Acknowledge and recover from faults that stopped the arm before, if any; nothing moves.

    Args:
        robot: A robot that was just connected.
        tell: Receives a sentence for each fault.

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
