"""Arguments that several commands have, each with its check, if it needs one."""

from __future__ import annotations

import argparse
import math
import os
import re
import shlex
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bioscara.arguments import OVERLAY_VARIABLE
from bioscara.cli.commands import COMMANDS
from bioscara.cli.parser import Options, Parser, number, whole_number
from bioscara.errors import BioscaraError

if TYPE_CHECKING:
    from bioscara.physics.camera import CameraView

TOKEN_VARIABLE = "BIOSCARA_TOKEN"  # noqa: S105  the name of the variable
"""Environment variable with the token of a gateway."""
ARM_VARIABLE = "BIOSCARA_ARM"
"""Environment variable with the name of the owner whose arm commands use."""
START = (-0.6, 0.2, 1.2, -0.6)
"""Default joint positions at the start of a plan [rad m rad rad]: in front of the column, with the
elbow bent, so that a line can start there. With a stretched arm, as at ``center``, none can."""
TABLE = Path("poses.yaml")
"""File with the taught poses if ``--table`` is not given; it need not exist."""
FINGERS = "fingers"
RECORDINGS = Path("recordings")
"""Folder of the recordings, unless another one is given."""
JOINTS = ("J1", "J2", "J3", "J4")
POSE = ("X", "Y", "Z", "YAW")


def _port(text: str) -> int:
    """Return the TCP port in an argument."""
    if not (text.isascii() and text.isdigit() and int(text) < 2**16):
        raise argparse.ArgumentTypeError(f"{text!r} is not a port: it is a number, 0 .. 65535")
    return int(text)


def _view(text: str) -> CameraView:
    """Return the view in an argument, ``PLACE`` or ``PLACE:WIDTHxHEIGHT``."""
    # Imported here: most commands show nothing.
    from bioscara.physics.camera import CameraView, camera_of, checked_size  # noqa: PLC0415

    name, colon, pixels = text.partition(":")
    found = re.fullmatch(r"(\d{1,6})x(\d{1,6})", pixels, re.ASCII)
    if colon and found is None:
        raise argparse.ArgumentTypeError(
            f"{pixels!r} is not a size: give width and height in pixels, as in {name}:640x480"
        )
    try:
        camera_of(name)
        return (
            CameraView(name, checked_size((int(found[1]), int(found[2]))))
            if found
            else CameraView(name)
        )
    except BioscaraError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


_ARGUMENTS: dict[str, dict[str, Any]] = {
    "--acknowledge": {
        "action": "store_true",
        "help": "acknowledge the faults that stopped the arm before, keep their evidence and "
        "continue; without it an arm that a fault stopped is refused",
    },
    "--arm": {
        "metavar": "NAME",
        "help": "name of the arm, or the address of its gateway, https://HOST:PORT (default: "
        f"${ARM_VARIABLE}, else the only one)",
    },
    "--ca-file": {
        "metavar": "FILE",
        "type": Path,
        "help": "certificates, as PEM, of the authorities that are trusted for a gateway (default: "
        "those of the system)",
    },
    "--camera": {
        "metavar": "PLACE[:WIDTHxHEIGHT]",
        "type": _view,
        "help": "camera that sees the world: front, side, top or wrist, with 640x480 pixels if no "
        "size is given; needs bioscara[physics-view]",
    },
    "--csv": {"metavar": "FILE", "type": Path, "help": "write the trajectory, for 'bioscara run'"},
    "--deg": {
        "dest": "degrees",
        "action": "store_true",
        "help": "give and show angles in degrees instead of radians; files keep radians",
    },
    "--force": {"action": "store_true"},
    "--fingerprint": {
        "metavar": "SHA256",
        "help": "fingerprint of the gateway's certificate, which is trusted in place of "
        "authorities, as 'bioscara web' prints it",
    },
    "--follow": {"action": "store_true", "help": "wait for more, until Ctrl-C"},
    "--from": {"dest": "start", "metavar": JOINTS, "type": number, "nargs": 4},
    "--full-speed": {"action": "store_true", "help": "let the tool move faster than 250 mm/s"},
    "--homed": {
        "action": "store_true",
        "help": "start with homed joints; for the arm simulated in this process only",
    },
    "--joints": {"metavar": JOINTS, "type": number, "nargs": 4},
    "--linear": {"action": "store_true", "help": "move the tool along a line"},
    "--out": {
        "metavar": "DIR",
        "type": Path,
        "help": "folder for samples, report and plot (default: a new one under runs/)",
    },
    "--parameters": {
        "metavar": "FILE",
        "type": Path,
        "help": "values of this arm, such as its calibration, over those of parameters.yaml "
        f"(default: ${OVERLAY_VARIABLE}, if it is set)",
    },
    "--plot": {
        "metavar": "FILE",
        "type": Path,
        "help": "draw joints and tool against their limits, as PNG",
    },
    "--port": {"metavar": "N", "type": _port, "default": 8080},
    "--pose": {"metavar": POSE, "type": number, "nargs": 4},
    "--priority": {
        "metavar": "N",
        "type": whole_number,
        "help": "run the control loop before everything else, as SCHED_FIFO N (1 .. 99, usually "
        "80) and with its memory locked; needs permission",
    },
    "--rate": {
        "metavar": "HZ",
        "type": whole_number,
        "help": "control cycles per second (default: 100, and 50 with joints of protocol version "
        "1)",
    },
    "--realtime": {
        "action": "store_true",
        "help": "simulated homing takes the time it takes on the arm",
    },
    "--scene": {
        "metavar": "FILE",
        "type": Path,
        "help": "file with the zones and the table that the arm keeps clear of",
    },
    "--seed": {"metavar": "N", "type": whole_number, "default": 0},
    "--table": {"metavar": "FILE", "type": Path, "help": "file with the poses"},
    "--token-file": {
        "metavar": "FILE",
        "type": Path,
        "help": f"file with the token for a gateway (default: ${TOKEN_VARIABLE})",
    },
    "--tool": {
        "metavar": "NAME",
        "default": FINGERS,
        "help": "name of the tool that is mounted",
    },
    "--world": {
        "metavar": "FILE",
        "type": Path,
        "help": "file with the table, walls, nests and labware that the arm keeps clear of, in "
        "place of --scene",
    },
    "--velocity-scaling": {
        "metavar": "SHARE",
        "type": number,
        "default": 1.0,
        "help": "share of the speed limits to use, 0.001 to 1 (default 1)",
    },
    "--via": {
        "metavar": POSE[:3],
        "type": number,
        "nargs": 3,
        "help": "move the tool along the arc through this point [m]",
    },
}
_OF_GATEWAY = ("--token-file", "--ca-file", "--fingerprint")
_DEFAULTS = {
    "--from": f" [rad m rad rad] (default: {' '.join(f'{value:g}' for value in START)})",
    "--table": f" (default: {TABLE}, if it exists)",
    "--tool": f" (default: {FINGERS})",
}
"""Ends of help texts."""


def share(parser: argparse._ActionsContainer, *names: str, **changes: Any) -> None:
    """Add arguments to a parser, or to a group of one.

    Args:
        parser: Parser of the command.
        names: Names of the arguments.
        changes: Differences of those of this command, such as their help.
    """
    for name in names:
        keywords = _ARGUMENTS[name] | changes
        if name == "--parameters" and (overlay := os.environ.get(OVERLAY_VARIABLE)):
            keywords["default"] = Path(overlay)
        keywords["help"] += _DEFAULTS.get(name, "")
        parser.add_argument(name, **keywords)
        if name in _CHECKS and isinstance(parser, Parser):
            parser.checks.append(_CHECKS[name])


def share_served(parser: Parser, **changes: Any) -> None:
    """Add the arguments that name a served arm, on this computer or beyond a gateway.

    Args:
        parser: Parser of the command.
        changes: Differences of ``--arm`` of this command, such as its help.
    """
    share(parser, "--arm", **changes)
    share_gateway(parser)


def share_gateway(parser: Parser) -> None:
    """Add the arguments that a gateway needs, to a parser with ``--arm``."""
    share(parser, *_OF_GATEWAY)
    parser.checks.append(_check_gateway)


def _check_gateway(parser: Parser, options: Options) -> None:
    arm = options.arm or os.environ.get(ARM_VARIABLE) or ""
    if "://" in arm:
        return
    for word in _OF_GATEWAY:
        if getattr(options, word[2:].replace("-", "_")) is not None:
            parser.error(
                f"{word} is for an arm that --arm names by the address of its gateway, "
                "https://HOST:PORT; leave it out"
            )


def share_target(parser: Parser, *, required: bool = True) -> None:
    """Add the arguments for target and type of motion."""
    target = parser.add_mutually_exclusive_group()
    share(target, "--pose", help="goal pose of the tool in the base [m m m rad]")
    share(target, "--joints", help="goal positions of the joints [rad m rad rad]")
    target.add_argument("--name", metavar="NAME", default="", help="name of a saved pose")
    share(parser, "--table", "--tool", "--linear", "--via", "--velocity-scaling")
    if required:
        parser.explain = partial(_as_target, parser.prog)
        # argparse would refuse a missing target before it finds a word that is meant as one.
        parser.checks.insert(0, _require_target)


def _as_target(command: str, options: Options, words: Sequence[str]) -> str:
    """Return the words of a target that was given without its option."""
    if _has_target(options):
        return ""
    if len(words) == len(POSE) and all(map(_is_number, words)):
        numbers = " ".join(words)
        return f"--pose {numbers}, of the tool, or --joints {numbers}"
    one = len(words) == 1 and not _is_number(words[0]) and words[0] not in COMMANDS
    return f"{command} --name {shlex.quote(words[0])}" if one else ""


def _has_target(options: Options) -> bool:
    return options.pose is not None or options.joints is not None or bool(options.name)


def _is_number(word: str) -> bool:
    with suppress(argparse.ArgumentTypeError):
        number(word)
        return True
    return False


def _require_target(parser: Parser, options: Options) -> None:
    if not _has_target(options):
        parser.error("one of the arguments --pose --joints --name is required")


def share_scene(parser: Parser, **changes: Any) -> None:
    """Add the arguments that name the surroundings of the arm, of which one can be given.

    Args:
        parser: Parser of the command.
        changes: Differences of ``--scene`` of this command, such as its help.
    """
    share(parser, "--scene", **changes)
    share(parser, "--world")
    parser.checks.append(_check_scene)


def _check_scene(parser: Parser, options: Options) -> None:
    if options.scene is not None and options.world is not None:
        parser.error(
            "--scene and --world exclude one another, as a world has its zones; leave out one of "
            "them"
        )
    if options.world is not None and options.bus is not None and options.bus.startswith("linux"):
        parser.error(
            f"--world is what surrounds a simulated arm, and the one on {options.bus} is real: "
            "what its gripper holds is not known; give its zones as --scene"
        )


def share_taught(parser: Parser) -> None:
    """Add the arguments of commands about taught poses: their file, or the arm that has them."""
    share(parser, "--table")
    share_served(parser, help="the poses of this arm, which 'bioscara serve' runs")
    share(parser, "--deg")
    parser.checks.append(_check_taught)


def gives_parameters(options: Options) -> bool:
    """Return whether the file of ``--parameters`` is another one than that of the environment."""
    overlay = options.parameters
    return overlay is not None and str(overlay) != os.environ.get(OVERLAY_VARIABLE)


def _check_homed(parser: Parser, options: Options) -> None:
    if options.homed and options.bus != "sim":
        parser.error(
            "--homed applies only to the arm simulated in this process, with --bus sim; any other "
            "arm is homed by its joints: leave out --homed, and home it"
        )


def _check_taught(parser: Parser, options: Options) -> None:
    owners_own = {
        "--table": options.table is not None,
        "--parameters": gives_parameters(options),
    }
    for word, given in owners_own.items():
        if given and options.arm is not None:
            parser.error(f"--arm and {word} exclude one another; leave out one of them")


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


_CHECKS: dict[str, Callable[[Parser, Options], None]] = {
    "--deg": _convert_degrees,
    "--homed": _check_homed,
}
