"""Interface of the programs that write firmware to a board."""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import ExitStack
from pathlib import Path
from typing import ClassVar

from bioscara.errors import FlashError, ImageError
from bioscara.files.locked_folder import LockedFolder
from bioscara.flashing.program import is_installed

FLASH = 0x08000000
"""Start address of the flash from which the controller boots."""
WRITTEN, READ_BACK = "image.bin", "readback.bin"
"""File names in the programs' working directory, so that no path has to be quoted."""


class Programmer(ABC):
    """A connection to the one board to flash.

    Attributes:
        program: Name of the program that writes the flash.
        package: Debian package that has the program.
    """

    program: ClassVar[str]
    package: ClassVar[str]

    @classmethod
    def is_installed(cls) -> bool:
        """Return whether the program is installed."""
        return is_installed(cls.program)

    @abstractmethod
    def connect(self, serial: str) -> str:
        """Find the board; nothing is written.

        Args:
            serial: Serial number of the device to use; ``""`` for the only one.

        Returns:
            A description of the device that was found, for messages.

        Raises:
            FlashError: There is none or more than one, it may not be used, or it is another board.
        """

    def flash(self, content: bytes) -> None:
        """Write ``content`` to the start of the flash, read it back and compare; starts nothing.

        Raises:
            ImageError: There is no room for the program's input file; nothing was written.
            FlashError: Writing or reading failed, or the data read back differ.
        """
        with ExitStack() as stack:
            try:
                folder = stack.enter_context(LockedFolder("bioscara-flash-"))
                (folder / WRITTEN).write_bytes(content)
            except OSError as error:
                raise ImageError(
                    f"the image cannot be copied: {error.strerror or error}; set TMPDIR to a "
                    "folder with room"
                ) from error
            self._write(folder)
            self._read(folder, len(content))
            read_back = (folder / READ_BACK).read_bytes() if (folder / READ_BACK).exists() else b""
        if read_back == content:
            return
        if len(read_back) != len(content):
            raise FlashError(f"{len(read_back)} bytes were read back instead of {len(content)}")
        first = next(i for i, (a, b) in enumerate(zip(read_back, content, strict=True)) if a != b)
        raise FlashError(
            f"what was read back differs from the image from {FLASH + first:#010x} on; the flash "
            "may be worn out or write-protected"
        )

    @abstractmethod
    def start(self) -> bool:
        """Start the written firmware; returns whether it runs, as far as that can be observed."""

    @abstractmethod
    def _write(self, folder: Path) -> None:
        """Write the file ``WRITTEN`` in ``folder`` to the flash."""

    @abstractmethod
    def _read(self, folder: Path, length: int) -> None:
        """Read ``length`` bytes of the flash to the file ``READ_BACK`` in ``folder``."""
