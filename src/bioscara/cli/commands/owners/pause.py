"""``bioscara pause``."""

from __future__ import annotations

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share_served
from bioscara.errors import OwnerLostError


def arguments(parser: Parser) -> None:
    share_served(
        parser,
        help="name of the arm, or the address of its gateway (default: all of this computer)",
    )


def run(options: Options, output: Output) -> None:
    """Pause all motion of an arm, or of all that are served."""
    from bioscara.api import messages as m, runtime
    from bioscara.cli.owner_link import author, linked, owner_of

    # All, as by a stop: to come to rest is safe.
    names = [options.arm] if options.arm else [owner.name for owner in runtime.owners()]
    if not names:
        raise OwnerLostError(f"no arm is served, so none was paused{runtime.unlisted()}")
    for each in names:
        with linked(owner_of(options, each), author()) as link:
            link.request(m.Pause())
        output.line(f"{each} is paused; continue with: bioscara resume --arm {each}")
