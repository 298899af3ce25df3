"""Independent watchdog (RM0368, section 14)."""

from __future__ import annotations

from typing import ClassVar

from emulator.clock import SECOND
from emulator.peripheral import Peripheral

_KR, _PR, _RLR, _SR = 0x00, 0x04, 0x08, 0x0C


class Iwdg(Peripheral):
    """Counts the slow oscillator; only a reset stops it."""

    plain: ClassVar[dict[int, int]] = {_KR: 0, _PR: 0, _RLR: 0xFFF, _SR: 0}

    def __init__(self, machine, name: str) -> None:
        super().__init__(machine, name)
        self._event = None
        self.running = False
        self._open = False
        self.frozen = False
        """A debugger has stopped it."""

    def reset(self) -> None:
        super().reset()
        if self._event is not None:
            self._event.cancel()
        self._event, self.running, self._open = None, False, False

    @property
    def timeout(self) -> float:
        """From a reload to the reset [s]."""
        divider = 4 << min(self.registers[_PR] & 7, 6)
        return (self.registers[_RLR] + 1) * divider / self.machine.lsi

    def write(self, offset: int, value: int) -> None:
        if offset != _KR:
            if not self._open:
                self.machine.violations.append(f"IWDG + {offset:#x} was written while protected")
                return
            super().write(offset, value)
            return
        self._open = value == 0x5555
        if value == 0xCCCC:
            self.running = True
        if value in {0xAAAA, 0xCCCC} and self.running:
            if self._event is not None:
                self._event.cancel()
            self._event = self.machine.at(
                self.machine.now + round(self.timeout * SECOND), self._expire
            )

    def _expire(self) -> None:
        if not self.frozen:
            self.machine.request_reset("watchdog")
