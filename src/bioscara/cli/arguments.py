"""The words of the command line."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from bioscara import __version__

_BUS_HELP = (
    "which arm: 'sim' (simulated in this process, the default), 'sim:/path.sock' (one that "
    "'bioscara simulate' runs) or 'linux:1' (a real one on I2C bus 1)"
)
_EPILOG = (
    "Exit status: 0 done; 1 something failed after the arm began to move; 2 wrong usage, or "
    "refused before anything moved; 130 interrupted."
)


class Options(argparse.Namespace):
    """What was asked for; which attributes there are depends on the command.

    Attributes:
        command: Name of the command, which is also the module that does it.
        bus: Name of the bus.
        v1: Whether the simulated joints speak protocol version 1 only.
        words: All words after ``bioscara``, as they were typed.
        acknowledge: Whether what stopped the arm before is taken note of.
        realtime: Whether simulated homing takes the time it takes.
        paced: Whether a simulated trajectory takes the time it takes.
        full_speed: Whether the tool may be faster than 250 mm/s.
        priority: Real-time priority of the control loop; None for an ordinary process.
        out: Where to put the run's files; None for a new folder under ``runs``.
        file: The trajectory.
        fit: Whether to stretch the trajectory to the limits.
        pose: Where the tool shall be: x, y, z [m] and yaw [rad]; None where joints are given.
        joints: Where the joints shall be; None where a pose is given.
        start: Where a plan starts from: positions of the joints.
        linear: Whether the tool goes along a line.
        via: A place that the tool's arc leads through [m].
        speed: Share of the speed limits to use.
        csv: Where to write the planned trajectory.
        plot: Where to draw it.
        socket: Where the simulated arm listens.
        seed: Seed of the simulation.
        port: Where the 3D view listens.
        action: What to do with poses.
        table: The file with taught poses.
        name: Of a pose.
        tool: Name of a tool.
        calibration: Id of the arm's calibration; may be empty.
    """

    command: str
    bus: str
    v1: bool
    words: Sequence[str]
    acknowledge: bool
    realtime: bool
    paced: bool
    full_speed: bool
    priority: int | None
    out: Path | None
    file: Path
    fit: bool
    pose: list[float] | None
    joints: list[float] | None
    start: Sequence[float]
    linear: bool
    via: list[float] | None
    speed: float
    csv: Path | None
    plot: Path | None
    socket: Path
    seed: int
    port: int
    action: str
    table: Path
    name: str
    tool: str
    calibration: str

    def load_command(self) -> Callable[[Options], int]:
        """Import the module of the command and return what runs it."""
        module = importlib.import_module(f"bioscara.cli.{self.command}")
        run: Callable[[Options], int] = module.run
        return run


def parse(arguments: Sequence[str] | None = None) -> Options:
    """Return the options; leaves through ``SystemExit`` with status 2 on wrong usage.

    Args:
        arguments: The words after ``bioscara``; those of the process by default.
    """
    parser = argparse.ArgumentParser(
        prog="bioscara",
        description="Move a Bioscara arm, simulated or real.",
        epilog=_EPILOG,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"bioscara {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_demo(commands)
    _add_run(commands)
    _add_plan(commands)
    _add_move(commands)
    _add_joints(commands)
    _add_simulate(commands)
    _add_view(commands)
    _add_poses(commands)
    options = parser.parse_args(arguments, namespace=Options())
    options.words = list(sys.argv[1:] if arguments is None else arguments)
    if getattr(options, "v1", False) and getattr(options, "bus", "sim") != "sim":
        parser.error("--v1 is about the arm simulated in this process; leave out --bus")
    return options


def _add(
    commands: argparse._SubParsersAction[argparse.ArgumentParser], name: str, help_text: str
) -> argparse.ArgumentParser:
    return commands.add_parser(
        name, help=help_text, description=help_text, epilog=_EPILOG, allow_abbrev=False
    )


def _add_demo(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    demo = _add(commands, "demo", "Home the arm, run the demonstration trajectory, report.")
    _add_motion(demo)


def _add_run(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    run = _add(commands, "run", "Home the arm, run a trajectory file, report.")
    run.add_argument(
        "file",
        metavar="FILE",
        type=Path,
        help="ROS 2 trajectory as YAML (as 'ros2 topic echo' writes it) or CSV",
    )
    run.add_argument(
        "--fit",
        action="store_true",
        help="stretch the trajectory in time where it exceeds a speed or acceleration limit",
    )
    _add_motion(run)


def _add_plan(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    plan = _add(commands, "plan", "Plan a motion and tell about it; no arm is needed.")
    plan.add_argument(
        "--from",
        dest="start",
        metavar=("J1", "J2", "J3", "J4"),
        type=float,
        nargs=4,
        default=(0.0, 0.2, 0.0, 0.0),
        help="where the joints are [rad m rad rad] (default: 0 0.2 0 0)",
    )
    _add_target(plan)
    _add_full_speed(plan)


def _add_move(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    move = _add(commands, "move", "Home the arm where need be and move it to a target.")
    _add_target(move)
    _add_bus(move)
    _add_acknowledge(move)
    _add_realtime(move)
    _add_full_speed(move)


def _add_target(parser: argparse.ArgumentParser) -> None:
    target = parser.add_mutually_exclusive_group(required=True)
    target.add_argument(
        "--pose",
        metavar=("X", "Y", "Z", "YAW"),
        type=float,
        nargs=4,
        help="where the tool shall be, in the base [m m m rad]",
    )
    target.add_argument(
        "--joints",
        metavar=("J1", "J2", "J3", "J4"),
        type=float,
        nargs=4,
        help="where the joints shall be [rad m rad rad]",
    )
    target.add_argument("--name", metavar="NAME", default="", help="a pose that has a name")
    _add_table(parser)
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
        help="share of the speed limits to use, above 0 and at most 1 (default 1)",
    )
    parser.add_argument(
        "--csv", metavar="FILE", type=Path, help="write the trajectory, for 'bioscara run'"
    )
    parser.add_argument(
        "--plot",
        metavar="FILE",
        type=Path,
        help="draw joints and tool against their limits, as PNG",
    )


def _add_joints(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    joints = _add(commands, "joints", "List the joints on a bus; nothing moves.")
    _add_bus(joints)


def _add_simulate(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    simulate = _add(
        commands, "simulate", "Run a simulated arm in real time, for other programs, until Ctrl-C."
    )
    simulate.add_argument(
        "--socket", metavar="PATH", type=Path, required=True, help="Unix socket to listen on"
    )
    simulate.add_argument(
        "--v1", action="store_true", help="joints that speak protocol version 1 only"
    )
    simulate.add_argument("--seed", type=int, default=0, help="seed of the simulation (default 0)")


def _add_view(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    view = _add(
        commands,
        "view",
        "Show the arm in 3D in the browser, with a slider for each joint; nothing moves.",
    )
    view.add_argument(
        "--port",
        metavar="N",
        type=_port,
        default=8080,
        help="where to listen (default 8080); the next free one is taken if it is in use",
    )


def _port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) < 2**16):
        raise argparse.ArgumentTypeError(f"{text!r} is not a port: it is a number, 0 .. 65535")
    return int(text)


def _add_poses(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    poses = _add(commands, "poses", "List, show, save or delete poses by name; nothing moves.")
    actions = poses.add_subparsers(dest="action", required=True, metavar="ACTION")
    listing = _add(actions, "list", "List all poses and tools.")
    show = _add(actions, "show", "Show one pose, and whether the arm can take it.")
    save = _add(actions, "save", "Save a pose under a new name.")
    delete = _add(actions, "delete", "Delete a saved pose.")
    for action in (show, save, delete):
        action.add_argument("name", metavar="NAME", help="name of the pose")
    for action in (listing, show, save, delete):
        _add_table(action)
    where = save.add_mutually_exclusive_group(required=True)
    where.add_argument("--bus", metavar="BUS", help="where this arm is now; " + _BUS_HELP)
    _add_four(where, "--joints", "J1 J2 J3 J4", "where the joints are [rad m rad rad]")
    _add_four(where, "--pose", "X Y Z YAW", "where the tool is, in the base [m m m rad]")
    save.add_argument("--tool", default="fingers", help="name of the tool (default: fingers)")
    save.add_argument(
        "--calibration",
        metavar="ID",
        default="",
        help="which calibration of the arm this is, to know old poses by later",
    )
    save.set_defaults(v1=False)


def _add_four(
    group: argparse._MutuallyExclusiveGroup, name: str, values: str, help_text: str
) -> None:
    group.add_argument(name, metavar=tuple(values.split()), type=float, nargs=4, help=help_text)


def _add_bus(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--bus", metavar="BUS", default="sim", help=_BUS_HELP)
    parser.add_argument(
        "--v1",
        action="store_true",
        help="simulate joints that speak protocol version 1 only, as existing arms do",
    )


def _add_motion(parser: argparse.ArgumentParser) -> None:
    _add_bus(parser)
    _add_acknowledge(parser)
    _add_realtime(parser)
    _add_full_speed(parser)
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


def _add_acknowledge(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--acknowledge",
        action="store_true",
        help="take note of what stopped the arm before, keep the evidence and go on; without it an "
        "arm that a fault stopped is refused",
    )


def _add_realtime(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--realtime",
        action="store_true",
        help="simulated homing takes the time it takes on the arm",
    )


def _add_full_speed(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--full-speed",
        action="store_true",
        help="let the tool move faster than 250 mm/s",
    )


def _add_table(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--table",
        metavar="FILE",
        type=Path,
        default=Path("poses.yaml"),
        help="file with the poses (default: poses.yaml)",
    )
