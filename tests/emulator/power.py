"""Power control and backup registers (RM0368, sections 5 and 17)."""

from __future__ import annotations

from typing import ClassVar

from emulator.peripheral import Peripheral


class Power(Peripheral):
    """PWR: only the write protection of the backup domain matters here."""

    plain: ClassVar[dict[int, int]] = {0x00: 0x8000, 0x04: 0x0000_4000}

    @property
    def backup_writable(self) -> bool:
        return bool(self.registers[0x00] & 1 << 8)


class Backup(Peripheral):
    """RTC: the 20 backup registers, which keep their value while the board has power."""

    plain: ClassVar[dict[int, int]] = dict.fromkeys(range(0x50, 0xA0, 4), 0)

    def reset(self) -> None:
        pass

    def lose_power(self) -> None:
        self.registers = dict(self.plain)

    def write(self, offset: int, value: int) -> None:
        if not self.machine.power.backup_writable:
            self.machine.violations.append(f"{self.name} + {offset:#x} was written while protected")
            return
        super().write(offset, value)
