"""System control space: NVIC, system control block, SysTick, cycle counter (PM0214, section 4)."""

from __future__ import annotations

from emulator.clock import FLASH
from emulator.cortex import (
    BUS_FAULT,
    FIRST_INTERRUPT,
    MEMORY_FAULT,
    PEND_SUPERVISOR,
    SYSTICK,
    USAGE_FAULT,
    EmulationError,
)

_CSR, _RVR, _CVR = 0xE010, 0xE014, 0xE018
_ICSR, _VTOR, _AIRCR, _SCR, _CCR, _SHPR, _SHCSR = (
    0xED04,
    0xED08,
    0xED0C,
    0xED10,
    0xED14,
    0xED18,
    0xED24,
)
_CFSR, _HFSR, _CPACR, _FPCCR = 0xED28, 0xED2C, 0xED88, 0xEF34
_DEMCR, _DWT_CTRL, _CYCCNT = 0xEDFC, 0x1000, 0x1004
_FAULT_BITS = {16: MEMORY_FAULT, 17: BUS_FAULT, 18: USAGE_FAULT}
_PLAIN = {
    _SCR: 0,
    _CCR: 0x200,
    _HFSR: 0,
    0xED30: 0,
    0xED34: 0,
    0xED38: 0,
    0xED3C: 0,
    _CPACR: 0,
    _FPCCR: 0xC000_0000,
    0xEF38: 0,
    0xEF3C: 0,
    0xE008: 0,
    _DEMCR: 0,
    _DWT_CTRL: 0x4000_0000,
    0xED94: 0,
    0xED98: 0,
    0xED9C: 0,
    0xEDA0: 0,
}


class System:
    """Registers that the core itself answers at 0xE0000000."""

    def __init__(self, machine, name: str) -> None:
        self.machine = machine
        self.name = name
        self._event = None
        self.reset()

    def reset(self) -> None:
        if self._event is not None:
            self._event.cancel()
        self.registers = dict(_PLAIN)
        self.machine.clock.fpu = 0
        self._control, self._reload = 0, 0
        self._zero = self.machine.now
        self._flag = False
        self._event = None
        self._counted_from = self.machine.now

    # SysTick counts down to zero at `_zero` and reloads in the cycle after.

    def _tick(self) -> int:
        return self.machine.clock.unit * (1 if self._control & 4 else 8)

    def _period(self) -> int:
        return (self._reload + 1) * self._tick()

    def _settle(self) -> None:
        if not self._control & 1 or self._reload == 0:
            return
        behind = self.machine.now - self._zero
        if behind >= 0:
            self._flag = True
            self._zero += (behind // self._period() + 1) * self._period()

    def _plan(self) -> None:
        if self._event is not None:
            self._event.cancel()
            self._event = None
        if self._control & 3 == 3 and self._reload:
            self._event = self.machine.at(self._zero, self._fire)

    def _fire(self) -> None:
        self._event = None
        self.machine.cpu.pend(SYSTICK)
        self._settle()
        self._plan()

    def _current(self) -> int:
        self._settle()
        if not self._control & 1:
            return 0
        return min(max(0, -(-(self._zero - self.machine.now) // self._tick())), self._reload)

    def read(self, offset: int) -> int:  # noqa: PLR0911, PLR0912
        cpu = self.machine.cpu
        if offset == _CSR:
            self._settle()
            value = self._control | (1 << 16 if self._flag else 0)
            self._flag = False
            return value
        if offset == _RVR:
            return self._reload
        if offset == _CVR:
            return self._current()
        if offset == _CYCCNT:
            if not self.registers[_DEMCR] >> 24 & 1:
                return 0
            return (self.machine.now - self._counted_from) // self.machine.clock.unit & 0xFFFF_FFFF
        if offset == _ICSR:
            active = cpu.active[-1].exception if cpu.active else 0
            pending = SYSTICK in cpu.latched, PEND_SUPERVISOR in cpu.latched
            return active | pending[0] << 26 | pending[1] << 28
        if offset == _VTOR:
            return cpu.vectors
        if offset == _CFSR:
            return cpu.fault_status
        if offset == _AIRCR:
            return 0xFA05_0000 | cpu.group << 8
        if offset == _SHCSR:
            return sum(
                1 << bit for bit, fault in _FAULT_BITS.items() if fault in cpu.handled_faults
            )
        if _SHPR <= offset < _SHPR + 12:
            return self._priorities(offset - _SHPR + 4)
        if 0xE400 <= offset < 0xE500:
            return self._priorities(offset - 0xE400 + FIRST_INTERRUPT)
        for base, members in ((0xE100, cpu.enabled), (0xE180, cpu.enabled)):
            if base <= offset < base + 32:
                return self._bits(members, offset - base)
        for base in (0xE200, 0xE280):
            if base <= offset < base + 32:
                return self._bits(cpu.latched | cpu.levels, offset - base)
        if 0xE300 <= offset < 0xE320:
            return self._bits({run.exception for run in cpu.active}, offset - 0xE300)
        if offset == 0xED00:
            return 0x410F_C241
        if offset == 0x4_2000:
            return 0x1000_6423
        if offset not in self.registers:
            raise EmulationError(f"no model of reading the system register {offset:#x}")
        return self.registers[offset]

    def _priorities(self, first: int) -> int:
        priorities = self.machine.cpu.priorities
        return sum((priorities.get(first + i, 0) & 0xFF) << 8 * i for i in range(4))

    @staticmethod
    def _bits(members: set[int], offset: int) -> int:
        first = FIRST_INTERRUPT + 8 * offset
        return sum(1 << i for i in range(32) if first + i in members)

    def write_part(self, offset: int, size: int, value: int) -> None:
        priorities = 0xE400 <= offset < 0xE500 or _SHPR <= offset < _SHPR + 12
        if priorities:
            first = offset - 0xE400 + FIRST_INTERRUPT
            if offset < 0xE000 + 0x100 or offset >= 0xED00:
                first = offset - _SHPR + 4
            for index in range(size):
                # Four bits of priority are implemented.
                self.machine.cpu.priorities[first + index] = value >> 8 * index & 0xF0
            self.machine._look()
        elif size != 4:
            raise EmulationError(f"{size} bytes written to the system register {offset:#x}")
        else:
            self._write(offset, value)

    def _write(self, offset: int, value: int) -> None:  # noqa: PLR0912
        cpu = self.machine.cpu
        if offset == _CSR:
            started = value & 1 and not self._control & 1
            self._settle()
            self._control = value & 7
            if started:
                self._zero = self.machine.now + self._period()
            self._plan()
        elif offset == _RVR:
            self._settle()
            self._reload = value & 0xFF_FFFF
        elif offset == _CVR:
            self._zero = self.machine.now + self._period()
            self._flag = False
            self._plan()
        elif offset == _CYCCNT:
            self._counted_from = self.machine.now - value * self.machine.clock.unit
        elif offset == _ICSR:
            self._pend(value)
        elif offset == _VTOR:
            cpu.vectors = value & ~0x7F
            if not FLASH <= cpu.vectors < FLASH + 0x4_0000 and not cpu.vectors >= 0x2000_0000:
                raise EmulationError(f"vector table at {value:#x}")
        elif offset == _AIRCR:
            self._control_reset(value)
        elif offset == _SHCSR:
            cpu.handled_faults = {fault for bit, fault in _FAULT_BITS.items() if value >> bit & 1}
            cpu.enabled |= cpu.handled_faults
        elif offset == _FPCCR:
            cpu.stacks_floats = bool(value >> 31)
            self.registers[offset] = value
        elif offset == _CFSR:
            cpu.fault_status &= ~value
        elif offset == _HFSR:
            self.registers[offset] &= ~value
        elif offset == 0xEF00:
            cpu.pend(FIRST_INTERRUPT + (value & 0x1FF))
        elif 0xE100 <= offset < 0xE2A0:
            self._nvic(offset, value)
        elif offset in self.registers:
            self.registers[offset] = value
            if offset == _CPACR:
                self.machine.clock.fpu = int(value >> 20 & 15 == 15)
        else:
            raise EmulationError(f"no model of writing {value:#x} to system register {offset:#x}")

    def _pend(self, value: int) -> None:
        cpu = self.machine.cpu
        for set_bit, clear_bit, exception in ((26, 25, SYSTICK), (28, 27, PEND_SUPERVISOR)):
            if value >> set_bit & 1:
                cpu.pend(exception)
            if value >> clear_bit & 1:
                cpu.unpend(exception)
        if value >> 31:
            cpu.pend(2)

    def _control_reset(self, value: int) -> None:
        if value >> 16 != 0x5FA:
            return
        self.machine.cpu.group = value >> 8 & 7
        if value & 4:
            self.machine.request_reset("software")

    def _nvic(self, offset: int, value: int) -> None:
        cpu = self.machine.cpu
        block, word = (offset - 0xE100) // 0x80, offset & 0x7F
        chosen = {FIRST_INTERRUPT + 8 * word + i for i in range(32) if value >> i & 1}
        if block == 0:
            cpu.enabled |= chosen
            self.machine._look()
        elif block == 1:
            cpu.enabled -= chosen
        else:
            for exception in chosen:
                (cpu.pend if block == 2 else cpu.unpend)(exception)
