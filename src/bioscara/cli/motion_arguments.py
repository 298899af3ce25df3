"""Arguments that commands share, about a motion: its target, its surroundings and its pictures."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from bioscara.cli.arm_arguments import add_acknowledge, add_bus, add_rate, gives_parameters
from bioscara.cli.parser import Options, Parser, number

START = (-0.6, 0.2, 1.2, -0.6)
"""Default joint positions at the start of a plan [rad m rad rad]: in front of the column, with the
elbow bent, so that a line can start there. With a stretched arm, as at ``center``, none can."""
TABLE = Path("poses.yaml")
"""File with the taught poses if ``--table`` is not given; it need not exist."""
FINGERS = "fingers"
JOINTS = "J1 J2 J3 J4"


def add_motion(
    parser: Parser, *, full_speed: bool = True, realtime: bool = True, owned: bool = True
) -> None:
    """Add the arguments of every command that moves an arm.

    Args:
        parser: Parser of the command.
        full_speed: Whether its speed can be limited.
        realtime: Whether it homes the arm.
        owned: As for :func:`add_bus`.
    """
    add_bus(parser, owned=owned)
    add_acknowledge(parser)
    if realtime:
        parser.add_argument(
            "--realtime",
            action="store_true",
            help="simulated homing takes the time it takes on the arm",
        )
    if full_speed:
        add_full_speed(parser)
    add_degrees(parser)
    add_rate(parser)


def add_full_speed(parser: Parser) -> None:
    """Add the argument that lifts the limit of the tool's speed."""
    parser.add_argument(
        "--full-speed",
        action="store_true",
        help="let the tool move faster than 250 mm/s",
    )


def add_degrees(parser: Parser) -> None:
    """Add the argument for angles in degrees; parsed ones are in radians."""
    parser.add_argument(
        "--deg",
        dest="degrees",
        action="store_true",
        help="give and show angles in degrees instead of radians; files keep radians",
    )
    parser.checks.append(_convert_degrees)


def add_target(parser: Parser, *, required: bool = True) -> None:
    """Add the arguments for target and type of motion."""
    target = parser.add_mutually_exclusive_group(required=required)
    add_four(target, "--pose", "X Y Z YAW", "goal pose of the tool in the base [m m m rad]")
    add_four(target, "--joints", JOINTS, "goal positions of the joints [rad m rad rad]")
    target.add_argument("--name", metavar="NAME", default="", help="name of a saved pose")
    add_table(parser)
    add_tool(parser, "name of the tool that is mounted")
    parser.add_argument("--linear", action="store_true", help="move the tool along a line")
    parser.add_argument(
        "--via",
        metavar=("X", "Y", "Z"),
        type=number,
        nargs=3,
        help="move the tool along the arc through this point [m]",
    )
    parser.add_argument(
        "--velocity-scaling",
        metavar="SHARE",
        type=number,
        default=1.0,
        help="share of the speed limits to use, 0.001 to 1 (default 1)",
    )


def add_planned_files(parser: Parser) -> None:
    """Add the arguments for the surroundings and the output files of a planned motion."""
    add_scene(parser)
    parser.add_argument(
        "--csv", metavar="FILE", type=Path, help="write the trajectory, for 'bioscara run'"
    )
    add_plot(parser, "draw joints and tool against their limits, as PNG")


def add_start(parser: Parser, help_text: str) -> None:
    """Add the argument for the joint positions at the start."""
    parser.add_argument(
        "--from",
        dest="start",
        metavar=tuple(JOINTS.split()),
        type=number,
        nargs=4,
        help=f"{help_text} [rad m rad rad] (default: {' '.join(f'{v:g}' for v in START)})",
    )


def add_scene(
    parser: Parser,
    help_text: str = "file with the zones and the table that the arm keeps clear of",
) -> None:
    """Add the argument for the scene file."""
    parser.add_argument("--scene", metavar="FILE", type=Path, help=help_text)


def add_plot(parser: Parser, help_text: str) -> None:
    """Add the argument for the plot of a motion."""
    parser.add_argument("--plot", metavar="FILE", type=Path, help=help_text)


def add_report(parser: Parser) -> None:
    """Add the argument for the files of a run."""
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        help="folder for samples, report and plot (default: a new one under runs/)",
    )


def add_table(parser: Parser, help_text: str = "file with the poses") -> None:
    """Add the argument for the file with the poses."""
    parser.add_argument(
        "--table",
        metavar="FILE",
        type=Path,
        help=f"{help_text} (default: {TABLE}, if it exists)",
    )


def add_taught(parser: Parser) -> None:
    """Add the arguments of commands about taught poses: their file, or the arm that has them."""
    add_table(parser)
    parser.add_argument(
        "--arm", metavar="NAME", help="the poses of this arm, which 'bioscara serve' runs"
    )
    add_degrees(parser)
    parser.checks.append(_check_taught)


def add_force(parser: Parser, what: str) -> None:
    """Add the argument that replaces an entry of the teach file."""
    parser.add_argument(
        "--force", action="store_true", help=f"replace the {what} of this name, if there is one"
    )


def add_tool(parser: Parser, help_text: str) -> None:
    """Add the argument for the name of a tool."""
    parser.add_argument(
        "--tool", metavar="NAME", default=FINGERS, help=f"{help_text} (default: {FINGERS})"
    )


def add_four(
    parser: argparse._ActionsContainer,
    name: str,
    values: str,
    help_text: str,
    *,
    required: bool = False,
) -> None:
    """Add an option with four numbers.

    Args:
        parser: Parser or group to add it to.
        name: Name of the option.
        values: Names of the numbers, separated by spaces.
        help_text: Help text of the option.
        required: Whether it must be given.
    """
    parser.add_argument(
        name,
        metavar=tuple(values.split()),
        type=number,
        nargs=4,
        help=help_text,
        required=required,
    )


def _convert_degrees(_: Parser, options: Options) -> None:
    """Convert the angles of all options to radians."""
    if not options.degrees:
        return
    for word in ("pose", "joints", "start", "offset"):
        values = getattr(options, word, None)
        if values is not None:
            lengths = {1} if word in {"joints", "start"} else {0, 1, 2}
            converted = [
                value if index in lengths else math.radians(value)
                for index, value in enumerate(values)
            ]
            setattr(options, word, converted)


def _check_taught(parser: Parser, options: Options) -> None:
    owners_own = {
        "--table": options.table is not None,
        "--parameters": gives_parameters(options),
    }
    for word, given in owners_own.items():
        if given and options.arm is not None:
            parser.error(f"--arm and {word} exclude one another; leave out one of them")
