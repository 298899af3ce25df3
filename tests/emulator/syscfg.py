"""System configuration (RM0368, section 7): the memory mapped to address 0."""

from __future__ import annotations

from typing import ClassVar

from emulator.peripheral import Peripheral

_MEMRMP = 0x00


class Syscfg(Peripheral):
    """MEMRMP; the mapping to address 0 is queried, not modelled."""

    plain: ClassVar[dict[int, int]] = {_MEMRMP: 0}

    @property
    def maps_system_memory(self) -> bool:
        return self.registers[_MEMRMP] & 3 == 1
