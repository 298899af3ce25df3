"""Diagnosis by the flashed image: exceptions, its checksum, captured errors, its light."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from bioscara.flashing import read_image
from bioscara.protocol import WRITE, Flags, Register, ResetCause
from bioscara.protocol.registers import BLOCK_SAMPLES, CAPTURE_SAMPLES
from emulator.board import IMAGES, Board
from emulator.clock import RAM, RAM_SIZE
from emulator.cortex import (
    ACCESS_ERROR,
    FETCH_ERROR,
    HARD_FAULT,
    NO_INSTRUCTION,
    STACKING_ERROR,
)
from emulator.gpio import OUTPUT

pytestmark = [pytest.mark.usefixtures("images"), pytest.mark.timeout(600)]

LIGHT = 4
"""The pin of port C that has the LED."""
UNUSED_INTERRUPT = 16 + 50
STORE = b"\x00\x60"
"""STR r0, [r0]."""


@pytest.fixture
def board() -> Board:
    board = Board(4, position=0.0)
    board.boot()
    board.run(0.05)
    return board


def _reset_and_boot(board: Board) -> None:
    """Run until the processor has reset, and on until the joint listens."""
    before = len(board.machine.resets)
    assert board.machine.run(0.01, until=lambda: len(board.machine.resets) > before)
    board.boot()


def _exception(board: Board) -> tuple[int, ...]:
    return tuple(map(int, board.read(Register.EXCEPTION)))


def _within_a_tick(board: Board) -> None:
    assert board.machine.run(0.002, until=lambda: bool(board.machine.cpu.active))
    board.machine.run(20e-6)


@pytest.mark.parametrize("joint", [1, 2, 3, 4])
def test_a_joint_tells_the_crc_of_the_image_that_was_built_for_it(joint: int) -> None:
    board = Board(joint)
    board.boot()
    image = read_image(IMAGES / f"j{joint}.bin")
    assert board.read(Register.IMAGE) == (image.crc,)


def test_there_is_no_exception_after_a_power_up_or_another_reset(board: Board) -> None:
    assert _exception(board) == (0, 0, 0, 0)
    board.machine.request_reset("pin")
    board.machine.run(1e-3)
    board.boot()
    assert _exception(board) == (0, 0, 0, 0)


@pytest.mark.parametrize("tick", [True, False], ids=["in a tick", "in the program"])
@pytest.mark.parametrize(
    ("code", "status"), [(b"\x00\xde", NO_INSTRUCTION), (STORE, ACCESS_ERROR)], ids=["UDF", "STR"]
)
def test_an_instruction_that_fails_is_found_at_its_address(
    board: Board, code: bytes, status: int, tick: bool
) -> None:
    cpu = board.machine.cpu
    if tick:
        _within_a_tick(board)
    else:
        # It sleeps until the next tick, which comes after the instruction.
        cpu.sleeping = False
    at, original = cpu.pc, cpu.peek(cpu.pc, 2)
    cpu.engine.reg_write(66, 0x3000_0000)  # R0
    cpu.load(at, code)
    cpu.flush()
    before = len(board.machine.resets)
    assert board.machine.run(0.01, until=lambda: len(board.machine.resets) > before)
    cpu.load(at, original)
    cpu.flush()
    board.boot()
    assert _exception(board) == (HARD_FAULT, at, status, 1)
    assert ResetCause(int(board.hello()[6])) is ResetCause.SOFTWARE


def test_a_jump_into_nothing_is_found_at_its_target(board: Board) -> None:
    _within_a_tick(board)
    board.machine.cpu.pc = 0x1000_0000
    _reset_and_boot(board)
    assert _exception(board) == (HARD_FAULT, 0x1000_0000, FETCH_ERROR, 1)


def test_an_interrupt_that_none_serves_is_told_by_its_vector(board: Board) -> None:
    cpu = board.machine.cpu
    cpu.enabled.add(UNUSED_INTERRUPT)
    at = cpu.pc
    cpu.pend(UNUSED_INTERRUPT)
    _reset_and_boot(board)
    assert _exception(board) == (UNUSED_INTERRUPT, at, 0, 1)


@pytest.mark.parametrize("stack", [RAM - 8, RAM + 16, RAM + RAM_SIZE + 64, 0x0800_0000, 8, 0])
def test_an_exception_with_a_corrupt_stack_has_no_address_and_resets_all_the_same(
    board: Board, stack: int
) -> None:
    cpu = board.machine.cpu
    _within_a_tick(board)
    cpu.stack = stack
    cpu.pend(16 + 31)
    _reset_and_boot(board)
    assert _exception(board) == (HARD_FAULT, 0, STACKING_ERROR, 1)


def test_the_last_exception_is_kept_until_power_is_lost(board: Board) -> None:
    machine = board.machine
    machine.cpu.pc = 0x1000_0000
    machine.cpu.sleeping = False
    _reset_and_boot(board)
    for starts in range(2, 5):
        machine.request_reset("pin")
        machine.run(1e-3)
        board.boot()
        assert _exception(board) == (HARD_FAULT, 0x1000_0000, FETCH_ERROR, starts)
    _within_a_tick(board)
    machine.cpu.pc = 0x1000_2000
    _reset_and_boot(board)
    assert _exception(board) == (HARD_FAULT, 0x1000_2000, FETCH_ERROR, 1)
    # Even where memory has kept all of its content.
    machine.power_up(forgets=0.0)
    board.boot()
    assert _exception(board) == (0, 0, 0, 0)


def test_a_captured_error_is_that_of_each_tick(board: Board) -> None:
    board.ready()
    board.write(Register.CAPTURE)
    begun = board.machine.seconds
    while board.read(Register.CAPTURE)[0] < CAPTURE_SAMPLES:
        board.write(Register.WATCHDOG, 60)
        board.run(2e-3)
    assert 0.255 < board.machine.seconds - begun < 0.262
    errors: list[float] = []
    for block in range(-(-CAPTURE_SAMPLES // BLOCK_SAMPLES)):
        answer, result = board.exchange(WRITE[Register.CAPTUREBLOCK], block)
        assert not answer.flags & Flags.REFUSED
        assert result.held < 10e-6
        errors += answer.values
    present = board.read(Register.GETPIDERROR)[0]
    assert errors[CAPTURE_SAMPLES:] == [0.0] * (len(errors) - CAPTURE_SAMPLES)
    assert errors[CAPTURE_SAMPLES - 1] == pytest.approx(present, abs=10.0)
    assert 0.0 not in errors[:CAPTURE_SAMPLES]
    assert not board.machine.violations


def _light(board: Board, seconds: float, alive: Callable[[], object] = lambda: None) -> list[float]:
    """Return the times between two changes of the light [s]."""
    changes: list[float] = []
    port = board.machine.gpio["C"]
    port.watchers[LIGHT] = lambda _: changes.append(board.machine.seconds)
    for _ in range(round(seconds / 0.02)):
        alive()
        board.run(0.02)
    del port.watchers[LIGHT]
    assert port.mode(LIGHT) == OUTPUT
    return [after - before for before, after in itertools.pairwise(changes)]


def test_the_light_shows_what_the_joint_does(board: Board) -> None:
    assert {round(duration, 2) for duration in _light(board, 4.5)[1:]} == {0.05, 1.95}
    board.ready()
    durations = _light(board, 3.0, lambda: board.write(Register.WATCHDOG, 60))
    assert durations[1:] == pytest.approx([0.5] * (len(durations) - 1), abs=2e-3)
    board.plant.reset_driver()
    board.run(0.05)
    assert board.flags() & Flags.FAULT
    durations = _light(board, 1.0)
    assert durations[1:] == pytest.approx([0.1] * (len(durations) - 1), abs=2e-3)
