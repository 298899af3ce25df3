"""``bioscara logs``."""

from __future__ import annotations

import time

from bioscara.cli.arm_arguments import add_owner
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser

_POLL = 0.1
"""Period in which a wait looks for Ctrl-C [s]."""
_PERIOD = 0.5
"""Time between two questions for new lines [s]."""


def arguments(parser: Parser) -> None:
    """Add the arguments of the command."""
    add_owner(parser)
    parser.add_argument("--follow", action="store_true", help="wait for more, until Ctrl-C")


def run(options: Options, output: Output) -> None:
    """List the log of the process that owns an arm.

    Raises:
        OwnerLostError: No owner runs.
        InvalidArgumentError: There are several, and none is named.
    """
    from bioscara.api import messages as m
    from bioscara.cli.owner_link import asked, linked, owner_name
    from bioscara.cli.signals import StopRequest

    with StopRequest() as cancelled, linked(owner_name(options)) as link:
        last, due = 0, 0.0
        while not cancelled() and output.problem is None:
            if (now := time.monotonic()) >= due:
                due = now + _PERIOD
                log = asked(link, m.GetLog(last), m.LogLines)
                last = log.last
                for line in log.lines:
                    output.line(line)
                if not options.follow:
                    break
            time.sleep(_POLL)
