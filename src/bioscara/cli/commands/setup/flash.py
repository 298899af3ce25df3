"""``bioscara flash``."""

from __future__ import annotations

from contextlib import ExitStack

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.commands.setup.flash_all import flash_all
from bioscara.cli.flashed_joint import BoardToFlash, JointOnBus, describe, first_installed
from bioscara.cli.opened_arm import own_arm
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output
from bioscara.cli.signals import raising_keyboard_interrupt
from bioscara.clock import MonotonicClock
from bioscara.flashing import Dfu, OpenOcd, Programmer, StFlash, prebuilt, read_image


def run(options: Options) -> int:
    """Write an image to a board, read it back, compare, and start it; with --all to each board.

    With a bus, the joint is requested to start its bootloader before, and identified afterwards.

    Raises:
        ImageError: The image is not for this joint; nothing was written.
        FlashError: There is no board or no program to flash it with, or the joint is enabled;
            nothing was written.
        BioscaraError: The bus cannot be used; nothing was written.
        OSError: Standard output cannot be written.
    """
    output = Output()
    if options.joint is None:
        status = flash_all(options, output)
    else:
        status = _flash_one(options.joint, options, output)
    output.check()
    return status


def _flash_one(number: int, options: Options, output: Output) -> ExitStatus:
    image = read_image(options.image or prebuilt(number))
    image.require(number)
    output.line(describe(image))
    programmer = _programmer(swd=options.swd)
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


def _programmer(*, swd: bool) -> Programmer:
    if swd:
        return first_installed(StFlash(), OpenOcd())
    return first_installed(Dfu(MonotonicClock()))
