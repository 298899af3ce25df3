"""``bioscara disable``; nothing moves."""

from __future__ import annotations

from bioscara.cli.arm_arguments import add_bus, add_parameters
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser


def arguments(parser: Parser) -> None:
    """Add the arguments of the command."""
    add_parameters(parser)
    add_bus(parser, lasting=True)


def run(options: Options, output: Output) -> None:
    """Bring the joints to rest and disable them.

    Raises:
        BioscaraError: The arm cannot be used.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.opened_arm import open_arm

    with open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        robot.disable()
    output.line("disabled")
