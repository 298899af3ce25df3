"""Host rules for joints with their original firmware, against the model of such a joint."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest

from bioscara.bus import Direction, Transaction, When
from bioscara.drivers import (
    Joint,
    JointSample,
    Quality,
    Setpoint,
    await_power_up,
    drive,
    read_states,
    track,
)
from bioscara.errors import (
    BioscaraError,
    BusTimeoutError,
    CommunicationError,
    ConfigurationError,
    IncorrectStateError,
    JointLostError,
    LimitError,
    MotionCancelledError,
    NoAcknowledgeError,
    NotEnabledError,
    NotSupportedError,
)
from bioscara.protocol import READ, REGISTERS, WRITE, Flags, Register
from bioscara.protocol.codec import field_bounds
from simulated import ARM, NEAR, Tap, World, greeted

R = Register
ANSWERED = {
    R.PING: 2, R.SETUP: 1, R.SETRPM: 1, R.MOVESTEPS: 1, R.MOVETOANGLE: 1, R.ANGLEMOVED: 5,
    R.SETCURRENT: 1, R.SETHOLDCURRENT: 1, R.SETMAXACCELERATION: 1, R.SETMAXVELOCITY: 1,
    R.ENABLESTALLGUARD: 1, R.SETBRAKEMODE: 1, R.DISABLECLOSEDLOOP: 1, R.STOP: 1,
    R.CHECKORIENTATION: 1, R.GETENCODERRPM: 5, R.HOME: 1,
}  # fmt: skip
"""Bytes that the original firmware writes; for all other registers its flags alone."""
DEFERRED = {R.HOME, R.CHECKORIENTATION} | (
    {row.register for row in REGISTERS} - set(ANSWERED) - {R.HOMEOFFSET, R.GETDRIVERRPM}
)
"""Commands that its main loop executes, including unknown ones."""
ADDRESSES = {joint.name: joint.address for joint in ARM.joints}


class Timed:
    """Records each transaction with its begin, before it reaches the joints."""

    def __init__(self, world: World) -> None:
        self.world, self.frames = world, list[tuple[float, float, Transaction]]()
        self._transfer = world.tap.transfer
        world.tap.transfer = self.transfer  # type: ignore[method-assign]

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        results = []
        for transaction in transactions:
            begin = self.world.arm.now()
            results += self._transfer([transaction])
            self.frames.append((begin, self.world.arm.now(), transaction))
        return results

    def registers(self, joint: Joint) -> list[Register]:
        """Return the frames sent to a joint, in order."""
        address = joint.parameters.address
        return [R(t.write[0]) for _, _, t in self.frames if t.address == address]

    def require_quiet(self) -> None:
        """Fail if an original joint was not left alone for 25 ms after a deferred command."""
        alone: dict[int, tuple[float, Register]] = {}
        ours = {t.address for _, _, t in self.frames if t.write[0] == R.ARM}
        for begin, end, (address, write, _) in self.frames:
            if address in ours:
                continue
            until, command = alone.get(address, (-math.inf, R.NONE))
            assert begin >= until - 1e-9, f"{R(write[0]).name} too soon after {command.name}"
            if R(write[0]) in DEFERRED:
                alone[address] = end + 25e-3, R(write[0])


def original(name: str, **changes: object) -> tuple[World, Joint]:
    """Return a joint with its original firmware, initialised."""
    world = World(v1=True)
    parameters = next(joint for joint in ARM.joints if joint.name == name)
    joint = world.joint(parameters, **changes)
    joint.init()
    assert joint.version == 1
    return world, joint


def enabled(name: str, **changes: object) -> tuple[World, Joint]:
    """Return an engaged joint with its original firmware."""
    world, joint = original(name, **changes)
    joint.enable()
    return world, joint


def homed(name: str) -> tuple[World, Joint]:
    """Return a homed joint with its original firmware."""
    world, joint = original(name)
    joint.home()
    return world, joint


def other_host(world: World, joint: Joint, **changes: object) -> Joint:
    """Return another driver of the same joint, initialised, with some other parameters."""
    other = world.joint(joint.parameters, **changes)
    other.init()
    return other


# 1. Never more is read than it writes.


def test_no_register_is_read_beyond_what_the_original_answers() -> None:
    world, joint = enabled("j4")
    world.tap.calls.clear()
    for row in REGISTERS:
        for message in (READ.get(row.register), WRITE.get(row.register)):
            if message is None:
                continue
            values = [
                min(max(1.0, low), high)
                for low, high in (field_bounds(field) for field in message._fields)
            ]
            before = len(world.tap.calls)
            if row.register in ANSWERED or row.register is R.HOMEOFFSET:
                joint.session.exchange(message, [int(v) for v in values], repeat=False)
                *polls, sent = [t for call in world.tap.calls[before:] for t in call]
                assert all(poll.write[0] == R.PING for poll in polls)
                assert sent.read == (
                    ANSWERED.get(row.register) or (5 if message is READ[R.HOMEOFFSET] else 1)
                )
                assert 1 <= len(sent.write) <= 5
            else:
                with pytest.raises(NotSupportedError, match=row.register.name):
                    joint.session.exchange(message, values)
                assert len(world.tap.calls) == before
    joint.stop()
    assert joint.get_flags() & Flags.NOTHOMED, "the bus still lives"


def test_a_single_byte_that_looks_like_the_magic_does_not_have_more_read() -> None:
    world = World(v1=True)
    corrupted: list[bool] = []

    def transfer(transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        results = carried(transactions)
        if transactions[0].write[:1] == bytes((R.HELLO,)) and not corrupted:
            corrupted.append(True)
            return [b"S"]
        return results

    carried, world.tap.transfer = world.tap.transfer, transfer  # type: ignore[method-assign]
    timed = Timed(world)
    with pytest.raises(CommunicationError, match="answered 53 0e, which is neither"):
        world.joints[0].init()
    assert {t.read for _, _, t in timed.frames if t.write[0] == R.HELLO} == {1}
    timed.require_quiet()
    world.joints[0].init()
    assert world.joints[0].version == 1


@pytest.mark.parametrize("seed", range(6))
def test_init_never_reads_more_than_the_joint_answers_despite_faults(seed: int) -> None:
    world, chance = World(v1=True), random.Random(seed)
    world.bus.off(When(probability=chance.choice((0.1, 0.4))))
    world.bus.lose(chance.choice(list(Direction)), When(probability=chance.choice((0.1, 0.4))))
    timed = Timed(world)
    for joint in world.joints * 2:
        try:
            joint.init()
            joint.read_state()
            joint.session.read(R.HOMEOFFSET)
            joint.check_communication()
        except BioscaraError:
            continue
    for _, _, (_, write, read) in timed.frames:
        register = R(write[0])
        allowed = 5 if register is R.HOMEOFFSET and len(write) == 1 else ANSWERED.get(register, 1)
        assert read <= allowed, f"seed {seed}"
    timed.require_quiet()


# 2. A quiet time after each command that its loop executes.


def test_a_whole_life_cycle_respects_the_quiet_times() -> None:
    world = World(v1=True)
    timed, joint = Timed(world), world.joints[3]
    joint.init()
    joint.enable()
    joint.check_orientation()
    joint.move_steps(640)
    joint.home()
    world.arm.run(0.5)  # The belt unwinds: an original joint stays where it met the end stop.
    joint.move_steps(-640)
    joint.check_communication()
    joint.disable()
    assert {R.HELLO, R.HOME, R.CHECKORIENTATION} <= set(timed.registers(joint))
    timed.require_quiet()


CALLS: list[Callable[[Joint], object]] = [
    lambda joint: joint.get_flags(),
    lambda joint: joint.read_state(),
    lambda joint: joint.keep_alive(),
    lambda joint: joint.stop(),
    lambda joint: joint.disable(),
    lambda joint: joint.settings.set_drive_current(20),
    lambda joint: joint.init(),
]


TAKEN_LATER: dict[Register, Callable[[Joint], object]] = {
    R.HOME: lambda joint: joint.start_homing(),
    R.CHECKORIENTATION: lambda joint: joint.session.write(R.CHECKORIENTATION, 5.0, repeat=False),
}


@pytest.mark.parametrize("command", list(TAKEN_LATER), ids=lambda register: register.name)
@pytest.mark.parametrize("call", CALLS)
def test_a_call_after_a_deferred_command_waits_until_it_is_taken(
    call: Callable[[Joint], object], command: Register
) -> None:
    world, joint = enabled("j4")
    timed = Timed(world)
    TAKEN_LATER[command](joint)
    call(joint)
    timed.require_quiet()
    sent = [end for _, end, t in timed.frames if t.write[0] == command]
    following = next(begin for begin, _, _ in timed.frames if begin >= sent[0])
    assert following - sent[0] < 30e-3, "and not much longer"


def test_a_homing_that_is_polled_at_once_completes() -> None:
    world, joint = enabled("j4")
    joint.start_homing()
    assert joint.get_flags() & Flags.BUSY
    begin = world.arm.now()
    while joint.get_flags() & Flags.BUSY:
        world.arm.run(0.01)
        assert world.arm.now() < begin + joint.homing_timeout
    joint.post_homing()
    assert joint.is_homed()


@pytest.mark.parametrize("stopped_after", [0.0, 0.03, 0.2, 0.45])
def test_a_homing_that_was_stopped_before_it_moved_is_not_continued(stopped_after: float) -> None:
    # The loop stands still for half a second first: commanded during it to home in the other
    # direction, it took the direction of before.
    world, joint = enabled("j1")
    world.arm.set_position("j1", 0.0)
    velocity = joint.parameters.homing.velocity
    joint.start_homing(-abs(velocity))
    world.arm.run(stopped_after)
    joint.stop()
    joint.start_homing(abs(velocity))
    world.arm.run(2.0)
    assert world.arm.position("j1") > 0.005
    assert joint.session.flags & Flags.NOTHOMED
    joint.stop()


def test_a_cycle_skips_a_quiet_joint_and_serves_the_others() -> None:
    world = World(v1=True)
    third, fourth = world.joints[2:]
    for joint in (third, fourth):
        joint.init()
        joint.enable()
    read_states([third, fourth])
    fourth.start_homing()
    world.tap.calls.clear()
    begin = world.arm.now()
    there, quiet = read_states([third, fourth], retry=True)
    assert world.arm.now() - begin < 5e-3, "no wait"
    assert isinstance(there, JointSample)
    assert there.quality is Quality.FRESH
    assert isinstance(quiet, JointSample)
    assert quiet.quality is Quality.STALE
    assert {t.address for call in world.tap.calls for t in call} == {0x13}
    assert fourth.cycle.bad_cycles == fourth.cycle.failures == 0
    world.arm.run(25e-3)
    _, again = read_states([third, fourth])
    assert isinstance(again, JointSample)
    assert again.quality is Quality.FRESH
    assert again.flags & Flags.BUSY


def test_setpoints_wait_for_the_end_of_the_quiet_time_too() -> None:
    world, joint = homed("j4")
    joint.move_steps(-640)
    joint.session.write(R.CHECKORIENTATION, 1.0, repeat=False)
    world.tap.calls.clear()
    here = Setpoint(joint.parameters.upper - 0.05)
    for outcome in (*track([joint], [here]), *drive([joint], [0.0])):
        assert isinstance(outcome, JointSample)
        assert outcome.quality is Quality.STALE
    assert [t for call in world.tap.calls for t in call] == []


@pytest.mark.parametrize("direction", list(Direction))
def test_a_home_whose_answer_is_lost_is_not_sent_again_but_stopped(direction: Direction) -> None:
    world, joint = enabled("j1")
    world.bus.lose(direction, When(first=R.HOME, count=1))
    timed = Timed(world)
    with pytest.raises(BusTimeoutError, match=r"j1 .*HOME.*not repeated"):
        joint.start_homing()
    assert timed.registers(joint).count(R.HOME) == (direction is Direction.BACK)
    assert R.STOP in timed.registers(joint)
    timed.require_quiet()
    world.arm.run(2.0)
    assert not joint.get_flags() & Flags.BUSY
    assert abs(world.arm.velocity("j1")) < 1e-3


def test_a_move_in_steps_is_followed_at_once() -> None:
    world, joint = enabled("j4")
    timed = Timed(world)
    joint.session.write(R.MOVESTEPS, -640, repeat=False)
    joint.get_flags()
    (_, sent, _), (following, _, _) = timed.frames
    assert following - sent < 1e-3


def test_a_move_in_steps_is_not_ended_by_a_homing_that_was_stopped() -> None:
    world, joint = enabled("j4")
    joint.start_homing()
    joint.stop()
    joint.set_max_acceleration(0.1)
    before = world.arm.position("j4")
    joint.move_steps(-12800)
    world.arm.run(0.5)
    assert world.arm.position("j4") - before == pytest.approx(-math.radians(7.5), abs=5e-3)


# An orientation check is waited for: STOP would not end it.


def check_in_progress() -> tuple[World, Joint]:
    """Return a homed joint that turns its motor to and fro, as after an interruption."""
    world, joint = homed("j4")
    joint.move_steps(-6400)
    joint.set_max_acceleration(0.5)
    joint.session.write(R.CHECKORIENTATION, 10.0, repeat=False)
    world.arm.run(0.1)
    return world, joint


def require_check_ended(world: World, timed: Timed, joint: Joint) -> None:
    """Fail unless the joint got no command before its check had ended, and works."""
    commands = [t for _, _, t in timed.frames if t.write[0] not in (R.PING, R.HELLO, R.ANGLEMOVED)]
    assert commands
    first = next(begin for begin, _, t in timed.frames if t is commands[0])
    assert 0.5 < first - timed.frames[0][0] < 3.0
    joint.enable()
    # Its loop comes round: the deadman is alive.
    joint.session.write(R.SETRPM, 5.0)
    world.arm.run(0.1)
    assert joint.get_flags() & Flags.NOTENABLED


DURING: dict[str, Callable[[Joint, World], object]] = {
    "stop": lambda joint, _: joint.stop(),
    "disable": lambda joint, _: joint.disable(),
    "enable": lambda joint, _: joint.enable(),
    "setting": lambda joint, _: joint.set_max_velocity(0.5),
    "init": lambda joint, _: joint.init(),
    "another host": lambda joint, world: other_host(world, joint),
}


@pytest.mark.parametrize("call", list(DURING))
def test_a_command_during_a_check_waits_for_its_end(call: str) -> None:
    world, joint = check_in_progress()
    timed = Timed(world)
    joint.get_flags()
    DURING[call](joint, world)
    require_check_ended(world, timed, joint)


def test_ctrl_c_during_a_check_waits_for_its_end_and_stops_the_joint() -> None:
    world, joint = homed("j4")
    joint.set_max_acceleration(0.5)
    joint.move_steps(-6400)
    timed = Timed(world)
    polls = 0

    def interrupt(transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        nonlocal polls
        checks = R.CHECKORIENTATION in timed.registers(joint)
        polls += checks and any(t.write[0] == R.ANGLEMOVED for t in transactions)
        if polls == 5:
            polls += 1
            raise KeyboardInterrupt
        return carried(transactions)

    carried, world.tap.transfer = world.tap.transfer, interrupt  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        joint.check_orientation(math.radians(10.0))
    check = next(end for _, end, t in timed.frames if t.write[0] == R.CHECKORIENTATION)
    stops = [begin for begin, _, t in timed.frames if t.write[0] == R.STOP]
    assert 0.5 < stops[-1] - check < 3.0
    joint.enable()
    joint.session.write(R.SETRPM, 5.0)
    world.arm.run(0.1)
    assert joint.get_flags() & Flags.NOTENABLED


def test_a_check_that_does_not_end_is_halted_after_5_s_with_the_remedy() -> None:
    world, joint = enabled("j4")
    world.arm.hang("j4")
    with pytest.raises(IncorrectStateError, match=r"5 s; switch the joint off and on"):
        joint.check_orientation()
    assert world.tap.count(R.STOP) >= 1


# 3. SETMAXVELOCITY in position mode only.


def _deadman(joint: Joint, world: World) -> None:
    joint.set_velocity(-0.1)
    joint.set_position(2.9)
    world.arm.run(0.2)


def _homing(joint: Joint, _: World) -> None:
    joint.start_homing()
    joint.stop()


BEFORE: dict[str, Callable[[Joint, World], object]] = {
    "stop": lambda joint, _: joint.stop(),
    "velocity": lambda joint, _: joint.set_velocity(-0.1),
    "zero": lambda joint, _: joint.set_velocity(0.0),
    "homing": _homing,
    "disabled": lambda joint, _: joint.disable(),
    "greeted": lambda joint, _: joint.init(),
    "silence": _deadman,
}
"""Transitions into velocity mode; the last is the deadman's, after a move to a position."""


@pytest.mark.parametrize("name", BEFORE)
def test_a_maximum_velocity_is_refused_where_it_would_start_a_motion(name: str) -> None:
    world, joint = homed("j4")
    BEFORE[name](joint, world)
    world.tap.calls.clear()
    with pytest.raises(IncorrectStateError, match=r"j4: .*not in position mode; enable"):
        joint.set_max_velocity(0.5)
    assert world.tap.count(R.SETMAXVELOCITY) == 0
    joint.stop()
    world.arm.run(1.0)
    before = world.arm.position("j4")
    world.arm.run(1.0)
    assert world.arm.position("j4") == pytest.approx(before, abs=1e-3), "nothing runs away"


@pytest.mark.parametrize(
    "begin",
    [
        lambda joint: joint.enable(),
        lambda joint: joint.set_position(2.9),
        lambda joint: joint.move_steps(-64),
    ],
)
def test_a_maximum_velocity_is_set_in_position_mode(begin: Callable[[Joint], object]) -> None:
    world, joint = homed("j4")
    joint.stop()
    begin(joint)
    joint.set_max_velocity(0.5)
    assert joint.settings.max_velocity == 0.5
    for _ in range(60):
        joint.set_position(2.5)
        world.arm.run(0.02)
    assert abs(world.arm.velocity("j4")) < 0.55
    assert joint.get_position() == pytest.approx(2.5, abs=0.05)


def test_a_stalled_joint_that_ignored_a_position_is_not_in_position_mode() -> None:
    _, joint = homed("j4")
    joint.stop()
    joint.session.take(WRITE[R.MOVETOANGLE], bytes((Flags.STALL,)))
    with pytest.raises(IncorrectStateError, match="position mode"):
        joint.set_max_velocity(0.5)


@pytest.mark.parametrize("seed", range(5))
def test_no_order_of_calls_sends_a_maximum_velocity_in_velocity_mode(seed: int) -> None:
    world, joint = homed("j4")
    timed, chance = Timed(world), random.Random(seed)
    calls: list[Callable[[], object]] = [
        joint.enable,
        joint.disable,
        joint.stop,
        joint.init,
        joint.check_orientation,
        lambda: joint.set_velocity(chance.choice((-0.1, 0.0, 0.1))),
        lambda: joint.set_position(2.8),
        lambda: joint.move_steps(-64),
        lambda: joint.set_max_velocity(0.5),
        lambda: joint.set_max_velocity(0.5),
        lambda: joint.set_max_acceleration(10.0),
        joint.start_homing,
        lambda: drive([joint], [0.1]),
        lambda: track([joint], [Setpoint(2.8)]),
        lambda: world.arm.run(0.1),
    ]
    for _ in range(120):
        try:
            chance.choice(calls)()
        except BioscaraError:
            continue
    mode = R.SETUP
    for register in timed.registers(joint):
        assert not (register is R.SETMAXVELOCITY and mode in (R.STOP, R.SETRPM, R.HOME)), (
            f"seed {seed}: SETMAXVELOCITY after {mode.name}"
        )
        if register in (R.SETUP, R.MOVETOANGLE, R.MOVESTEPS, R.STOP, R.SETRPM, R.HOME):
            mode = register
    assert R.SETMAXVELOCITY in timed.registers(joint)
    timed.require_quiet()


# 4. Accelerations that it accepts unchanged.


def test_an_acceleration_that_wraps_is_refused_in_joint_units() -> None:
    world, joint = enabled("j4")
    with pytest.raises(
        ConfigurationError, match=r"max_acceleration: 40 is outside 1e-06 \.\. 30\.4"
    ):
        replace(joint.parameters, max_acceleration=40.0)
    joint = other_host(world, joint, max_acceleration=highest(joint))
    world.tap.calls.clear()
    with pytest.raises(LimitError, match=r"j4 acceleration.*: 31 rad/s\^2 is outside"):
        joint.set_max_acceleration(31.0)
    with pytest.raises(LimitError, match="j4 acceleration with its original firmware"):
        joint.set_max_acceleration(1e-5)
    assert world.tap.calls == []


def highest(joint: Joint) -> float:
    """Return the highest acceleration that the parameters of a joint may have."""
    return 365.0 / abs(joint.parameters.reduction) * (1.0 - 1e-12)


@pytest.mark.parametrize("name", list(NEAR))
def test_the_bounds_themselves_are_taken_as_they_are(name: str) -> None:
    world, joint = enabled(name)
    joint = other_host(world, joint, max_acceleration=highest(joint))
    with pytest.raises(LimitError) as caught:
        joint.set_max_acceleration(1e-9)
    registers = []
    for bound in (caught.value.lower * (1 + 1e-9), highest(joint)):
        joint.set_max_acceleration(bound)
        [sent] = [t.write for t in world.tap.calls[-1]]
        (deg,) = struct.unpack("<f", sent[1:])
        registers.append(int(deg * 200.0 / 360.0 * 5.632))
    assert registers[0] == 1
    assert 65_400 <= registers[1] <= 65_535, "it does not wrap"


def test_the_lowest_acceleration_still_moves_and_stops_the_joint() -> None:
    world, joint = enabled("j4")
    with pytest.raises(LimitError) as caught:
        joint.set_max_acceleration(1e-6)
    joint.set_max_acceleration(caught.value.lower)
    before = world.arm.field("j4")
    for _ in range(60):
        joint.session.write(R.SETRPM, 5.0)
        world.arm.run(0.02)
    assert world.arm.field("j4") > before + 10.0


def test_an_acceleration_that_does_not_move_it_is_refused_before_the_motor_is_engaged() -> None:
    world, joint = original("j4")
    homing = replace(joint.parameters.homing, acceleration=1e-6)
    joint = other_host(world, joint, max_acceleration=1e-6, homing=homing)
    world.tap.calls.clear()
    with pytest.raises(LimitError, match="j4 acceleration"):
        joint.enable()
    assert world.tap.calls == []
    assert not world.arm.has_torque("j4")


def test_homing_with_an_acceleration_that_does_not_move_it_is_refused_before_its_home_is_lost() -> (
    None
):
    world, joint = homed("j4")
    homing = replace(joint.parameters.homing, acceleration=1e-6)
    joint = other_host(world, joint, homing=homing)
    world.tap.calls.clear()
    with pytest.raises(LimitError, match="j4 acceleration"):
        joint.start_homing()
    assert world.tap.calls == []
    assert joint.is_homed()


# 5. No STOP without taking SETRPM's setpoint back.


def test_stop_resets_the_velocity_and_the_joint_stays_enabled() -> None:
    world, joint = homed("j4")
    timed = Timed(world)
    for _ in range(10):
        joint.set_velocity(-0.5)
        world.arm.run(0.02)
    joint.stop()
    assert timed.registers(joint)[-2:] == [R.SETRPM, R.STOP]
    assert timed.frames[-2][2].write[1:] == bytes(4)
    world.arm.run(1.0)
    assert joint.is_enabled()
    assert abs(world.arm.velocity("j4")) < 1e-3


def test_a_velocity_before_a_position_is_reset_too() -> None:
    world, joint = homed("j4")
    joint.set_velocity(-0.5)
    joint.set_position(2.8)
    joint.stop()
    world.arm.run(1.0)
    assert joint.is_enabled()


def test_a_joint_that_a_cycle_stopped_at_its_limit_stays_enabled() -> None:
    world, joint = homed("j4")
    read_states([joint])
    [moving] = drive([joint], [-0.1])
    assert isinstance(moving, JointSample)
    world.arm.run(0.02)
    read_states([joint])
    [refused] = drive([joint], [joint.parameters.max_velocity])
    assert isinstance(refused, LimitError)
    world.arm.run(0.3)
    assert joint.is_enabled()
    assert abs(world.arm.velocity("j4")) < 1e-3


def test_stop_is_sent_though_the_velocity_before_it_is_lost() -> None:
    world, joint = homed("j4")
    world.bus.off(When(first=R.SETRPM))
    world.tap.calls.clear()
    joint.stop()
    assert world.tap.count(R.STOP) == 1


def test_init_stops_a_motion_of_an_earlier_host() -> None:
    world, joint = homed("j1")
    joint.set_position(2.0)
    # That host dies; the move to a position runs on.
    world.arm.run(1.5)
    assert world.arm.velocity("j1") > 0.9
    other = world.joint(ARM.joints[0])
    other.init()
    world.arm.run(1.0)
    assert abs(world.arm.velocity("j1")) < 1e-3
    assert world.arm.position("j1") < 0.0
    assert other.is_homed()
    assert other.is_enabled()


# 6. A move ends at its target.


def test_a_slow_short_move_is_waited_for() -> None:
    world, joint = enabled("j4")
    joint.set_max_acceleration(0.01)
    field, begin = world.arm.field("j4"), world.arm.now()
    joint.move_steps(2000)
    assert world.arm.now() - begin > 2.5
    assert world.arm.field("j4") - field == pytest.approx(2000, abs=64)
    assert joint.read_state().velocity == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("steps", [0, 3, -40, 12800, -51200])
def test_moves_of_all_sizes_end_at_their_target(steps: int) -> None:
    world, joint = enabled("j4")
    joint.move_steps(-12800)
    field = world.arm.field("j4")
    joint.move_steps(steps)
    assert world.arm.field("j4") - field == pytest.approx(steps, abs=64)


def test_a_move_that_misses_its_target_raises_and_stops() -> None:
    world, joint = enabled("j4")
    stop = Transaction(0x14, bytes((R.STOP, 1)), 1)

    def interfere(_: JointSample) -> None:
        # Another host stops it halfway.
        world.tap.transfer([stop])

    with pytest.raises(IncorrectStateError, match="j4: the move did not end within"):
        joint.move_steps(51200, progress=interfere)
    assert world.tap.count(R.MOVESTEPS) == 1


def test_a_cancelled_slow_move_is_at_rest() -> None:
    world, joint = enabled("j4")
    joint.set_max_acceleration(0.2)
    with pytest.raises(MotionCancelledError):
        joint.move_steps(-51200, cancel=lambda: abs(joint.last.velocity) > 0.1)
    field = world.arm.field("j4")
    world.arm.run(1.0)
    assert world.arm.field("j4") == pytest.approx(field, abs=20)


def test_a_released_motor_is_not_moved_by_steps() -> None:
    world, joint = enabled("j4")
    world.tap.transfer([Transaction(0x14, bytes((R.SETCURRENT, 0)), 1)])
    world.tap.calls.clear()
    with pytest.raises(NotEnabledError):
        joint.move_steps(6400)
    assert world.tap.count(R.MOVESTEPS) == 0


# 7. A second without traffic after power-up.


class Switch(Tap):
    """Switches joints on at set times, and records the requests that each got too early."""

    def __init__(self, world: World, after: float, names: Sequence[str]) -> None:
        super().__init__(world.bus)
        self._world, self._names = world, list(names)
        for name in names:
            world.arm.set_power(name, on=False)
        self._due = world.arm.now() + after
        self.on_since: dict[int, float] = {}
        self.too_soon: list[tuple[float, Transaction]] = []

    def now(self) -> float:
        return self._world.arm.now()

    def sleep_until(self, deadline: float) -> None:
        """Wait as the clock does, and switch on in time."""
        if self._names and deadline >= self._due:
            self._world.arm.clock.sleep_until(self._due)
            while self._names:
                name = self._names.pop()
                self._world.arm.set_power(name, on=True)
                self.on_since[ADDRESSES[name]] = self.now()
        self._world.arm.clock.sleep_until(deadline)

    def transfer(self, transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        for transaction in transactions:
            since = self.on_since.get(transaction.address)
            if transaction.read and since is not None and self.now() - since < 1.0:
                self.too_soon.append((self.now() - since, transaction))
        return super().transfer(transactions)


@pytest.mark.parametrize("after", [1e-3, 0.01, 0.04, 0.3, 0.6, 0.9, 0.999])
def test_joints_switched_on_during_the_wait_get_their_start_up_pause(after: float) -> None:
    world = World(v1=True)
    bus = Switch(world, after, list(NEAR))
    messages: list[str] = []
    await_power_up(bus, bus, ADDRESSES, messages.append)
    for parameters in ARM.joints:
        joint = Joint(bus, bus, parameters)
        joint.init()
        assert joint.version == 1
        assert joint.get_flags() & Flags.NOTENABLED
    assert bus.too_soon == []
    assert messages == [
        "no device acknowledges at the address of j1, j2, j3, j4; waiting 1 s, in case the arm was "
        "just switched on"
    ]


@pytest.mark.parametrize("after", [1e-3, 0.02, 0.04, 0.3])
def test_a_joint_switched_on_during_init_gets_its_start_up_pause(after: float) -> None:
    world = World(v1=True)
    bus = Switch(world, after, ["j2"])
    joint = Joint(bus, bus, ARM.joints[1])
    for _ in range(20):
        try:
            joint.init()
        except NoAcknowledgeError:
            continue
        break
    assert joint.version == 1
    assert bus.too_soon == []


def test_a_joint_that_lost_power_gets_its_start_up_pause() -> None:
    world = World(v1=True)
    bus = Switch(world, math.inf, [])
    joint = Joint(bus, bus, ARM.joints[0])
    joint.init()
    world.arm.set_power("j1", on=False)
    for _ in range(3):
        read_states([joint])
    world.arm.set_power("j1", on=True)
    bus.on_since[0x11] = bus.now()
    world.arm.run(0.1)
    joint.init()
    assert bus.too_soon == []
    assert joint.get_flags() & Flags.NOTENABLED


def test_a_joint_that_does_not_acknowledge_is_lost_at_once_and_not_polled() -> None:
    world = World(v1=True)
    joints = world.joints[2:]
    for joint in joints:
        joint.init()
    read_states(joints)
    away = world.bus.off(When(address=0x14))
    there, lost = read_states(joints, retry=True)
    assert isinstance(there, JointSample)
    assert isinstance(lost, JointLostError)
    away.cancel()
    world.tap.calls.clear()
    there, lost = read_states(joints, retry=True)
    assert isinstance(there, JointSample)
    assert isinstance(lost, JointLostError)
    assert {t.address for call in world.tap.calls for t in call} == {0x13}
    # One exchange with it alone, after its second, and the cycles have it again.
    begin = world.arm.now()
    joints[1].get_flags()
    assert world.arm.now() - begin > 1.0
    there, back = read_states(joints)
    assert isinstance(back, JointSample)
    assert back.quality is Quality.FRESH


def test_one_missing_acknowledge_gives_the_last_sample() -> None:
    world, joint = greeted("j4", v1=True)
    read_states([joint])
    world.bus.off(When(address=0x14, count=1))
    [sample] = read_states([joint])
    assert isinstance(sample, JointSample)
    assert sample.quality is Quality.STALE
    world.bus.off(When(address=0x14, count=1))
    begin = world.arm.now()
    joint.get_flags()
    assert world.arm.now() - begin < 5e-3
    assert joint.session.retries == 1


def test_joints_that_answer_are_not_waited_for() -> None:
    world, messages = World(v1=True), list[str]()
    begin = world.arm.now()
    await_power_up(world.bus, world.arm.clock, ADDRESSES, messages.append)
    assert world.arm.now() - begin < 0.01
    assert messages == []


def test_a_joint_that_restarts_while_it_is_read_holds_the_bus_and_the_error_has_the_remedy() -> (
    None
):
    world, joint = enabled("j4")
    other = world.joints[0]
    other.init()
    world.arm.reset("j4")
    world.arm.run(0.1)
    remedy = r"may be moving; switch the arm's power off, then on"
    calls = (joint.get_flags, joint.enable, joint.stop, other.get_flags, other.stop, other.init)
    for call in calls:
        with pytest.raises(BusTimeoutError, match=remedy):
            call()
    world.arm.set_power("j4", on=False)
    world.arm.run(0.1)
    other.init()


def test_a_single_answer_that_is_lost_does_not_ask_for_the_power() -> None:
    world, joint = enabled("j4")
    world.bus.lose(Direction.BACK, When(first=R.MOVESTEPS, count=1))
    with pytest.raises(BusTimeoutError) as caught:
        joint.move_steps(-64)
    assert "power" not in str(caught.value)


# 8. Arms of both kinds.


def test_joints_of_both_kinds_share_a_bus() -> None:
    world = World(v1=("j1", "j4"))
    timed = Timed(world)
    joints = world.ready()
    assert [joint.version for joint in joints] == [1, 2, 2, 1]
    setpoints = [Setpoint(joint.get_position()) for joint in joints]
    setpoints = [
        Setpoint(min(max(p, joint.parameters.lower), joint.parameters.upper))
        for joint, (p, _) in zip(joints, setpoints, strict=True)
    ]
    for _ in range(30):
        for sample in track(joints, setpoints, retry=True):
            assert isinstance(sample, JointSample)
            assert sample.quality is Quality.FRESH
        world.arm.run(0.01)
    for joint in joints:
        joint.stop()
        joint.disable()
    for _, _, (address, write, read) in timed.frames:
        if address in (0x11, 0x14) and write[0] != R.HELLO:
            assert len(write) <= 5
            assert read <= 5
    timed.require_quiet()
