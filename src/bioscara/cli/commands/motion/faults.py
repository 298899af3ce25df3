"""``bioscara faults``, ``bioscara acknowledge`` and ``bioscara recover``; nothing moves."""

from __future__ import annotations

import shlex

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_arm(parser, lasting=True)


def run(options: Options, output: Output) -> None:
    """List the faults that stopped the arm, write their evidence, or clear them.

    Raises:
        FaultedError: The evidence cannot be written; the faults stay.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.opened_arm import acknowledge_faults, open_arm

    with open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        if not robot.faults:
            output.line("no faults")
        elif options.command == "faults":
            for fault in robot.faults:
                output.line(str(fault))
            output.line(f"then clear them: {_recover(options)}")
        else:
            recover = options.command == "recover"
            acknowledge_faults(robot, output.line, recover=recover)
            output.line("recovered" if recover else f"clear them: {_recover(options)}")


def _recover(options: Options) -> str:
    which = ("--bus", options.bus) if options.arm is None else ("--arm", options.arm)
    return shlex.join(("bioscara", "recover", *which))
