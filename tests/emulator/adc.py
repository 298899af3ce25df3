"""Analogue-to-digital converter (RM0368, section 11): single conversions with noise."""

from __future__ import annotations

from typing import ClassVar

from emulator.clock import SECOND
from emulator.peripheral import Peripheral

_SR, _CR1, _CR2, _SQR3, _DR = 0x00, 0x04, 0x08, 0x34, 0x4C
_TYPICAL = {16: 943, 17: 1502, 18: 943}
"""Temperature sensor at 25 degrees and the internal reference at 3.3 V [counts]."""


class Adc(Peripheral):
    """One regular conversion at a time.

    Attributes:
        noise: Standard deviation of a conversion [counts].
    """

    noise = 1.5
    plain: ClassVar[dict[int, int]] = {**dict.fromkeys(range(0x00, 0x50, 4), 0), 0x304: 0}

    def __init__(self, machine, name: str) -> None:
        super().__init__(machine, name)
        self._done: int | None = None

    def reset(self) -> None:
        super().reset()
        self._done = None

    def _settle(self) -> None:
        if self._done is None or self.machine.now < self._done:
            return
        self._done = None
        channel = self.registers[_SQR3] & 31
        value = self.machine.random.gauss(_TYPICAL.get(channel, 2436), self.noise)
        self.registers[_DR] = min(max(round(value), 0), 4095)
        self.registers[_SR] |= 2

    def read(self, offset: int) -> int:
        if offset == _SR and self._done is not None:
            self.machine.skip_to(self._done)
        self._settle()
        if offset == _DR:
            self.registers[_SR] &= ~2
        return super().read(offset)

    def write(self, offset: int, value: int) -> None:
        if offset == _SR:
            value &= self.registers[_SR]
        super().write(offset, value)
        if offset == _CR2 and value & 1 and value & 1 << 30:
            self.registers[_CR2] &= ~(1 << 30)
            # The longest sampling time and the conversion, at a quarter of APB2.
            self._done = self.machine.now + round(
                (480 + 12) * 4 * SECOND / self.machine.rcc.bus_hz(2)
            )
