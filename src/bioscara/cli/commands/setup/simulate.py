"""``bioscara simulate``."""

from __future__ import annotations

from pathlib import Path

from bioscara.cli.output.console import Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import share
from bioscara.errors import InvalidArgumentError


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
    share(parser, "--camera")
    parser.add_argument(
        "--image",
        metavar="FILE",
        type=Path,
        help="write an image of the world as PNG about once a second",
    )
    parser.add_argument("--v1", action="store_true", help="joints with their original firmware")
    share(parser, "--seed", help="seed of the simulation (default 0)")


def run(options: Options, output: Output) -> None:
    """Simulate an arm behind a Unix socket until Ctrl-C."""
    from contextlib import ExitStack

    from bioscara.cli.signals import StopRequest
    from bioscara.model import load_parameters
    from bioscara.processes.unread_output import never_wait
    from bioscara.sim import SimulatedArm, SimulatedServo, serve

    if (options.camera is None) is not (options.image is None):
        raise InvalidArgumentError("--camera and --image belong together; give both or none")
    if options.camera is not None and options.world is None:
        raise InvalidArgumentError("--camera shows a world; give --world FILE, too")
    never_wait()
    arm = SimulatedArm(seed=options.seed, v1=options.v1)
    parameters = load_parameters()
    servo = SimulatedServo(parameters.gripper.outputs[0])
    if options.world is not None:
        from bioscara.physics.world import PhysicsWorld
        from bioscara.planning.world import read_world

        # The arm keeps it.
        world = PhysicsWorld(arm, servo, read_world(options.world), parameters)
    firmware = "their original firmware" if options.v1 else "this project's firmware"
    invitation = f"simulated arm, joints with {firmware}: --bus sim:{options.socket}"
    with StopRequest() as cancelled, ExitStack() as ends:
        if options.camera is not None:
            from bioscara.cli.pictures import Pictures

            pictures = Pictures(world, options.camera, options.image, output.line)
            ends.enter_context(pictures)

        def ended() -> bool:
            if options.camera is not None:
                pictures.step()
            return cancelled()

        serve(
            arm,
            options.socket,
            ended,
            listening=lambda: output.line(invitation),
            report=output.line,
            servo=servo,
        )
