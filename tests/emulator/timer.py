"""General-purpose timers (RM0368, sections 13 to 15): counting up, update interrupt."""

from __future__ import annotations

from typing import ClassVar

from emulator.clock import SECOND
from emulator.cortex import FIRST_INTERRUPT, EmulationError
from emulator.peripheral import Peripheral

_CR1, _DIER, _SR, _EGR, _CNT, _PSC, _ARR = 0x00, 0x0C, 0x10, 0x14, 0x24, 0x28, 0x2C


class Timer(Peripheral):
    """Counter, prescaler with its shadow, automatic reload."""

    plain: ClassVar[dict[int, int]] = {**dict.fromkeys(range(0x00, 0x54, 4), 0), _ARR: 0xFFFF}
    half = frozenset({_CR1, _DIER, _SR, _EGR, _CNT, _PSC, _ARR})

    def __init__(self, machine, name: str, irq: int, apb: int) -> None:
        super().__init__(machine, name)
        self._exception = FIRST_INTERRUPT + irq
        self._apb = apb
        self._wide = name in {"TIM2", "TIM5"}
        self._event = None
        self._start()

    def _start(self) -> None:
        if self._event is not None:
            self._event.cancel()
        self._event = None
        self._prescaler = 0
        # The counter had the value `_count` at `_since`.
        self._count, self._since = 0, self.machine.now
        if self._wide:
            self.registers[_ARR] = 0xFFFF_FFFF

    def reset(self) -> None:
        super().reset()
        self._start()
        self.machine.cpu.level(self._exception, False)

    @property
    def _period(self) -> int:
        return self.registers[_ARR] + 1

    def _tick(self) -> float:
        return (self._prescaler + 1) * SECOND / self.machine.rcc.timer_hz(self._apb)

    def _settle(self) -> None:
        if not self.registers[_CR1] & 1:
            self._since = self.machine.now
            return
        ticks = int((self.machine.now - self._since) / self._tick())
        total = self._count + ticks
        self._since += round(ticks * self._tick())
        self._count = total % self._period
        if total >= self._period:
            self._update()

    def _update(self) -> None:
        self._prescaler = self.registers[_PSC]
        self.registers[_SR] |= 1
        self._line()

    def _line(self) -> None:
        pending = self.registers[_SR] & self.registers[_DIER] & 1
        self.machine.cpu.level(self._exception, bool(pending))

    def _plan(self) -> None:
        if self._event is not None:
            self._event.cancel()
            self._event = None
        if self.registers[_CR1] & 1 and self.registers[_DIER] & 1:
            left = (self._period - self._count) * self._tick()
            self._event = self.machine.at(self._since + round(left), self._overflow)

    def _overflow(self) -> None:
        self._event = None
        self._since = self.machine.now
        self._count = 0
        self._update()
        self._plan()

    def read(self, offset: int) -> int:
        self._settle()
        return self._count if offset == _CNT else super().read(offset)

    def write(self, offset: int, value: int) -> None:
        self._settle()
        if offset == _SR:
            self.registers[_SR] &= value
        elif offset == _CNT:
            self._count = value
        elif offset == _EGR:
            if value & 1:
                self._count, self._since = 0, self.machine.now
                self._prescaler = self.registers[_PSC]
                if not self.registers[_CR1] & 1 << 2:
                    self.registers[_SR] |= 1
        elif offset == _CR1 and value & ~0x8D:
            raise EmulationError(f"{self.name}: counting as in CR1 {value:#x} is not modelled")
        else:
            super().write(offset, value)
        self._line()
        self._plan()
