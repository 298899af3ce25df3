"""The model of a joint as existing arms are flashed, defects included; bytes in, bytes out.

One test or more for each row of the table in docs/simulation.md.
"""

from __future__ import annotations

import random
import statistics
import struct
from collections.abc import Callable

import pytest

from bioscara.bus import Transaction
from bioscara.errors import BusTimeoutError, InvalidArgumentError, NoAcknowledgeError
from bioscara.protocol import MAGIC, READ, WRITE, Register
from bioscara.sim import FirmwareBus, SimulatedArm
from entries import entry

pytestmark = pytest.mark.thorough

STALL, BUSY, NOTHOMED, NOTENABLED = 1, 2, 4, 8
STEPS_PER_DEG = 51200.0 / 360.0
RAD_PER_S_PER_RPM = 2.0 * 3.141592653589793 / 60.0
LOOP = 0.01
RAMP = 10 * 51.2e-6
"""Ten periods of the ramp generator [s]."""
QUIET = 0.025


class Original:
    """One original joint, spoken to in bytes and motor units; a bus that takes no time."""

    def __init__(self, joint: str = "j4", *, frequency: float | None = None, **options: object):
        self.arm = SimulatedArm(v1=True, frequency=frequency, **options)  # type: ignore[arg-type]
        self.bus = FirmwareBus(self.arm)
        self.joint, self.address = joint, 0x10 + int(joint[1])

    def exchange(self, write: bytes, count: int = 1) -> bytes:
        (answer,) = self.bus.transfer([Transaction(self.address, write, count)])
        if not isinstance(answer, bytes):
            raise answer
        return answer

    def write(self, register: Register, *values: float) -> int:
        return self.exchange(WRITE[register].encode_v1(values))[0]

    def number(self, register: Register) -> float:
        answer = self.exchange(bytes((register,)), READ[register].answer_size)
        (value,) = struct.unpack("<f", answer[:4])
        return float(value)

    def flags(self) -> int:
        answer = self.exchange(bytes((Register.PING,)), 2)
        assert answer[:1] == b"O"
        return answer[1]

    def enable(self, rpm: float = 600.0, acceleration_deg: float = 5000.0) -> None:
        self.write(Register.SETUP, 20, 20)
        self.write(Register.SETMAXACCELERATION, acceleration_deg)
        self.write(Register.SETMAXVELOCITY, 6.0 * rpm)

    def speed(self) -> float:
        """Return how the ramp generator turns the field [rpm]."""
        before = self.arm.field(self.joint)
        self.arm.run(RAMP)
        return (self.arm.field(self.joint) - before) / RAMP * 60.0 / 51200.0

    def stands(self, seconds: float = 0.1) -> bool:
        """Return whether the field stands still for so long."""
        before = self.arm.field(self.joint)
        self.arm.run(seconds)
        return abs(self.arm.field(self.joint) - before) < 30.0


def spinning(rpm: float = 60.0, **options: object) -> Original:
    """Return an enabled joint in velocity mode, at its speed."""
    joint = Original(**options)  # type: ignore[arg-type]
    joint.arm.remove_stops(joint.joint)
    joint.enable()
    for _ in range(50):
        joint.write(Register.SETRPM, rpm)
        joint.arm.run(0.01)
    assert joint.speed() == pytest.approx(rpm, abs=0.1)
    return joint


# Unknown registers.


@pytest.mark.parametrize("register", [0xC0, 0xE6, 0xCB, 0xF3, 0x14, 0x20, 0x2A, 0x00, 0xFF])
def test_an_unknown_register_answers_its_flags_and_is_busy_for_a_loop(register: int) -> None:
    joint = Original()
    joint.enable()
    assert joint.exchange(bytes((register, 1, 2, 3, 4))) == bytes((NOTHOMED | BUSY,))
    assert joint.stands(LOOP)
    assert joint.flags() == NOTHOMED
    assert joint.stands()


def test_getdriverrpm_answers_only_flags_and_is_not_busy() -> None:
    assert Original().exchange(bytes((Register.GETDRIVERRPM,))) == bytes((NOTHOMED | NOTENABLED,))


# Over-read.


@pytest.mark.parametrize(
    ("write", "count"),
    [(b"\xc0\x01\x02", 13), (b"\x0f", 3), (b"\x18", 6), (b"\x29\x00", 2), (b"\x12", 5)],
)
def test_over_read_hangs_the_bus_until_the_joint_is_power_cycled(write: bytes, count: int) -> None:
    joint = Original("j2", frequency=100e3)
    with pytest.raises(BusTimeoutError):
        joint.exchange(write, count)
    others = [Transaction(address, b"\x0f", 2) for address in (0x11, 0x12, 0x13, 0x14)]
    assert all(isinstance(answer, BusTimeoutError) for answer in joint.bus.transfer(others))
    joint.arm.run(60.0)
    assert all(isinstance(answer, BusTimeoutError) for answer in joint.bus.transfer(others))
    joint.arm.set_power("j2", on=False)
    answers = joint.bus.transfer(others)
    assert isinstance(answers.pop(1), NoAcknowledgeError)
    assert all(isinstance(answer, bytes) for answer in answers)
    joint.arm.set_power("j2", on=True)
    joint.arm.run(1.0)
    assert joint.flags() == NOTHOMED | NOTENABLED


ANSWERS = {0x0F: 2, 0x18: 5, 0x2C: 5, 0x2E: 5}
"""Bytes that are written to a request without payload; for all other registers the flags alone."""


def test_one_byte_beyond_an_answer_hangs_and_the_answer_itself_does_not() -> None:
    for register in range(256):
        with entry(f"register {register:#04x}"):
            joint = Original("j2")
            size = ANSWERS.get(register, 1)
            joint.exchange(bytes((register,)), size)
            with pytest.raises(BusTimeoutError):
                joint.exchange(bytes((register,)), size + 1)


def test_a_joint_that_holds_the_clock_runs_nothing_else() -> None:
    joint = spinning()
    with pytest.raises(BusTimeoutError):
        joint.exchange(b"\xc0\x01\x02", 13)
    joint.arm.run(5.0)
    # No deadman stops it.
    assert joint.speed() == pytest.approx(60.0, abs=0.1)


def test_reading_less_than_there_is_is_safe() -> None:
    joint = Original()
    assert joint.exchange(b"\x0f", 1) == b"O"
    assert joint.exchange(b"\x18", 2)
    assert joint.flags() == NOTHOMED | NOTENABLED


# Power-up.


@pytest.mark.parametrize("after", [0.03, 0.3, 0.55])
def test_a_poll_during_the_start_hangs_the_bus(after: float) -> None:
    joint = Original("j3")
    joint.arm.reset("j3")
    joint.arm.run(after)
    with pytest.raises(BusTimeoutError):
        joint.flags()
    (answer,) = joint.bus.transfer([Transaction(0x11, b"\x0f", 2)])
    assert isinstance(answer, BusTimeoutError)


def test_the_start_turns_the_motor_a_degree_to_and_fro_for_six_tenths_of_a_second() -> None:
    joint = Original("j4")
    start = joint.arm.field("j4")
    joint.arm.reset("j4")
    travel = []
    for _ in range(700):
        joint.arm.run(0.001)
        travel.append((joint.arm.field("j4") - start) / STEPS_PER_DEG)
    assert max(travel) == pytest.approx(1.0, abs=0.02)
    assert min(travel) > -0.02
    moving = [0.001 * i for i in range(1, 700) if abs(travel[i] - travel[i - 1]) > 1e-4]
    assert moving[-1] - moving[0] == pytest.approx(0.6, abs=0.03)
    assert travel[-1] == pytest.approx(0.0, abs=0.02)
    assert joint.flags() == NOTHOMED | NOTENABLED
    joint.arm.run(0.5)
    assert not joint.arm.has_torque("j4")


@pytest.mark.parametrize("spoil", [SimulatedArm.reverse_coil, SimulatedArm.reverse_encoder])
def test_the_start_matches_the_motor_to_its_encoder(
    spoil: Callable[[SimulatedArm, str], None],
) -> None:
    joint = Original("j4")
    spoil(joint.arm, "j4")
    joint.arm.reset("j4")
    joint.arm.run(1.0)
    joint.enable()
    joint.write(Register.MOVETOANGLE, 90.0)
    joint.arm.run(2.0)
    assert joint.number(Register.ANGLEMOVED) == pytest.approx(90.0, abs=0.3)


# The main loop.


def test_a_deferred_command_starts_when_the_loop_comes_round() -> None:
    waits = []
    for scene in range(40):
        joint = Original("j4")
        joint.enable()
        joint.arm.run(0.1 + 0.000731 * scene)
        before = joint.arm.field("j4")
        assert joint.write(Register.CHECKORIENTATION, 10.0) & BUSY
        begun = joint.arm.now()
        while abs(joint.arm.field("j4") - before) < 0.5:
            joint.arm.run(0.0001)
        waits.append(joint.arm.now() - begun)
    assert min(waits) < 0.003
    assert 0.008 < max(waits) < 0.0115


DEFERRED: list[tuple[Register, tuple[float, ...]]] = [
    (Register.HOME, (1, 20, 30, 15)),
    (Register.CHECKORIENTATION, (5.0,)),
]


@pytest.mark.parametrize(("register", "values"), DEFERRED)
def test_home_followed_by_a_frame_within_10_ms_is_lost(
    register: Register, values: tuple[float, ...]
) -> None:
    joint = Original("j4")
    joint.enable()
    assert joint.write(register, *values) & BUSY
    joint.flags()
    # It reports "busy" indefinitely.
    assert joint.stands(30.0)
    assert joint.flags() & BUSY
    assert not joint.write(Register.STOP, 0) & BUSY
    # Without traffic, it moves.
    joint.write(Register.SETUP, 20, 20)
    joint.write(register, *values)
    joint.arm.run(QUIET)
    assert joint.flags() & BUSY
    assert not joint.stands(1.0)


def test_a_write_without_a_read_executes_nothing_and_still_loses_the_command() -> None:
    joint = Original("j4")
    joint.enable()
    joint.write(Register.CHECKORIENTATION, 10.0)
    joint.exchange(b"\x29\x00", 0)
    assert joint.stands()
    assert joint.flags() & BUSY


def test_movesteps_is_executed_at_once_and_not_busy() -> None:
    joint = Original("j4")
    joint.enable()
    assert joint.exchange(b"\x13\x88\x13\x00\x00") == b"\x04"
    assert joint.exchange(b"\x0f", 2) == b"\x4f\x04"
    joint.arm.run(0.5)
    assert joint.number(Register.ANGLEMOVED) == pytest.approx(35.16, abs=1.5)


def test_a_read_without_a_write_executes_the_last_command_again() -> None:
    joint = Original("j4")
    joint.enable()
    joint.arm.remove_stops("j4")
    joint.write(Register.MOVESTEPS, 14222)
    joint.arm.run(1.0)
    joint.exchange(b"")
    joint.arm.run(1.0)
    assert joint.number(Register.ANGLEMOVED) == pytest.approx(200.0, abs=2.0)


@pytest.mark.parametrize("count", [0, 1, 2, 31, 32, 33, 255])
def test_writes_of_odd_lengths_move_nothing_and_are_survived(count: int) -> None:
    for first in (0x00, 0x2A, 0xFF):
        joint = Original("j4")
        joint.enable()
        joint.exchange(bytes((first,) * min(count, 1)) + bytes(max(count - 1, 0)))
        assert joint.stands(QUIET)
        assert joint.flags() == NOTHOMED


def test_a_short_payload_keeps_the_bytes_before() -> None:
    joint = Original("j4")
    joint.write(Register.HOMEOFFSET, 1.5)
    joint.exchange(b"\x2e\x00")
    assert joint.number(Register.HOMEOFFSET) == 1.5


# Silence.


@pytest.mark.parametrize("register", [Register.MOVETOANGLE, Register.MOVESTEPS])
def test_a_position_move_continues_in_silence(register: Register) -> None:
    joint = Original("j4")
    joint.arm.remove_stops("j4")
    joint.enable(rpm=60.0)
    joint.write(register, 1800.0 if register is Register.MOVETOANGLE else 256000)
    joint.arm.run(6.0)
    assert joint.number(Register.ANGLEMOVED) == pytest.approx(1800.0, abs=2.0)
    assert joint.flags() == NOTHOMED


def test_the_deadman_stops_a_velocity_between_50_and_60_ms_of_silence() -> None:
    chance = random.Random(7)
    joint = Original("j4", frequency=100e3)
    joint.arm.remove_stops("j4")
    joint.enable()

    def stopped(silence: float) -> int:
        count = 0
        for _ in range(40):
            joint.write(Register.SETUP, 20, 20)
            joint.arm.run(chance.uniform(0.0, 0.02))
            joint.write(Register.SETRPM, 60.0)
            joint.arm.run(silence)
            count += bool(joint.flags() & NOTENABLED)
        return count

    # The original: 2, 22 and 39 of 40.
    assert stopped(0.045) == 0
    assert 0 < stopped(0.050) <= 8
    assert 16 <= stopped(0.055) <= 32
    assert stopped(0.060) >= 38


def test_any_frame_feeds_the_deadman() -> None:
    joint = spinning()
    for _ in range(50):
        joint.arm.run(0.04)
        assert joint.flags() == NOTHOMED
    assert joint.speed() == pytest.approx(60.0, abs=0.1)
    joint.arm.run(0.2)
    assert joint.speed() == pytest.approx(0.0, abs=0.1)
    assert joint.flags() == NOTHOMED | NOTENABLED
    assert joint.arm.has_torque("j4")


def test_the_deadman_fires_after_stop_but_not_after_a_speed_of_zero() -> None:
    joint = spinning()
    assert not joint.write(Register.STOP, 0) & NOTENABLED
    joint.arm.run(0.065)
    assert joint.flags() & NOTENABLED
    joint = spinning()
    joint.write(Register.SETRPM, 0.0)
    joint.arm.run(1.0)
    assert not joint.flags() & NOTENABLED


# STOP.


@pytest.mark.parametrize("before", [Register.STOP, Register.SETRPM])
def test_stop_then_setmaxvelocity_runs_away(before: Register) -> None:
    joint = Original("j4")
    joint.arm.remove_stops("j4")
    joint.enable()
    joint.write(before, 0)
    assert joint.stands()
    joint.write(Register.SETMAXVELOCITY, 6.0 * 90.0)
    joint.arm.run(30.0)
    # Backwards, with flags that say nothing and no deadman.
    assert joint.speed() == pytest.approx(-90.0, abs=0.1)
    assert joint.flags() == NOTHOMED
    assert joint.number(Register.ANGLEMOVED) < -10000.0


@pytest.mark.parametrize(
    ("register", "values"),
    [
        (Register.SETUP, (20, 20)),
        (Register.MOVETOANGLE, (0.0,)),
        (Register.MOVESTEPS, (0,)),
    ],
)
def test_setmaxvelocity_is_safe_in_position_mode(
    register: Register, values: tuple[float, ...]
) -> None:
    joint = Original("j4")
    joint.enable()
    joint.write(Register.STOP, 0)
    joint.write(register, *values)
    joint.arm.run(QUIET)
    joint.write(Register.SETMAXVELOCITY, 540.0)
    assert joint.stands(1.0)


def test_stop_ignores_its_mode() -> None:
    travel = []
    for mode in (0, 1):
        joint = spinning(300.0)
        before = joint.arm.field("j4")
        joint.write(Register.STOP, mode)
        joint.arm.run(1.0)
        travel.append(joint.arm.field("j4") - before)
    # v^2 / 2a of 1800 deg/s and 5000 deg/s^2, in microsteps, both times.
    assert travel == pytest.approx([324.0 * STEPS_PER_DEG] * 2, rel=0.02)


# STOP within an orientation check.


def stopped_in_its_check() -> Original:
    """Return a joint that a STOP reached before the first target of its check, 10 degrees ahead."""
    joint = Original("j4")
    joint.arm.remove_stops("j4")
    joint.enable(rpm=9.4)
    joint.write(Register.ENABLESTALLGUARD, 6)
    joint.write(Register.CHECKORIENTATION, 10.0)
    joint.arm.run(0.1)
    assert joint.flags() == NOTHOMED | BUSY
    assert joint.write(Register.STOP, 0) == NOTHOMED
    joint.arm.run(0.1)
    assert joint.stands()
    assert 1.0 < joint.number(Register.ANGLEMOVED) < 9.0
    return joint


def test_a_stop_leaves_the_check_waiting_without_deadman_stall_detection_and_main_loop() -> None:
    joint = stopped_in_its_check()
    joint.write(Register.SETRPM, -30.0)
    joint.arm.run(2.0)
    assert joint.speed() == pytest.approx(-30.0, abs=0.1)
    assert joint.flags() == NOTHOMED
    joint.arm.add_obstacle("j4", joint.arm.position("j4") - 0.1)
    joint.arm.run(2.0)
    assert joint.flags() == NOTHOMED
    joint.write(Register.STOP, 0)
    joint.write(Register.HOME, 1, 20, 30, 15)
    joint.arm.run(10.0)
    assert joint.flags() == NOTHOMED | BUSY
    assert joint.stands()


@pytest.mark.parametrize("rpm", [10.0, 20.0, 30.0])
def test_a_speed_across_the_old_target_lets_the_check_turn_the_joint_back(rpm: float) -> None:
    joint = stopped_in_its_check()
    joint.write(Register.SETRPM, rpm)
    speeds = []
    for _ in range(200):
        joint.arm.run(0.01)
        speeds.append(joint.speed())
    assert max(speeds) == pytest.approx(rpm, abs=0.1)
    # 10 degrees at 9.4 rpm, twice.
    assert min(speeds) == pytest.approx(-9.4, abs=0.1)
    assert 0.3 < 0.01 * sum(speed < -5.0 for speed in speeds) < 0.6
    # The check has ended, and the deadman of that speed is alive again.
    assert speeds[-1] == pytest.approx(0.0, abs=0.1)
    assert joint.flags() == NOTHOMED | NOTENABLED


def test_enabling_after_a_stop_lets_the_check_move_on() -> None:
    joint = stopped_in_its_check()
    before = joint.number(Register.ANGLEMOVED)
    joint.write(Register.SETUP, 20, 20)
    joint.arm.run(0.15)
    # The target of SETUP is where the joint stands, so that the check goes on.
    assert abs(joint.number(Register.ANGLEMOVED) - before) > 3.0


# Acceleration.


def rate(joint: Original, acceleration_deg: float) -> float:
    """Return how the field speeds up [deg/s^2] after a SETMAXACCELERATION."""
    joint.write(Register.SETMAXACCELERATION, acceleration_deg)
    joint.write(Register.SETRPM, 3000.0)
    joint.arm.run(0.005)
    before = joint.speed()
    joint.arm.run(0.02048 - RAMP)
    return (joint.speed() - before) / 0.02048 * 6.0


@pytest.mark.parametrize(
    ("at_the_joint", "register"), [(30.0, 64536), (30.4, 65396), (30.46, 65525), (31.0, 1152)]
)
def test_an_acceleration_above_16_bits_wraps(at_the_joint: float, register: int) -> None:
    joint = Original("j4")
    joint.enable()
    wanted = at_the_joint * 12.0 * 57.29577951308232
    # 45.4747 microsteps/s^2 per unit of the register.
    assert rate(joint, wanted) == pytest.approx(register * 45.4747 / STEPS_PER_DEG, rel=0.01)


@pytest.mark.parametrize("register", [Register.MOVESTEPS, Register.MOVETOANGLE])
def test_a_position_move_wraps_its_acceleration_too(register: Register) -> None:
    times = []
    for at_the_joint in (30.0, 31.0):
        joint = Original("j4")
        joint.arm.remove_stops("j4")
        joint.enable(rpm=3000.0, acceleration_deg=at_the_joint * 12.0 * 57.29577951308232)
        joint.write(register, 360.0 if register is Register.MOVETOANGLE else 51200)
        begun = joint.arm.now()
        joint.arm.run(0.1)
        while not joint.stands():
            pass
        times.append(joint.arm.now() - begun)
    # 64536 and 1152 units of the register, and the root of their ratio in time.
    assert times[1] / times[0] > 4.0


def test_with_an_acceleration_of_zero_even_stop_has_no_effect() -> None:
    joint = spinning()
    joint.write(Register.SETMAXACCELERATION, 0.3)
    joint.write(Register.STOP, 0)
    joint.arm.run(2.0)
    assert joint.speed() == pytest.approx(60.0, abs=0.1)


def test_a_small_motion_at_low_acceleration_is_below_1_rpm_for_a_second() -> None:
    joint = Original("j4")
    joint.enable(acceleration_deg=5.0)
    joint.arm.run(0.5)
    before = joint.number(Register.ANGLEMOVED)
    joint.write(Register.MOVESTEPS, 2000)
    for _ in range(10):
        joint.arm.run(0.1)
        assert abs(joint.number(Register.GETENCODERRPM)) < 1.0
    joint.arm.run(4.0)
    assert joint.number(Register.ANGLEMOVED) - before == pytest.approx(14.06, abs=0.3)


# Homing.


def test_home_runs_to_the_end_stop_with_and_without_polling() -> None:
    joint = Original("j1", positions={"j1": 3.0})
    joint.enable(acceleration_deg=57.3 * 0.35)
    assert joint.write(Register.HOME, 0, 10, 30, 15) == NOTHOMED | BUSY
    # 0.5 s of waiting, then 6.05 rad at 0.03 rad/s: 202 s.
    joint.arm.run(195.0)
    assert not joint.stands()
    joint.arm.run(12.0)
    assert joint.stands(0.5)
    assert joint.flags() == 0
    assert joint.arm.position("j1") == pytest.approx(-3.04647, abs=0.01)
    # Within an electrical period and the belt's give.
    assert joint.number(Register.ANGLEMOVED) == pytest.approx(0.0, abs=15.0)


def test_home_waits_half_a_second_before_it_moves() -> None:
    joint = Original("j4")
    joint.enable()
    joint.write(Register.HOME, 1, 20, 30, 15)
    joint.arm.run(LOOP)
    assert joint.stands(0.45)
    assert not joint.stands(0.2)


def test_stop_cancels_a_homing_and_the_joint_is_not_homed() -> None:
    joint = Original("j4", positions={"j4": 0.0})
    joint.enable()
    joint.write(Register.HOME, 1, 20, 30, 15)
    joint.arm.run(1.0)
    assert joint.flags() == NOTHOMED | BUSY
    assert joint.write(Register.STOP, 0) == NOTHOMED
    joint.arm.run(0.1)
    assert joint.stands()
    assert joint.flags() == NOTHOMED


def test_the_homing_offset_is_stored_until_power_off() -> None:
    joint = Original("j4")
    joint.write(Register.HOMEOFFSET, 3.25)
    joint.enable()
    assert joint.number(Register.HOMEOFFSET) == 3.25
    joint.arm.set_power("j4", on=False)
    joint.arm.set_power("j4", on=True)
    joint.arm.run(1.0)
    assert joint.number(Register.HOMEOFFSET) == 0.0


# Enabling and currents.


def test_enabling_turns_nothing_and_switches_stall_detection_off() -> None:
    joint = Original("j4")
    joint.write(Register.SETRPM, 20.0)
    joint.write(Register.ENABLESTALLGUARD, 0)
    joint.arm.run(0.1)
    assert joint.flags() & STALL
    before = joint.arm.field("j4")
    assert joint.write(Register.SETUP, 20, 20) == NOTHOMED
    joint.arm.run(1.0)
    assert abs(joint.arm.field("j4") - before) < 30.0
    assert joint.arm.has_torque("j4")
    assert joint.flags() == NOTHOMED


@pytest.mark.parametrize("register", [Register.SETCURRENT, Register.SETHOLDCURRENT])
def test_a_current_of_zero_is_not_enabled_and_another_current_does_not_help(
    register: Register,
) -> None:
    joint = Original("j4")
    joint.enable()
    assert joint.write(register, 0) & NOTENABLED
    assert joint.write(register, 50) & NOTENABLED
    # The flag prevents no motion.
    joint.write(Register.MOVETOANGLE, 20.0)
    assert not joint.stands()
    assert not joint.write(Register.SETUP, 20, 20) & NOTENABLED


def test_a_joint_loses_its_power_with_the_supply_and_starts_when_it_is_back() -> None:
    joint = spinning()
    joint.arm.set_supply(on=False)
    joint.arm.run(0.5)
    with pytest.raises(NoAcknowledgeError):
        joint.flags()
    assert not joint.arm.has_torque("j4")
    joint.arm.set_supply(on=True)
    joint.arm.run(1.0)
    assert joint.flags() == NOTHOMED | NOTENABLED
    assert joint.stands()


def test_a_joint_whose_controller_is_fed_does_not_notice_that_its_motor_has_no_supply() -> None:
    joint = Original("j4", controllers_fed=True)
    joint.arm.set_supply(on=False)
    joint.enable()
    joint.write(Register.ENABLESTALLGUARD, 6)
    assert joint.flags() == NOTHOMED
    assert not joint.arm.has_torque("j4")
    joint.write(Register.MOVETOANGLE, 30.0)
    joint.arm.run(2.0)
    assert joint.number(Register.ANGLEMOVED) == pytest.approx(0.0, abs=1.5)
    assert joint.flags() == NOTHOMED
    # Its driver kept all settings: with power it turns to the target without a command.
    joint.arm.set_supply(on=True)
    joint.arm.run(2.0)
    assert joint.arm.has_torque("j4")
    assert joint.number(Register.ANGLEMOVED) == pytest.approx(30.0, abs=1.5)


def test_a_motor_supply_that_is_back_while_it_homes_is_an_end_stop_to_it() -> None:
    joint = Original("j4", positions={"j4": 2.0}, controllers_fed=True)
    joint.enable()
    joint.write(Register.HOME, 1, 20, 30, 15)
    joint.arm.run(1.5)
    before = joint.arm.position("j4")
    joint.arm.set_supply(on=False)
    joint.arm.run(5.0)
    assert joint.flags() == NOTHOMED | BUSY
    assert joint.arm.position("j4") == pytest.approx(before, abs=0.05)
    # The rotor jumps into the field that went on turning, by more than the threshold.
    joint.arm.set_supply(on=True)
    joint.arm.run(0.5)
    assert joint.flags() == 0
    assert joint.number(Register.ANGLEMOVED) == pytest.approx(0.0, abs=5.0)
    assert joint.arm.position("j4") == pytest.approx(before, abs=0.05)
    assert joint.arm.has_torque("j4")


def test_without_the_closed_loop_it_is_not_enabled_and_finds_no_stall() -> None:
    joint = Original("j4")
    joint.enable()
    assert joint.write(Register.DISABLECLOSEDLOOP) & NOTENABLED
    joint.enable()
    joint.write(Register.ENABLESTALLGUARD, 6)
    joint.arm.add_obstacle("j4", joint.arm.position("j4") + 0.1)
    joint.write(Register.MOVETOANGLE, 720.0)
    joint.arm.run(2.0)
    assert not joint.flags() & STALL


# Stall.


def test_a_stall_stops_the_joint_energised_and_a_move_is_ignored() -> None:
    joint = Original("j4")
    joint.enable(rpm=120.0)
    joint.write(Register.ENABLESTALLGUARD, 3)
    joint.arm.add_obstacle("j4", joint.arm.position("j4") + 0.1)
    joint.write(Register.MOVETOANGLE, 720.0)
    joint.arm.run(3.0)
    assert joint.flags() == NOTHOMED | STALL
    assert joint.arm.has_torque("j4")
    joint.write(Register.MOVETOANGLE, -90.0)
    assert joint.stands()
    joint.write(Register.ENABLESTALLGUARD, 3)
    assert not joint.flags() & STALL


@pytest.mark.parametrize(("rpm", "found"), [(150.0, True), (400.0, False)])
def test_an_error_that_jumps_by_more_than_100_microsteps_is_no_stall_while_it_lasts(
    rpm: float, *, found: bool
) -> None:
    """With the encoder standing still it jumps to the field's travel in 0.65 ms."""
    joint = spinning(rpm)
    joint.write(Register.ENABLESTALLGUARD, 6)
    joint.arm.freeze_encoder("j4")
    for _ in range(100):
        joint.write(Register.SETRPM, rpm)
        joint.arm.run(0.02)
    assert bool(joint.flags() & STALL) is found


# Its reports, and their times.


def test_the_speed_is_reported_63_ms_late_and_the_position_is_not() -> None:
    joint = spinning(0.0)
    joint.write(Register.SETMAXACCELERATION, 1000.0)
    before = joint.arm.field("j4")
    lags = []
    for cycle in range(45):
        joint.write(Register.SETRPM, 600.0)
        joint.arm.run(0.02)
        if cycle < 25:
            continue
        travelled = (joint.arm.field("j4") - before) / STEPS_PER_DEG
        assert joint.number(Register.ANGLEMOVED) == pytest.approx(travelled, abs=3.0)
        reported = joint.number(Register.GETENCODERRPM)
        lags.append((joint.speed() - reported) * 6.0 / 1000.0)
    assert statistics.mean(lags) == pytest.approx(0.0632, abs=0.002)


TIMES: list[tuple[bytes, int, float]] = [
    (b"\x0f", 2, 4e-6),
    (b"\x18", 5, 5.2e-6),
    (b"\x2c", 5, 5.2e-6),
    (b"\x15\x00\x00\x00\x00", 1, 353e-6),
    (b"\x13\x00\x00\x00\x00", 1, 351e-6),
    (b"\x22\x00", 1, 102e-6),
    (b"\x29\x00", 1, 50e-6),
    (b"\x11\x00\x00\x00\x00", 1, 50e-6),
    (b"\x1a\x14", 1, 34e-6),
    (b"\x1e\x06", 1, 6e-6),
]


@pytest.mark.parametrize(("write", "count", "handler"), TIMES)
@pytest.mark.parametrize(("frequency", "overhead"), [(100e3, 105e-6), (400e3, 80e-6)])
def test_a_handler_holds_the_clock_for_its_time(
    write: bytes, count: int, handler: float, frequency: float, overhead: float
) -> None:
    joint = Original("j4", frequency=frequency)
    begun = joint.arm.now()
    joint.exchange(write, count)
    bits = 30 + 9 * (len(write) - 1) + 9 * count
    assert joint.arm.now() - begun == pytest.approx(overhead + bits / frequency + handler, abs=1e-6)


@pytest.mark.parametrize(
    ("frequency", "write", "read", "measured"),
    [
        (100e3, b"\x15", b"\x18", 8.38e-3),
        (100e3, b"\x11", b"\x2c", 7.11e-3),
        (400e3, b"\x15", b"\x18", 3.64e-3),
        (400e3, b"\x11", b"\x2c", 2.40e-3),
    ],
)
def test_a_cycle_of_four_joints_takes_what_it_takes_on_the_arm(
    frequency: float, write: bytes, read: bytes, measured: float
) -> None:
    arm = SimulatedArm(v1=True, frequency=frequency)
    addresses = (0x11, 0x12, 0x13, 0x14)
    cycle = [Transaction(address, read, 5) for address in addresses]
    cycle += [Transaction(address, write + bytes(4), 1) for address in addresses]
    begun = arm.now()
    FirmwareBus(arm).transfer(cycle)
    assert arm.now() - begun == pytest.approx(measured, rel=0.05)


def test_power_up_flags_and_the_lengths_of_the_answers() -> None:
    joint = Original("j1")
    assert joint.exchange(b"\x0f", 2) == b"O\x0c"
    for register in (0x18, 0x2C, 0x2E):
        assert joint.exchange(bytes((register,)), 5)[4] == NOTHOMED | NOTENABLED
    # Byte 0 is the drive current: 0 of it and 20 % hold leave the joint enabled.
    assert joint.exchange(b"\x10\x00\x14") == bytes((NOTHOMED,))


# Arms of both kinds.


def test_some_joints_of_an_arm_can_be_original() -> None:
    bus = FirmwareBus(SimulatedArm(v1=("j1", "j3")))
    message = READ[Register.HELLO]
    hello = [Transaction(a, message.encode_v2(a, 0), 1) for a in (0x11, 0x12, 0x13, 0x14)]
    firsts = [answer[0] for answer in bus.transfer(hello) if isinstance(answer, bytes)]
    old, magic = NOTHOMED | NOTENABLED | BUSY, MAGIC & 0xFF
    assert firsts == [old, magic, old, magic]
    with pytest.raises(InvalidArgumentError, match="no joint 'j5'"):
        SimulatedArm(v1=("j1", "j5"))
    with pytest.raises(InvalidArgumentError, match="v1"):
        SimulatedArm(v1="j1")
