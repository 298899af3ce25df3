"""``bioscara stop``, when the command line has been imported already."""

from __future__ import annotations

from bioscara import stop
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser


def arguments(parser: Parser) -> None:
    parser.add_argument("name", metavar="NAME", nargs="?", help="name of the arm (default: all)")


def run(options: Options, output: Output) -> ExitStatus:  # noqa: ARG001
    """Stop the motion of an arm, or of all that are served."""
    return ExitStatus(stop.main([options.name] if options.name else []))
