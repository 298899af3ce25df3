"""Interrupts and ticks of the flashed image, and their table in docs/firmware.md."""

from __future__ import annotations

import os
from itertools import product

import pytest

from bioscara.bus import Transaction
from bioscara.protocol import READ, TRAILER, WRITE, Register, ResetCause
from bioscara.sim import SimulatedArm
from emulator.board import HOLD_MOST, STACK_MOST, Board
from emulator.clock import MICROSECOND, SECOND
from emulator.timing import (
    BEGIN,
    END,
    ERROR,
    EVENT,
    PAGE,
    TICK,
    Measurement,
    differences,
    stack_used,
    table,
)

pytestmark = [pytest.mark.usefixtures("images"), pytest.mark.timeout(600)]

LATENCY_MOST = 20e-6
"""Nothing may hold off the I2C interrupt for longer at 400 kHz [s]."""
LOOKED = 100
"""Cycles before the end of a tick in which it samples the bus."""
STEPS = int(os.environ.get("BIOSCARA_LATENCY_STEPS", "150"))


@pytest.mark.parametrize("hertz", [100_000, 400_000])
def test_an_address_match_at_any_time_of_the_tick_is_answered_at_once(hertz: int) -> None:
    """The frame moves through the tick in steps that no loop of the firmware shares."""
    board = Board(4, hertz=hertz, position=0.0)
    board.ready()
    start = board.read(Register.STATE)[0]
    longest = 0.0
    tick = board.machine.timers["TIM3"]
    for step in range(STEPS):
        # The motor moves, so that the tick is long.
        start += 1.5
        message = WRITE[Register.TRACKLOAD] if step % 2 else READ[Register.STATE]
        frame, sequence = board.frame(message, *((start, 12.5) if step % 2 else ()))
        # To the beginning of a tick, and on so that the address of the read falls into it.
        left = 1000 - tick.read(0x24)
        ahead = (len(frame) + 2.3) * 9 / hertz
        board.machine.run(left * 1e-6 + 1e-3 - ahead % 1e-3 + step * 0.37e-3 / STEPS)
        board.machine.cpu.runs.clear()
        size = message.answer_size + TRAILER
        result = board.bus.transfer(board.address, frame, size)
        assert result.data is not None
        message.decode_v2(board.address, sequence, result.data)
        assert result.held <= HOLD_MOST
        bus = [run for run in board.machine.cpu.runs if run.exception in {EVENT, ERROR}]
        longest = max(longest, *((run.start - run.pending) / SECOND for run in bus))
        board.machine.run(0.004)
    assert longest <= LATENCY_MOST
    assert not board.machine.violations


def test_an_address_match_while_a_silent_bus_is_looked_at_is_served() -> None:
    """Each tick ends with a check of the bus; a transfer that seems to hang is reset."""
    board = Board(4, position=0.0)
    board.ready()
    timer = board.machine.timers["TIM3"]
    message = READ[Register.STATE]
    for cycle, silent in product(range(LOOKED), range(4, 9)):
        board.machine.run(silent * 1e-3)
        board.machine.cpu.runs.clear()
        board.machine.run(0.001)
        tick = next(run for run in board.machine.cpu.runs if run.exception == TICK)
        lasts = (tick.end - tick.start) / SECOND
        # The match comes after START and nine clocks, and this many cycles before the tick ends.
        match = lasts - cycle / 84e6 - 9.6 / board.bus.hertz
        board.machine.run((1000 - timer.read(0x24)) * 1e-6 + 1e-3 + match)
        frame, sequence = board.frame(message)
        result = board.bus.transfer(board.address, frame, message.answer_size + TRAILER)
        assert result.data is not None, f"{cycle} cycles before the end, {silent} ms silent"
        message.decode_v2(board.address, sequence, result.data)
    assert board.read(Register.BUSERRORS) == (0,)


def test_the_tick_gives_way_to_the_bus_and_never_the_other_way_round() -> None:
    board = Board(4, position=0.0)
    board.ready()
    board.machine.cpu.runs.clear()
    for _ in range(50):
        board.send(READ[Register.STATE])
    runs = board.machine.cpu.runs
    ticks = [run for run in runs if run.exception == TICK]
    assert any(run.nested for run in ticks), "no frame met a tick"
    assert not any(run.nested for run in runs if run.exception in {EVENT, ERROR})


def test_the_table_in_the_documentation_is_what_the_image_needs() -> None:
    measured = Measurement()
    assert measured.tick_worst <= 0.45e-3
    assert max(most for _, most in measured.holds.values()) <= HOLD_MOST
    assert measured.stack <= STACK_MOST
    assert stack_used(measured.board) == measured.stack
    written = PAGE.read_text().split(BEGIN, 1)[1].split(END, 1)[0]
    found = differences(written, table(measured))
    assert not found, "\n".join(["python tests/emulator/timing.py measures it anew:", *found])


def test_the_simulated_joint_starts_as_late_as_the_emulated_one() -> None:
    emulated = Board(4, position=0.0).boot()
    arm = SimulatedArm()
    arm.run(0.1)
    arm.reset("j4", ResetCause.POWER_ON)
    begun = arm.now()
    while arm.transfer([Transaction(0x14, bytes((Register.PING,)), 2)]) == [1]:
        arm.run(1e-4)
    assert arm.now() - begun == pytest.approx(emulated, abs=1.5e-3)


def test_micros_count_microseconds() -> None:
    """The firmware's time is that of the crystal: 1 MHz out of TIM5."""
    board = Board(4, position=0.0)
    board.boot()
    timer = board.machine.timers["TIM5"]
    before, begun = timer.read(0x24), board.machine.now
    board.machine.run(0.05)
    passed = (board.machine.now - begun) / MICROSECOND
    assert timer.read(0x24) - before == pytest.approx(passed, abs=1.5)
