"""``bioscara home``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from bioscara.cli.arm_choice import share_arm
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser
from bioscara.cli.shared_arguments import JOINTS, share

if TYPE_CHECKING:
    from bioscara.robot.arm_methods import ArmMethods

NAMES = tuple(name.lower() for name in JOINTS)


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    parser.add_argument(
        "--joint",
        dest="joint_names",
        metavar="NAME",
        choices=NAMES,
        nargs="+",
        action="extend",
        help="home these alone, also where they are homed, in the order of homing (default: those "
        "that are not homed)",
    )
    parser.explain = _as_joints
    share_arm(parser)
    share(parser, "--acknowledge", "--realtime", "--deg", "--rate", "--priority")


def _as_joints(_: Options, words: Sequence[str]) -> str:
    return f"bioscara home --joint {' '.join(words)}" if set(NAMES).issuperset(words) else ""


def run(options: Options, output: Output) -> ExitStatus:
    """Home the joints that are not homed, or those given, and release the arm; they stay homed."""
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.motion import Progress, carry_out, opened_arm, show_position

    status = ExitStatus.OK
    with opened_arm(options, parameters_from(options), output) as (robot, cancelled):

        def home(progress: Progress) -> None:
            order = robot.parameters.homing_order
            wanted = [name for name in order if name in (options.joint_names or order)]
            progress.phase("homing " + ", ".join(wanted))
            robot.home(options.joint_names, on_cycle=progress.cycle)

        if robot.is_homed and not options.joint_names:
            output.line("all joints are homed already")
        else:
            status = carry_out(robot, cancelled, options, output, home)
        if status is ExitStatus.OK:
            if robot.is_homed:
                show_position(robot, options, output)
            else:
                output.line(_left(robot))
    return status


def _left(robot: ArmMethods) -> str:
    """Return in words which joints are not homed."""
    from bioscara.protocol import Flags

    joints = zip(robot.parameters.joints, robot.flags, strict=True)
    return "not homed: " + ", ".join(
        joint.name for joint, flags in joints if flags & Flags.NOTHOMED
    )
