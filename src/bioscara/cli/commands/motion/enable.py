"""``bioscara enable``; nothing moves."""

from __future__ import annotations

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    share_arm(parser, lasting=True)
    share(parser, "--acknowledge", "--deg")


def run(options: Options, output: Output) -> ExitStatus:
    """Hold the joints enabled until Ctrl-C; those of a served arm until they are disabled.

    Raises:
        FaultedError: A fault stopped the arm before, and is not acknowledged.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.opened_arm import (
        acknowledge_faults,
        open_arm,
        remedy,
        require_acknowledgement,
    )
    from bioscara.cli.signals import StopRequest
    from bioscara.cli.terminal.live_state import show_live

    with StopRequest() as cancelled, open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        require_acknowledgement(robot, options)
        acknowledge_faults(robot, output.line)
        robot.enable()
        if options.arm is not None:
            output.line(f"enabled; {options.arm} holds the joints until 'bioscara disable'")
            return ExitStatus.OK
        robot.watch()
        output.line("enabled; Ctrl-C disables the joints")
        show_live(robot, options, output, lambda: cancelled() or bool(robot.faults))
        faults = robot.faults
        if faults:
            complain(f"{faults[0]}{remedy(robot)}; all joints were stopped and disabled")
    output.line("disabled")
    return ExitStatus.FAILED if faults else ExitStatus.OK
