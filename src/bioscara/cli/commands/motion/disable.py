"""``bioscara disable``; nothing moves."""

from __future__ import annotations

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_arm(parser, lasting=True)


def run(options: Options, output: Output) -> None:
    """Bring the joints to rest and disable them."""
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.opened_arm import open_arm

    with open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        robot.disable()
    output.line("disabled")
