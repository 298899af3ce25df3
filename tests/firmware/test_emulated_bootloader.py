"""Entry of the flashed image into the bootloader in ROM, and return from it."""

from __future__ import annotations

import random

import pytest

from bioscara.protocol import Flags, Register, ResetCause
from emulator.board import Board
from emulator.clock import FLASH
from emulator.cortex import ROM_STACK
from emulator.gpio import OUTPUT

pytestmark = [pytest.mark.usefixtures("images"), pytest.mark.timeout(600)]

BLOCK = 2048
"""Block size of dfu-util [bytes]."""
LENGTH_AT = FLASH + 0x210
LIGHT = 4
"""The pin of port C that has the LED."""


@pytest.fixture
def board() -> Board:
    return Board(4, position=0.0)


def _restart(board: Board) -> bool:
    """Reset, and return whether the bootloader runs 20 ms later."""
    board.machine.cpu.flush()
    board.machine.request_reset("pin")
    board.run(0.02)
    return board.machine.cpu.in_bootloader


def _require_safe(board: Board) -> None:
    """Assert that it is in the bootloader, with its stack and memory, and an open power stage."""
    machine = board.machine
    assert machine.cpu.in_bootloader
    assert machine.cpu.stack == ROM_STACK
    assert machine.syscfg.maps_system_memory
    assert not machine.violations
    assert machine.gpio["A"].mode(1) == OUTPUT, "the enable pin is not driven"
    assert board.enables[-1][1] is False
    assert not board.plant.has_torque()
    assert machine.gpio["C"].driven(LIGHT) == 1


def test_a_flashing_that_breaks_off_after_any_block_leads_to_the_bootloader(board: Board) -> None:
    cpu, size = board.machine.cpu, board.machine.flash_size
    whole = cpu.peek(FLASH, size)
    for written in range(BLOCK, size, BLOCK):
        cpu.load(FLASH, whole[:written] + b"\xff" * (size - written))
        board.machine.power_up()
        assert _restart(board), f"not after {written} of {size} bytes"
        _require_safe(board)
    cpu.load(FLASH, whole)
    assert not _restart(board)
    board.boot()
    assert board.hello()[4] == 4


def test_a_flipped_bit_anywhere_behind_the_first_block_leads_to_the_bootloader(
    board: Board,
) -> None:
    cpu, chance = board.machine.cpu, random.Random(11)
    for at in (0, *(chance.randrange(board.machine.flash_size - BLOCK) for _ in range(20))):
        address = FLASH + BLOCK + at
        (byte,) = cpu.peek(address, 1)
        cpu.load(address, bytes((byte ^ 1 << chance.randrange(8),)))
        assert _restart(board), hex(address)
        cpu.load(address, bytes((byte,)))
    _require_safe(board)


@pytest.mark.parametrize("length", [0, 20, 0x401, 0x4_0004, 0x8000_0000, 0xFFFF_FFFF])
def test_a_length_that_no_image_has_leads_to_the_bootloader(board: Board, length: int) -> None:
    board.machine.cpu.load(LENGTH_AT, length.to_bytes(4, "little"))
    assert _restart(board)
    _require_safe(board)


def test_the_two_step_request_leads_to_the_bootloader_once(board: Board) -> None:
    board.ready()
    board.write(Register.DISABLECLOSEDLOOP)
    assert board.idle() & Flags.NOTENABLED
    board.run(0.1)
    number = board.hello()[5]
    begun = board.machine.seconds
    for register in (Register.DISARM, Register.BOOTLOADER):
        assert not Flags(board.write(register, number).flags) & Flags.REFUSED
    assert board.machine.run(0.1, until=lambda: board.machine.cpu.in_bootloader)
    # Its answer was read before.
    assert 0.01 < board.machine.seconds - begun < 0.05
    board.follow()
    _require_safe(board)
    # Another reset lets go of the enable pin: nothing flows even so.
    board.plant.enable(True)
    assert not board.plant.has_torque()
    # The request is used up.
    assert not _restart(board)
    board.boot()
    assert board.hello()[5] != number


def test_the_request_outlives_no_loss_of_power(board: Board) -> None:
    board.boot()
    board.arm()
    number = board.hello()[5]
    board.write(Register.DISARM, number)
    board.write(Register.BOOTLOADER, number)
    assert board.machine.run(0.1, until=lambda: board.machine.cpu.in_bootloader)
    board.machine.power_up()
    board.boot()
    assert not board.machine.cpu.in_bootloader


@pytest.mark.parametrize("left", ["PLL", "USB"])
def test_an_image_that_the_bootloader_jumps_to_starts_anew_from_a_reset(
    board: Board, left: str
) -> None:
    """It leaves its clocks and its USB on."""
    machine = board.machine
    board.boot()
    length = machine.cpu.peek(LENGTH_AT, 4)
    machine.cpu.load(LENGTH_AT, bytes(4))
    assert _restart(board)
    machine.cpu.load(LENGTH_AT, length)
    if left == "PLL":
        machine.rcc.write(0x00, machine.rcc.read(0x00) | 1 << 24)
    else:
        machine.rcc.write(0x34, 1 << 7)
    before = len(machine.resets)
    machine.jump_to_image()
    board.run(1e-4)
    assert [cause for _, cause in machine.resets[before:]] == ["software"]
    board.boot()
    assert board.hello()[6] == ResetCause.SOFTWARE
    assert not board.plant.has_torque()
    assert not machine.violations
