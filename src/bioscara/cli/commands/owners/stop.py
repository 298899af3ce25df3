"""``bioscara stop``, when the command line has been imported already."""

from __future__ import annotations

from bioscara import stop
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share_gateway


def arguments(parser: Parser) -> None:
    parser.add_argument(
        "arm",
        metavar="NAME",
        nargs="?",
        help="name of the arm, or the address of its gateway (default: all of this computer)",
    )
    share_gateway(parser)


def run(options: Options, output: Output) -> ExitStatus:
    """Stop the motion of an arm, or of all that are served."""
    if options.arm is None or "://" not in options.arm:
        return ExitStatus(stop.main([options.arm] if options.arm else []))
    from bioscara.api import messages as m
    from bioscara.cli.owner_link import linked, owner_of

    with linked(owner_of(options)) as link:
        link.request(m.StopAll())
    output.line(f"{options.arm} was stopped")
    return ExitStatus.OK
