"""The arm that the command line names: opening it, its faults and its warnings."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, cast

from bioscara.cli.owner_link import served_robot
from bioscara.cli.parser import Options
from bioscara.cli.shared_arguments import FINGERS
from bioscara.connect import Robot
from bioscara.errors import FaultedError
from bioscara.model import ArmParameters
from bioscara.planning.collision.scene import Scene
from bioscara.robot import FAULTS
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.workspace.poses import TeachTable

if TYPE_CHECKING:
    from bioscara.remote import RemoteRobot

_BUS_SHARE = 0.8
"""Share of each cycle that the bus may take without a note."""


def open_arm(options: Options, parameters: ArmParameters, evidence: Path = FAULTS) -> ArmMethods:
    """Return the arm that ``--arm``, or ``--bus`` and ``--v1`` name; nothing is opened yet.

    Args:
        options: Parsed options.
        parameters: Parameters of the arm.
        evidence: Folder for the flight records of faults.

    Raises:
        InvalidArgumentError: There is no bus of that name, or ``--rate`` is not possible.
    """
    if options.arm is not None:
        return served_robot(options)
    return own_arm(options, parameters, evidence)


def own_arm(options: Options, parameters: ArmParameters, evidence: Path = FAULTS) -> Robot:
    """Return the arm of this process that ``--bus`` and ``--v1`` name; as :func:`open_arm`."""
    rate, reduced_speed = options.rate, not options.full_speed
    if options.bus != "sim":
        return Robot.on_bus(
            options.bus, parameters, rate=rate, evidence=evidence, reduced_speed=reduced_speed
        )
    return Robot.simulated(
        parameters,
        v1=options.v1,
        world=options.world,
        rate=rate,
        evidence=evidence,
        reduced_speed=reduced_speed,
        pace_homing=options.realtime,
        pace_motion=options.paced,
    )


def introduce(robot: ArmMethods, options: Options, report: Callable[[str], None]) -> None:
    """Report which arm it is, and how much of each cycle its bus leaves if that is little."""
    report(f"arm: {robot.description}{others_served(options)}")
    share = robot.bus_share
    if options.bus != "sim" and share > _BUS_SHARE:
        slower = math.floor(_BUS_SHARE / share / robot.period)
        report(
            f"note: at {1.0 / robot.period:.0f} Hz the bus leaves {1.0 - share:.0%} of each cycle "
            f"free; on a busy computer, --rate {slower} leaves a fifth"
        )


def others_served(options: Options) -> str:
    """Return how to use a served arm in place of the one that the command simulates; or nothing."""
    if not options.served:
        return ""
    each = " or ".join(f"--arm {name}" for name in options.served)
    return f"; {each} takes the served arm{'s' if len(options.served) > 1 else ''}"


@contextmanager
def at_full_speed(robot: ArmMethods, options: Options) -> Iterator[None]:
    """Let the arm of an owner move as fast as ``--full-speed`` wants, within a block of code."""
    if options.arm is None or not options.full_speed:
        yield
        return
    before, robot.reduced_speed = robot.reduced_speed, False
    try:
        yield
    finally:
        robot.reduced_speed = before


def arrange(
    robot: ArmMethods, options: Options, table: TeachTable, scene: Scene, tool: str
) -> None:
    """Give the arm the table, the scene and the tool of the command line.

    Those of an owner's arm stay as they are unless an option names others.
    """
    own = options.arm is None
    if own:
        robot.table = table
    elif options.table is not None:
        # Not as the table of that arm: its owner would save it in place of the taught poses.
        cast("RemoteRobot", robot).borrow_table(table)
    if own or options.surroundings is not None:
        robot.scene = scene
    if own or tool != FINGERS:
        robot.tool = tool


def left(options: Options) -> str:
    """Return in words how a motion that ended early leaves the arm."""
    if options.arm is not None:
        return f"the arm came to rest, and {options.arm} holds it"
    return "all joints were stopped and disabled"


def require_acknowledgement(robot: ArmMethods, options: Options) -> None:
    """Raise if there are faults from before this run, unless ``--acknowledge`` is given.

    Raises:
        FaultedError: There are faults; names them, the remedy and the command to continue.
    """
    if options.acknowledge or not robot.faults:
        return
    sources: dict[tuple[str, str], list[str]] = {}
    for fault in robot.faults:
        sources.setdefault((fault.kind.name, fault.action), []).append(fault.source)
    faults = "; ".join(
        f"{kind} ({', '.join(names)}): {action}" for (kind, action), names in sources.items()
    )
    command = options.typed("--acknowledge")
    raise FaultedError(
        f"the arm stopped before this run and nothing moves until that is resolved: {faults}; "
        f"then continue with: {command}"
    )


def acknowledge_faults(
    robot: ArmMethods, report: Callable[[str], None], *, recover: bool = True
) -> None:
    """Acknowledge and recover from faults that stopped the arm before, if any; nothing moves.

    Args:
        robot: A robot that was just connected.
        report: Receives a sentence for each fault.
        recover: Whether to recover; False only writes the evidence.

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
        report(f"acknowledged: {fault}")
    for path in dict.fromkeys(fault.evidence for fault in faults):
        report(f"evidence: {path}")
        # The owner of a served arm has it, in a folder of its own.
        if path is not None and path.exists():
            report(f"look at it: {shlex.join(('bioscara', 'record', 'info', str(path)))}")
    if recover:
        robot.recover()


def remedy(robot: ArmMethods) -> str:
    """Return the advice appended to a failure's cause if a fault is latched; else nothing."""
    return "; then continue with --acknowledge" if robot.faults else ""


class NewWarnings:
    """Filters the warnings of a robot for those not yet reported.

    Args:
        robot: A connected robot; its present warnings count as reported.
    """

    def __init__(self, robot: ArmMethods) -> None:
        self._robot = robot
        self._known = robot.warnings

    def take(self) -> list[str]:
        """Return the warnings since the last call, oldest first, as sentences."""
        known, self._known = self._known, self._robot.warnings
        # The oldest are dropped over time, so their number is no indication; and those of an owner
        # are other objects each time.
        kept = next(
            count
            for count in range(min(len(known), len(self._known)), -1, -1)
            if known[len(known) - count :] == self._known[:count]
        )
        return [f"warning: {text}" for text in self._known[kept:]]
