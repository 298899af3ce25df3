"""The arguments of the command line: commands and their options."""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from bioscara.api.runtime import DEFAULT
from bioscara.arguments import OVERLAY_VARIABLE
from bioscara.cli.options import FINGERS, START, TABLE, Options
from bioscara.cli.parser import Parser, gateways, number, whole_number
from bioscara.errors import AccessError
from bioscara.version import __version__

ARM_VARIABLE = "BIOSCARA_ARM"
"""Environment variable with the name of the owner whose arm commands use."""
BUS_HELP = (
    "which arm: 'sim' (simulated in this process, the default), 'sim:/path.sock' (one that "
    "'bioscara simulate' runs) or 'linux:1' (a real one on I2C bus 1)"
)
_JOINTS = "J1 J2 J3 J4"
_EPILOG = (
    "Exit status: 0 done; 1 something failed after the arm began to move or a board was written; "
    "2 wrong usage, or refused before that; 130 interrupted."
)
_OF_OWNERS = ("arms", "status", "lease", "events", "logs")
"""Commands about running owners."""
_RECORDINGS = Path("recordings")
"""Folder of the recordings, unless another one is given."""
_FOLDERS = {
    "motion": {"run", "plan", "move", "home", "jog", "gripper", "power", "faults"},
    "serving": {
        "serve",
        "owners",
        "stop",
        "pause",
        "confirm",
        "simulate_fault",
        "monitor",
        "record",
        "view",
        "web",
        "ros",
    },
    "setup": {"joints", "flash", "poses", "tools", "simulate"},
}
"""Modules of the commands by their folders in ``commands/``."""
_WITHOUT_PARAMETERS = {
    *("simulate", "poses", "tools", "stop", "pause", "resume", "record", "web", "ros"),
    *("simulate-fault", "confirm"),
    *_OF_OWNERS,
}
"""Commands that load no parameters, or leave it to their actions."""
_SIZES = {"K": 10**3, "M": 10**6, "G": 10**9}
_LASTING = frozenset({"enable", "disable", "monitor", "faults", "acknowledge", "recover"})
"""Commands whose effect, or object, is an arm that exists before and after them."""


def parse(arguments: Sequence[str] | None = None) -> Options:
    """Parse the options; raises ``SystemExit`` with status 2 on wrong usage.

    Args:
        arguments: The arguments after ``bioscara``; those of the process by default.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    parser = Parser(
        prog="bioscara", description="Move a Bioscara arm, simulated or real.", epilog=_EPILOG
    )
    parser.add_argument("--version", action="version", version=f"bioscara {__version__}")
    parser.take_commands("command", "COMMAND")
    _add_demo_command(parser)
    _add_run_command(parser)
    _add_plan_command(parser)
    _add_move_command(parser)
    _add_home_command(parser)
    _add_jog_command(parser)
    _add_gripper_command(parser)
    _add_power_commands(parser)
    _add_monitor_command(parser)
    _add_joints_command(parser)
    _add_fault_commands(parser)
    _add_poses_command(parser)
    _add_tools_command(parser)
    _add_view_command(parser)
    _add_simulate_command(parser)
    _add_record_command(parser)
    _add_flash_command(parser)
    _add_serve_command(parser)
    _add_owner_commands(parser)
    _add_simulate_fault_command(parser, words)
    _add_web_command(parser)
    _add_ros_command(parser)
    options = Options()
    parsed, options.ros_arguments = _without_ros(words)
    parser.read(parsed, options)
    options.words = words
    options.arm = getattr(options, "arm", None)
    _choose_owner(parser.commands[options.command], options)
    _check(parser.commands[options.command], options)
    for gateway in getattr(options, "gateways", ()):
        # Refused here, not when it is started again and again.
        parse([gateway[0], "--arm", options.name, *gateway[1:]])
    if getattr(options, "degrees", False):
        _convert_degrees(options)
    return options


def _without_ros(words: list[str]) -> tuple[list[str], list[str]]:
    """Return the words without those of ROS, which begin with --ros-args and end with --."""
    if words[:1] != ["ros"] or "--ros-args" not in words:
        return words, []
    begin = words.index("--ros-args")
    end = words.index("--", begin) if "--" in words[begin:] else len(words)
    return words[:begin] + words[end + 1 :], words[begin:end]


def _choose_owner(parser: Parser, options: Options) -> None:
    """Choose the owner whose arm the command uses, if there is one."""
    if not hasattr(options, "owned"):
        return
    bus_given = options.bus is not None
    if bus_given and options.bus.startswith("arm:"):
        parser.error(f"a served arm is named by --arm {options.bus[4:]}; leave out --bus")
    if not bus_given:
        options.bus = "sim"
    overlay = getattr(options, "parameters", None)
    owners_own = {
        "--parameters": overlay is not None and str(overlay) != os.environ.get(OVERLAY_VARIABLE),
        "--v1": getattr(options, "v1", False),
        "--rate": getattr(options, "rate", None) is not None,
        "--priority": getattr(options, "priority", None) is not None,
        "--realtime": getattr(options, "realtime", False),
    }
    given = [word for word, value in owners_own.items() if value]
    if options.arm is not None and bus_given:
        parser.error("--arm and --bus exclude one another; leave out one of them")
    source = ""
    if options.arm is None and options.owned and not bus_given:
        options.arm = os.environ.get(ARM_VARIABLE) or None
        source = f" (from {ARM_VARIABLE})"
    if options.arm is not None:
        if given:
            parser.error(
                f"{given[0]} is chosen by the owner of {options.arm}{source}; leave it out"
            )
        return
    if not options.owned:
        return
    # Imported here: most commands have no owner to look for.
    from bioscara.api import runtime  # noqa: PLC0415

    try:
        owners = runtime.owners()
    except AccessError as error:
        parser.error(str(error))
    served = [owner.name for owner in owners]
    # A command about an arm that lasts has none of its own, and takes a served one on any bus.
    any_bus = options.command in _LASTING and not bus_given
    running = [owner.name for owner in owners if any_bus or owner.bus == options.bus]
    if running and not given:
        if len(running) > 1:
            parser.error(f"there are the arms {', '.join(running)}; choose one with --arm NAME")
        options.arm = running[0]
    elif options.bus == "sim":
        options.served = served


def _check(parser: Parser, options: Options) -> None:
    """Refuse options that exclude one another."""
    bus = getattr(options, "bus", "sim")
    if getattr(options, "v1", False) and bus != "sim":
        parser.error("--v1 applies only to the arm simulated in this process; leave out --bus")
    if getattr(options, "homed", False) and bus != "sim":
        parser.error(
            "--homed applies only to the arm simulated in this process, with --bus sim; any other "
            "arm is homed by its joints: leave out --homed, and home it"
        )
    if options.command in _LASTING and bus == "sim" and options.arm is None:
        parser.error(
            f"{options.command} needs an arm that outlasts this command, and the one simulated in "
            "this process does not: give --bus linux:1, --arm NAME of an arm that 'bioscara serve' "
            "runs, or --bus sim:/path.sock of one that 'bioscara simulate --socket /path.sock' runs"
        )
    if options.command in {"poses", "tools"}:
        _check_poses(parser, options)
    if options.command == "flash" and bus == "sim":
        parser.error("--bus sim has no board to flash; name the bus of the joint, as linux:1")
    if options.command == "flash" and options.all:
        _check_flash_all(parser, options)
    if getattr(options, "keep", math.inf) < getattr(options, "max_size", 0):
        parser.error("--keep is smaller than --max-size; give a larger one")
    if options.command == "view":
        _check_view(parser, options)
    if options.command == "web":
        _check_web(parser, options)
    if options.command == "ros" and options.bus and options.arm:
        parser.error("--arm and --bus exclude one another; leave out one of them")


def _check_flash_all(parser: Parser, options: Options) -> None:
    """Refuse options of ``flash`` that are for one joint alone."""
    if options.bus is None:
        parser.error("--all finds the joints by their bus: name it, as --bus linux:1")
    single = {
        "FILE": (options.image is not None, "each joint has an image of its own"),
        "--swd": (options.swd, "only over USB can a joint be chosen by the bus"),
        "--serial": (options.serial is not None, "the joint's own board appears on request"),
    }
    for word, (given, why) in single.items():
        if given:
            parser.error(f"--all and {word} exclude one another: {why}; leave out one of them")


def _check_poses(parser: Parser, options: Options) -> None:
    """Refuse options of ``poses`` and ``tools`` that exclude or need one another."""
    overlay = options.parameters
    owners_own = {
        "--table": options.table is not None,
        "--bus": getattr(options, "bus", None) is not None,
        "--parameters": overlay is not None and str(overlay) != os.environ.get(OVERLAY_VARIABLE),
    }
    for word, given in owners_own.items():
        if given and options.arm is not None:
            parser.error(f"--arm and {word} exclude one another; leave out one of them")
    if options.command == "tools":
        return
    if options.action == "save" and (
        options.bus is None and options.arm is None and not (options.joints or options.pose)
    ):
        parser.error(
            "poses save needs one of --arm NAME or --bus BUS for the position of that arm, "
            f"--joints {_JOINTS}, --pose X Y Z YAW"
        )
    if options.action == "show" and options.plot is None:
        for word, value in (("--from", options.start), ("--scene", options.scene)):
            if value is not None:
                parser.error(
                    f"{word} applies only to the motion that --plot FILE draws; add --plot"
                )


def _convert_degrees(options: Options) -> None:
    """Convert the angles of all options to radians."""
    for word in ("pose", "joints", "start", "offset"):
        values = getattr(options, word, None)
        if values is not None:
            lengths = {1} if word in {"joints", "start"} else {0, 1, 2}
            converted = [
                value if index in lengths else math.radians(value)
                for index, value in enumerate(values)
            ]
            setattr(options, word, converted)


def _check_view(parser: Parser, options: Options) -> None:
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
        "--velocity-scaling": options.velocity_scaling != 1.0,
        "--full-speed": options.full_speed,
    }
    for word, is_given in given.items():
        if is_given and not planned:
            parser.error(f"{word} applies to a planned motion; add --pose, --joints or --name")


def _check_web(parser: Parser, options: Options) -> None:
    """Refuse options of ``web`` that exclude or need one another."""
    certificate, key = options.tls_cert is not None, options.tls_key is not None
    if certificate != key:
        given, other = ("--tls-cert", "--tls-key") if certificate else ("--tls-key", "--tls-cert")
        parser.error(f"{given} needs {other} with the other half; give both")
    if certificate and options.tls_self_signed:
        parser.error("--tls-cert and --tls-self-signed exclude one another; leave out one of them")


def _place(module: str) -> str:
    """Return the name of a command's module below ``bioscara.cli.commands``."""
    folder = next(folder for folder, modules in _FOLDERS.items() if module in modules)
    return f"{folder}.{module}"


def _add_command(commands: Parser, name: str, help_text: str, module: str | None = None) -> Parser:
    parser = commands.add_command(name, help_text)
    parser.set_defaults(module=_place(module or name))
    if name not in _WITHOUT_PARAMETERS:
        overlay = os.environ.get(OVERLAY_VARIABLE)
        parser.add_argument(
            "--parameters",
            metavar="FILE",
            type=Path,
            default=Path(overlay) if overlay else None,
            help="values of this arm, such as its calibration, over those of parameters.yaml "
            f"(default: ${OVERLAY_VARIABLE}, if it is set)",
        )
    return parser


def _add_demo_command(commands: Parser) -> None:
    demo = _add_command(
        commands, "demo", "Home the arm, run the demonstration trajectory, report.", "run"
    )
    demo.add_argument(
        "--watch",
        action="store_true",
        help="serve the simulated arm, open its page in the browser, move it there in real time, "
        "and go on until Ctrl-C; needs the packages of bioscara[web]",
    )
    _add_report(demo)
    _add_motion(demo, owned=False)


def _add_run_command(commands: Parser) -> None:
    run = _add_command(
        commands, "run", "Home the arm, run a trajectory file and report, or a sequence of steps."
    )
    run.add_argument(
        "file",
        metavar="FILE",
        type=Path,
        help="ROS 2 trajectory as YAML (as 'ros2 topic echo' writes it) or CSV, or a sequence of "
        "steps as YAML",
    )
    run.add_argument(
        "--dry-run",
        action="store_true",
        help="check or plan it and print the duration of each step; nothing moves",
    )
    _add_start(run, "joint positions at the start of a dry run of a sequence")
    _add_table(run)
    _add_tool(run, "name of the tool that is mounted, for a sequence")
    run.add_argument(
        "--fit",
        action="store_true",
        help="stretch the trajectory in time where it exceeds a speed or acceleration limit",
    )
    _add_scene(run)
    _add_report(run)
    _add_motion(run)


def _add_plan_command(commands: Parser) -> None:
    plan = _add_command(commands, "plan", "Plan a motion and describe it; no arm is needed.")
    _add_start(plan, "joint positions at the start")
    _add_target(plan)
    _add_full_speed(plan)
    _add_degrees(plan)


def _add_move_command(commands: Parser) -> None:
    move = _add_command(commands, "move", "Home the arm where necessary and move it to a target.")
    _add_target(move)
    move.set_defaults(start=None)
    _add_motion(move)


def _add_home_command(commands: Parser) -> None:
    home = _add_command(
        commands,
        "home",
        "Home the joints that are not homed; the elbow must be open, the gripper empty.",
    )
    _add_motion(home, full_speed=False)


def _add_jog_command(commands: Parser) -> None:
    jog = _add_command(
        commands,
        "jog",
        "Home the arm where necessary and move it by the keyboard, as long as a key is held.",
    )
    _add_scene(jog)
    _add_table(jog)
    _add_tool(jog, "name of the tool that is mounted")
    _add_motion(jog)


def _add_gripper_command(commands: Parser) -> None:
    gripper = _add_command(commands, "gripper", "Move the jaws of the gripper.")
    gripper.add_argument(
        "width",
        metavar="WIDTH",
        nargs="?",
        type=_width,
        help="width between the jaws [m], or open or close for the largest or smallest",
    )
    gripper.add_argument(
        "--servo-angle",
        metavar="DEG",
        type=number,
        help="instead of a width: angle of the servo [deg], to mount its horn or measure a width",
    )
    _add_motion(gripper, full_speed=False, realtime=False)


def _width(word: str) -> float | str:
    return word if word in {"open", "close"} else number(word)


def _add_power_commands(commands: Parser) -> None:
    enable = _add_command(
        commands,
        "enable",
        "Enable the joints where they stand and hold them until Ctrl-C; nothing moves.",
        "power",
    )
    _add_bus(enable)
    _add_acknowledge(enable)
    _add_degrees(enable)
    disable = _add_command(
        commands, "disable", "Bring the joints to rest and disable them; loads may sink.", "power"
    )
    _add_bus(disable)


def _add_monitor_command(commands: Parser) -> None:
    monitor = _add_command(
        commands, "monitor", "Show the joints live until Ctrl-C, without enabling them."
    )
    _add_bus(monitor)
    _add_degrees(monitor)


def _add_fault_commands(commands: Parser) -> None:
    for name, help_text in (
        ("faults", "List the faults that stopped the arm, and what to do about each."),
        ("acknowledge", "Write the evidence of the faults; they stay until 'recover'."),
        ("recover", "Acknowledge the faults and clear them in the joints; nothing moves."),
    ):
        _add_bus(_add_command(commands, name, help_text, "faults"))


def _add_joints_command(commands: Parser) -> None:
    joints = _add_command(commands, "joints", "List the joints on a bus; nothing moves.")
    _add_bus(joints)


def _add_simulate_command(commands: Parser) -> None:
    simulate = _add_command(
        commands, "simulate", "Run a simulated arm in real time, for other programs, until Ctrl-C."
    )
    simulate.add_argument(
        "--socket", metavar="PATH", type=Path, required=True, help="Unix socket to listen on"
    )
    simulate.add_argument("--v1", action="store_true", help="joints with their original firmware")
    simulate.add_argument(
        "--seed",
        metavar="N",
        type=whole_number,
        default=0,
        help="seed of the simulation (default 0)",
    )


def _add_serve_command(commands: Parser) -> None:
    serve = _add_command(
        commands, "serve", "Own an arm and let other programs use it, until Ctrl-C or SIGTERM."
    )
    _add_bus(serve, owned=False)
    serve.add_argument(
        "--name", metavar="NAME", default="arm", help="name of the arm for clients (default: arm)"
    )
    _add_rate(serve)
    serve.add_argument(
        "--real-time-factor",
        metavar="N",
        type=number,
        default=1.0,
        help="let the arm simulated in this process be N times as fast as real time (default 1)",
    )
    serve.add_argument(
        "--with",
        dest="gateways",
        metavar="LIST",
        type=gateways,
        action="extend",
        default=[],
        help="also run these gateways, as web,record or 'web --port 9000' with options; repeatable",
    )
    serve.add_argument(
        "--group",
        metavar="GROUP",
        default="",
        help="let the members of this group be clients, too (default: this user alone)",
    )
    serve.add_argument(
        "--evidence",
        metavar="DIR",
        type=Path,
        default=Path("faults"),
        help="folder for the flight records of faults (default: faults)",
    )
    _add_table(serve, "file with the poses, in which those that clients teach are saved")
    _add_scene(
        serve, "file with the zones and the table; a scene that a client sets is saved in it"
    )
    serve.add_argument("--json", action="store_true", help="write the log as JSON")
    serve.add_argument(
        "--seed", metavar="N", type=whole_number, default=0, help="seed of the simulation"
    )
    _add_homed(serve)


def _add_owner_commands(commands: Parser) -> None:
    stop = _add_command(commands, "stop", "Stop the motion of an arm, or of all that are served.")
    stop.add_argument("name", metavar="NAME", nargs="?", help="name of the arm (default: all)")
    pause = _add_command(
        commands,
        "pause",
        "Bring the motion of an arm, or of all that are served, to rest on its path until "
        "'bioscara resume'.",
    )
    pause.add_argument("--arm", metavar="NAME", help="name of the arm (default: all)")
    resume = _add_command(
        commands,
        "resume",
        "Lift the pause of this user, and where no client commands the arm those of all.",
        "pause",
    )
    _add_arm(resume)
    confirm = _add_command(
        commands,
        "confirm",
        "Confirm that zones, tool and load are still those of the owner's last run.",
    )
    _add_arm(confirm)
    texts = {
        "arms": "List the arms that are served, their processes and their states.",
        "status": "Show the state, the motion, the lease and the faults of an arm.",
        "lease": "Show the client that commands an arm, or end its lease.",
        "events": "List what happened to an arm.",
        "logs": "List the log of the process that owns an arm.",
    }
    added = {name: _add_command(commands, name, text, "owners") for name, text in texts.items()}
    for name in ("status", "lease", "events", "logs"):
        _add_arm(added[name])
    for name in ("events", "logs"):
        added[name].add_argument(
            "--follow", action="store_true", help="wait for more, until Ctrl-C"
        )
    added["events"].add_argument(
        "--after", metavar="N", type=whole_number, default=0, help="only those after this number"
    )
    added["events"].add_argument("--json", action="store_true", help="as JSON, one a line")
    added["lease"].add_argument(
        "--end",
        action="store_true",
        help="end the lease: the motion of its client is stopped, and others may command the arm",
    )


def _add_simulate_fault_command(commands: Parser, words: Sequence[str]) -> None:
    simulate = _add_command(
        commands,
        "simulate-fault",
        "Let a served, simulated arm fail, also while a program moves it, or end that.",
        "simulate_fault",
    )
    simulate.add_argument("fault", metavar="FAULT", help="one of the faults below")
    simulate.add_argument(
        "values",
        metavar="JOINT VALUE",
        nargs="*",
        help="its arguments: a joint, as j3, and a value",
    )
    _add_arm(simulate)
    if words[:1] == ["simulate-fault"]:
        # Imported here: the compiled firmware, which the other commands do not load for their help.
        from bioscara.cli.commands.serving.simulate_fault import kinds  # noqa: PLC0415

        simulate.formatter_class = argparse.RawDescriptionHelpFormatter
        simulate.epilog = "\n".join(["faults:", *kinds(), "", _EPILOG, ""])


def _add_arm(parser: Parser) -> None:
    """Add the argument that names the owner of an arm."""
    parser.add_argument(
        "--arm",
        metavar="NAME",
        help=f"name of the arm (default: ${ARM_VARIABLE}, else the only one)",
    )


def _add_view_command(commands: Parser) -> None:
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
        help="folder of a run, recording, trajectory file, sim:/path.sock for the arm that "
        "'bioscara simulate' runs, while a program uses it, or arm:NAME for one that "
        "'bioscara serve' runs (default: sliders, or the plan to the target)",
    )
    _add_start(view, "joint positions at the start of the plan")
    _add_motion_target(view, required=False)
    _add_full_speed(view)
    _add_degrees(view)
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


def _add_poses_command(commands: Parser) -> None:
    poses = _add_command(
        commands, "poses", "List, show, save or delete poses by name; nothing moves."
    )
    poses.take_commands("action", "ACTION")
    texts = {
        "list": "List all poses and tools.",
        "show": "Show one pose, and whether the arm can take it.",
        "save": "Save a pose under a name.",
        "delete": "Delete a saved pose.",
    }
    listing, show, save, delete = (
        _add_command(poses, name, text, "poses") for name, text in texts.items()
    )
    for action in (show, save, delete):
        action.add_argument("name", metavar="NAME", help="name of the pose")
    for action in (listing, show, save, delete):
        _add_table(action)
        _add_arm_of_table(action)
        _add_degrees(action)
    _add_plot(show, "draw the motion to the pose, joints and tool against their limits, as PNG")
    _add_start(show, "joint positions at the start of that motion")
    _add_scene(show, "file with the zones and the table that the motion keeps clear of")
    where = save.add_mutually_exclusive_group()
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
    _add_force(save, "pose")
    save.set_defaults(v1=False)


def _add_tools_command(commands: Parser) -> None:
    tools = _add_command(commands, "tools", "List the tools, or add one to the teach file.")
    tools.take_commands("action", "ACTION")
    listing = _add_command(tools, "list", "List all tools.", "tools")
    add = _add_command(tools, "add", "Add a tool under a name.", "tools")
    for action in (listing, add):
        _add_table(action)
        _add_arm_of_table(action)
        _add_degrees(action)
    add.add_argument("name", metavar="NAME", help="name of the tool")
    _add_four(
        add,
        "--offset",
        "X Y Z YAW",
        "its centre point in the flange [m m m rad]",
        required=True,
    )
    add.add_argument("--mass", metavar="KG", type=number, required=True, help="its mass [kg]")
    _add_force(add, "tool")


def _add_record_command(commands: Parser) -> None:
    record = _add_command(commands, "record", "Record a served arm as MCAP files, or use them.")
    record.take_commands("action", "ACTION", default="start")
    texts = {
        "start": "Record a served arm until Ctrl-C (the default).",
        "info": "List what a recording contains.",
        "recover": "Complete a recording whose recorder was killed or whose disk was full.",
        "export": "Write samples, events and trajectories as tables, and the flight records.",
        "replay": "Serve a recording as an arm that clients can look at but not command.",
    }
    start, info, recover, export, replay = (
        record.add_command(name, text) for name, text in texts.items()
    )
    _add_record_start(start)
    for action in (info, recover, export, replay):
        action.add_argument("file", metavar="FILE", type=Path, help="the recording")
    recover.add_argument(
        "--out", metavar="FILE", type=Path, help="file to write (default: replace the given one)"
    )
    kind = export.add_mutually_exclusive_group(required=True)
    kind.add_argument("--csv", metavar="DIR", type=Path, help="folder for CSV files")
    kind.add_argument("--parquet", metavar="DIR", type=Path, help="folder for Parquet files")
    replay.add_argument(
        "--name", metavar="NAME", default="replay", help="name of the served arm (default replay)"
    )
    replay.add_argument(
        "--real-time-factor",
        metavar="FACTOR",
        type=number,
        default=1.0,
        help="factor to real time, 0.01 to 100 (default 1)",
    )


def _add_record_start(start: Parser) -> None:
    start.add_argument(
        "--arm",
        metavar="NAME",
        default=os.environ.get(ARM_VARIABLE) or DEFAULT,
        help=f"name of the arm (default: ${ARM_VARIABLE}, else {DEFAULT})",
    )
    start.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        default=_RECORDINGS,
        help="folder of the files (default recordings)",
    )
    start.add_argument(
        "--max-size",
        metavar="SIZE",
        type=_size,
        default=_size("256M"),
        help="size at which the next file begins, as 500K, 256M or 2G (default 256M)",
    )
    start.add_argument(
        "--max-time",
        metavar="S",
        type=_positive,
        default=3600.0,
        help="duration after which the next file begins [s] (default 3600)",
    )
    start.add_argument(
        "--keep",
        metavar="SIZE",
        type=_size,
        default=_size("10G"),
        help="total size of this arm's files in the folder, above which the oldest are deleted "
        "(default 10G)",
    )


def _size(word: str) -> int:
    """Return a number of bytes."""
    factor = _SIZES.get(word[-1:].upper())
    digits = word if factor is None else word[:-1]
    value = number(digits) * (factor or 1)
    if not 1.0 <= value < 2.0**63:
        raise argparse.ArgumentTypeError(f"{word!r} is not a size from 1 byte on")
    return int(value)


def _positive(word: str) -> float:
    value = number(word)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{word!r} is not above zero")
    return value


def _add_force(parser: Parser, what: str) -> None:
    """Add the argument that replaces an entry of the teach file."""
    parser.add_argument(
        "--force", action="store_true", help=f"replace the {what} of this name, if there is one"
    )


def _serial_number(word: str) -> str:
    if not word:  # As from an unset variable: the only connected board may be another one.
        raise argparse.ArgumentTypeError("is empty; leave it out, or name a board")
    return word


def _add_flash_command(commands: Parser) -> None:
    flash = _add_command(
        commands,
        "flash",
        "Write the firmware of one or all joints to their boards, and verify it.",
    )
    which = flash.add_mutually_exclusive_group(required=True)
    which.add_argument(
        "--joint",
        metavar="N",
        type=whole_number,
        choices=(1, 2, 3, 4),
        help="number of the joint, 1 .. 4; an image for another is refused",
    )
    which.add_argument(
        "--all",
        action="store_true",
        help="one joint after the other, those that do not have their image; all boards on USB; "
        "needs --bus",
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


def _add_web_command(commands: Parser) -> None:
    web = _add_command(
        commands,
        "web",
        "Let browsers and programs reach an arm that an owner serves, until Ctrl-C.",
    )
    _add_arm(web)
    web.add_argument(
        "--host",
        metavar="ADDRESS",
        default="127.0.0.1",
        help="address to listen on (default: 127.0.0.1, for this computer only); another one needs "
        "TLS",
    )
    web.add_argument(
        "--port",
        metavar="N",
        type=_port,
        default=8080,
        help="TCP port to listen on (default 8080); 0 for a free one",
    )
    web.add_argument(
        "--allowed-host",
        metavar="NAME",
        action="append",
        default=[],
        help="a further name by which browsers call this computer; may be given several times",
    )
    web.add_argument("--tls-cert", metavar="FILE", type=Path, help="certificate for TLS, as PEM")
    web.add_argument("--tls-key", metavar="FILE", type=Path, help="its key, as PEM")
    web.add_argument(
        "--tls-self-signed",
        action="store_true",
        help="make a certificate for TLS; the browser asks whether to trust it",
    )
    web.add_argument(
        "--token-file",
        metavar="FILE",
        type=Path,
        help="file with the tokens, made if it does not exist (default: beside the owner's socket)",
    )
    web.add_argument(
        "--recordings",
        metavar="DIR",
        type=Path,
        default=_RECORDINGS,
        help="folder of the recordings that browsers may load (default recordings)",
    )
    web.add_argument(
        "--show",
        metavar="SCOPE",
        choices=("view", "operate", "admin"),
        help="print only the address with the token of this scope (default: all three)",
    )


def _add_ros_command(commands: Parser) -> None:
    ros = _add_command(
        commands,
        "ros",
        "Be the controller manager of an arm for clients of ROS 2, until Ctrl-C. All that follows "
        "--ros-args is for ROS.",
    )
    _add_arm(ros)
    ros.add_argument(
        "--bus",
        metavar="BUS",
        default="",
        help="own the arm on this bus, 'sim' (simulated) or 'linux:1' (I2C bus 1), instead of "
        "using that of another owner; it is named as --arm says, else 'arm'",
    )
    _add_homed(ros)


def _add_homed(parser: Parser) -> None:
    parser.add_argument(
        "--homed",
        action="store_true",
        help="start with homed joints; for the arm simulated in this process only",
    )


def _add_bus(parser: Parser, *, owned: bool = True) -> None:
    """Add the arguments that select the arm.

    Args:
        parser: Parser of the command.
        owned: Whether it may be the arm of a running owner.
    """
    parser.add_argument("--bus", metavar="BUS", help=BUS_HELP)
    parser.set_defaults(owned=owned)
    if owned:
        parser.add_argument(
            "--arm",
            metavar="NAME",
            help=f"the arm of this name, which 'bioscara serve' runs (default: ${ARM_VARIABLE}, "
            "else the only one on that bus, if any)",
        )
    parser.add_argument(
        "--v1",
        action="store_true",
        help="simulate joints with their original firmware, as existing arms have it",
    )


def _add_report(parser: Parser) -> None:
    """Add the argument for the files of ``demo`` and ``run``."""
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        help="folder for samples, report and plot (default: a new one under runs/)",
    )


def _add_motion(
    parser: Parser, *, full_speed: bool = True, realtime: bool = True, owned: bool = True
) -> None:
    """Add the arguments of every command that moves an arm.

    Args:
        parser: Parser of the command.
        full_speed: Whether its speed can be limited.
        realtime: Whether it homes the arm.
        owned: As for :func:`_add_bus`.
    """
    _add_bus(parser, owned=owned)
    _add_acknowledge(parser)
    if realtime:
        _add_realtime(parser)
    if full_speed:
        _add_full_speed(parser)
    _add_degrees(parser)
    _add_rate(parser)


def _add_rate(parser: Parser) -> None:
    """Add the arguments of the control loop."""
    parser.add_argument(
        "--rate",
        metavar="HZ",
        type=whole_number,
        help="control cycles per second (default: 100, and 50 with joints of protocol version 1)",
    )
    parser.add_argument(
        "--priority",
        metavar="N",
        type=whole_number,
        help="run the control loop before everything else, as SCHED_FIFO N (1 .. 99, usually 80) "
        "and with its memory locked; needs permission",
    )


def _add_degrees(parser: Parser) -> None:
    """Add the argument for angles in degrees."""
    parser.add_argument(
        "--deg",
        dest="degrees",
        action="store_true",
        help="give and show angles in degrees instead of radians; files keep radians",
    )


def _add_acknowledge(parser: Parser) -> None:
    """Add the argument that acknowledges faults."""
    parser.add_argument(
        "--acknowledge",
        action="store_true",
        help="acknowledge the faults that stopped the arm before, keep their evidence and "
        "continue; without it an arm that a fault stopped is refused",
    )


def _add_realtime(parser: Parser) -> None:
    """Add the argument for simulated homing in real time."""
    parser.add_argument(
        "--realtime",
        action="store_true",
        help="simulated homing takes the time it takes on the arm",
    )


def _add_full_speed(parser: Parser) -> None:
    """Add the argument that lifts the limit of the tool's speed."""
    parser.add_argument(
        "--full-speed",
        action="store_true",
        help="let the tool move faster than 250 mm/s",
    )


def _add_target(parser: Parser) -> None:
    """Add the arguments for target, type of motion, surroundings and output files."""
    _add_motion_target(parser, required=True)
    _add_scene(parser)
    parser.add_argument(
        "--csv", metavar="FILE", type=Path, help="write the trajectory, for 'bioscara run'"
    )
    _add_plot(parser, "draw joints and tool against their limits, as PNG")


def _add_motion_target(parser: Parser, *, required: bool) -> None:
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


def _add_start(parser: Parser, help_text: str) -> None:
    """Add the argument for the joint positions at the start."""
    parser.add_argument(
        "--from",
        dest="start",
        metavar=tuple(_JOINTS.split()),
        type=number,
        nargs=4,
        help=f"{help_text} [rad m rad rad] (default: {' '.join(f'{v:g}' for v in START)})",
    )


def _add_scene(
    parser: Parser,
    help_text: str = "file with the zones and the table that the arm keeps clear of",
) -> None:
    """Add the argument for the scene file."""
    parser.add_argument("--scene", metavar="FILE", type=Path, help=help_text)


def _add_plot(parser: Parser, help_text: str) -> None:
    """Add the argument for the plot of a motion."""
    parser.add_argument("--plot", metavar="FILE", type=Path, help=help_text)


def _add_table(parser: Parser, help_text: str = "file with the poses") -> None:
    """Add the argument for the file with the poses."""
    parser.add_argument(
        "--table",
        metavar="FILE",
        type=Path,
        help=f"{help_text} (default: {TABLE}, if it exists)",
    )


def _add_arm_of_table(parser: Parser) -> None:
    """Add the argument for the served arm whose poses are used."""
    parser.add_argument(
        "--arm", metavar="NAME", help="the poses of this arm, which 'bioscara serve' runs"
    )


def _add_tool(parser: Parser, help_text: str) -> None:
    """Add the argument for the name of a tool."""
    parser.add_argument(
        "--tool", metavar="NAME", default=FINGERS, help=f"{help_text} (default: {FINGERS})"
    )


def _add_four(
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
