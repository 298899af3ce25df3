"""``bioscara monitor``."""

from __future__ import annotations

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_arm(parser, lasting=True)
    share(parser, "--deg")


def run(options: Options, output: Output) -> None:
    """Show the joints live until Ctrl-C; nothing is enabled.

    Raises:
        BusUnavailableError: Another program uses the bus; names it.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.opened_arm import open_arm
    from bioscara.cli.signals import StopRequest
    from bioscara.cli.terminal.live_state import show_live

    with StopRequest() as cancelled, open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        show_live(robot, options, output, lambda: cancelled() or output.problem is not None)
