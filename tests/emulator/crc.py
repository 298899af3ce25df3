"""CRC unit (RM0368, section 4)."""

from __future__ import annotations

from typing import ClassVar

from emulator.peripheral import Peripheral


class Crc(Peripheral):
    """Polynomial 0x04C11DB7 over whole words, start 0xFFFFFFFF."""

    plain: ClassVar[dict[int, int]] = {0x00: 0xFFFF_FFFF, 0x04: 0, 0x08: 0}

    def write(self, offset: int, value: int) -> None:
        if offset == 0x08:
            if value & 1:
                self.registers[0x00] = 0xFFFF_FFFF
            return
        if offset == 0x00:
            value ^= self.registers[0x00]
            for _ in range(32):
                value = (value << 1 ^ (0x04C1_1DB7 if value >> 31 else 0)) & 0xFFFF_FFFF
        super().write(offset, value)
