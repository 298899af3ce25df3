"""``bioscara pause``."""

from __future__ import annotations

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share
from bioscara.errors import OwnerLostError


def arguments(parser: Parser) -> None:
    share(parser, "--arm", help="name of the arm (default: all)")


def run(options: Options, output: Output) -> None:
    """Pause all motion of an arm, or of all that are served."""
    from bioscara.api import messages as m, runtime
    from bioscara.cli.owner_link import author, linked

    # All, as by a stop: to come to rest is safe.
    names = [options.arm] if options.arm else [owner.name for owner in runtime.owners()]
    if not names:
        raise OwnerLostError(f"no arm is served, so none was paused{runtime.unlisted()}")
    for each in names:
        with linked(each, author()) as link:
            link.request(m.Pause())
        output.line(f"{each} is paused; continue with: bioscara resume --arm {each}")
