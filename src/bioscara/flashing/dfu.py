"""The USB bootloader in the controller's ROM, through dfu-util.

The commands and the parsed output are those of dfu-util 0.11. ``-d ,ID`` selects a device by its ID
in the bootloader: without the comma, other vendors' devices in their bootloaders would match as
well.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from bioscara.clock import Clock
from bioscara.errors import FlashError
from bioscara.flashing.access import not_permitted
from bioscara.flashing.image import FLASH_SIZE
from bioscara.flashing.program import run
from bioscara.flashing.programmer import FLASH, READ_BACK, WRITTEN, Programmer

BUTTON = (
    "connect the joint's board by USB, hold its BOOT button, press RESET for half a second and "
    "release BOOT"
)

_ID = "0483:df11"
_DEVICE = ("-d", f",{_ID}")
_FOUND = re.compile(
    r'Found DFU: \[0483:df11\].* alt=0, name="(?P<name>[^"]*)", serial="(?P<serial>[^"]*)"'
)
_CLOSED = re.compile(r"Cannot open DFU device 0483:df11(?P<rest>.*)")
_SECTORS = re.compile(r"(\d+)\*(\d+)([ BKM])")
_UNITS = {" ": 1, "B": 1, "K": 1024, "M": 1024 * 1024}
_PATIENCE, _PAUSE = 5.0, 0.1
"""Longest time for a board to appear or disappear, and polling interval [s]."""


class Board(NamedTuple):
    """A board in its bootloader: its serial number and flash size [bytes]."""

    serial: str
    flash_size: int


class Boards(NamedTuple):
    """Boards in their bootloader: the usable ones, and the error of one that cannot be opened."""

    found: list[Board]
    closed: FlashError | None


class Dfu(Programmer):
    """A board in its USB bootloader.

    Args:
        clock: Clock for waiting for a board.
    """

    program = "dfu-util"
    package = "dfu-util"

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._serial = ""
        self._beside_closed = False

    def list_boards(self) -> list[Board]:
        """Return the devices that are in the bootloader now.

        Raises:
            FlashError: There are only devices that may not be used.
        """
        found, closed = self._scan()
        if closed is not None and not found:
            raise closed
        return found

    def wait(self) -> None:
        """Wait until a board appears; :meth:`connect` raises if none did."""
        self._wait_until(self._is_connected)

    def connect(self, serial: str) -> str:
        """Find the board in its bootloader; as :meth:`Programmer.connect`."""
        found, closed = self._scan()
        if closed is not None and not found:
            raise closed
        listed = ", ".join(each.serial for each in found)
        if not found:
            raise FlashError(f"no board is in its bootloader: {BUTTON}, then repeat the command")
        if serial:
            found = [each for each in found if each.serial == serial]
            if not found:
                raise FlashError(
                    f"no board in its bootloader has the serial number {serial}; there are: "
                    f"{listed}"
                )
        if len(found) > 1:
            raise FlashError(
                f"{len(found)} boards are in their bootloader: {listed}; disconnect all but one, "
                f"or name one with --serial, as --serial {found[0].serial}"
            )
        (board,) = found
        if closed is not None and not serial:
            raise FlashError(
                f"besides {board.serial} there is a board in its bootloader that cannot be opened; "
                f"disconnect one of them, or name this one with --serial {board.serial}"
            )
        if board.flash_size not in (0, FLASH_SIZE):
            raise FlashError(
                f"the device in its bootloader, {board.serial}, has {board.flash_size // 1024} KiB "
                f"of flash; a uStepper S32 has {FLASH_SIZE // 1024}: this is another board"
            )
        self._serial, self._beside_closed = board.serial, closed is not None
        return f"board in its USB bootloader, serial number {board.serial}"

    def start(self) -> bool:
        """Leave the bootloader; the board may disconnect before dfu-util gets its answer."""
        run(self.program, *self._board(), "-s", f"{FLASH:#010x}:leave")
        return self._wait_until(self._has_left)

    def _scan(self) -> Boards:
        result = run(self.program, *_DEVICE, "-l")
        result.require_success("the boards cannot be listed, see 'dfu-util -l'")
        found = [
            Board(match["serial"], _flash_size(match["name"]))
            for match in _FOUND.finditer(result.text)
        ]
        closed = _CLOSED.search(result.text)
        if closed is None:
            return Boards(found, None)
        if "LIBUSB_ERROR" in closed["rest"] and "ACCESS" not in closed["rest"]:
            return Boards(
                found, FlashError(f"the board cannot be used: {closed[0]}; disconnect it once")
            )
        return Boards(found, not_permitted("the board in its bootloader"))

    def _write(self, folder: Path) -> None:
        words = ("-s", f"{FLASH:#010x}", "-D", WRITTEN)
        run(self.program, *self._board(), *words, folder=folder).require_success("writing failed")

    def _read(self, folder: Path, length: int) -> None:
        words = ("-s", f"{FLASH:#010x}:{length}", "-U", READ_BACK)
        run(self.program, *self._board(), *words, folder=folder).require_success(
            "reading back failed"
        )

    def _board(self) -> tuple[str, ...]:
        return (*_DEVICE, "-S", self._serial, "-a", "0")

    def _wait_until(self, condition: Callable[[], bool]) -> bool:
        """Return whether a condition was met in time."""
        end = self._clock.now() + _PATIENCE
        while not (met := condition()) and self._clock.now() < end:
            self._clock.sleep_until(self._clock.now() + _PAUSE)
        return met

    def _is_connected(self) -> bool:
        try:
            return bool(self.list_boards())
        except FlashError:
            return False  # Before udev has set the permissions of the new device.

    def _has_left(self) -> bool:
        """Return whether the board of :meth:`connect` is gone; others may stay."""
        try:
            found, closed = self._scan()
        except FlashError:
            return False
        # One that cannot be opened may be the board while it disconnects.
        known = closed is None or self._beside_closed
        return known and self._serial not in {each.serial for each in found}


def _flash_size(name: str) -> int:
    """Parse the size in a name such as ``@Internal Flash  /0x08000000/04*016Kg``; else 0."""
    sectors = _SECTORS.findall(name.rpartition("/")[2])
    return sum(int(count) * int(size) * _UNITS[unit] for count, size, unit in sectors)
