"""General-purpose input and output (RM0368, section 8)."""

from __future__ import annotations

from collections.abc import Callable

from emulator.peripheral import Peripheral

_MODER, _OTYPER, _PUPDR, _IDR, _ODR, _BSRR, _LCKR, _AFRL, _AFRH = (
    0x00,
    0x04,
    0x0C,
    0x10,
    0x14,
    0x18,
    0x1C,
    0x20,
    0x24,
)
_DEFAULTS = {
    "A": {_MODER: 0x0C00_0000, 0x08: 0x0C00_0000, _PUPDR: 0x6400_0000},
    "B": {_MODER: 0x0000_0280, 0x08: 0x0000_00C0, _PUPDR: 0x0000_0100},
}
INPUT, OUTPUT, ALTERNATE, ANALOGUE = range(4)


class Gpio(Peripheral):
    """One port."""

    half = frozenset({_BSRR, _BSRR + 2, _ODR})

    def __init__(self, machine, letter: str) -> None:
        self.letter = letter
        self.inputs: dict[int, Callable[[], int]] = {}
        """External driver of a pin."""
        self.watchers: dict[int, Callable[[int | None], None]] = {}
        """Called with the level of a pin when the port drives it anew; None when it lets go."""
        super().__init__(machine, f"GPIO{letter}")
        self.registers = self._defaults()
        self._driven: dict[int, int | None] = {}
        self._steady: int | None = None

    def _defaults(self) -> dict[int, int]:
        return dict.fromkeys(range(0, 0x28, 4), 0) | _DEFAULTS.get(self.letter, {})

    def reset(self) -> None:
        self.registers = self._defaults()
        self._notify()

    def _levels(self) -> int:
        """Levels of the pins that nothing outside drives."""
        pins = (pin for pin in range(16) if self.mode(pin) != ANALOGUE and pin not in self.inputs)
        return sum(self.level(pin) << pin for pin in pins)

    def mode(self, pin: int) -> int:
        return self.registers[_MODER] >> 2 * pin & 3

    def alternate(self, pin: int) -> int | None:
        """The alternate function of a pin that has one now."""
        if self.mode(pin) != ALTERNATE:
            return None
        return self.registers[_AFRL if pin < 8 else _AFRH] >> 4 * (pin % 8) & 15

    def open_drain(self, pin: int) -> bool:
        return bool(self.registers[_OTYPER] >> pin & 1)

    def driven(self, pin: int) -> int | None:
        """The level that the port itself gives a pin; None where it does not drive it."""
        if self.mode(pin) != OUTPUT:
            return None
        high = self.registers[_ODR] >> pin & 1
        return None if high and self.open_drain(pin) else high

    def level(self, pin: int) -> int:
        outside = self.inputs[pin]() if pin in self.inputs else None
        own = self.driven(pin)
        if own is not None and outside is not None:
            return own & outside
        if own is not None or outside is not None:
            return own if own is not None else outside
        return 1 if self.registers[_PUPDR] >> 2 * pin & 3 == 1 else 0

    def _notify(self) -> None:
        self._steady = None
        for pin, watcher in self.watchers.items():
            level = self.driven(pin)
            if level != self._driven.get(pin):
                self._driven[pin] = level
                watcher(level)

    def read(self, offset: int) -> int:
        if offset == _IDR:
            if self._steady is None:
                self._steady = self._levels()
            outside = sum(self.level(pin) << pin for pin in self.inputs)
            return self._steady | outside
        return 0 if offset == _BSRR else super().read(offset)

    def write(self, offset: int, value: int) -> None:
        if offset == _BSRR:
            output = self.registers[_ODR] & ~(value >> 16)
            self.registers[_ODR] = output | value & 0xFFFF
        elif offset == _IDR:
            return
        else:
            super().write(offset, value)
        self._notify()
