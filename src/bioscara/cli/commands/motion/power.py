"""``bioscara enable`` and ``bioscara disable``; nothing moves."""

from __future__ import annotations

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.opened_arm import acknowledge_faults, open_arm, remedy, require_acknowledgement
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.signals import StopRequest
from bioscara.cli.terminal.live_state import show_live


def run(options: Options) -> int:
    """Hold the joints enabled until Ctrl-C, or bring them to rest and disable them.

    Raises:
        FaultedError: A fault stopped the arm before, and is not acknowledged.
        BioscaraError: The arm cannot be used.
        OSError: Standard output cannot be written.
    """
    return _enable(options) if options.command == "enable" else _disable(options)


def _enable(options: Options) -> ExitStatus:
    output = Output()
    with StopRequest() as cancelled, open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        require_acknowledgement(robot, options)
        acknowledge_faults(robot, output.line)
        robot.enable()
        if options.arm is not None:
            output.line(f"enabled; {options.arm} holds the joints until 'bioscara disable'")
            output.check()
            return ExitStatus.OK
        robot.watch()
        output.line("enabled; Ctrl-C disables the joints")
        show_live(robot, options, output, lambda: cancelled() or bool(robot.faults))
        faults = robot.faults
        if faults:
            complain(f"{faults[0]}{remedy(robot)}; all joints were stopped and disabled")
    output.line("disabled")
    output.check()
    return ExitStatus.FAILED if faults else ExitStatus.OK


def _disable(options: Options) -> ExitStatus:
    output = Output()
    with open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        robot.disable()
    output.line("disabled")
    output.check()
    return ExitStatus.OK
