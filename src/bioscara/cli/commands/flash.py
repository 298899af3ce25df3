"""``bioscara flash``."""

from __future__ import annotations

import shlex
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from bioscara.cli import complain
from bioscara.cli.arguments import Options
from bioscara.cli.connect import open_arm
from bioscara.cli.console import Output
from bioscara.cli.exit_status import Status
from bioscara.cli.flashed_joint import Flashed
from bioscara.clock import MonotonicClock
from bioscara.errors import FlashError
from bioscara.flashing import Dfu, Image, OpenOcd, Programmer, StFlash, prebuilt, read_image
from bioscara.flashing.image import dotted
from bioscara.model import load_parameters


def run(options: Options) -> int:
    """Write an image to a board, read it back, compare, and start it.

    With a bus, the joint is requested to start its bootloader before, and identified afterwards.

    Raises:
        ImageError: The image is not for this joint; nothing was written.
        FlashError: There is no board or no program to flash it with, or the joint is enabled;
            nothing was written.
        BioscaraError: The bus cannot be used; nothing was written.
        OSError: Standard output cannot be written.
    """
    output = Output()
    image = read_image(options.image or prebuilt(options.joint))
    image.require(options.joint)
    output.line(
        f"image: {image.name}, j{image.joint}, version {dotted(image.version)}, "
        f"{len(image.content)} bytes"
    )
    programmer = _programmer(options)
    with ExitStack() as stack, _interruptible():
        joint = stack.enter_context(_on_bus(options, output)) if options.bus is not None else None
        if joint is not None:
            joint.prepare(programmer)
        board = programmer.connect(options.serial or "")
        output.line(f"writing to the {board}; keep it connected")
        status = _write(programmer, image, options)
        if status is Status.OK:
            output.line("verified: the flash holds the image")
            status = _start(programmer, output, options)
            if status is Status.OK and joint is not None:
                status = joint.confirm(image)
    output.check()
    return status


@contextmanager
def _on_bus(options: Options, output: Output) -> Iterator[Flashed]:
    robot = open_arm(options, load_parameters())
    with robot.bus:
        yield Flashed(robot.joints[options.joint - 1], robot.clock, output)


def _programmer(options: Options) -> Programmer:
    """Return the programmer for the requested interface, USB or SWD.

    Raises:
        FlashError: The program is not installed; names its package.
    """
    programmers = [StFlash(), OpenOcd()] if options.swd else [Dfu(MonotonicClock())]
    for programmer in programmers:
        if programmer.is_installed():
            return programmer
    first, *others = programmers
    raise FlashError(
        f"{first.program} is not installed: sudo apt install {first.package}"
        + "".join(f"; or {other.program}: sudo apt install {other.package}" for other in others)
    )


def _write(programmer: Programmer, image: Image, options: Options) -> Status:
    """Write and verify; a failure leaves the joint without firmware, and the message says so."""
    try:
        programmer.flash(image.content)
    except FlashError as error:
        complain(f"{error}; {_without_firmware(options)}")
        return Status.FAILED
    except KeyboardInterrupt:
        complain(f"interrupted; {_without_firmware(options)}")
        return Status.INTERRUPTED
    return Status.OK


def _start(programmer: Programmer, output: Output, options: Options) -> Status:
    """Start a board whose image is verified; a failure no longer affects the firmware."""
    try:
        started = programmer.start()
    except FlashError:
        started = False
    except KeyboardInterrupt:
        complain(f"interrupted; j{options.joint} has its firmware: press RESET to start it")
        return Status.INTERRUPTED
    if not started:
        output.line("it was not seen to start: press RESET")
    return Status.OK


def _without_firmware(options: Options) -> str:
    again = shlex.join(("bioscara", *options.words))
    if options.swd:
        still = "the ST-Link still reaches it"
    else:
        still = (
            "its bootloader is in ROM and still there: it comes up by itself, or else with BOOT "
            "held while RESET is pressed"
        )
    return (
        f"j{options.joint} is without working firmware now and does not move; {still}; repeat: "
        f"{again}"
    )


@contextmanager
def _interruptible() -> Iterator[None]:
    """Handle SIGTERM and a closed terminal during flashing as Ctrl-C, with the same messages."""
    numbers = (signal.SIGTERM, signal.SIGHUP)
    before = [(number, signal.signal(number, signal.default_int_handler)) for number in numbers]
    try:
        yield
    finally:
        for number, handler in before:
            signal.signal(number, handler)
