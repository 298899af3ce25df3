"""``bioscara arms``."""

from __future__ import annotations

from bioscara.cli.output.console import Output, columns
from bioscara.cli.parser import Options, Parser
from bioscara.errors import BioscaraError


def arguments(_: Parser) -> None:
    pass


def run(options: Options, output: Output) -> None:  # noqa: ARG001
    """List the running owners."""
    from bioscara.api import messages as m, runtime
    from bioscara.cli.owner_link import asked, linked, state_words

    rows: list[tuple[str, ...]] = [("arm", "bus", "process", "state", "commanded by")]
    for owner in runtime.owners():
        try:
            with linked(owner.name) as link:
                state = asked(link, m.GetState(), m.StateSample)
                lease = asked(link, m.GetLease(), m.LeaseState).lease
                words = state_words(state), lease.client or "nobody"
        except BioscaraError as error:
            words = f"does not answer: {error}", "-"
        rows.append((owner.name, owner.bus, str(owner.pid), *words))
    if len(rows) == 1:
        output.line(f"no arm is served; bioscara serve starts an owner{runtime.unlisted()}")
        return
    output.lines(columns(rows))
