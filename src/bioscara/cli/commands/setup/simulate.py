"""``bioscara simulate``."""

from __future__ import annotations

from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.signals import StopRequest
from bioscara.sim import SimulatedArm, serve


def run(options: Options) -> int:
    """Simulate an arm behind a Unix socket until Ctrl-C.

    Raises:
        BioscaraError: The socket cannot be used.
        OSError: Standard output cannot be written.
    """
    output = Output()
    arm = SimulatedArm(seed=options.seed, v1=options.v1)
    firmware = "their original firmware" if options.v1 else "this project's firmware"
    invitation = f"simulated arm, joints with {firmware}: --bus sim:{options.socket}"
    with StopRequest() as cancelled:
        serve(
            arm,
            options.socket,
            cancelled,
            listening=lambda: output.line(invitation),
            report=output.line,
        )
    output.check()
    return ExitStatus.OK
