"""``bioscara simulate``."""

from __future__ import annotations

from pathlib import Path

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    parser.add_argument(
        "--socket", metavar="PATH", type=Path, required=True, help="Unix socket to listen on"
    )
    parser.add_argument("--v1", action="store_true", help="joints with their original firmware")
    share(parser, "--seed", help="seed of the simulation (default 0)")


def run(options: Options, output: Output) -> None:
    """Simulate an arm behind a Unix socket until Ctrl-C."""
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
