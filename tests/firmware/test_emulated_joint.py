"""A joint's life in the image as it is flashed, on an emulated board with the simulated plant."""

from __future__ import annotations

import itertools
import math
import os
import random

import pytest

from bioscara.protocol import (
    READ,
    WRITE,
    Capability,
    Fault,
    Flags,
    JointState,
    Register,
    ResetCause,
)
from bioscara.protocol.registers import MAGIC, PROTOCOL
from emulator.board import BOOT_MOST, HOLD_MOST, IMAGES, STACK_MOST, Board
from emulator.clock import RAM_SIZE
from emulator.timing import stack_used
from firmware.host import HOME, NEAR

pytestmark = [pytest.mark.usefixtures("images"), pytest.mark.timeout(600)]

WATCHDOG = 0.06
JOINTS = (1, 2, 3, 4) if os.environ.get("BIOSCARA_EVERY_JOINT") else (2, 4)


@pytest.fixture
def board() -> Board:
    return Board(4, position=0.0)


def _cause(board: Board) -> ResetCause:
    return ResetCause(int(board.hello()[6]))


def _boot_id(board: Board) -> int:
    return int(board.hello()[5])


@pytest.mark.parametrize("joint", [1, 2, 3, 4])
def test_each_image_boots_and_says_who_it_is(joint: int) -> None:
    board = Board(joint, seed=joint)
    assert board.boot() < BOOT_MOST
    magic, protocol, _, _, number, _, cause, capabilities = board.hello()
    assert (magic, protocol, number) == (MAGIC, PROTOCOL, joint)
    assert cause == ResetCause.POWER_ON
    assert capabilities == sum(Capability)
    assert board.flags() & (Flags.NOTHOMED | Flags.NOTENABLED) == Flags.NOTHOMED | Flags.NOTENABLED
    assert board.state() is JointState.DISABLED
    assert board.fault() is Fault.NONE
    assert not board.machine.violations
    assert not board.plant.has_torque()


def test_the_power_stage_is_opened_before_anything_else_and_stays_open(board: Board) -> None:
    board.boot()
    board.run(0.1)
    first, *others = board.enables
    assert first[0] < 10e-6
    assert not first[1]
    assert not any(closed for _, closed in others)


def test_without_its_crystal_the_joint_stays_open_and_tries_again(board: Board) -> None:
    board.machine.rcc.crystal_swings = False
    board.run(0.5)
    assert not board.listens()
    assert not any(closed for _, closed in board.enables)
    board.machine.rcc.crystal_swings = True
    board.boot(1.0)
    assert not board.plant.has_torque()


@pytest.mark.parametrize("joint", JOINTS)
def test_setup_checks_the_orientation_and_homing_finds_the_end_stop(joint: int) -> None:
    name = f"j{joint}"
    board = Board(joint, position=NEAR[name])
    board.ready()
    assert board.fault() is Fault.NONE
    board.write(Register.HOME, *HOME[name])
    board.run(0.002)
    assert board.state() is JointState.HOMING
    flags = board.idle(60.0)
    assert not flags & (Flags.BUSY | Flags.NOTHOMED | Flags.FAULT), board.read(Register.FAULT)
    assert not board.machine.violations
    assert len(board.machine.resets) == 1
    assert stack_used(board) <= STACK_MOST


@pytest.mark.parametrize("turned", [False, True])
def test_a_motor_plugged_in_either_way_moves_in_the_same_direction(
    board: Board, turned: bool
) -> None:
    board.plant.reverse_coil(turned)
    board.ready()
    assert board.fault() is Fault.NONE
    before, told = board.position(), board.read(Register.STATE)[0]
    board.write(Register.MOVEANGLE, 60.0)
    for _ in range(30):
        board.write(Register.WATCHDOG, 60)
        board.run(0.02)
    assert board.read(Register.STATE)[0] - told == pytest.approx(60.0, abs=0.5)
    assert board.position() - before == pytest.approx(math.radians(60.0) / 12, abs=2e-3)
    assert not board.machine.violations


def _course(damage: tuple[int, bytes, bool] | None) -> tuple[list[float], Fault]:
    """Return j4's positions in a move at its full speed, with one damaged datagram of the driver."""
    board = Board(4, position=0.0)
    board.ready()
    board.write(Register.SETMAXACCELERATION, math.degrees(360.0))
    board.write(Register.SETMAXVELOCITY, math.degrees(120.0))
    end = board.read(Register.STATE)[0] + 1200.0
    first = board.driver.datagrams
    if damage is not None:
        number, bits, sent = damage
        damaged = board.driver.damage_sent if sent else board.driver.damage_received
        damaged[first + number] = bits
    positions = []
    for _ in range(30):
        board.write(Register.MOVETOANGLE, end)
        board.run(0.02)
        positions.append(board.position())
    return positions, board.fault()


def test_a_flipped_bit_between_controller_and_driver_moves_the_joint_nowhere_else() -> None:
    """The law of firmware/tests/test_spi.cpp, for some datagrams of the image."""
    seed = int(os.environ.get("BIOSCARA_SEED", "1"))
    print(f"BIOSCARA_SEED={seed}")
    choice = random.Random(seed)
    sound, fault = _course(None)
    assert fault is Fault.NONE
    assert sound[-1] > 1.5
    for _ in range(int(os.environ.get("BIOSCARA_SPI_RUNS", "120")) // 30):
        bit = choice.randrange(40)
        bits = (1 << bit).to_bytes(5, "big")
        damage = choice.randrange(2800), bits, choice.random() < 0.7
        positions, fault = _course(damage)
        away = max(abs(a - b) for a, b in zip(positions, sound, strict=True))
        assert away <= 10e-3 or fault is not Fault.NONE, damage


def _follow(board: Board, seconds: float, start: float, rpm: float) -> float:
    """Track a ramp at 50 Hz; returns where it ended [deg]."""
    begun, position = board.machine.seconds, start
    while board.machine.seconds < begun + seconds:
        position = start + rpm * 6.0 * (board.machine.seconds - begun)
        board.write(Register.TRACK, position, rpm)
        board.run(0.02)
    return position


def test_track_follows_and_its_silence_stops_the_joint(board: Board) -> None:
    board.ready()
    start = board.read(Register.STATE)[0]
    end = _follow(board, 0.5, start, 30.0)
    answer, result = board.exchange(READ[Register.STATE])
    assert answer.values[2] == JointState.TRACKING
    assert answer.values[0] == pytest.approx(end, abs=6.0)
    # The encoder's error over a turn shows in the speed.
    assert answer.values[1] == pytest.approx(30.0, rel=0.3)
    assert result.held <= HOLD_MOST
    silent = board.machine.seconds - 0.02
    while board.state() is JointState.TRACKING and board.machine.seconds < silent + 0.2:
        board.run(0.001)
    assert board.machine.seconds - silent < WATCHDOG + 0.025
    board.run(0.3)
    assert board.fault() is Fault.SETPOINT_LOST
    before = board.position()
    board.run(0.1)
    assert board.position() == pytest.approx(before, abs=1e-4)
    assert not board.machine.violations


def test_the_answer_to_trackload_has_the_load_that_state_has(board: Board) -> None:
    board.ready()
    end = _follow(board, 0.2, board.read(Register.STATE)[0], 30.0)
    loads = []
    for _ in range(10):
        end += 30.0 * 6.0 * 0.02
        answer, result = board.exchange(WRITE[Register.TRACKLOAD], end, 30.0)
        position, rpm, load = answer.values
        state = board.read(Register.STATE)
        assert load == pytest.approx(state[3], abs=3)
        assert (position, rpm) == pytest.approx(state[:2], abs=2.0)
        assert result.held <= HOLD_MOST
        loads.append(load)
        board.run(0.02)
    assert 0 < max(loads) < 100
    assert board.state() is JointState.TRACKING
    assert board.fault() is Fault.NONE
    assert not board.machine.violations


@pytest.mark.parametrize("lsi", [17_000.0, 32_000.0, 47_000.0])
def test_a_tick_that_stops_resets_the_controller_and_opens_the_power_stage(lsi: float) -> None:
    board = Board(4, position=0.0, lsi=lsi)
    board.ready()
    number = _boot_id(board)
    _follow(board, 0.1, board.read(Register.STATE)[0], 30.0)
    hung = board.machine.seconds
    board.machine.timers["TIM3"].write(0x00, 0)
    _until_reset(board)
    # The oscillator of the watchdog spreads: a nominal 100 ms are 68 to 188 ms.
    assert 0.066 < board.machine.seconds - hung < 0.190
    board.boot()
    assert board.enables[-1][1] is False
    assert not board.plant.has_torque()
    assert _cause(board) is ResetCause.WATCHDOG
    assert _boot_id(board) != number


def _until_reset(board: Board, limit: float = 1.0) -> None:
    before = len(board.machine.resets)
    assert board.machine.run(limit, until=lambda: len(board.machine.resets) > before)


def test_slow_oscillators_do_not_bite_a_healthy_joint() -> None:
    board = Board(4, position=0.0, lsi=47_000.0)
    board.ready()
    board.run(1.0)
    assert len(board.machine.resets) == 1


@pytest.mark.parametrize("what", ["jump into nothing", "undefined instruction", "stack overflow"])
def test_a_fault_of_the_processor_opens_the_power_stage_at_once_and_resets(
    board: Board, what: str
) -> None:
    board.ready()
    number = _boot_id(board)
    _follow(board, 0.1, board.read(Register.STATE)[0], 30.0)
    assert board.plant.has_torque()
    assert board.machine.run(0.002, until=lambda: bool(board.machine.cpu.active))
    cpu = board.machine.cpu
    if what == "jump into nothing":
        cpu.pc = 0x1000_0000
    elif what == "undefined instruction":
        cpu.load(cpu.pc, b"\x00\xde")
        cpu.flush()
    else:
        cpu.stack = board.machine.symbol("stack_bottom") - 8
        cpu.pend(47)
    failed = board.machine.seconds
    _until_reset(board, 0.01)
    assert board.machine.seconds - failed < 20e-6
    assert board.enables[-1][1] is False
    if what != "undefined instruction":  # which is still in its flash
        board.boot()
        assert _cause(board) is ResetCause.SOFTWARE
        assert _boot_id(board) != number


def test_the_boot_id_differs_after_each_loss_of_power(board: Board) -> None:
    numbers = []
    for index in range(40):
        board.machine.power_up(forgets=(1.0, 1.0, 0.5, 0.05)[index % 4])
        board.boot()
        assert _cause(board) is ResetCause.POWER_ON
        numbers.append(_boot_id(board))
    assert all(one != two for one, two in itertools.pairwise(numbers))
    assert len(set(numbers)) >= len(numbers) - 1


@pytest.mark.parametrize("seed", range(5))
def test_two_boards_that_start_together_have_different_numbers(seed: int) -> None:
    numbers = set()
    for joint in (1, 2, 3, 4):
        board = Board(joint, seed=10 * seed + joint)
        board.boot()
        numbers.add(_boot_id(board))
    assert len(numbers) == 4


@pytest.mark.parametrize("source", ["memory", "converter", "counter", "unique id"])
def test_each_source_of_the_boot_id_alone_changes_it(board: Board, source: str) -> None:
    machine = board.machine

    def number(changed: str) -> int:
        machine.random = random.Random(changed == "converter")
        machine.set_memory_at_power_up(bytes((changed == "memory",)) * RAM_SIZE)
        machine.set_unique_id(bytes((changed == "unique id",)) * 12)
        machine.power_up(noise=0.0)
        machine.backup.registers[0x50] = int(changed == "counter")
        board.boot()
        return _boot_id(board)

    same = number("nothing")
    assert number("nothing") == same
    assert number(source) != same


def test_a_reset_by_its_pin_is_told_apart_and_counts_on(board: Board) -> None:
    board.boot()
    before = _boot_id(board)
    for count in range(1, 4):
        board.machine.request_reset("pin")
        board.run(1e-5)
        board.boot()
        assert _cause(board) is ResetCause.PIN
        assert _boot_id(board) == (before + count) & 0xFFFF


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.007, 0.02])
def test_an_encoder_that_starts_late_is_waited_for(delay: float) -> None:
    board = Board(4, position=0.0, encoder_delay=delay)
    board.ready()
    assert board.fault() is Fault.NONE


def test_an_encoder_that_starts_much_too_late_is_a_fault_that_can_be_cleared() -> None:
    board = Board(4, position=0.0, encoder_delay=0.4)
    board.boot()
    board.arm()
    board.run(0.05)
    assert board.fault() is Fault.ENCODER
    board.run(0.5)
    board.write(Register.CLEARFAULT, Fault.ENCODER)
    board.write(Register.SETUP, 20, 20)
    assert not board.idle() & (Flags.NOTENABLED | Flags.FAULT)


def test_an_error_of_the_encoder_is_judged_after_its_status_was_read(board: Board) -> None:
    """Its status bits stay latched until then: one bad sample must not become a fault."""
    board.ready()
    board.encoder_unsound = True
    board.run(0.1)
    assert board.fault() is Fault.NONE
    assert not board.encoder_unsound


@pytest.mark.parametrize("by", [Register.TRACK, Register.SETRPM], ids=lambda by: by.name)
def test_a_driver_that_resets_cuts_the_motor_and_can_be_set_up_again(
    board: Board, by: Register
) -> None:
    board.ready()
    if by is Register.TRACK:
        _follow(board, 0.1, board.read(Register.STATE)[0], 30.0)
    else:
        board.write(Register.SETRPM, 60.0)
        board.run(0.05)
    board.plant.reset_driver()
    reset = board.machine.seconds
    board.run(0.05)
    assert board.fault() is Fault.DRIVER_RESET
    opened, closed = board.enables[-1]
    assert not closed
    assert opened - reset < 2e-3
    board.run(0.5)
    board.write(Register.CLEARFAULT, Fault.DRIVER_RESET)
    board.write(Register.SETUP, 20, 20)
    assert not board.idle() & (Flags.NOTENABLED | Flags.FAULT)
    assert board.plant.has_torque()


def test_a_motor_supply_that_is_cut_alone_is_a_fault_and_its_return_closes_nothing(
    board: Board,
) -> None:
    board.ready()
    boots, angle = len(board.machine.resets), board.read(Register.ANGLEMOVED)[0]
    board.plant.set_motor_power(False)
    cut = board.machine.seconds
    board.run(0.04)
    assert board.fault() is Fault.DRIVER
    opened, closed = board.enables[-1]
    assert not closed
    assert opened - cut < 0.04
    board.plant.set_motor_power(True)
    board.run(0.5)
    assert board.enables[-1] == (opened, False)
    assert board.fault() is Fault.DRIVER
    assert len(board.machine.resets) == boots
    assert board.read(Register.ANGLEMOVED)[0] == pytest.approx(angle, abs=2.0)
    board.write(Register.CLEARFAULT, Fault.DRIVER)
    board.write(Register.SETUP, 20, 20)
    assert not board.idle() & (Flags.NOTENABLED | Flags.FAULT)
    assert board.plant.has_torque()


def test_the_tick_runs_every_millisecond_whatever_the_bus_does(board: Board) -> None:
    board.boot()
    board.arm()
    board.machine.cpu.runs.clear()
    for _ in range(100):
        board.send(READ[Register.STATE])
    ticks = [run for run in board.machine.cpu.runs if run.exception == 45]
    assert len(ticks) >= 40
    gaps = [(two.start - one.start) / 1.68e9 for one, two in itertools.pairwise(ticks)]
    assert max(abs(gap - 1e-3) for gap in gaps) < 20e-6


def test_the_images_are_those_of_this_tree() -> None:
    assert sorted(path.name for path in IMAGES.glob("j?.elf")) == [f"j{n}.elf" for n in range(1, 5)]
