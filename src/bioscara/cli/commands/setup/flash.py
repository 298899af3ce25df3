"""``bioscara flash``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from bioscara.cli.arm_parameters import parameters_from
from bioscara.cli.opened_arm import open_arm
from bioscara.cli.options import Options
from bioscara.cli.output.console import ExitStatus, Output, complain
from bioscara.cli.signals import raising_keyboard_interrupt
from bioscara.clock import Clock, MonotonicClock
from bioscara.drivers import Joint
from bioscara.errors import (
    BioscaraError,
    BusUnavailableError,
    CommunicationError,
    FlashError,
    NotSupportedError,
)
from bioscara.flashing import Dfu, Image, OpenOcd, Programmer, StFlash, prebuilt, read_image
from bioscara.flashing.image import dotted
from bioscara.protocol import Flags

_PATIENCE, _PAUSE = 5.0, 0.1
"""Longest time for the new firmware to answer, and interval between two attempts [s]."""


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
    with ExitStack() as stack, raising_keyboard_interrupt():
        joint = stack.enter_context(_on_bus(options, output)) if options.bus is not None else None
        if joint is not None:
            joint.prepare(programmer)
        board = programmer.connect(options.serial or "")
        output.line(f"writing to the {board}; keep it connected")
        status = _write(programmer, image, options)
        if status is ExitStatus.OK:
            output.line("verified: the flash holds the image")
            status = _start(programmer, output, options)
            if status is ExitStatus.OK and joint is not None:
                status = joint.confirm(image)
    output.check()
    return status


@contextmanager
def _on_bus(options: Options, output: Output) -> Iterator[_JointOnBus]:
    robot = open_arm(options, parameters_from(options))
    with robot.bus:
        yield _JointOnBus(robot.joints[options.joint - 1], robot.clock, output)


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


def _write(programmer: Programmer, image: Image, options: Options) -> ExitStatus:
    """Write and verify; a failure leaves the joint without firmware, and the message says so."""
    try:
        programmer.flash(image.content)
    except FlashError as error:
        complain(f"{error}; {_without_firmware(options)}")
        return ExitStatus.FAILED
    except KeyboardInterrupt:
        complain(f"interrupted; {_without_firmware(options)}")
        return ExitStatus.INTERRUPTED
    return ExitStatus.OK


def _start(programmer: Programmer, output: Output, options: Options) -> ExitStatus:
    """Start a board whose image is verified; a failure no longer affects the firmware."""
    try:
        started = programmer.start()
    except FlashError:
        started = False
    except KeyboardInterrupt:
        complain(f"interrupted; j{options.joint} has its firmware: press RESET to start it")
        return ExitStatus.INTERRUPTED
    if not started:
        output.line("it was not seen to start: press RESET")
    return ExitStatus.OK


def _without_firmware(options: Options) -> str:
    again = options.typed()
    if options.swd:
        still = "the ST-Link still reaches it"
    else:
        still = (
            "its bootloader is in ROM and still there: it starts automatically, or else with BOOT "
            "held while RESET is pressed"
        )
    return (
        f"j{options.joint} is without working firmware now and does not move; {still}; repeat: "
        f"{again}"
    )


class _JointOnBus:
    """The joint to flash, on its bus.

    Args:
        joint: The joint.
        clock: Clock of its bus.
        output: Output for messages to the user.
    """

    def __init__(self, joint: Joint, clock: Clock, output: Output) -> None:
        self._joint, self._clock, self._output = joint, clock, output
        self._boot_id: int | None = None

    def prepare(self, programmer: Programmer) -> None:
        """Start the bootloader of the joint, if that is needed and supported.

        A joint that does not answer, or does not support the request, needs its BOOT button.

        Raises:
            FlashError: The joint is enabled, or the board in its bootloader is another one.
            CommunicationError: The joint did not answer the request, or refused it.
            BusUnavailableError: The bus cannot be opened.
        """
        joint = self._joint
        in_bootloader = programmer.list_boards() if isinstance(programmer, Dfu) else []
        try:
            joint.init()
        except BusUnavailableError:
            raise
        except BioscaraError as error:
            self._output.line(f"not asked for its bootloader: {error}")
            return
        self._output.line(f"{joint.name} has {joint.firmware}")
        if joint.hello is not None:
            self._boot_id = joint.hello.boot_id
        if not joint.session.flags & Flags.NOTENABLED:
            raise FlashError(
                f"{joint.name} is enabled, and its load may fall: end the program that uses it"
            )
        if not isinstance(programmer, Dfu):
            return
        if in_bootloader:
            serials = ", ".join(board.serial for board in in_bootloader)
            raise FlashError(
                f"{joint.name} answers on the bus, so the board in its bootloader, {serials}, is "
                "another one: disconnect it, or leave out --bus to flash it"
            )
        if joint.version == 1:
            self._output.line("not asked for its bootloader: the original firmware has no request")
            return
        try:
            joint.start_bootloader()
        except NotSupportedError as error:
            self._output.line(f"not asked for its bootloader: {error}")
            return
        self._output.line("asked to start its bootloader")
        programmer.wait()

    def confirm(self, image: Image) -> ExitStatus:
        """Query the identity of the joint, and compare it with the image.

        Raises:
            BusUnavailableError: The bus cannot be opened.
        """
        joint, expected = self._joint, dotted(image.version[:2])
        end = self._clock.now() + _PATIENCE
        while True:
            try:
                joint.init()
                break
            except BusUnavailableError:
                raise
            except BioscaraError as error:
                if isinstance(error, CommunicationError) and self._clock.now() < end:
                    self._clock.sleep_until(self._clock.now() + _PAUSE)
                    continue
                complain(f"flashed, but not confirmed: {error}")
                return ExitStatus.FAILED
        hello = joint.hello
        if hello is None or hello.firmware != image.version[:2] or hello.boot_id == self._boot_id:
            complain(
                f"{joint.name} answers with {joint.firmware}, not restarted with {expected}: "
                "another board was flashed; check which board the cable is connected to"
            )
            return ExitStatus.FAILED
        self._output.line(f"confirmed: {joint.name} answers with {joint.firmware}")
        return ExitStatus.OK
