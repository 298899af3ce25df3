"""``bioscara resume``."""

from __future__ import annotations

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share_served
from bioscara.errors import LeaseError


def arguments(parser: Parser) -> None:
    share_served(parser)


def run(options: Options, output: Output) -> None:
    """Lift the pause of an arm.

    Raises:
        LeaseError: Others have paused, and another client commands the arm.
    """
    from bioscara.api import messages as m
    from bioscara.cli.owner_link import asked, author, linked, owner_of

    name = owner_of(options)
    with linked(name, author()) as link:
        if not asked(link, m.GetState(), m.StateSample).paused:
            output.line(f"{name} is not paused")
            return
        try:
            link.request(m.Resume())
        except LeaseError as error:
            if error.holder:
                raise
            epoch = asked(link, m.AcquireLease(), m.LeaseState).lease.epoch
            link.request(m.Resume())
            link.request(m.ReleaseLease(), epoch)
        left = asked(link, m.GetState(), m.StateSample).paused_by
    output.line(f"{name} stays paused by {', '.join(left)}" if left else f"{name} continues")
