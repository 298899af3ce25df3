"""``bioscara monitor``."""

from __future__ import annotations

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.opened_arm import open_arm
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.signals import StopRequest
from bioscara.cli.terminal.live_state import show_live


def run(options: Options) -> int:
    """Show the joints live until Ctrl-C; nothing is enabled.

    Raises:
        BusUnavailableError: Another program uses the bus; names it.
        BioscaraError: A joint cannot be used.
        OSError: Standard output cannot be written.
    """
    output = Output()
    with StopRequest() as cancelled, open_arm(options, parameters_from(options)) as robot:
        output.line(f"arm: {robot.description}")
        show_live(robot, options, output, lambda: cancelled() or output.problem is not None)
    output.check()
    return ExitStatus.OK
