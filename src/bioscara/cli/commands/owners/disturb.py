"""``bioscara disturb``: the world around a served arm that its owner simulates."""

from __future__ import annotations

from bioscara.cli.output.console import Output, columns
from bioscara.cli.parser import Options, Parser, number
from bioscara.cli.shared_arguments import share_served

_AXES = ("x", "y", "z")


def arguments(parser: Parser) -> None:
    parser.take_commands("action", "ACTION", "list")
    actions = {
        name: parser.add_command(name, help_text)
        for name, help_text in (
            ("list", "List the bodies, their places, and the one that the jaws hold."),
            ("push", "Push a piece of labware, or a link of the arm, as link_3."),
            ("tilt", "Tilt a nest, a wall or an obstacle."),
            ("obstacle", "Put a box into the world."),
            ("remove", "Take labware that is not held, a nest, a wall or an obstacle away."),
        )
    }
    for name, action in actions.items():
        if name != "list":
            action.add_argument("name", metavar="NAME", help="name of the body")
    push, tilt, obstacle = actions["push"], actions["tilt"], actions["obstacle"]
    for axis in _AXES:
        push.add_argument(axis, metavar=axis.upper(), type=number, help="force in the base [N]")
    push.add_argument(
        "--duration", metavar="T", type=number, default=0.1, help="time (default: 0.1) [s]"
    )
    tilt.add_argument(
        "height",
        metavar="HEIGHT",
        type=number,
        help="by how much the end of a plate on it is raised, up to 0.02; 0 ends it [m]",
    )
    tilt.add_argument(
        "--direction",
        metavar="ANGLE",
        type=number,
        default=0.0,
        help="direction of that end, from the body's x axis (default: 0) [rad]",
    )
    for corner, words in (("lower", "smallest"), ("upper", "largest")):
        for axis in _AXES:
            obstacle.add_argument(
                f"{corner}_{axis}",
                metavar=f"{corner.upper()}_{axis.upper()}",
                type=number,
                help=f"{words} {axis} in the base [m]",
            )
    for action in actions.values():
        share_served(action)


def run(options: Options, output: Output) -> None:
    """Disturb the world of a simulated arm, or list it; needs no lease.

    Raises:
        NotSupportedError: The arm is real, or has no world.
        InvalidArgumentError: There is no such body, or the value is not possible; or there are
            several arms, and none is named.
        LimitError: A value is outside its range.
        LifecycleError: The jaws hold the body to be taken away.
    """
    from bioscara.cli.owner_link import served_robot

    with served_robot(options) as robot:
        world = robot.simulation
        name = getattr(options, "name", "")
        match options.action:
            case "push":
                world.push(name, [getattr(options, axis) for axis in _AXES], options.duration)
                output.line(f"{name} is pushed for {options.duration:g} s of the arm's time")
            case "tilt":
                world.tilt(name, options.height, options.direction)
                output.line(f"{name} is tilted by {1e3 * options.height:g} mm")
            case "obstacle":
                corners = [
                    [getattr(options, f"{corner}_{axis}") for axis in _AXES]
                    for corner in ("lower", "upper")
                ]
                world.add_obstacle(name, *corners)
                output.line(f"{name} is in the world; bioscara disturb remove {name}")
            case "remove":
                world.take_away(name)
                output.line(f"{name} is away")
            case _:
                rows = [
                    (shape.name, shape.kind, *(f"{value:.4f}" for value in pose[1:4]))
                    for shape, pose in zip(world.bodies, world.poses, strict=True)
                ]
                for line in columns([("body", "kind", "x [m]", "y [m]", "z [m]"), *rows]):
                    output.line(line)
                output.line(f"held: {world.held or 'nothing'}")
