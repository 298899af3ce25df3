"""``bioscara flash``."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path

from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.parser import Options, Parser, whole_number
from bioscara.cli.shared_arguments import share


def arguments(parser: Parser) -> None:
    share(parser, "--parameters")
    which = parser.add_mutually_exclusive_group(required=True)
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
    parser.add_argument(
        "image",
        metavar="FILE",
        type=Path,
        nargs="?",
        help="the image (default: the one of this version, built in the checkout or downloaded)",
    )
    means = parser.add_mutually_exclusive_group()
    means.add_argument(
        "--dfu",
        dest="swd",
        action="store_false",
        help="over USB, through the bootloader that the BOOT button starts (the default)",
    )
    means.add_argument("--swd", action="store_true", help="through an ST-Link")
    parser.add_argument(
        "--serial",
        metavar="NUMBER",
        type=_serial_number,
        help="serial number of the board or ST-Link, if there are several",
    )
    parser.add_argument(
        "--bus",
        metavar="BUS",
        help="bus of the joint: starts its bootloader without the button, and reads its firmware "
        "version afterwards; 'linux:1' is I2C bus 1",
    )
    parser.set_defaults(swd=False)
    parser.checks.append(_check)


def _serial_number(word: str) -> str:
    if not word:  # As from an unset variable: the only connected board may be another one.
        raise argparse.ArgumentTypeError("is empty; leave it out, or name a board")
    return word


def _check(parser: Parser, options: Options) -> None:
    """Refuse a bus without a board, and with --all options that are for one joint alone."""
    if options.bus == "sim":
        parser.error("--bus sim has no board to flash; name the bus of the joint, as linux:1")
    if not options.all:
        return
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


def run(options: Options, output: Output) -> ExitStatus:
    """Write an image to a board, read it back, compare, and start it; with --all to each board.

    With a bus, the joint is requested to start its bootloader before, and identified afterwards.

    Raises:
        ImageError: The image is not for this joint; nothing was written.
        FlashError: There is no board or no program to flash it with, or the joint is enabled;
            nothing was written.
        BioscaraError: The bus cannot be used; nothing was written.
    """
    from bioscara.cli.arm_parameters import parameters_from
    from bioscara.cli.flash_all import flash_all
    from bioscara.cli.flashed_joint import BoardToFlash, JointOnBus, describe, first_installed
    from bioscara.cli.opened_arm import own_arm
    from bioscara.cli.signals import raising_keyboard_interrupt
    from bioscara.clock import MonotonicClock
    from bioscara.flashing import Dfu, OpenOcd, Programmer, StFlash, prebuilt, read_image

    number = options.joint
    if number is None:
        return flash_all(options, output)
    image = read_image(options.image or prebuilt(number))
    image.require(number)
    output.line(describe(image))
    programmer: Programmer = (
        first_installed(StFlash(), OpenOcd())
        if options.swd
        else first_installed(Dfu(MonotonicClock()))
    )
    board = BoardToFlash(programmer, f"j{number}", options.typed(), output.line)
    with ExitStack() as stack, raising_keyboard_interrupt():
        joint = None
        if options.bus is not None:
            robot = own_arm(options, parameters_from(options))
            stack.enter_context(robot.bus)
            joint = JointOnBus(robot.joints[number - 1], robot.clock, output.line)
            joint.prepare(programmer, image)
        board.connect(options.serial or "")
        status = board.write(image)
        if status is ExitStatus.OK and joint is not None:
            status = joint.confirm(image)
    return status
