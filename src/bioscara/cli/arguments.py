"""The arguments of the command line."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from bioscara.version import __version__

BUS_HELP = (
    "which arm: 'sim' (simulated in this process, the default), 'sim:/path.sock' (one that "
    "'bioscara simulate' runs) or 'linux:1' (a real one on I2C bus 1)"
)
START = (-0.6, 0.2, 1.2, -0.6)
"""Default joint positions at the start of a plan [rad m rad rad]: in front of the column, with the
elbow bent, so that a line can start there. With a stretched arm, as at ``center``, none can."""
TABLE = Path("poses.yaml")
"""File with the taught poses if ``--table`` is not given; it need not exist."""
FINGERS = "fingers"
_JOINTS = "J1 J2 J3 J4"
_EPILOG = (
    "Exit status: 0 done; 1 something failed after the arm began to move or a board was written; "
    "2 wrong usage, or refused before that; 130 interrupted."
)


class Options(argparse.Namespace):
    """Parsed options; the set of attributes depends on the command.

    Attributes:
        command: Name of the command, and of the module that implements it.
        bus: Name of the bus.
        v1: Whether the simulated joints have their original firmware.
        words: All arguments after ``bioscara``, as typed.
        acknowledge: Whether to acknowledge the faults that stopped the arm before.
        realtime: Whether simulated homing runs in real time.
        paced: Whether a simulated trajectory runs in real time.
        full_speed: Whether the tool may be faster than 250 mm/s.
        priority: Real-time priority of the control loop; None for an ordinary process.
        out: Folder for the files of the run; None for a new folder under ``runs``.
        file: File of the trajectory.
        fit: Whether to stretch the trajectory in time to fit the limits.
        pose: Goal pose of the tool: x, y, z [m] and yaw [rad]; None if joints are given.
        joints: Goal positions of the joints; None if a pose is given.
        start: Joint positions at the start of a plan; None for :data:`START`.
        scene: File with the zones and the table around the arm.
        linear: Whether the tool moves along a line.
        via: A point on the tool's arc [m].
        speed: Share of the speed limits to use.
        csv: File for the planned trajectory.
        plot: File for the plot of the motion; None for no plot.
        socket: Unix socket on which the simulated arm listens.
        seed: Seed of the simulation.
        port: TCP port of the 3D view.
        source: What the 3D view shows: a run folder, a trajectory file or a running simulated arm;
            None for sliders, or with a target.
        action: Action on poses.
        table: The file with taught poses; None for :data:`TABLE`.
        name: Name of a pose.
        tool: Name of a tool.
        calibration: Identifier of the arm's calibration; may be empty.
        joint: Number of the joint to flash.
        swd: Whether to flash through an ST-Link instead of the USB bootloader.
        image: The firmware image; None for the available one of this version.
        serial: Serial number of the board in its bootloader, or of the ST-Link, if given.
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
    start: Sequence[float] | None
    scene: Path | None
    linear: bool
    via: list[float] | None
    speed: float
    csv: Path | None
    plot: Path | None
    socket: Path
    seed: int
    port: int
    source: str | None
    action: str
    table: Path | None
    name: str
    tool: str
    calibration: str
    joint: int
    swd: bool
    image: Path | None
    serial: str | None

    def has_target(self) -> bool:
        """Return whether a target of a motion is given."""
        return bool(self.name) or self.pose is not None or self.joints is not None

    def load_command(self) -> Callable[[Options], int]:
        """Import the module of the command and return its ``run`` function."""
        module = importlib.import_module(f"bioscara.cli.commands.{self.command}")
        run: Callable[[Options], int] = module.run
        return run


def parse(arguments: Sequence[str] | None = None) -> Options:
    """Parse the options; raises ``SystemExit`` with status 2 on wrong usage.

    Args:
        arguments: The arguments after ``bioscara``; those of the process by default.
    """
    parser = argparse.ArgumentParser(
        prog="bioscara",
        description="Move a Bioscara arm, simulated or real.",
        epilog=_EPILOG,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"bioscara {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_demo_command(commands)
    _add_run_command(commands)
    _add_plan_command(commands)
    _add_move_command(commands)
    _add_joints_command(commands)
    _add_simulate_command(commands)
    _add_view_command(commands)
    _add_poses_command(commands)
    _add_flash_command(commands)
    options = parser.parse_args(arguments, namespace=Options())
    options.words = list(sys.argv[1:] if arguments is None else arguments)
    if getattr(options, "v1", False) and getattr(options, "bus", "sim") != "sim":
        parser.error("--v1 applies only to the arm simulated in this process; leave out --bus")
    if options.command == "flash" and options.bus == "sim":
        parser.error("--bus sim has no board to flash; name the bus of the joint, as linux:1")
    if options.command == "poses" and options.action == "show" and options.plot is None:
        for word, value in (("--from", options.start), ("--scene", options.scene)):
            if value is not None:
                parser.error(
                    f"{word} applies only to the motion that --plot FILE draws; add --plot"
                )
    if options.command == "view":
        _check_view(parser, options)
    return options


def _check_view(parser: argparse.ArgumentParser, options: Options) -> None:
    """Refuse options of ``view`` that exclude one another."""
    planned = options.has_target()
    if planned and options.source is not None:
        parser.error(f"{options.source} and a target exclude one another; leave out one of them")
    if options.plot is not None and (planned or options.source is not None):
        parser.error(
            "--plot of view draws the motion of the sliders; 'bioscara plan --plot FILE' draws a "
            "plan, and the folder of a run has plot.png"
        )
    given = {
        "--from": options.start is not None,
        "--table": options.table is not None,
        "--tool": options.tool != FINGERS,
        "--linear": options.linear,
        "--via": options.via is not None,
        "--speed": options.speed != 1.0,
        "--full-speed": options.full_speed,
    }
    for word, is_given in given.items():
        if is_given and not planned:
            parser.error(f"{word} applies to a planned motion; add --pose, --joints or --name")


def _add_command(
    commands: argparse._SubParsersAction[argparse.ArgumentParser], name: str, help_text: str
) -> argparse.ArgumentParser:
    return commands.add_parser(
        name, help=help_text, description=help_text, epilog=_EPILOG, allow_abbrev=False
    )


def _add_demo_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    demo = _add_command(commands, "demo", "Home the arm, run the demonstration trajectory, report.")
    _add_motion(demo)


def _add_run_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    run = _add_command(commands, "run", "Home the arm, run a trajectory file, report.")
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
    _add_scene(run)
    _add_motion(run)


def _add_plan_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    plan = _add_command(commands, "plan", "Plan a motion and describe it; no arm is needed.")
    _add_start(plan, "joint positions at the start")
    _add_target(plan)
    _add_full_speed(plan)


def _add_move_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    move = _add_command(commands, "move", "Home the arm where necessary and move it to a target.")
    _add_target(move)
    move.set_defaults(start=None)
    _add_bus(move)
    _add_acknowledge(move)
    _add_realtime(move)
    _add_full_speed(move)


def _add_joints_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    joints = _add_command(commands, "joints", "List the joints on a bus; nothing moves.")
    _add_bus(joints)


def _add_simulate_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    simulate = _add_command(
        commands, "simulate", "Run a simulated arm in real time, for other programs, until Ctrl-C."
    )
    simulate.add_argument(
        "--socket", metavar="PATH", type=Path, required=True, help="Unix socket to listen on"
    )
    simulate.add_argument("--v1", action="store_true", help="joints with their original firmware")
    simulate.add_argument("--seed", type=int, default=0, help="seed of the simulation (default 0)")


def _add_view_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    view = _add_command(
        commands,
        "view",
        "Show a run, a trajectory, a plan or a running simulated arm in 3D in the browser, or the "
        "arm with a slider for each joint; nothing moves.",
    )
    view.add_argument(
        "source",
        metavar="SOURCE",
        nargs="?",
        help="folder of a run, trajectory file, or sim:/path.sock for the arm that 'bioscara "
        "simulate' runs, beside the program that uses it (default: sliders, or the plan to the "
        "target)",
    )
    _add_start(view, "joint positions at the start of the plan")
    _add_motion_target(view, required=False)
    _add_full_speed(view)
    view.add_argument(
        "--port",
        metavar="N",
        type=_port,
        default=8080,
        help="TCP port to listen on (default 8080); the next free one is taken if it is in use",
    )
    _add_scene(view, "file with the zones and the table to show")
    _add_plot(
        view,
        "at the end, draw the motion from the first to the last slider positions, as PNG",
    )


def _port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) < 2**16):
        raise argparse.ArgumentTypeError(f"{text!r} is not a port: it is a number, 0 .. 65535")
    return int(text)


def _add_poses_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    poses = _add_command(
        commands, "poses", "List, show, save or delete poses by name; nothing moves."
    )
    actions = poses.add_subparsers(dest="action", required=True, metavar="ACTION")
    listing = _add_command(actions, "list", "List all poses and tools.")
    show = _add_command(actions, "show", "Show one pose, and whether the arm can take it.")
    save = _add_command(actions, "save", "Save a pose under a new name.")
    delete = _add_command(actions, "delete", "Delete a saved pose.")
    for action in (show, save, delete):
        action.add_argument("name", metavar="NAME", help="name of the pose")
    for action in (listing, show, save, delete):
        _add_table(action)
    _add_plot(show, "draw the motion to the pose, joints and tool against their limits, as PNG")
    _add_start(show, "joint positions at the start of that motion")
    _add_scene(show, "file with the zones and the table that the motion keeps clear of")
    where = save.add_mutually_exclusive_group(required=True)
    where.add_argument("--bus", metavar="BUS", help="current position of this arm; " + BUS_HELP)
    _add_four(where, "--joints", "J1 J2 J3 J4", "joint positions [rad m rad rad]")
    _add_four(where, "--pose", "X Y Z YAW", "pose of the tool in the base [m m m rad]")
    _add_tool(save, "name of the tool")
    save.add_argument(
        "--calibration",
        metavar="ID",
        default="",
        help="identifier of the calibration of the arm, stored with the pose",
    )
    save.set_defaults(v1=False)


def _serial_number(word: str) -> str:
    if not word:  # As from an unset variable: the only connected board may be another one.
        raise argparse.ArgumentTypeError("is empty; leave it out, or name a board")
    return word


def _add_flash_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    flash = _add_command(
        commands, "flash", "Write the firmware of one joint to its board, and verify it."
    )
    flash.add_argument(
        "--joint",
        metavar="N",
        type=int,
        choices=(1, 2, 3, 4),
        required=True,
        help="number of the joint, 1 .. 4; an image for another is refused",
    )
    flash.add_argument(
        "image",
        metavar="FILE",
        type=Path,
        nargs="?",
        help="the image (default: the one of this version, built in the checkout or downloaded)",
    )
    means = flash.add_mutually_exclusive_group()
    means.add_argument(
        "--dfu",
        dest="swd",
        action="store_false",
        help="over USB, through the bootloader that the BOOT button starts (the default)",
    )
    means.add_argument("--swd", action="store_true", help="through an ST-Link")
    flash.add_argument(
        "--serial",
        metavar="NUMBER",
        type=_serial_number,
        help="serial number of the board or ST-Link, if there are several",
    )
    flash.add_argument(
        "--bus",
        metavar="BUS",
        help="bus of the joint: starts its bootloader without the button, and reads its firmware "
        "version afterwards; 'linux:1' is I2C bus 1",
    )
    flash.set_defaults(swd=False, v1=False)


def _add_bus(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that select the arm."""
    parser.add_argument("--bus", metavar="BUS", default="sim", help=BUS_HELP)
    parser.add_argument(
        "--v1",
        action="store_true",
        help="simulate joints with their original firmware, as existing arms have it",
    )


def _add_motion(parser: argparse.ArgumentParser) -> None:
    """Add the common arguments of ``demo`` and ``run``."""
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
    """Add the argument that acknowledges faults."""
    parser.add_argument(
        "--acknowledge",
        action="store_true",
        help="acknowledge the faults that stopped the arm before, keep their evidence and "
        "continue; without it an arm that a fault stopped is refused",
    )


def _add_realtime(parser: argparse.ArgumentParser) -> None:
    """Add the argument for simulated homing in real time."""
    parser.add_argument(
        "--realtime",
        action="store_true",
        help="simulated homing takes the time it takes on the arm",
    )


def _add_full_speed(parser: argparse.ArgumentParser) -> None:
    """Add the argument that lifts the limit of the tool's speed."""
    parser.add_argument(
        "--full-speed",
        action="store_true",
        help="let the tool move faster than 250 mm/s",
    )


def _add_target(parser: argparse.ArgumentParser) -> None:
    """Add the arguments for target, type of motion, surroundings and output files."""
    _add_motion_target(parser, required=True)
    _add_scene(parser)
    parser.add_argument(
        "--csv", metavar="FILE", type=Path, help="write the trajectory, for 'bioscara run'"
    )
    _add_plot(parser, "draw joints and tool against their limits, as PNG")


def _add_motion_target(parser: argparse.ArgumentParser, *, required: bool) -> None:
    """Add the arguments for target and type of motion."""
    target = parser.add_mutually_exclusive_group(required=required)
    _add_four(target, "--pose", "X Y Z YAW", "goal pose of the tool in the base [m m m rad]")
    _add_four(target, "--joints", _JOINTS, "goal positions of the joints [rad m rad rad]")
    target.add_argument("--name", metavar="NAME", default="", help="name of a saved pose")
    _add_table(parser)
    _add_tool(parser, "name of the tool that is mounted")
    parser.add_argument("--linear", action="store_true", help="move the tool along a line")
    parser.add_argument(
        "--via",
        metavar=("X", "Y", "Z"),
        type=float,
        nargs=3,
        help="move the tool along the arc through this point [m]",
    )
    parser.add_argument(
        "--speed",
        metavar="SHARE",
        type=float,
        default=1.0,
        help="share of the speed limits to use, 0.001 to 1 (default 1)",
    )


def _add_start(parser: argparse.ArgumentParser, help_text: str) -> None:
    """Add the argument for the joint positions at the start."""
    parser.add_argument(
        "--from",
        dest="start",
        metavar=tuple(_JOINTS.split()),
        type=float,
        nargs=4,
        help=f"{help_text} [rad m rad rad] (default: {' '.join(f'{v:g}' for v in START)})",
    )


def _add_scene(
    parser: argparse.ArgumentParser,
    help_text: str = "file with the zones and the table that the arm keeps clear of",
) -> None:
    """Add the argument for the scene file."""
    parser.add_argument("--scene", metavar="FILE", type=Path, help=help_text)


def _add_plot(parser: argparse.ArgumentParser, help_text: str) -> None:
    """Add the argument for the plot of a motion."""
    parser.add_argument("--plot", metavar="FILE", type=Path, help=help_text)


def _add_table(parser: argparse.ArgumentParser) -> None:
    """Add the argument for the file with the poses."""
    parser.add_argument(
        "--table",
        metavar="FILE",
        type=Path,
        help=f"file with the poses (default: {TABLE}, if it exists)",
    )


def _add_tool(parser: argparse.ArgumentParser, help_text: str) -> None:
    """Add the argument for the name of a tool."""
    parser.add_argument(
        "--tool", metavar="NAME", default=FINGERS, help=f"{help_text} (default: {FINGERS})"
    )


def _add_four(parser: argparse._ActionsContainer, name: str, values: str, help_text: str) -> None:
    """Add an option with four numbers.

    Args:
        parser: Parser or group to add it to.
        name: Name of the option.
        values: Names of the numbers, separated by spaces.
        help_text: Help text of the option.
    """
    parser.add_argument(name, metavar=tuple(values.split()), type=float, nargs=4, help=help_text)
