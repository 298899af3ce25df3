"""Which arm a command uses: the arguments, and the choice of an owner where none is named."""

from __future__ import annotations

import os
from functools import partial

from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import ARM_VARIABLE, gives_parameters, share_gateway
from bioscara.errors import AccessError

BUS_HELP = (
    "which arm: 'sim' (simulated in this process, the default), 'sim:/path.sock' (one that "
    "'bioscara simulate' runs) or 'linux:1' (a real one on I2C bus 1)"
)


def share_arm(parser: Parser, *, owned: bool = True, lasting: bool = False) -> None:
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
            help="name of the arm, which 'bioscara serve' runs, or address of its gateway, "
            f"https://HOST:PORT (default: ${ARM_VARIABLE}, else the only one on that bus, if any)",
        )
        share_gateway(parser)
    parser.add_argument(
        "--v1",
        action="store_true",
        help="simulate joints with their original firmware, as existing arms have it",
    )
    parser.checks += [partial(_choose_owner, owned=owned, lasting=lasting), _check_v1]
    if lasting:
        parser.checks.append(_require_lasting)


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


def _require_lasting(parser: Parser, options: Options) -> None:
    if options.bus == "sim" and options.arm is None:
        parser.error(
            f"{options.command} needs an arm that outlasts this command, and the one simulated in "
            "this process does not: give --bus linux:1, --arm NAME of an arm that 'bioscara serve' "
            "runs, or --bus sim:/path.sock of one that 'bioscara simulate --socket /path.sock' runs"
        )
