"""``bioscara events``."""

from __future__ import annotations

import queue
import time
from contextlib import closing, suppress
from typing import TYPE_CHECKING

from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.parser import Options, Parser, whole_number
from bioscara.cli.shared_arguments import share, share_served
from bioscara.errors import OwnerLostError

if TYPE_CHECKING:
    from bioscara.api import messages as m

_POLL = 0.1
"""Period in which a wait looks for Ctrl-C [s]."""


def arguments(parser: Parser) -> None:
    share_served(parser)
    share(parser, "--follow")
    parser.add_argument(
        "--after", metavar="N", type=whole_number, default=0, help="only those after this number"
    )
    parser.add_argument("--json", action="store_true", help="as JSON, one a line")


def run(options: Options, output: Output) -> ExitStatus:
    """List what happened to an arm."""
    from bioscara.api import messages as m
    from bioscara.cli.owner_link import owner_of
    from bioscara.cli.signals import StopRequest
    from bioscara.remote.link import OwnerLink

    arrived: queue.SimpleQueue[m.Event | OwnerLostError] = queue.SimpleQueue()

    def receive(message: m.FromOwner) -> None:
        if isinstance(message, m.Event):
            arrived.put(message)

    link = OwnerLink(owner_of(options), receive, arrived.put, events_after=options.after)
    with StopRequest() as cancelled, closing(link):
        link.open()
        last = link.welcome.last_event
        shown = options.after
        while not cancelled() and (options.follow or shown < last) and output.problem is None:
            with suppress(queue.Empty):
                event = arrived.get(timeout=_POLL)
                if isinstance(event, OwnerLostError):
                    complain(str(event))
                    return ExitStatus.FAILED
                shown = event.number
                output.line(_line(event, options))
    return ExitStatus.OK


def _line(event: m.Event, options: Options) -> str:
    from bioscara.api import framing

    if options.json:
        return framing.encode_json(event).decode()
    clock = time.strftime("%H:%M:%S", time.localtime(event.wall))
    return f"{event.number:6d}  {clock}  {event.what:14s}  {event.text}"
