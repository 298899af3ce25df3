"""Reset and clock control (RM0368, section 6)."""

from __future__ import annotations

from typing import ClassVar

from emulator.clock import MICROSECOND, SECOND
from emulator.cortex import EmulationError
from emulator.peripheral import Peripheral

HSE_HZ = 20_000_000
"""The board's crystal."""
_HSE_START = 2_000 * MICROSECOND
_PLL_LOCK = 200 * MICROSECOND

_CR, _PLLCFGR, _CFGR, _CSR = 0x00, 0x04, 0x08, 0x74
_RESETS = {"AHB1": 0x10, "AHB2": 0x14, "APB1": 0x20, "APB2": 0x24}
_ENABLES = {"AHB1": 0x30, "APB1": 0x40, "APB2": 0x44}
_HSI_ON, _HSI_READY, _HSE_ON, _HSE_READY = 1 << 0, 1 << 1, 1 << 16, 1 << 17
_PLL_ON, _PLL_READY = 1 << 24, 1 << 25
_FLAGS = {
    "power": 1 << 27 | 1 << 26 | 1 << 25,
    "pin": 1 << 26,
    "software": 1 << 28 | 1 << 26,
    "watchdog": 1 << 29 | 1 << 26,
}
_GATES = {
    **{f"GPIO{letter}": ("AHB1", "ABCDE--H".index(letter)) for letter in "ABCDEH"},
    "CRC": ("AHB1", 12),
    **{f"TIM{number}": ("APB1", number - 2) for number in range(2, 6)},
    "SPI2": ("APB1", 14),
    "SPI3": ("APB1", 15),
    "I2C1": ("APB1", 21),
    "PWR": ("APB1", 28),
    "ADC1": ("APB2", 8),
    "SYSCFG": ("APB2", 14),
    **{f"TIM{number}": ("APB2", number + 7) for number in range(9, 12)},
}


class Rcc(Peripheral):
    """Oscillators, PLL, prescalers, gates, MCO1 and the causes of resets."""

    plain: ClassVar[dict[int, int]] = {
        **dict.fromkeys(
            (0x0C, 0x10, 0x14, 0x20, 0x24, 0x30, 0x34, 0x40, 0x44, 0x70, 0x80, 0x84), 0
        ),
        0x50: 0x0061_900F,
        0x54: 0x80,
        0x60: 0x10E2_C9FF,
        0x64: 0x0007_5933,
        0x8C: 0,
        _PLLCFGR: 0x2400_3010,
        _CFGR: 0,
    }

    crystal_swings = True

    def __init__(self, machine) -> None:
        self._cause_flags = 0
        super().__init__(machine, "RCC")
        self._start()

    def _start(self) -> None:
        self._control = 0x83
        self._csr = 0
        self._hse_since = self._pll_since = None
        self.system_hz = 16_000_000
        self._apply()

    def reset(self) -> None:
        super().reset()
        self._start()

    def note_reset(self, cause: str) -> None:
        self._cause_flags = _FLAGS[cause] if cause == "power" else self._cause_flags | _FLAGS[cause]

    def has_clock(self, name: str) -> bool:
        if name not in _GATES:
            return True
        bus, bit = _GATES[name]
        return bool(self.registers[_ENABLES[bus]] >> bit & 1)

    def _apb(self, shift: int) -> int:
        field = self.registers[_CFGR] >> shift & 7
        return 1 if field < 4 else 2 << (field - 4)

    @property
    def core_hz(self) -> int:
        field = self.registers[_CFGR] >> 4 & 15
        divider = 1 if field < 8 else (2, 4, 8, 16, 64, 128, 256, 512)[field - 8]
        return self.system_hz // divider

    def bus_hz(self, apb: int) -> int:
        return self.core_hz // self._apb(10 if apb == 1 else 13)

    def timer_hz(self, apb: int) -> int:
        divider = self._apb(10 if apb == 1 else 13)
        return self.bus_hz(apb) * (1 if divider == 1 else 2)

    def mco1_hz(self) -> float:
        """Return the frequency at PA8 where that pin is MCO1 [Hz]."""
        configuration = self.registers[_CFGR]
        source = (16_000_000, 0, HSE_HZ if self._ready(_HSE_READY) else 0, self._pll_hz())
        prescaler = configuration >> 24 & 7
        return source[configuration >> 21 & 3] / (1 if prescaler < 4 else prescaler - 2)

    def _ready(self, bit: int) -> bool:
        return bool(self.read(_CR) & bit)

    def _pll_hz(self) -> int:
        field = self.registers[_PLLCFGR]
        m, n, p = field & 63, field >> 6 & 511, 2 * ((field >> 16 & 3) + 1)
        source = HSE_HZ if field >> 22 & 1 else 16_000_000
        if not m:
            return 0
        inside, vco = source / m, source / m * n
        if not (1e6 <= inside <= 2e6 and 192e6 <= vco <= 432e6):
            raise EmulationError(f"the PLL cannot run with {inside:g} Hz in and {vco:g} Hz inside")
        return round(vco / p)

    def _apply(self) -> None:
        core = self.core_hz
        if SECOND % core:
            raise EmulationError(f"no time is kept for a core of {core} Hz")
        if core > 84_000_000 or self.bus_hz(1) > 42_000_000:
            raise EmulationError(f"core {core} Hz, APB1 {self.bus_hz(1)} Hz: too fast")
        self.machine.clock.unit = SECOND // core

    def read(self, offset: int) -> int:
        now = self.machine.now
        if offset == _CR:
            value = self._control
            if self._hse_since is not None and now - self._hse_since >= _HSE_START:
                value |= _HSE_READY
            if self._pll_since is not None and now - self._pll_since >= _PLL_LOCK:
                value |= _PLL_READY
            return value
        if offset == _CFGR:
            value = self.registers[_CFGR]
            return value & ~0xC | (value & 3) << 2
        if offset == _CSR:
            return self._csr | (2 if self._csr & 1 else 0) | self._cause_flags
        return super().read(offset)

    def write(self, offset: int, value: int) -> None:
        if offset == _CR:
            self._write_control(value)
        elif offset == _CFGR:
            self._switch(value)
        elif offset == _CSR:
            self._csr = value & 1
            if value & 1 << 24:
                self._cause_flags = 0
        else:
            if offset == _PLLCFGR and self._control & _PLL_ON:
                raise EmulationError("the PLL was set while it runs")
            super().write(offset, value)
            for bus, reset in _RESETS.items():
                if offset == reset and bus in _ENABLES:
                    for peripheral in self.machine._peripherals.values():
                        gate = _GATES.get(peripheral.name)
                        if gate and gate[0] == bus and value >> gate[1] & 1:
                            peripheral.reset()

    def _write_control(self, value: int) -> None:
        now = self.machine.now
        before, self._control = self._control, value & (0x00FD_00F9 | _PLL_ON) | _HSI_READY
        if value & _HSE_ON and not before & _HSE_ON and self.crystal_swings:
            self._hse_since = now
        elif not value & _HSE_ON:
            self._hse_since = None
        if value & _PLL_ON and not before & _PLL_ON:
            if self.registers[_PLLCFGR] >> 22 & 1 and not self._ready(_HSE_READY):
                raise EmulationError("the PLL was started on a crystal that does not swing yet")
            self._pll_hz()
            self._pll_since = now
        elif not value & _PLL_ON:
            self._pll_since = None

    def _switch(self, value: int) -> None:
        wanted = value & 3
        if wanted == 1 and not self._ready(_HSE_READY):
            raise EmulationError("switched to a crystal that does not swing yet")
        if wanted == 2 and not self._ready(_PLL_READY):
            raise EmulationError("switched to a PLL that has not locked yet")
        self.registers[_CFGR] = value
        self.system_hz = (16_000_000, HSE_HZ, self._pll_hz() if wanted == 2 else 0)[wanted]
        self._apply()
        self.machine.flash.check()
