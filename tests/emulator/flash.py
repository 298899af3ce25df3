"""Flash interface (RM0368, section 3): wait states and accelerator; nothing is programmed."""

from __future__ import annotations

from typing import ClassVar

from emulator.cortex import EmulationError
from emulator.peripheral import Peripheral

_ACR = 0x00


class Flash(Peripheral):
    """ACR; programming is not modelled."""

    plain: ClassVar[dict[int, int]] = {_ACR: 0}

    def __init__(self, machine, name: str) -> None:
        super().__init__(machine, name)
        self._apply()

    def reset(self) -> None:
        super().reset()
        self._apply()

    def write(self, offset: int, value: int) -> None:
        super().write(offset, value)
        self._apply()
        self.check()

    def _apply(self) -> None:
        value, clock = self.registers[_ACR], self.machine.clock
        clock.wait = value & 15
        clock.prefetched = value >> 8 & 1
        clock.cached = value >> 9 & 1

    def check(self) -> None:
        """At 2.7 V and more each wait state is good for 30 MHz (RM0368, table 6)."""
        core = self.machine.rcc.core_hz
        if core > 30_000_000 * (self.registers[_ACR] & 15) + 30_000_000:
            raise EmulationError(
                f"{core} Hz need more than {self.registers[_ACR] & 15} wait states of the flash"
            )
