"""The core: unicorn's instructions, with the exceptions of the Cortex-M4 around them.

Exception entry and return, priorities, nesting and masking follow PM0214; entry takes 12 cycles,
return 10, and the floating-point registers are stacked as FPCCR says (the 18 cycles of lazy
stacking when the handler first uses the unit). Tail-chaining is not modelled, which is slower than
the silicon. Code runs privileged on the main stack. The bootloader in ROM is its entry alone: the
core that jumps there stays there until a reset.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import unicorn as u
from unicorn import arm_const as arm
from unicorn.unicorn_py3.unicorn import uclib

from emulator.clock import (
    DEADLINE,
    FLASH,
    FLASH_SIZE,
    LOST,
    NO_COPROCESSOR,
    RAM,
    RAM_SIZE,
    RUNNING,
    SLEEP,
    UNMASKED,
    Clock,
    library,
)

HARD_FAULT, MEMORY_FAULT, BUS_FAULT, USAGE_FAULT = 3, 4, 5, 6
FETCH_ERROR, ACCESS_ERROR, STACKING_ERROR = 1 << 8, 1 << 9, 1 << 12
NO_INSTRUCTION, NO_STATE, NO_UNIT = 1 << 16, 1 << 17, 1 << 19
"""Bits of the fault status, CFSR."""
SUPERVISOR_CALL, PEND_SUPERVISOR, SYSTICK = 11, 14, 15
FIRST_INTERRUPT = 16

ROM, ROM_STACK, ROM_ENTRY = 0x1FFF_0000, 0x2000_2D40, 0x1FFF_3DB4
"""System memory; the first two words there are stack pointer and entry of its bootloader."""

_ENTRY_CYCLES, _RETURN_CYCLES = 12, 10
_STACKED = (
    arm.UC_ARM_REG_R0,
    arm.UC_ARM_REG_R1,
    arm.UC_ARM_REG_R2,
    arm.UC_ARM_REG_R3,
    arm.UC_ARM_REG_R12,
    arm.UC_ARM_REG_LR,
    arm.UC_ARM_REG_PC,
    arm.UC_ARM_REG_XPSR,
)
_FLOATS = tuple(arm.UC_ARM_REG_S0 + index for index in range(16))
_EXCEPTION_EXIT = 8
_THUMB = 1 << 24
_ICI_AND_IT = 0x0600_FC00


class EmulationError(Exception):
    """The firmware did something that the hardware forbids, or that no model covers."""


@dataclass
class Run:
    """One handler, from the cycle in which the exception was pending to its return."""

    exception: int
    pending: int
    start: int
    end: int = 0
    nested: int = 0

    @property
    def own(self) -> int:
        """Time in this handler, without those that interrupted it."""
        return self.end - self.start - self.nested


class Cpu:
    """Core, NVIC, system control block and SysTick."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self._memory = [ctypes.create_string_buffer(size + 4096) for size in (FLASH_SIZE, RAM_SIZE)]
        addresses = [(ctypes.addressof(buffer) + 4095) & ~4095 for buffer in self._memory]
        self._flash, self._ram = addresses
        self.engine = u.Uc(u.UC_ARCH_ARM, u.UC_MODE_THUMB | u.UC_MODE_MCLASS)
        self.engine.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M4)
        readable = u.UC_PROT_READ | u.UC_PROT_EXEC
        for base in (FLASH, 0):
            self.engine.mem_map_ptr(base, FLASH_SIZE, readable, self._flash)
        self.engine.mem_map_ptr(RAM, RAM_SIZE, u.UC_PROT_ALL, self._ram)
        self.engine.mem_map(0xFFFF_F000, 0x1000, readable)
        self.clock = Clock()
        self.clock.stop = ctypes.cast(uclib.uc_emu_stop, ctypes.c_void_p).value
        self.clock.flash, self.clock.ram = addresses
        hook = ctypes.c_size_t()
        status = uclib.uc_hook_add(
            self.engine._uch,
            ctypes.byref(hook),
            u.UC_HOOK_CODE,
            ctypes.cast(library().clock_instruction, ctypes.c_void_p),
            ctypes.cast(ctypes.byref(self.clock), ctypes.c_void_p),
            ctypes.c_uint64(1),
            ctypes.c_uint64(0),
        )
        if status != u.UC_ERR_OK:
            raise u.UcError(status)
        self.engine.hook_add(u.UC_HOOK_INTR, self._interrupted)
        self._wake = wake
        self.runs: list[Run] = []
        """Handlers that ran since this list was last emptied."""
        self._reset_state()

    def _reset_state(self) -> None:
        self.enabled: set[int] = {HARD_FAULT, 2, SUPERVISOR_CALL, PEND_SUPERVISOR, SYSTICK}
        self.latched: set[int] = set()
        self.levels: set[int] = set()
        self.priorities: dict[int, int] = {2: -2, HARD_FAULT: -1}
        self.since: dict[int, int] = {}
        self.active: list[Run] = []
        self.sleeping = False
        self.locked_up = False
        self.in_bootloader = False
        self.group = 0
        self.stacks_floats = True
        self.vectors = 0
        self.handled_faults: set[int] = set()
        self.fault_status = 0
        self._trap: int | None = None
        self._event = False

    # Memory, as a debugger sees it.

    def load(self, address: int, data: bytes) -> None:
        base = self._flash - FLASH if address >= FLASH and address < RAM else self._ram - RAM
        ctypes.memmove(base + address, data, len(data))

    def peek(self, address: int, size: int) -> bytes:
        base = self._flash - FLASH if FLASH <= address < RAM else self._ram - RAM
        return ctypes.string_at(base + address, size)

    def word(self, address: int) -> int:
        return int.from_bytes(self.peek(address, 4), "little")

    @property
    def stack(self) -> int:
        return int(self.engine.reg_read(arm.UC_ARM_REG_SP))

    @stack.setter
    def stack(self, address: int) -> None:
        self.engine.reg_write(arm.UC_ARM_REG_SP, address)

    def flush(self) -> None:
        """Forget translated code after the flash has changed."""
        self.engine.ctl_flush_tb()

    # Reset and execution.

    def reset(self) -> None:
        self._reset_state()
        library().clock_reset(ctypes.byref(self.clock))
        stack, entry = struct.unpack("<II", self.peek(FLASH, 8))
        for register in (*_STACKED, *_FLOATS):
            self.engine.reg_write(register, 0)
        self.engine.reg_write(arm.UC_ARM_REG_XPSR, _THUMB)
        for register in (
            arm.UC_ARM_REG_PRIMASK,
            arm.UC_ARM_REG_BASEPRI,
            arm.UC_ARM_REG_FAULTMASK,
            arm.UC_ARM_REG_CONTROL,
            arm.UC_ARM_REG_FPSCR,
        ):
            self.engine.reg_write(register, 0)
        self.engine.reg_write(arm.UC_ARM_REG_SP, stack)
        self.engine.reg_write(arm.UC_ARM_REG_LR, 0xFFFF_FFFF)
        self.pc = entry & ~1

    def spend(self, cycles: int) -> None:
        self.clock.now += cycles * self.clock.unit

    def execute(self) -> None:
        """Run until the deadline, until it sleeps, or until an exception has to be evaluated."""
        clock = self.clock
        clock.why = RUNNING
        self._trap = None
        fault = None
        try:
            self.engine.emu_start(self.pc | 1, 0xFFFF_FFFE)
        except u.UcError as error:
            fault = error
        self.pc = self.engine.reg_read(arm.UC_ARM_REG_PC) & ~1
        if self._trap == _EXCEPTION_EXIT or self.pc >= 0xFFFF_FF00:
            self._leave(self.pc | 1)
        elif self._trap == 2:
            self.pend(SUPERVISOR_CALL)
        elif self._trap is not None:
            self._fault(
                {1: NO_INSTRUCTION, 17: NO_UNIT, 18: NO_STATE}.get(self._trap, ACCESS_ERROR)
            )
        elif clock.why == LOST and self.pc == ROM_ENTRY:
            self.in_bootloader = True
        elif fault is not None or clock.why == LOST:
            errors = {u.UC_ERR_INSN_INVALID: NO_INSTRUCTION, u.UC_ERR_FETCH_UNMAPPED: FETCH_ERROR}
            self._fault(FETCH_ERROR if fault is None else errors.get(fault.errno, ACCESS_ERROR))
        elif clock.why == NO_COPROCESSOR:
            self._fault(NO_UNIT)
        elif clock.why == SLEEP:
            self._sleep()
        elif clock.why not in {DEADLINE, UNMASKED}:
            raise EmulationError(f"the core stopped at {self.pc:#x} for no known reason")

    def _interrupted(self, engine: Any, number: int, _: object) -> None:
        self._trap = number
        engine.emu_stop()

    def _sleep(self) -> None:
        opcode = int.from_bytes(self.peek(self.pc, 2), "little")
        self.pc += 2
        self.clock.after = self.pc
        self.spend(1)
        if opcode == 0xBF20 and self._event:
            self._event = False
            return
        self.sleeping = True

    # Exceptions.

    def level(self, exception: int, high: bool) -> None:
        """Set the level of an interrupt line."""
        if high == (exception in self.levels):
            return
        if high:
            self.levels.add(exception)
            self.since.setdefault(exception, self.clock.now)
            if exception in self.enabled:
                self._wake()
        else:
            self.levels.discard(exception)
            if exception not in self.latched:
                self.since.pop(exception, None)

    def pend(self, exception: int) -> None:
        self.latched.add(exception)
        self.since.setdefault(exception, self.clock.now)
        self._wake()

    def unpend(self, exception: int) -> None:
        self.latched.discard(exception)
        if exception not in self.levels:
            self.since.pop(exception, None)

    def _preemption(self, exception: int) -> int:
        priority = self.priorities.get(exception, 0)
        return priority if priority < 0 else priority >> (self.group + 1)

    def _next(self) -> int | None:
        waiting = (self.latched | self.levels) & self.enabled
        waiting.difference_update(run.exception for run in self.active)
        if not waiting:
            return None
        return min(waiting, key=lambda number: (self.priorities.get(number, 0), number))

    def _running_priority(self, *, primask: bool = True) -> int:
        running = min((self._preemption(run.exception) for run in self.active), default=1 << 8)
        if self.engine.reg_read(arm.UC_ARM_REG_FAULTMASK) & 1:
            return -1
        if primask and self.engine.reg_read(arm.UC_ARM_REG_PRIMASK) & 1:
            return min(running, 0)
        basepri = self.engine.reg_read(arm.UC_ARM_REG_BASEPRI) & 0xFF
        return min(running, basepri >> (self.group + 1)) if basepri else running

    def take(self) -> None:
        """Enter the handler of a pending exception unless one as urgent runs or masks it."""
        exception = self._next()
        self.clock.masked = exception is not None
        if exception is None:
            return
        priority = self._preemption(exception)
        if self.sleeping and priority < self._running_priority(primask=False):
            self.sleeping = False
        if priority < self._running_priority():
            self.sleeping = False
            self.enter(exception)

    def enter(self, exception: int) -> None:
        """Stack the frame of the architecture and start the handler."""
        engine = self.engine
        run = Run(exception, self.since.pop(exception, self.clock.now), self.clock.now)
        self.latched.discard(exception)
        stack = engine.reg_read(arm.UC_ARM_REG_SP)
        words = [value & 0xFFFF_FFFF for value in engine.reg_read_batch(_STACKED)]
        words[6] = self.pc
        xpsr = words[7] & ~_ICI_AND_IT & ~0x1FF | _THUMB
        xpsr |= self.active[-1].exception if self.active else 0
        floats = self.stacks_floats and bool(self.clock.fpca)
        size = 26 * 4 if floats else 8 * 4
        aligned = (stack - size) & ~7
        if aligned != stack - size:
            xpsr |= 1 << 9
        words[7] = xpsr
        if floats:
            words += [value & 0xFFFF_FFFF for value in engine.reg_read_batch(_FLOATS)]
            words += [engine.reg_read(arm.UC_ARM_REG_FPSCR) & 0xFFFF_FFFF, 0]
        if RAM <= aligned <= RAM + RAM_SIZE - size:
            self.load(aligned, struct.pack(f"<{len(words)}I", *words))
        elif exception != HARD_FAULT:
            # Stacking failed: the fault that this is runs in its place, and nothing was stacked.
            exception = run.exception = HARD_FAULT
            self.fault_status |= STACKING_ERROR
        engine.reg_write(arm.UC_ARM_REG_SP, aligned)
        link = 0xFFFF_FFE1 if self.active else 0xFFFF_FFE9
        engine.reg_write(arm.UC_ARM_REG_LR, link if floats else link | 0x10)
        self.clock.fpca, self.clock.lazy = 0, int(floats)
        self.clock.look = self.clock.conditional = 0
        self.active.append(run)
        self.pc = self.word(self.vectors + 4 * exception if self.vectors else FLASH + 4 * exception)
        self.pc &= ~1
        engine.reg_write(arm.UC_ARM_REG_XPSR, _THUMB | exception)
        self.clock.after = 0
        self.spend(_ENTRY_CYCLES)

    def _leave(self, link: int) -> None:
        if not self.active:
            raise EmulationError(f"exception return to {link:#x} outside a handler")
        engine = self.engine
        stack = engine.reg_read(arm.UC_ARM_REG_SP)
        floats = not link & 0x10
        count = 26 if floats else 8
        words = struct.unpack(f"<{count}I", self.peek(stack, 4 * count))
        engine.reg_write_batch(tuple(zip(_STACKED[:6], words[:6], strict=True)))
        if floats:
            engine.reg_write_batch(tuple(zip(_FLOATS, words[8:24], strict=True)))
            engine.reg_write(arm.UC_ARM_REG_FPSCR, words[24])
        self.clock.fpca, self.clock.lazy = int(floats), 0
        stack += 4 * count + (4 if words[7] & 1 << 9 else 0)
        engine.reg_write(arm.UC_ARM_REG_SP, stack)
        engine.reg_write(arm.UC_ARM_REG_XPSR, words[7] & ~(1 << 9))
        self.pc = words[6] & ~1
        self.clock.after = 0
        self.spend(_RETURN_CYCLES)
        run = self.active.pop()
        run.end = self.clock.now
        self.runs.append(run)
        if run.exception in self.levels:
            self.since.setdefault(run.exception, self.clock.now)
        if self.active:
            self.active[-1].nested += run.end - run.start

    def _fault(self, status: int) -> None:
        self.fault_status |= status
        exception = USAGE_FAULT if status >> 16 else BUS_FAULT
        if any(run.exception in {2, HARD_FAULT} for run in self.active):
            self.locked_up = True
            return
        masked = self._preemption(exception) >= self._running_priority()
        if exception not in self.handled_faults or masked:
            exception = HARD_FAULT
        self.enter(exception)
