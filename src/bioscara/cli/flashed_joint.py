"""One joint to flash: the board on a programmer, and the joint on its bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from bioscara.cli.output.console import ExitStatus, complain
from bioscara.clock import Clock
from bioscara.drivers import Joint
from bioscara.errors import (
    BioscaraError,
    BusUnavailableError,
    CommunicationError,
    FlashError,
    NotSupportedError,
)
from bioscara.flashing import Dfu, Image, Programmer
from bioscara.flashing.image import dotted
from bioscara.protocol import Capability, Flags

_PATIENCE, _PAUSE = 5.0, 0.1
"""Longest time for the new firmware to answer, and interval between two attempts [s]."""

Report = Callable[[str], None]
"""Called with each message to the user."""
AnyProgrammer = TypeVar("AnyProgrammer", bound=Programmer)


def describe(image: Image) -> str:
    """Return a line about an image."""
    return (
        f"image: {image.name}, j{image.joint}, version {dotted(image.version)}, "
        f"{len(image.content)} bytes, CRC {image.crc:08x}"
    )


def image_of(joint: Joint) -> int | None:
    """Request the CRC-32 of the image that a joint runs; None if its firmware does not tell.

    Raises:
        CommunicationError: It does not answer.
    """
    if joint.hello is None or not joint.hello.capabilities & Capability.DIAGNOSIS:
        return None
    return joint.get_image()


def image_name(crc: int) -> str:
    """Return the CRC-32 of an image in words."""
    return f"{crc:08x}" if crc else "simulation"


def first_installed(*programmers: AnyProgrammer) -> AnyProgrammer:
    """Return the first of these whose program is installed.

    Raises:
        FlashError: None is; names their packages.
    """
    for programmer in programmers:
        if programmer.is_installed():
            return programmer
    first, *others = programmers
    raise FlashError(
        f"{first.program} is not installed: sudo apt install {first.package}"
        + "".join(f"; or {other.program}: sudo apt install {other.package}" for other in others)
    )


class BoardToFlash:
    """The board of a joint on a programmer.

    Args:
        programmer: The programmer.
        name: Name of the joint.
        again: Command that flashes it again.
        report: Called with each message.
    """

    def __init__(self, programmer: Programmer, name: str, again: str, report: Report) -> None:
        self._programmer, self._name, self._again, self._report = programmer, name, again, report

    def connect(self, serial: str = "") -> None:
        """Find the board; as :meth:`bioscara.flashing.Programmer.connect`."""
        board = self._programmer.connect(serial)
        self._report(f"writing to the {board}; keep it connected")

    def write(self, image: Image) -> ExitStatus:
        """Write and verify an image, then start it.

        A failure before it is verified leaves the joint without firmware, and the message says so.
        """
        try:
            self._programmer.flash(image.content)
        except FlashError as error:
            complain(f"{error}; {self._without_firmware()}")
            return ExitStatus.FAILED
        except KeyboardInterrupt:
            complain(f"interrupted; {self._without_firmware()}")
            return ExitStatus.INTERRUPTED
        self._report("verified: the flash holds the image")
        try:
            started = self._programmer.start()
        except FlashError:
            started = False
        except KeyboardInterrupt:
            complain(f"interrupted; {self._name} has its firmware: press RESET to start it")
            return ExitStatus.INTERRUPTED
        if not started:
            self._report("it was not seen to start: press RESET")
        return ExitStatus.OK

    def _without_firmware(self) -> str:
        if isinstance(self._programmer, Dfu):
            still = (
                "its bootloader is in ROM and still there: it starts automatically, or else with "
                "BOOT held while RESET is pressed"
            )
        else:
            still = "the ST-Link still reaches it"
        return (
            f"{self._name} is without working firmware now and does not move; {still}; repeat: "
            f"{self._again}"
        )


class JointOnBus:
    """The joint to flash, on its bus.

    Attributes:
        image: CRC-32 of the image that it runs; None if its firmware does not tell.
    """

    def __init__(self, joint: Joint, clock: Clock, report: Report) -> None:
        self._joint, self._clock, self._report = joint, clock, report
        self._boot_id: int | None = None
        self.image: int | None = None

    @property
    def name(self) -> str:
        """Name of the joint."""
        return self._joint.name

    @property
    def starts_bootloader(self) -> bool:
        """Whether it starts its bootloader on request."""
        return self._joint.hello is not None and self._joint.hello.starts_bootloader

    @property
    def is_original(self) -> bool:
        """Whether it has its original firmware."""
        return self._joint.version == 1

    def identify(self) -> str:
        """Query the joint; return its firmware with its image, in words.

        Raises:
            CommunicationError: It does not answer.
            WrongJointError: Another joint answers.
            NotSupportedError: It speaks a newer protocol.
        """
        joint = self._joint
        joint.init()
        if joint.hello is not None:
            self._boot_id = joint.hello.boot_id
        self.image = image_of(joint)
        return self._firmware()

    def require_disabled(self) -> None:
        """Raise if the joint is enabled.

        Raises:
            FlashError: It is.
        """
        if not self._joint.session.flags & Flags.NOTENABLED:
            raise FlashError(
                f"{self.name} is enabled, and its load may fall: end the program that uses it"
            )

    def prepare(self, programmer: Programmer, image: Image) -> None:
        """Start the bootloader of the joint, if that is needed and supported.

        A joint that does not answer, or does not support the request, needs its BOOT button.

        Raises:
            FlashError: The joint is enabled, or the board in its bootloader is another one.
            CommunicationError: The joint did not answer the request, or refused it.
            BusUnavailableError: The bus cannot be opened.
        """
        in_bootloader = programmer.list_boards() if isinstance(programmer, Dfu) else []
        try:
            firmware = self.identify()
        except BusUnavailableError:
            raise
        except BioscaraError as error:
            self._report(f"not asked for its bootloader: {error}")
            return
        self._report(f"{self.name} has {firmware}")
        if self.image == image.crc:
            self._report(f"{self.name} already has this image")
        self.require_disabled()
        if not isinstance(programmer, Dfu):
            return
        if in_bootloader:
            serials = ", ".join(board.serial for board in in_bootloader)
            raise FlashError(
                f"{self.name} answers on the bus, so the board in its bootloader, {serials}, is "
                "another one: disconnect it, or leave out --bus to flash it"
            )
        if self.is_original:
            self._report("not asked for its bootloader: the original firmware has no request")
            return
        try:
            self.start_bootloader(programmer)
        except NotSupportedError as error:
            self._report(f"not asked for its bootloader: {error}")

    def start_bootloader(self, programmer: Dfu) -> None:
        """Request the bootloader of the joint, and wait until a board appears in it.

        Raises:
            NotSupportedError: Its firmware has no such request.
            CommunicationError: It did not answer, or refused the request.
            BusUnavailableError: The bus cannot be opened.
        """
        self._joint.start_bootloader()
        self._report("asked to start its bootloader")
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
                self.image = image_of(joint)
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
        if (
            hello is None
            or hello.firmware != image.version[:2]
            or hello.boot_id == self._boot_id
            or self.image not in (None, image.crc)
        ):
            complain(
                f"{self.name} answers with {self._firmware()}, not restarted with {expected}, "
                f"image {image.crc:08x}: another board was flashed; check which board the cable is "
                "connected to"
            )
            return ExitStatus.FAILED
        self._report(f"confirmed: {self.name} answers with {self._firmware()}")
        return ExitStatus.OK

    def _firmware(self) -> str:
        known = "" if self.image is None else f", image {image_name(self.image)}"
        return self._joint.firmware + known
