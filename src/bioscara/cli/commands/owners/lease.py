"""``bioscara lease``."""

from __future__ import annotations

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share_served


def arguments(parser: Parser) -> None:
    share_served(parser)
    parser.add_argument(
        "--end",
        action="store_true",
        help="end the lease: the motion of its client is stopped, and others may command the arm",
    )


def run(options: Options, output: Output) -> None:
    """Name the client that commands an arm, or end its lease."""
    from bioscara.api import messages as m
    from bioscara.cli.owner_link import asked, linked, owner_of

    name = owner_of(options)
    with linked(name) as link:
        lease = asked(link, m.GetLease(), m.LeaseState).lease
        if lease.client is None:
            output.line(f"nobody commands {name}")
        elif options.end:
            taken = asked(link, m.AcquireLease(force=True), m.LeaseState).lease
            link.request(m.ReleaseLease(), taken.epoch)
            output.line(f"ended the lease of {lease.client}; nobody commands {name} now")
        else:
            output.line(f"{lease.client} commands {name}, for {lease.remaining:.1f} s more")
