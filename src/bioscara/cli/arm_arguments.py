"""Arguments that commands share, about the arm: which one, its parameters, loop and faults."""

from __future__ import annotations

import argparse
import os
from functools import partial
from pathlib import Path

from bioscara.arguments import OVERLAY_VARIABLE
from bioscara.cli.parser import Options, Parser, whole_number
from bioscara.errors import AccessError

ARM_VARIABLE = "BIOSCARA_ARM"
"""Environment variable with the name of the owner whose arm commands use."""
RECORDINGS = Path("recordings")
"""Folder of the recordings, unless another one is given."""
BUS_HELP = (
    "which arm: 'sim' (simulated in this process, the default), 'sim:/path.sock' (one that "
    "'bioscara simulate' runs) or 'linux:1' (a real one on I2C bus 1)"
)


def add_parameters(parser: Parser) -> None:
    """Add the argument for the file with the values of this arm."""
    overlay = os.environ.get(OVERLAY_VARIABLE)
    parser.add_argument(
        "--parameters",
        metavar="FILE",
        type=Path,
        default=Path(overlay) if overlay else None,
        help="values of this arm, such as its calibration, over those of parameters.yaml "
        f"(default: ${OVERLAY_VARIABLE}, if it is set)",
    )


def gives_parameters(options: Options) -> bool:
    """Return whether the file of ``--parameters`` is another one than that of the environment."""
    overlay = options.parameters
    return overlay is not None and str(overlay) != os.environ.get(OVERLAY_VARIABLE)


def add_bus(parser: Parser, *, owned: bool = True, lasting: bool = False) -> None:
    """Add the arguments that select the arm.

    Args:
        parser: Parser of the command.
        owned: Whether it may be the arm of a running owner.
        lasting: Whether it has to exist before and after the command.
    """
    parser.add_argument("--bus", metavar="BUS", help=BUS_HELP)
    if owned:
        parser.add_argument(
            "--arm",
            metavar="NAME",
            help=f"the arm of this name, which 'bioscara serve' runs (default: ${ARM_VARIABLE}, "
            "else the only one on that bus, if any)",
        )
    parser.add_argument(
        "--v1",
        action="store_true",
        help="simulate joints with their original firmware, as existing arms have it",
    )
    parser.checks.append(partial(_choose_owner, owned=owned, lasting=lasting))
    parser.checks.append(_check_v1)
    if lasting:
        parser.checks.append(_require_lasting)


def add_owner(parser: Parser) -> None:
    """Add the argument that names the owner of an arm."""
    parser.add_argument(
        "--arm",
        metavar="NAME",
        help=f"name of the arm (default: ${ARM_VARIABLE}, else the only one)",
    )


def add_homed(parser: Parser) -> None:
    """Add the argument for an arm that is homed when the simulation begins."""
    parser.add_argument(
        "--homed",
        action="store_true",
        help="start with homed joints; for the arm simulated in this process only",
    )
    parser.checks.append(_check_homed)


def add_rate(parser: Parser) -> None:
    """Add the arguments of the control loop."""
    parser.add_argument(
        "--rate",
        metavar="HZ",
        type=whole_number,
        help="control cycles per second (default: 100, and 50 with joints of protocol version 1)",
    )
    parser.add_argument(
        "--priority",
        metavar="N",
        type=whole_number,
        help="run the control loop before everything else, as SCHED_FIFO N (1 .. 99, usually 80) "
        "and with its memory locked; needs permission",
    )


def add_acknowledge(parser: Parser) -> None:
    """Add the argument that acknowledges faults."""
    parser.add_argument(
        "--acknowledge",
        action="store_true",
        help="acknowledge the faults that stopped the arm before, keep their evidence and "
        "continue; without it an arm that a fault stopped is refused",
    )


def port(text: str) -> int:
    """Return the TCP port in an argument."""
    if not (text.isascii() and text.isdigit() and int(text) < 2**16):
        raise argparse.ArgumentTypeError(f"{text!r} is not a port: it is a number, 0 .. 65535")
    return int(text)


def _choose_owner(parser: Parser, options: Options, *, owned: bool, lasting: bool) -> None:
    """Choose the owner whose arm the command uses, if there is one."""
    bus_given = options.bus is not None
    if bus_given and options.bus.startswith("arm:"):
        parser.error(f"a served arm is named by --arm {options.bus[4:]}; leave out --bus")
    if not bus_given:
        options.bus = "sim"
    owners_own = {
        "--parameters": gives_parameters(options),
        "--v1": options.v1,
        "--rate": options.rate is not None,
        "--priority": options.priority is not None,
        "--realtime": options.realtime,
    }
    given = [word for word, value in owners_own.items() if value]
    if options.arm is not None and bus_given:
        parser.error("--arm and --bus exclude one another; leave out one of them")
    source = ""
    if options.arm is None and owned and not bus_given:
        options.arm = os.environ.get(ARM_VARIABLE) or None
        source = f" (from {ARM_VARIABLE})"
    if options.arm is not None:
        if given:
            parser.error(
                f"{given[0]} is chosen by the owner of {options.arm}{source}; leave it out"
            )
        return
    if not owned:
        return
    # Imported here: help has no owner to look for.
    from bioscara.api import runtime  # noqa: PLC0415

    try:
        owners = runtime.owners()
    except AccessError as error:
        parser.error(str(error))
    served = [owner.name for owner in owners]
    # A command about an arm that lasts has none of its own, and takes a served one on any bus.
    any_bus = lasting and not bus_given
    running = [owner.name for owner in owners if any_bus or owner.bus == options.bus]
    if running and not given:
        if len(running) > 1:
            parser.error(f"there are the arms {', '.join(running)}; choose one with --arm NAME")
        options.arm = running[0]
    elif options.bus == "sim":
        options.served = served


def _check_v1(parser: Parser, options: Options) -> None:
    if options.v1 and options.bus != "sim":
        parser.error("--v1 applies only to the arm simulated in this process; leave out --bus")


def _check_homed(parser: Parser, options: Options) -> None:
    if options.homed and options.bus != "sim":
        parser.error(
            "--homed applies only to the arm simulated in this process, with --bus sim; any other "
            "arm is homed by its joints: leave out --homed, and home it"
        )


def _require_lasting(parser: Parser, options: Options) -> None:
    if options.bus == "sim" and options.arm is None:
        parser.error(
            f"{options.command} needs an arm that outlasts this command, and the one simulated in "
            "this process does not: give --bus linux:1, --arm NAME of an arm that 'bioscara serve' "
            "runs, or --bus sim:/path.sock of one that 'bioscara simulate --socket /path.sock' runs"
        )
