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
    parser.add_argument(
        "--world",
        metavar="FILE",
        type=Path,
        help="table, walls, nests and labware around the arm; needs bioscara[physics]",
    )
    parser.add_argument("--v1", action="store_true", help="joints with their original firmware")
    share(parser, "--seed", help="seed of the simulation (default 0)")


def run(options: Options, output: Output) -> None:
    """Simulate an arm behind a Unix socket until Ctrl-C."""
    from bioscara.cli.signals import StopRequest
    from bioscara.model import load_parameters
    from bioscara.sim import SimulatedArm, SimulatedServo, serve

    arm = SimulatedArm(seed=options.seed, v1=options.v1)
    parameters = load_parameters()
    servo = SimulatedServo(parameters.gripper.outputs[0])
    if options.world is not None:
        from bioscara.physics.world import PhysicsWorld
        from bioscara.planning.world import read_world

        # The arm keeps it.
        PhysicsWorld(arm, servo, read_world(options.world), parameters)
    firmware = "their original firmware" if options.v1 else "this project's firmware"
    invitation = f"simulated arm, joints with {firmware}: --bus sim:{options.socket}"
    with StopRequest() as cancelled:
        serve(
            arm,
            options.socket,
            cancelled,
            listening=lambda: output.line(invitation),
            report=output.line,
            servo=servo,
        )
