"""SWD through an ST-Link, with OpenOCD 0.12."""

from __future__ import annotations

import re
from pathlib import Path

from bioscara.errors import FlashError
from bioscara.flashing.access import not_permitted
from bioscara.flashing.program import ProgramResult, run
from bioscara.flashing.programmer import FLASH, READ_BACK, WRITTEN, Programmer
from bioscara.flashing.stflash import WIRING, require_chip

_DEVICE_ID = re.compile(r"device id = (0x[0-9a-fA-F]+)")


class OpenOcd(Programmer):
    """A board on an ST-Link; OpenOCD lists none, so without a serial number it uses the first."""

    program = "openocd"
    package = "openocd"

    def __init__(self) -> None:
        self._serial = ""

    def connect(self, serial: str) -> str:
        """Find the ST-Link and the board; as :meth:`Programmer.connect`."""
        if serial and not serial.isalnum():
            raise FlashError(f"{serial!r} is not a serial number of an ST-Link")
        self._serial = serial
        result = self._run("init", "reset halt", "flash probe 0", "reset run")
        if "LIBUSB_ERROR_ACCESS" in result.text:
            raise not_permitted("the ST-Link")
        if "Error: open failed" in result.text:
            raise FlashError(f"there is no ST-Link: connect one by USB and {WIRING}")
        device = _DEVICE_ID.search(result.text)
        require_chip(int(device[1], 16) & 0xFFF if device else 0)
        result.require_success("the board cannot be used")
        return f"board on the ST-Link {serial}".rstrip()

    def start(self) -> bool:
        """Reset the board."""
        return self._run("init", "reset run").code == 0

    def _write(self, folder: Path) -> None:
        self._run(f"program {WRITTEN} {FLASH:#x}", folder=folder).require_success("writing failed")

    def _read(self, folder: Path, length: int) -> None:
        self._run(
            "init", "reset halt", f"dump_image {READ_BACK} {FLASH:#x} {length:#x}", folder=folder
        ).require_success("reading back failed")

    def _run(self, *commands: str, folder: Path | None = None) -> ProgramResult:
        adapter = ("-c", f"adapter serial {self._serial}") if self._serial else ()
        words = ("-f", "interface/stlink.cfg", *adapter, "-f", "target/stm32f4x.cfg")
        steps = (word for command in (*commands, "shutdown") for word in ("-c", command))
        return run(self.program, *words, *steps, folder=folder)
