"""Base of every peripheral: registers at an address, with a clock that may be off."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from emulator.cortex import EmulationError

if TYPE_CHECKING:
    from emulator.machine import Machine


class Peripheral:
    """Registers of 32 bits; a model reads and writes whole words.

    Attributes:
        registers: Written values, for registers that only hold their value.
        half: Offsets at which the manual allows narrower writes.
    """

    plain: ClassVar[dict[int, int]] = {}
    """Offsets of registers that only hold the written value, and their reset values."""
    half: frozenset[int] = frozenset()

    def __init__(self, machine: Machine, name: str) -> None:
        self.machine = machine
        self.name = name
        self.registers = dict(self.plain)

    def reset(self) -> None:
        self.registers = dict(self.plain)

    def read(self, offset: int) -> int:
        if offset not in self.registers:
            raise EmulationError(f"no model of reading {self.name} + {offset:#x}")
        return self.registers[offset]

    def write(self, offset: int, value: int) -> None:
        if offset not in self.registers:
            raise EmulationError(f"no model of writing {value:#x} to {self.name} + {offset:#x}")
        self.registers[offset] = value
