"""Arguments that several commands share: the arm, the target, the scene and the plot."""

from __future__ import annotations

import argparse
from pathlib import Path

BUS_HELP = (
    "which arm: 'sim' (simulated in this process, the default), 'sim:/path.sock' (one that "
    "'bioscara simulate' runs) or 'linux:1' (a real one on I2C bus 1)"
)
START = (-0.6, 0.2, 1.2, -0.6)
"""Default joint positions at the start of a plan [rad m rad rad]: in front of the column, with the
elbow bent, so that a line can start there. With a stretched arm, as at ``center``, none can."""
_JOINTS = "J1 J2 J3 J4"


def add_bus(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that select the arm."""
    parser.add_argument("--bus", metavar="BUS", default="sim", help=BUS_HELP)
    parser.add_argument(
        "--v1",
        action="store_true",
        help="simulate joints with their original firmware, as existing arms have it",
    )


def add_motion(parser: argparse.ArgumentParser) -> None:
    """Add the common arguments of ``demo`` and ``run``."""
    add_bus(parser)
    add_acknowledge(parser)
    add_realtime(parser)
    add_full_speed(parser)
    parser.add_argument(
        "--priority",
        metavar="N",
        type=int,
        help="run the control loop before everything else, as SCHED_FIFO N (1 .. 99, usually 80) "
        "and with its memory locked; needs permission",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        help="folder for samples, report and plot (default: a new one under runs/)",
    )


def add_acknowledge(parser: argparse.ArgumentParser) -> None:
    """Add the argument that acknowledges faults."""
    parser.add_argument(
        "--acknowledge",
        action="store_true",
        help="take note of what stopped the arm before, keep the evidence and go on; without it an "
        "arm that a fault stopped is refused",
    )


def add_realtime(parser: argparse.ArgumentParser) -> None:
    """Add the argument for simulated homing in real time."""
    parser.add_argument(
        "--realtime",
        action="store_true",
        help="simulated homing takes the time it takes on the arm",
    )


def add_full_speed(parser: argparse.ArgumentParser) -> None:
    """Add the argument that lifts the limit of the tool's speed."""
    parser.add_argument(
        "--full-speed",
        action="store_true",
        help="let the tool move faster than 250 mm/s",
    )


def add_target(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for target, type of motion and output files."""
    target = parser.add_mutually_exclusive_group(required=True)
    add_four(target, "--pose", "X Y Z YAW", "where the tool shall be, in the base [m m m rad]")
    add_four(target, "--joints", _JOINTS, "where the joints shall be [rad m rad rad]")
    target.add_argument("--name", metavar="NAME", default="", help="a pose that has a name")
    add_table(parser)
    add_tool(parser, "name of the tool that is mounted")
    parser.add_argument("--linear", action="store_true", help="lead the tool along a line")
    parser.add_argument(
        "--via",
        metavar=("X", "Y", "Z"),
        type=float,
        nargs=3,
        help="lead the tool along the arc through this place [m]",
    )
    parser.add_argument(
        "--speed",
        metavar="SHARE",
        type=float,
        default=1.0,
        help="share of the speed limits to use, 0.001 to 1 (default 1)",
    )
    add_scene(parser)
    parser.add_argument(
        "--csv", metavar="FILE", type=Path, help="write the trajectory, for 'bioscara run'"
    )
    add_plot(parser, "draw joints and tool against their limits, as PNG")


def add_start(parser: argparse.ArgumentParser, help_text: str) -> None:
    """Add the argument for the joint positions at the start."""
    parser.add_argument(
        "--from",
        dest="start",
        metavar=tuple(_JOINTS.split()),
        type=float,
        nargs=4,
        help=f"{help_text} [rad m rad rad] (default: {' '.join(f'{v:g}' for v in START)})",
    )


def add_scene(
    parser: argparse.ArgumentParser,
    help_text: str = "file with the zones and the table that the arm keeps clear of",
) -> None:
    """Add the argument for the scene file."""
    parser.add_argument("--scene", metavar="FILE", type=Path, help=help_text)


def add_plot(parser: argparse.ArgumentParser, help_text: str) -> None:
    """Add the argument for the plot of a motion."""
    parser.add_argument("--plot", metavar="FILE", type=Path, help=help_text)


def add_table(parser: argparse.ArgumentParser) -> None:
    """Add the argument for the file with the poses."""
    parser.add_argument(
        "--table",
        metavar="FILE",
        type=Path,
        default=Path("poses.yaml"),
        help="file with the poses (default: poses.yaml)",
    )


def add_tool(parser: argparse.ArgumentParser, help_text: str) -> None:
    """Add the argument for the name of a tool."""
    parser.add_argument(
        "--tool", metavar="NAME", default="fingers", help=f"{help_text} (default: fingers)"
    )


def add_four(parser: argparse._ActionsContainer, name: str, values: str, help_text: str) -> None:
    """Add an option with four numbers.

    Args:
        parser: Parser or group to add it to.
        name: Name of the option.
        values: Names of the numbers, separated by spaces.
        help_text: Help text of the option.
    """
    parser.add_argument(name, metavar=tuple(values.split()), type=float, nargs=4, help=help_text)
