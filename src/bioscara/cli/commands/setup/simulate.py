"""``bioscara simulate``."""

from __future__ import annotations

from pathlib import Path

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser, whole_number


def arguments(parser: Parser) -> None:
    """Add the arguments of the command."""
    parser.add_argument(
        "--socket", metavar="PATH", type=Path, required=True, help="Unix socket to listen on"
    )
    parser.add_argument("--v1", action="store_true", help="joints with their original firmware")
    parser.add_argument(
        "--seed",
        metavar="N",
        type=whole_number,
        default=0,
        help="seed of the simulation (default 0)",
    )


def run(options: Options, output: Output) -> None:
    """Simulate an arm behind a Unix socket until Ctrl-C.

    Raises:
        BioscaraError: The socket cannot be used.
    """
    from bioscara.cli.signals import StopRequest
    from bioscara.sim import SimulatedArm, serve

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
