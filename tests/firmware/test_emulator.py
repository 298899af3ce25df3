"""The emulator itself: exceptions and time as in the manuals, since the firmware needs both."""

from __future__ import annotations

import shutil
import struct
import subprocess
from pathlib import Path

import pytest
from bioscara_firmware_sim import Plant

from emulator import i2c
from emulator.clock import SECOND
from emulator.cortex import EmulationError
from emulator.machine import Machine

HERE = Path(__file__).parents[1] / "emulator"
FLAGS = "-O1 -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -nostdlib -Wall -Wextra"
HSI = 16_000_000


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = shutil.which("arm-none-eabi-gcc")
    if compiler is None:
        pytest.skip("no arm-none-eabi-gcc: on Debian and Ubuntu, apt install gcc-arm-none-eabi")
    built = tmp_path_factory.mktemp("program") / "program.elf"
    command: list[str | Path] = [compiler, *FLAGS.split(), "-Werror", "-T", HERE / "program.ld"]
    subprocess.run([*command, HERE / "program.c", "-o", built], check=True)
    return built


def test_interrupts_nest_mask_wake_and_keep_every_register(program: Path) -> None:
    machine = Machine(program)
    result = machine.symbol("result")
    machine.run(0.05)
    words = struct.unpack("<16I", machine.cpu.peek(result, 64))
    assert words[0] == 1, words
    assert words[1] > 40
    assert words[5] == 1, "the floating-point registers were lost in an interrupt"
    assert words[6] == 2
    assert words[2] == words[3] == 7
    assert words[7:9] == (0, 7)
    assert words[9:11] == (0, 5040)
    assert words[11] == 1


def test_the_floating_point_unit_has_to_be_switched_on(program: Path) -> None:
    machine = Machine(program)
    machine.run(0.0001)
    assert machine.clock.fpu
    machine.clock.fpu = 0
    machine.run(0.01)
    assert machine.cpu.word(machine.symbol("result")) == 0xBAD


def test_systick_and_sleep_keep_the_time(program: Path) -> None:
    machine = Machine(program)
    machine.run(0.05)
    result = machine.symbol("result")
    before = machine.cpu.word(result + 4)
    machine.run(0.1)
    assert machine.cpu.word(result + 4) - before == pytest.approx(0.1 * HSI / 1000, abs=1)
    assert machine.clock.unit == SECOND // HSI


def test_a_run_repeats_exactly(program: Path) -> None:
    ends = set()
    for _ in range(2):
        machine = Machine(program)
        machine.run(0.03)
        ends.add((machine.now, machine.clock.instructions, machine.cpu.pc))
    assert len(ends) == 1


def test_what_is_not_modelled_is_named(program: Path) -> None:
    machine = Machine(program)
    with pytest.raises(EmulationError, match="SPI2"):
        machine.spi2.write(0x00, 1 << 15 | 1 << 6)
    with pytest.raises(EmulationError, match="I2C1"):
        machine.i2c.read(0x18 + 0x100)
    with pytest.raises(EmulationError, match="0x40004400"):
        machine._find(0x4400)
    machine.rcc.system_hz = 84_000_000
    with pytest.raises(EmulationError, match="wait states"):
        machine.flash.check()


def test_the_target_follows_the_manuals_order_of_flags(program: Path) -> None:
    """ADDR by SR1 then SR2, STOPF by SR1 then CR1, RXNE by DR, BTF by SR1 then DR."""
    target = _target(Machine(program))
    _clock(target, 0x28, start=True)
    assert target.read(0x14) & i2c.ADDR
    assert target.stretching
    target.read(0x18)
    assert not target.stretching
    _clock(target, 0x55)
    _clock(target, 0xAA)
    assert target.read(0x14) & (i2c.RXNE | i2c.BTF) == i2c.RXNE | i2c.BTF
    assert target.stretching
    assert [target.read(0x10), target.read(0x10)] == [0x55, 0xAA]
    assert not target.stretching
    target.stop()
    target.write(0x00, 0x401)
    assert target.read(0x14) & i2c.STOPF
    target.write(0x00, 0x401)
    assert not target.read(0x14) & i2c.STOPF


def test_the_target_holds_the_clock_until_it_has_something_to_send(program: Path) -> None:
    target = _target(Machine(program))
    _clock(target, 0x29, start=True)
    target.read(0x14)
    target.read(0x18)
    assert target.stretching
    target.write(0x10, 0x5A)
    assert not target.stretching
    assert target.read(0x14) & i2c.TXE
    assert _clock(target, None, acknowledge=True) == 0x5A
    assert target.read(0x14) & i2c.BTF
    assert target.stretching
    target.write(0x10, 0xA5)
    assert _clock(target, None, acknowledge=False) == 0xA5
    assert target.read(0x14) & i2c.AF
    assert not target.stretching


def test_a_start_inside_a_byte_is_an_error_and_begins_an_address(program: Path) -> None:
    target = _target(Machine(program))
    target.start()
    for level in (0, 1, 1):
        target.clock(level)
    _clock(target, 0x28, start=True)
    assert target.read(0x14) & (i2c.BERR | i2c.ADDR) == i2c.BERR | i2c.ADDR
    target.write(0x14, 0)
    assert not target.read(0x14) & i2c.BERR
    target.write(0x00, 1 << 15)
    assert not target.stretching


def test_both_halves_of_a_datagram_make_the_whole(program: Path) -> None:
    """The plant answers when the driver is selected and obeys when it is deselected."""
    plant = Plant(1, 1)
    assert plant.driver_answer()[0] & 1, "the chip says that it was reset"
    written = bytes((0, 0, 0x12, 0x34))
    # The next datagram returns the value of the last one, whether the register can be read or not.
    for register, readable in ((0x27, False), (0x2D, True)):
        plant.driver_accept(bytes((0x80 | register,)) + written)
        assert plant.driver_answer()[1:] == written
        plant.driver_accept(bytes((register, 0, 0, 0, 0)))
        assert plant.driver_answer()[1:] == (written if readable else bytes(4))
    with pytest.raises(ValueError, match="backwards"):
        plant.advance(-1.0)
    with pytest.raises(ValueError, match="5 bytes"):
        plant.driver_accept(b"1234")
    with pytest.raises(ValueError, match="1 to 4"):
        Plant(5, 1)


def _target(machine: Machine) -> i2c.I2c:
    target = machine.i2c
    target.write(0x04, 16)
    target.write(0x08, 1 << 14 | 0x14 << 1)
    target.write(0x00, 1)
    target.write(0x00, 0x401)
    return target


def _clock(
    target: i2c.I2c, byte: int | None, *, start: bool = False, acknowledge: bool = True
) -> int:
    """Nine clocks of a controller that writes a byte, or reads one."""
    if start:
        target.start()
    seen = 0
    for bit in range(8):
        level = target.sda if byte is None else target.sda & (byte >> 7 - bit & 1)
        seen = seen << 1 | level
        target.clock(level)
    answer = (0 if acknowledge else 1) if byte is None else 1
    target.clock(target.sda & answer)
    return seen
