"""The flashed joint on its bus: bootloader request before flashing, identity check afterwards."""

from __future__ import annotations

from bioscara.cli import complain
from bioscara.cli.commands.joints import firmware
from bioscara.cli.console import Output
from bioscara.cli.exit_status import Status
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
from bioscara.protocol import Flags

_PATIENCE, _PAUSE = 5.0, 0.1
"""Longest time for the new firmware to answer, and interval between two attempts [s]."""


class Flashed:
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
        self._output.line(f"{joint.name} has {firmware(joint)}")
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

    def confirm(self, image: Image) -> Status:
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
                return Status.FAILED
        hello = joint.hello
        if hello is None or hello.firmware != image.version[:2] or hello.boot_id == self._boot_id:
            complain(
                f"{joint.name} answers with {firmware(joint)}, not restarted with {expected}: "
                "another board was flashed; look where the cable goes"
            )
            return Status.FAILED
        self._output.line(f"confirmed: {joint.name} answers with {firmware(joint)}")
        return Status.OK
