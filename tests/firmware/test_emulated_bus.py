"""The I2C side of the flashed image: bus faults, at every place in a frame."""

from __future__ import annotations

import itertools
import os
import random
from collections.abc import Iterator

import pytest

from bioscara.protocol import READ, TRAILER, WRITE, Fault as JointFault, JointState, Register
from emulator import i2c
from emulator.board import HOLD_MOST, Board
from emulator.controller import Fault, Result, Trouble

pytestmark = [pytest.mark.usefixtures("images"), pytest.mark.timeout(600)]

SPEEDS = (100_000, 400_000)
BACK = 5e-3
"""A joint answers again this long after any error [s]."""
TICK_VARIES = 0.2e-3
"""By which the end of a tick varies, at which a line that stands still is noticed [s]."""
HOLD_MOST_THROWN_AWAY = 13e-6
"""Longest time for which SCL is held in a frame that a flag without cause ends [s]."""
EVERY_BIT = bool(os.environ.get("BIOSCARA_EVERY_BIT"))


@pytest.fixture(scope="module", params=SPEEDS)
def board(request: pytest.FixtureRequest) -> Iterator[Board]:
    made = Board(4, hertz=request.param, position=2.0)
    made.boot()
    made.arm()
    yield made
    assert not made.machine.violations
    assert len(made.machine.resets) == 1, "a bus error must not reset the joint"


def _held(result: Result) -> None:
    assert not result.hung
    assert result.held <= HOLD_MOST


def _answers(board: Board, since: float, within: float = BACK) -> Result:
    """Read STATE until it comes back whole."""
    message = READ[Register.STATE]
    while True:
        frame, sequence = board.frame(message)
        result = board.bus.transfer(board.address, frame, message.answer_size + TRAILER)
        if result.data is not None:
            message.decode_v2(board.address, sequence, result.data)
            return result
        assert board.machine.seconds - since < within, f"silent for {within} s: {result}"
        assert not result.hung
        board.machine.run(3e-4)


def _track(board: Board, joint: int) -> tuple[int, bytes, int]:
    """A frame of the control cycle, for any joint."""
    message = WRITE[Register.TRACKLOAD]
    frame = message.encode_v2(0x10 + joint, board.next_sequence(), (0.0, 0.0))
    return 0x10 + joint, frame, message.answer_size + TRAILER


def _size(frame: bytes, read: int) -> int:
    return 1 + len(frame) + 1 + read


def _bits(kind: Trouble, byte: int, joint: int) -> Iterator[int]:
    """Where in a byte: before its first clock, between two of its nine, or behind them."""
    first, last = (1, 8) if kind is Trouble.START else (0, 9)  # Else it is a repeated START.
    if EVERY_BIT:
        yield from range(first, last + 1)
    else:
        yield first + (byte * 7 + joint) % (last - first + 1)


@pytest.mark.parametrize("hertz", SPEEDS)
@pytest.mark.parametrize("own", [1, 2, 3, 4])
def test_after_an_error_in_any_byte_of_the_four_joints_cycle_the_joint_answers_within_5_ms(
    own: int, hertz: int
) -> None:
    """The joint moves, so that its tick is long, and goes on moving through all of it."""
    board = Board(own, hertz=hertz, position=0.1 if own == 2 else 0.0)
    board.ready(40 if own == 2 else 20)
    begun, start = board.machine.seconds, board.read(Register.STATE)[0]
    if own == 4:
        frames = [(Register.TRACKLOAD, joint) for joint in (1, 2, 3, 4)] + [(Register.STATE, own)]
    else:
        frames = [(Register.TRACKLOAD, own)]

    def shared(joint: int, number: int) -> bool:
        """Images 1 to 3 are one but for their address, frames for others are one too: each of
        the three takes a third of the places, and all are taken once."""
        return EVERY_BIT or joint == own == 4 or number % 3 == (own if own < 4 else joint) - 1

    def frame(register: Register, joint: int) -> tuple[int, bytes, int]:
        message = READ[Register.STATE]
        values: tuple[float, ...] = ()
        if register is Register.TRACKLOAD:
            message, rpm = WRITE[register], 5.0
            values = start + rpm * 6.0 * (board.machine.seconds - begun), rpm
        address = 0x10 + joint
        written = message.encode_v2(address, board.next_sequence(), values)
        return address, written, message.answer_size + TRAILER

    faults = [
        (register, joint, Fault(kind, byte, bit, 1e-3))
        for register, joint in frames
        for number, kind in enumerate(Trouble)
        for byte in range(_size(*frame(register, joint)[1:]))
        if shared(joint, number + byte)
        for bit in _bits(kind, byte, joint)
    ]
    for register, joint, fault in faults:
        _held(board.bus.transfer(*frame(register, joint), fault=fault))
        _held(_answers(board, board.machine.seconds))
        result = board.bus.transfer(*frame(Register.TRACKLOAD, own))
        assert result.data is not None
        _held(result)
    assert board.state() is JointState.TRACKING
    assert board.fault() is JointFault.NONE
    assert not board.machine.violations
    assert len(board.machine.resets) == 1


@pytest.mark.parametrize(
    "kind", [Trouble.START, Trouble.STOP, Trouble.ABORT, Trouble.VANISH], ids=lambda k: k.name
)
@pytest.mark.parametrize("hertz", SPEEDS)
def test_a_frame_that_breaks_off_in_its_trailer_is_not_taken_for_a_version_1_frame(
    hertz: int, kind: Trouble
) -> None:
    """Without its trailer it would be one, and nothing would check it."""
    board = Board(4, hertz=hertz, position=2.0)
    board.boot()
    board.write(Register.HOMEOFFSET, 1.5)
    message = WRITE[Register.HOMEOFFSET]
    for byte in (6, 7):
        for bit in range(1, 9):
            frame, _ = board.frame(message, 2.5)
            fault = Fault(kind, byte, bit)
            _held(board.bus.transfer(board.address, frame, 3, fault=fault))
            _answers(board, board.machine.seconds)
            assert board.read(Register.HOMEOFFSET) == (1.5,)


def _sound(board: Board) -> None:
    """Several exchanges in a row, none of which may fail."""
    for _ in range(5):
        answer, result = board.exchange(READ[Register.STATE])
        assert len(answer.values) == 4
        _held(result)
        board.machine.run(0.7e-3)


def test_bus_errors_are_counted_where_the_host_can_read_them(board: Board) -> None:
    before = board.read(Register.BUSERRORS)[0]
    address, frame, read = _track(board, 4)
    for byte in (0, 1, 4, 6):
        board.bus.transfer(address, frame, read, fault=Fault(Trouble.START, byte, 4))
        _answers(board, board.machine.seconds)
    assert before + 4 <= board.read(Register.BUSERRORS)[0] <= before + 8


def test_the_held_clocks_of_original_joints_are_no_bus_errors(board: Board) -> None:
    """Three of them get a command each in a cycle, at every phase against the control tick."""
    before = board.read(Register.BUSERRORS)
    board.bus.others, board.bus.others_hold = {0x11, 0x12, 0x13}, 353e-6
    begin = board.machine.seconds
    for step in range(1, 161 if EVERY_BIT else 81):
        for address in (0x11, 0x12, 0x13):
            assert board.bus.transfer(address, b"\x15\x00\x00\x00\x00", 1).data == b"\x00"
            board.machine.run(100e-6)
        board.machine.run(begin + step * 10.05e-3 - board.machine.seconds)
    board.bus.others, board.bus.others_hold = set(), 0.0
    assert board.read(Register.BUSERRORS) == before


@pytest.mark.parametrize("line", ["clock", "data"])
def test_a_line_that_is_held_without_a_transfer_of_the_joint_is_one_bus_error(
    board: Board, line: str
) -> None:
    before = board.read(Register.BUSERRORS)[0]
    board.machine.run(20e-3)
    if line == "clock":
        board.bus.others, board.bus.others_hold = {0x11}, 30e-3
        board.bus.transfer(0x11, b"\x15\x00\x00\x00\x00", 1)
        board.bus.others, board.bus.others_hold = set(), 0.0
    else:
        board.bus.hold_sda(30e-3)
        board.machine.run(30e-3 + 1e-5)
    _answers(board, board.machine.seconds)
    assert board.read(Register.BUSERRORS)[0] == before + 1
    _sound(board)


@pytest.mark.parametrize("flag", [i2c.ARLO, i2c.OVR, i2c.BERR, i2c.AF], ids=lambda f: f"{f:#x}")
def test_error_flags_that_noise_sets_at_any_time_pass(board: Board, flag: int) -> None:
    address, frame, read = _track(board, 4)
    length = board.bus.transfer(address, frame, read)
    duration = length.ended - length.begun
    for step in range(40):
        board.machine.run(1.1e-3)
        result = board.bus.begin(address, frame, read)
        board.machine.run(duration * (step + 0.5) / 40)
        board.machine.i2c.inject(flag)
        board.machine.run(10.0, until=lambda result=result: result.ended > 0.0)  # type: ignore[misc]
        assert not result.hung
        # An answer that is thrown away is not sent on: the next byte waits until that is noticed.
        assert max(result.holds, default=0.0) <= HOLD_MOST
        assert result.held <= HOLD_MOST_THROWN_AWAY
        _answers(board, board.machine.seconds)
    _sound(board)


@pytest.mark.parametrize("seconds", [0.0005, 0.003, 0.02, 0.3])
def test_a_clock_or_data_line_held_low_for_a_time(board: Board, seconds: float) -> None:
    address, frame, read = _track(board, 4)
    for byte in range(0, _size(frame, read), 1 if EVERY_BIT else 3):
        for kind in (Trouble.SDA_LOW, Trouble.VANISH_LOW):
            if seconds > 0.1 and byte % 9:
                continue
            fault = Fault(kind, byte, 4, seconds)
            _held(board.bus.transfer(address, frame, read, fault=fault))
            _answers(board, board.machine.seconds)
    board.bus.hold_sda(seconds)
    board.machine.run(seconds + 1e-5)
    _answers(board, board.machine.seconds)
    _sound(board)


def test_a_controller_that_vanishes_while_the_joint_pulls_the_data_line_frees_it_in_5_ms(
    board: Board,
) -> None:
    address, frame, read = _track(board, 4)
    low = 0
    for byte in range(len(frame) + 2, _size(frame, read)):
        for bit in range(8):
            board.bus.transfer(address, frame, read, fault=Fault(Trouble.VANISH, byte, bit))
            low += board.machine.i2c.sda == 0
            board.machine.run(BACK + TICK_VARIES)
            assert board.machine.i2c.sda == 1
            _answers(board, board.machine.seconds, 1e-3)
    assert low > 3, "no answer held a zero bit"


@pytest.mark.parametrize("count", [1, 2, 12, 13, 14, 31, 32, 33, 64, 255])
def test_a_read_of_any_length_ends_in_ff_and_never_holds_the_clock(
    board: Board, count: int
) -> None:
    message = READ[Register.HELLO]
    frame, sequence = board.frame(message)
    result = board.bus.transfer(board.address, frame, count)
    _held(result)
    assert result.data is not None
    size = message.answer_size + TRAILER
    if count >= size:
        message.decode_v2(board.address, sequence, result.data[:size])
    assert result.data[size:] == b"\xff" * max(count - size, 0)
    _held(_answers(board, board.machine.seconds))


@pytest.mark.parametrize("register", [Register.HELLO, Register.STATE, Register.FAULT])
def test_a_read_of_no_byte_ends_at_its_address(board: Board, register: Register) -> None:
    """The joint has put the first bit of its answer on SDA by then."""
    frame, _ = board.frame(READ[register])
    for written in (frame, b""):
        at = len(written) + 1 if written else 0
        fault = Fault(Trouble.ABORT, at, 9)
        _held(board.bus.transfer(board.address, written, 1, fault=fault))
        _held(_answers(board, board.machine.seconds))
    _sound(board)


def test_a_read_without_a_write_before_it_repeats_the_answer_or_ff(board: Board) -> None:
    before = board.read(Register.BUSERRORS)
    for count in (1, 5, 32):
        result = board.bus.transfer(board.address, b"", count)
        assert result.data is not None
        assert len(result.data) == count
        _held(result)
    assert board.read(Register.BUSERRORS) == before
    _sound(board)


@pytest.mark.parametrize("count", [0, 1, 31, 32, 33, 40, 255])
def test_a_write_of_any_length_is_taken_or_refused_and_never_holds_the_clock(
    board: Board, count: int
) -> None:
    chance = random.Random(count)
    for read in (0, 1, 13):
        written = chance.randbytes(count)
        _held(board.bus.transfer(board.address, written, read))
        _held(_answers(board, board.machine.seconds))
    _sound(board)


def test_a_start_at_once_after_a_stop(board: Board) -> None:
    message = READ[Register.STATE]
    for _ in range(30):
        frame, sequence = board.frame(message)
        first = board.bus.begin(board.address, frame, 0)
        board.machine.run(1.0, until=lambda first=first: first.ended > 0.0)  # type: ignore[misc]
        second = board.bus.transfer(board.address, b"", message.answer_size + TRAILER)
        assert second.data is not None
        message.decode_v2(board.address, sequence, second.data)
        _held(second)


def test_a_repeated_start_at_once_after_the_last_byte_of_a_write(board: Board) -> None:
    """24 us of latency there led to a storm of interrupts with the vendor's library."""
    for _ in range(30):
        before = len(board.machine.cpu.runs)
        _sound(board)
        assert len(board.machine.cpu.runs) - before < 400


def test_an_address_of_others_is_not_acknowledged_and_not_held(board: Board) -> None:
    taken = board.machine.i2c.acknowledged
    for address in (0x08, 0x10 ^ 0x7F, 0x11, 0x12, 0x13, 0x15, 0x54, 0x77):
        result = board.bus.transfer(address, b"\x0f", 1)
        assert not result.holds
    assert board.machine.i2c.acknowledged == taken
    _sound(board)


@pytest.mark.parametrize("stop_sets_stopf", [True, False])
def test_a_misplaced_stop_with_and_without_the_stop_flag(
    board: Board, stop_sets_stopf: bool
) -> None:
    """The manual does not state whether STOPF comes with BERR: either is accepted."""
    address, frame, read = _track(board, 4)
    board.machine.i2c.stop_after_error = stop_sets_stopf
    try:
        for byte in range(_size(frame, read)):
            board.bus.transfer(address, frame, read, fault=Fault(Trouble.STOP, byte, 3))
            _answers(board, board.machine.seconds)
    finally:
        board.machine.i2c.stop_after_error = True
    _sound(board)


def test_a_peripheral_that_is_deaf_after_an_error_is_reset(board: Board) -> None:
    board.machine.i2c.deaf_after_error = True
    try:
        for kind, byte in itertools.product((Trouble.START, Trouble.STOP), range(20)):
            address, frame, read = _track(board, 4)
            board.bus.transfer(address, frame, read, fault=Fault(kind, byte, 3))
            board.machine.run(BACK)
            _sound(board)
        for flag in (i2c.ARLO, i2c.OVR, i2c.BERR):
            board.machine.i2c.inject(flag)
            board.machine.run(BACK)
            _sound(board)
    finally:
        board.machine.i2c.deaf_after_error = False


def test_noise_of_random_troubles_for_a_second(board: Board) -> None:
    chance = random.Random(20261122)
    kinds = list(Trouble)
    begun = board.machine.seconds
    while board.machine.seconds < begun + (10.0 if EVERY_BIT else 1.0):
        address, frame, read = _track(board, chance.choice((1, 2, 3, 4, 4, 4)))
        read = chance.choice((0, 1, read, read, 33))
        fault = Fault(
            chance.choice(kinds),
            chance.randrange(_size(frame, read)),
            chance.randrange(10),
            chance.choice((1e-5, 1e-4, 1e-3, 1e-2)),
        )
        _held(board.bus.transfer(address, frame, read, fault=fault))
        board.machine.run(chance.choice((0.0, 1e-5, 1e-4, 1e-3)))
        if chance.random() < 0.3:
            _answers(board, board.machine.seconds)
    board.machine.run(BACK)
    _sound(board)
