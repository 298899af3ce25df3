"""SPI as a controller (RM0368, section 20): full duplex and one bidirectional line."""

from __future__ import annotations

from typing import ClassVar, Protocol

from emulator.clock import SECOND
from emulator.cortex import FIRST_INTERRUPT, EmulationError
from emulator.peripheral import Peripheral

_CR1, _CR2, _SR, _DR = 0x00, 0x04, 0x08, 0x0C
_RXNE, _TXE, _OVR, _BSY = 1 << 0, 1 << 1, 1 << 6, 1 << 7


class Device(Protocol):
    """A device on the lines."""

    def transfer(self, bits: int, sent: int, mode: int, hertz: float) -> int:
        """Shift one frame; returns the bits at the controller's data input."""


class Spi(Peripheral):
    """Frames of 8 or 16 bits, polled or with interrupts."""

    plain: ClassVar[dict[int, int]] = {
        _CR1: 0,
        _CR2: 0,
        0x10: 7,
        0x14: 0,
        0x18: 0,
        0x1C: 0,
        0x20: 2,
    }
    half = frozenset({_CR1, _CR2, _DR})

    def __init__(self, machine, name: str, irq: int) -> None:
        super().__init__(machine, name)
        self._exception = FIRST_INTERRUPT + irq
        self.device: Device | None = None
        self._start()

    def _start(self) -> None:
        self._waiting: int | None = None
        self._shifting: int | None = None
        self._end = 0
        self._received: int | None = None
        self._data = 0
        self._overrun = False
        self._event = None
        self._polled = False

    def reset(self) -> None:
        super().reset()
        self._start()
        self.machine.cpu.level(self._exception, False)

    @property
    def bits(self) -> int:
        return 16 if self.registers[_CR1] & 1 << 11 else 8

    @property
    def hertz(self) -> float:
        return self.machine.rcc.bus_hz(1) / (2 << (self.registers[_CR1] >> 3 & 7))

    @property
    def busy(self) -> bool:
        self._settle()
        return self._shifting is not None

    def _settle(self) -> None:
        while self._shifting is not None and self.machine.now >= self._end:
            sent, self._shifting = self._shifting, None
            mode = self.registers[_CR1] & 3
            received = 0xFFFF
            if self.device is not None:
                received = self.device.transfer(self.bits, sent, mode, self.hertz)
            if self._received is not None:
                self._overrun = True
            else:
                self._received = received & (1 << self.bits) - 1
                self._data = self._received
            if self._waiting is not None:
                self._begin(self._waiting, self._end)
                self._waiting = None

    def _begin(self, value: int, at: int) -> None:
        self._shifting = value & (1 << self.bits) - 1
        self._end = at + round(self.bits * SECOND / self.hertz)

    def _status(self) -> int:
        status = _TXE if self._waiting is None else 0
        status |= _RXNE if self._received is not None else 0
        status |= _BSY if self._shifting is not None else 0
        return status | (_OVR if self._overrun else 0)

    def _line(self) -> None:
        if self.registers[_CR2] & 0xE0 == 0:
            return
        if self._event is not None:
            self._event.cancel()
            self._event = None
        wanted = self.registers[_CR2]
        status = self._status()
        pending = (wanted & 0x80 and status & _TXE) or (wanted & 0x40 and status & _RXNE)
        self.machine.cpu.level(self._exception, bool(pending))
        if self._shifting is not None:
            self._event = self.machine.at(self._end, self._tick)

    def _tick(self) -> None:
        self._event = None
        self._settle()
        self._line()

    def read(self, offset: int) -> int:
        if offset == _SR and self._shifting is not None:
            self._settle()
            if self._shifting is not None and (self._waiting is not None or self._polled):
                # Nothing changes before the frame ends.
                self.machine.skip_to(self._end)
        self._settle()
        if offset == _SR:
            self._polled = True
            return self._status()
        if offset == _DR:
            self._polled = False
            self._received = None
            self._overrun = False
            self._line()
            return self._data
        return super().read(offset)

    def write(self, offset: int, value: int) -> None:
        self._settle()
        if offset == _DR:
            if not self.registers[_CR1] & 1 << 6 or not self.registers[_CR1] & 1 << 2:
                raise EmulationError(f"{self.name}: data written to no enabled controller")
            self._polled = False
            if self._shifting is None:
                self._begin(value, self.machine.now)
            else:
                if self._waiting is not None:
                    self.machine.violations.append(f"{self.name}: a frame was overwritten")
                self._waiting = value
        elif offset == _SR:
            return
        else:
            if offset == _CR1:
                if value & (1 << 13 | 1 << 15 | 1 << 10 | 1 << 7):
                    raise EmulationError(f"{self.name}: CR1 {value:#x} is not modelled")
                if self._shifting is not None and value != self.registers[_CR1]:
                    self.machine.violations.append(f"{self.name}: CR1 changed inside a frame")
            super().write(offset, value)
        self._line()
