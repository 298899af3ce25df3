"""SWD through an ST-Link, with the programs of stlink-tools 1.7."""

from __future__ import annotations

import re
from pathlib import Path

from bioscara.errors import FlashError
from bioscara.flashing.access import not_permitted
from bioscara.flashing.program import is_installed, run
from bioscara.flashing.programmer import FLASH, READ_BACK, WRITTEN, Programmer

CHIP = 0x423
"""Device id of the STM32F401xB and xC (DBGMCU_IDCODE in the reference manual RM0368)."""
WIRING = "connect SWDIO, SWCLK, GND and 3.3 V of the board to the ST-Link, and supply the board"

_SERIAL = re.compile(r"serial: +(\S+)")
_CHIP = re.compile(r"chipid: +(0x[0-9a-fA-F]+)")


class StFlash(Programmer):
    """A board on an ST-Link."""

    program = "st-flash"
    package = "stlink-tools"

    def __init__(self) -> None:
        self._serial = ""

    @classmethod
    def is_installed(cls) -> bool:
        """Return whether both programs of the package are installed."""
        return super().is_installed() and is_installed("st-info")

    def connect(self, serial: str) -> str:
        """Find the ST-Link and the board; as :meth:`Programmer.connect`."""
        output = run("st-info", "--probe").text
        found = dict(zip(_SERIAL.findall(output), _CHIP.findall(output), strict=False))
        listed = ", ".join(found)
        if not found:
            if "access error" in output or "LIBUSB_ERROR_ACCESS" in output:
                raise not_permitted("the ST-Link")
            raise FlashError(f"there is no ST-Link: connect one by USB and {WIRING}")
        if serial and serial not in found:
            raise FlashError(f"no ST-Link has the serial number {serial}; there are: {listed}")
        if not serial and len(found) > 1:
            raise FlashError(
                f"there are {len(found)} ST-Links: {listed}; disconnect all but one, or name one "
                f"with --serial, as --serial {next(iter(found))}"
            )
        self._serial = serial or next(iter(found))
        require_chip(int(found[self._serial], 16))
        return f"board on the ST-Link {self._serial}"

    def start(self) -> bool:
        """Reset the board."""
        return run(self.program, "--serial", self._serial, "reset").code == 0

    def _write(self, folder: Path) -> None:
        words = ("--serial", self._serial, "write", WRITTEN, f"{FLASH:#x}")
        run(self.program, *words, folder=folder).require_success("writing failed")

    def _read(self, folder: Path, length: int) -> None:
        words = ("--serial", self._serial, "read", READ_BACK, f"{FLASH:#x}", f"{length:#x}")
        run(self.program, *words, folder=folder).require_success("reading back failed")


def require_chip(chip: int) -> None:
    """Raise unless the device id read by an ST-Link is that of the board's controller.

    Args:
        chip: The device id; 0 if no controller answered.

    Raises:
        FlashError: It is another device id.
    """
    if chip == 0:
        raise FlashError(f"the ST-Link finds no controller: {WIRING}")
    if chip != CHIP:
        raise FlashError(
            f"the controller on the ST-Link has the device id {chip:#x}; that of a uStepper S32 "
            f"has {CHIP:#x}: this is another board"
        )
