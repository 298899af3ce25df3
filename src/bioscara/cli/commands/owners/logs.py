"""``bioscara logs``."""

from __future__ import annotations

import time

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share, share_served

_POLL = 0.1
"""Period in which a wait looks for Ctrl-C [s]."""
_PERIOD = 0.5
"""Time between two questions for new lines [s]."""


def arguments(parser: Parser) -> None:
    share_served(parser)
    share(parser, "--follow")


def run(options: Options, output: Output) -> None:
    """List the log of the process that owns an arm."""
    from bioscara.api import messages as m
    from bioscara.cli.owner_link import asked, linked, owner_of
    from bioscara.cli.signals import StopRequest

    with StopRequest() as cancelled, linked(owner_of(options)) as link:
        last, due = 0, 0.0
        while not cancelled() and output.problem is None:
            if (now := time.monotonic()) >= due:
                due = now + _PERIOD
                log = asked(link, m.GetLog(last), m.LogLines)
                last = log.last
                output.lines(log.lines)
                if not options.follow:
                    break
            time.sleep(_POLL)
