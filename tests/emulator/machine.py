"""The controller: core, buses and peripherals in one virtual time."""

from __future__ import annotations

import heapq
import random
import struct
from collections.abc import Callable, Generator
from pathlib import Path

from emulator.adc import Adc
from emulator.clock import FLASH, RAM, RAM_SIZE, SECOND
from emulator.cortex import ROM, ROM_ENTRY, ROM_STACK, Cpu, EmulationError
from emulator.crc import Crc
from emulator.elf import Image
from emulator.flash import Flash
from emulator.gpio import Gpio
from emulator.i2c import I2c
from emulator.iwdg import Iwdg
from emulator.peripheral import Peripheral
from emulator.power import Backup, Power
from emulator.rcc import Rcc
from emulator.spi import Spi
from emulator.syscfg import Syscfg
from emulator.system import System
from emulator.timer import Timer

POWER, PIN, SOFTWARE, WATCHDOG = "power", "pin", "software", "watchdog"
"""Causes of a reset."""

_UNIQUE_ID = 0x1FFF_7A10


class Event:
    """An event at a time; may be cancelled."""

    __slots__ = ("action", "order", "when")

    def __init__(self, when: int, order: int, action: Callable[[], None] | None) -> None:
        self.when, self.order, self.action = when, order, action

    def __lt__(self, other: Event) -> bool:
        return (self.when, self.order) < (other.when, other.order)

    def cancel(self) -> None:
        self.action = None


class Signal:
    """A signal that a process may wait for, with a limit of time."""

    def __init__(self) -> None:
        self.waiter: Callable[[], None] | None = None

    def fire(self) -> None:
        waiter, self.waiter = self.waiter, None
        if waiter is not None:
            waiter()


class Machine:
    """An STM32F401RC running one image.

    Args:
        path: The ELF file.
        seed: Of everything that differs from board to board and from start to start.
        lsi: Frequency of the slow oscillator, which feeds the watchdog [Hz].
    """

    def __init__(self, path: Path, *, seed: int = 1, lsi: float = 32_000.0) -> None:
        self.image = Image(path)
        self.random = random.Random(seed)
        self.lsi = lsi
        self.cpu = Cpu(self._look)
        self.clock = self.cpu.clock
        self.violations: list[str] = []
        """Violations of the manual that the hardware would not report."""
        self.resets: list[tuple[int, str]] = []
        self.on_reset: list[Callable[[str], None]] = []
        self._events: list[Event] = []
        self._order = 0
        self._reset_wanted: str | None = None
        unique = self.random.randbytes(12)
        self.set_memory_at_power_up(self.random.randbytes(RAM_SIZE))

        self.rcc = Rcc(self)
        self.gpio = {letter: Gpio(self, letter) for letter in "ABCDEH"}
        self.timers = {
            name: Timer(self, name, irq, apb)
            for name, irq, apb in (
                ("TIM2", 28, 1),
                ("TIM3", 29, 1),
                ("TIM4", 30, 1),
                ("TIM5", 50, 1),
                ("TIM9", 24, 2),
                ("TIM10", 25, 2),
                ("TIM11", 26, 2),
            )
        }
        self.i2c = I2c(self, "I2C1", event=31, error=32)
        self.spi2 = Spi(self, "SPI2", irq=36)
        self.spi3 = Spi(self, "SPI3", irq=51)
        self.iwdg = Iwdg(self, "IWDG")
        self.power = Power(self, "PWR")
        self.backup = Backup(self, "RTC")
        self.adc = Adc(self, "ADC1")
        self.flash = Flash(self, "FLASH")
        self.syscfg = Syscfg(self, "SYSCFG")
        self._peripherals: dict[int, Peripheral] = {
            0x0000: self.timers["TIM2"],
            0x0400: self.timers["TIM3"],
            0x0800: self.timers["TIM4"],
            0x0C00: self.timers["TIM5"],
            0x2800: self.backup,
            0x3000: self.iwdg,
            0x3800: self.spi2,
            0x3C00: self.spi3,
            0x5400: self.i2c,
            0x7000: self.power,
            0x12000: self.adc,
            0x13800: self.syscfg,
            0x14000: self.timers["TIM9"],
            0x14400: self.timers["TIM10"],
            0x14800: self.timers["TIM11"],
            0x20000: self.gpio["A"],
            0x20400: self.gpio["B"],
            0x20800: self.gpio["C"],
            0x20C00: self.gpio["D"],
            0x21000: self.gpio["E"],
            0x21C00: self.gpio["H"],
            0x23000: Crc(self, "CRC"),
            0x23800: self.rcc,
            0x23C00: self.flash,
        }
        self.system = System(self, "SCS")
        engine = self.cpu.engine
        engine.mmio_map(0x4000_0000, 0x30000, self._read, None, self._write, None)
        engine.mmio_map(0xE000_0000, 0x100000, self._read_system, None, self._write_system, None)
        engine.mem_map(ROM, 0x10000)
        engine.mem_write(ROM, struct.pack("<II", ROM_STACK, ROM_ENTRY | 1))
        self.set_unique_id(unique)
        engine.mem_write(0x1FFF_7A22, (256).to_bytes(2, "little"))
        for address, data in self.image.segments:
            self.cpu.load(address, data)
        self.power_up()

    # Access of the core to the peripherals.

    def _find(self, offset: int) -> Peripheral:
        peripheral = self._peripherals.get(offset & ~0x3FF)
        if peripheral is None:
            raise EmulationError(
                f"no peripheral is modelled at {0x4000_0000 + offset:#x} (pc {self.cpu.pc:#x})"
            )
        return peripheral

    def _read(self, _: object, offset: int, size: int, __: object) -> int:
        # Bridges to the slower buses: two cycles of the bus to get there.
        self.cpu.spend(1 if offset >= 0x20000 else 2 if offset >= 0x10000 else 4)
        peripheral = self._find(offset)
        if not self.rcc.has_clock(peripheral.name):
            self.violations.append(f"{peripheral.name} was read without its clock")
            return 0
        word = peripheral.read(offset & 0x3FC)
        return word >> 8 * (offset & 3) & (1 << 8 * size) - 1

    def _write(self, _: object, offset: int, size: int, value: int, __: object) -> None:
        self.cpu.spend(1 if offset >= 0x20000 else 2 if offset >= 0x10000 else 4)
        peripheral = self._find(offset)
        if not self.rcc.has_clock(peripheral.name):
            self.violations.append(f"{peripheral.name} was written without its clock")
            return
        if size != 4 and offset & 0x3FF not in peripheral.half:
            raise EmulationError(
                f"{size} bytes written to {peripheral.name} + {offset & 0x3FF:#x}: no model"
            )
        peripheral.write(offset & 0x3FC, value << 8 * (offset & 3))

    def _read_system(self, _: object, offset: int, size: int, __: object) -> int:
        word = self.system.read(offset & ~3)
        return word >> 8 * (offset & 3) & (1 << 8 * size) - 1

    def _write_system(self, _: object, offset: int, size: int, value: int, __: object) -> None:
        self.system.write_part(offset, size, value)

    # Time.

    @property
    def now(self) -> int:
        return int(self.clock.now)

    @property
    def seconds(self) -> float:
        return self.clock.now / SECOND

    def at(self, when: int, action: Callable[[], None]) -> Event:
        self._order += 1
        event = Event(when, self._order, action)
        heapq.heappush(self._events, event)
        self.clock.deadline = min(self.clock.deadline, when)
        return event

    def after(self, seconds: float, action: Callable[[], None]) -> Event:
        return self.at(self.now + round(seconds * SECOND), action)

    def spawn(self, process: Generator[int | tuple[Signal, int], None, None]) -> None:
        """Run a process that yields the durations it waits for, or a signal and the limit."""

        def step() -> None:
            pause = next(process, None)
            if isinstance(pause, int):
                self.at(self.now + pause, step)
            elif pause is not None:
                signal, limit = pause
                timeout = self.at(self.now + limit, step)

                def resume() -> None:
                    timeout.cancel()
                    self.at(self.now, step)

                signal.waiter = resume

        step()

    def _look(self) -> None:
        """Stop the core before its next instruction, to check its interrupts."""
        self.clock.deadline = 0

    def skip_to(self, when: int) -> None:
        """The core polls: nothing changes until then, or until the next event."""
        self.clock.now = max(self.clock.now, min(when, self.clock.deadline))

    def run(self, seconds: float, until: Callable[[], bool] | None = None) -> bool:
        """Run for a time, or until something holds after an event; true where it held."""
        end = self.now + round(seconds * SECOND)
        clock, cpu, events = self.clock, self.cpu, self._events
        while True:
            while events and events[0].when <= clock.now:
                action = heapq.heappop(events).action
                if action is not None:
                    action()
            if self._reset_wanted is not None:
                self._reset(self._reset_wanted)
                continue
            if until is not None and until():
                return True
            if clock.now >= end:
                return False
            cpu.take()
            deadline = min(end, events[0].when) if events else end
            if cpu.sleeping or cpu.locked_up or cpu.in_bootloader:
                clock.now = max(clock.now, deadline)
                continue
            clock.deadline = deadline
            cpu.execute()

    # Resets.

    def request_reset(self, cause: str) -> None:
        """Reset before the next instruction."""
        self._reset_wanted = cause
        self._look()

    def jump_to_image(self) -> None:
        """Start the new image as the bootloader does: without a reset, its peripherals left on."""
        cpu = self.cpu
        cpu.in_bootloader = False
        cpu.flush()
        cpu.stack, cpu.pc = cpu.word(FLASH), cpu.word(FLASH + 4) & ~1

    def set_unique_id(self, unique: bytes) -> None:
        """Set the 12 bytes that no other controller has."""
        self.cpu.engine.mem_write(_UNIQUE_ID, unique)

    def set_memory_at_power_up(self, content: bytes) -> None:
        """Set the values that the memory's cells take at power-up."""
        self._favourite = content

    def power_up(self, *, forgets: float = 1.0, noise: float = 0.02) -> None:
        """The supply comes back.

        Args:
            forgets: Share of the memory's bytes that have lost their value.
            noise: Share of those that come up differently from time to time; the others have a
                value of their own on each board.
        """
        memory = bytearray(self.cpu.peek(RAM, RAM_SIZE))
        if forgets >= 1.0:
            memory = bytearray(self._favourite)
        else:
            for index in self.random.sample(range(RAM_SIZE), round(forgets * RAM_SIZE)):
                memory[index] = self._favourite[index]
        for bit in self.random.sample(range(RAM_SIZE * 8), round(noise * forgets * RAM_SIZE * 8)):
            memory[bit // 8] ^= 1 << bit % 8
        self.cpu.load(RAM, bytes(memory))
        self.backup.lose_power()
        self._reset(POWER)

    def _reset(self, cause: str) -> None:
        self._reset_wanted = None
        self.resets.append((self.now, cause))
        self.rcc.note_reset(cause)
        for peripheral in self._peripherals.values():
            peripheral.reset()
        self.system.reset()
        for listener in self.on_reset:
            listener(cause)
        self.cpu.flush()
        self.cpu.reset()

    # Symbols and sizes of the linked firmware.

    def symbol(self, name: str) -> int:
        if name not in self.image.symbols:
            raise EmulationError(f"{self.image.path.name} has no symbol {name}")
        return self.image.symbols[name]

    @property
    def flash_size(self) -> int:
        return max(address + len(data) - FLASH for address, data in self.image.segments)
