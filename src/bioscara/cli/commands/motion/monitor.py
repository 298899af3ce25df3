"""``bioscara monitor``."""

from __future__ import annotations

from bioscara.cli.arm_arguments import add_bus, add_parameters
from bioscara.cli.motion_arguments import add_degrees
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser


def arguments(parser: Parser) -> None:
    """Add the arguments of the command."""
    add_parameters(parser)
    add_bus(parser, lasting=True)
    add_degrees(parser)


def run(options: Options, output: Output) -> None:
    """Show the joints live until Ctrl-C; nothing is enabled.

    Raises:
        BusUnavailableError: Another program uses the bus; names it.
        BioscaraError: A joint cannot be used.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.opened_arm import open_arm
    from bioscara.cli.signals import StopRequest
    from bioscara.cli.terminal.live_state import show_live

    with StopRequest() as cancelled, open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        show_live(robot, options, output, lambda: cancelled() or output.problem is not None)
