"""The arguments of the command line."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from bioscara import __version__
from bioscara.cli.shared_arguments import (
    BUS_HELP,
    add_acknowledge,
    add_bus,
    add_four,
    add_full_speed,
    add_motion,
    add_plot,
    add_realtime,
    add_scene,
    add_start,
    add_table,
    add_target,
    add_tool,
)

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
        action: Action on poses.
        table: The file with taught poses.
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
    action: str
    table: Path
    name: str
    tool: str
    calibration: str
    joint: int
    swd: bool
    image: Path | None
    serial: str | None

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
    _add_demo(commands)
    _add_run(commands)
    _add_plan(commands)
    _add_move(commands)
    _add_joints(commands)
    _add_simulate(commands)
    _add_view(commands)
    _add_poses(commands)
    _add_flash(commands)
    options = parser.parse_args(arguments, namespace=Options())
    options.words = list(sys.argv[1:] if arguments is None else arguments)
    if getattr(options, "v1", False) and getattr(options, "bus", "sim") != "sim":
        parser.error("--v1 is about the arm simulated in this process; leave out --bus")
    if options.command == "flash" and options.bus == "sim":
        parser.error("--bus sim has no board to flash; name the bus of the joint, as linux:1")
    if options.command == "poses" and options.action == "show" and options.plot is None:
        for word, value in (("--from", options.start), ("--scene", options.scene)):
            if value is not None:
                parser.error(f"{word} is about the motion that --plot FILE draws; add that")
    return options


def _add(
    commands: argparse._SubParsersAction[argparse.ArgumentParser], name: str, help_text: str
) -> argparse.ArgumentParser:
    return commands.add_parser(
        name, help=help_text, description=help_text, epilog=_EPILOG, allow_abbrev=False
    )


def _add_demo(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    demo = _add(commands, "demo", "Home the arm, run the demonstration trajectory, report.")
    add_motion(demo)


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
    add_scene(run)
    add_motion(run)


def _add_plan(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    plan = _add(commands, "plan", "Plan a motion and tell about it; no arm is needed.")
    add_start(plan, "where the joints are")
    add_target(plan)
    add_full_speed(plan)


def _add_move(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    move = _add(commands, "move", "Home the arm where need be and move it to a target.")
    add_target(move)
    move.set_defaults(start=None)
    add_bus(move)
    add_acknowledge(move)
    add_realtime(move)
    add_full_speed(move)


def _add_joints(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    joints = _add(commands, "joints", "List the joints on a bus; nothing moves.")
    add_bus(joints)


def _add_simulate(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    simulate = _add(
        commands, "simulate", "Run a simulated arm in real time, for other programs, until Ctrl-C."
    )
    simulate.add_argument(
        "--socket", metavar="PATH", type=Path, required=True, help="Unix socket to listen on"
    )
    simulate.add_argument("--v1", action="store_true", help="joints with their original firmware")
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
    add_scene(view, "show the zones and the table of this file")
    add_plot(
        view,
        "at the end, draw the motion from where the sliders stood to where they stand, as PNG",
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
        add_table(action)
    add_plot(show, "draw the motion to the pose, joints and tool against their limits, as PNG")
    add_start(show, "where that motion starts")
    add_scene(show, "file with the zones and the table that the motion keeps clear of")
    where = save.add_mutually_exclusive_group(required=True)
    where.add_argument("--bus", metavar="BUS", help="where this arm is now; " + BUS_HELP)
    add_four(where, "--joints", "J1 J2 J3 J4", "where the joints are [rad m rad rad]")
    add_four(where, "--pose", "X Y Z YAW", "where the tool is, in the base [m m m rad]")
    add_tool(save, "name of the tool")
    save.add_argument(
        "--calibration",
        metavar="ID",
        default="",
        help="which calibration of the arm this is, to know old poses by later",
    )
    save.set_defaults(v1=False)


def _serial_number(word: str) -> str:
    if not word:  # As from an unset variable: the only connected board may be another one.
        raise argparse.ArgumentTypeError("is empty; leave it out, or name a board")
    return word


def _add_flash(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    flash = _add(commands, "flash", "Write the firmware of one joint to its board, and verify it.")
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
        help="which board in its bootloader, or which ST-Link, where there are several",
    )
    flash.add_argument(
        "--bus",
        metavar="BUS",
        help="where the joint is: it is asked to start its bootloader, without the button, and "
        "afterwards which firmware it runs; 'linux:1' is I2C bus 1",
    )
    flash.set_defaults(swd=False, v1=False)
