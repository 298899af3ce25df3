"""Hazards of the original firmware, each against the compiled new one. HZ15: test_repository."""

from __future__ import annotations

import itertools
import math
import random
import struct

import pytest

from bioscara.bus import Transaction
from bioscara.protocol import (
    READ,
    WRITE,
    Fault,
    Flags,
    JointState,
    Refusal,
    Register,
    ResetCause,
    crc8,
)
from bioscara.sim import SimulatedArm
from firmware.host import NEAR, Host

STILL = 20.0  # microsteps; the field leads the rotor by what friction needs
RPM = 51200.0 / 60.0


def _ready(joint: str = "j4") -> Host:
    host = Host(joint)
    host.enable()
    return host


def _frames(host: Host) -> list[bytes]:
    """One frame of every register a host uses in motion, none of which moves this joint."""
    angle = host.read(Register.ANGLEMOVED)[0]
    return [
        host.frame(READ[Register.GETENCODERRPM]),
        host.frame(READ[Register.ANGLEMOVED]),
        host.frame(READ[Register.STATE]),
        host.frame(READ[Register.FAULT]),
        host.frame(READ[Register.HOMEOFFSET]),
        host.frame(WRITE[Register.STOP], 0),
        host.frame(WRITE[Register.SETRPM], 0.0),
        host.frame(WRITE[Register.MOVETOANGLE], angle),
        host.frame(WRITE[Register.TRACK], angle, 0.0),
        host.frame(WRITE[Register.TRACKLOAD], angle, 0.0),
        host.frame(WRITE[Register.WATCHDOG], 60),
    ]


def test_hz01_no_frame_with_one_or_two_flipped_bits_moves_a_joint() -> None:
    chance = random.Random(1)
    arm = SimulatedArm(positions=NEAR, frequency=None)
    host = Host("j4", arm)
    host.enable()
    before = host.field()
    for frame in _frames(host):
        bits = range(8 * len(frame))
        pairs = list(itertools.combinations(bits, 2))
        for flips in [*((bit,) for bit in bits), *chance.sample(pairs, min(400, len(pairs)))]:
            damaged = bytearray(frame)
            for bit in flips:
                damaged[bit // 8] ^= 1 << bit % 8
            host.bus.transfer([Transaction(host.address, bytes(damaged), 4)])
        arm.run(0.05)
    assert abs(host.field() - before) < STILL
    assert host.state() in {JointState.HOLDING, JointState.POSITION, JointState.VELOCITY}


def test_hz02_a_bare_read_executes_nothing_and_cannot_grow() -> None:
    host = _ready()
    host.write(Register.MOVESTEPS, 500)
    host.alive(0.5)
    before = host.field()
    answers = {host.raw(b"", 13) for _ in range(50)}
    host.alive(0.5)
    assert abs(host.field() - before) < STILL
    assert len(answers) == 1


def test_hz03_a_repeated_relative_move_is_made_once_and_a_late_copy_not_at_all() -> None:
    host = _ready()
    host.alive(0.3)  # until the rotor stands where it should
    before = host.read(Register.ANGLEMOVED)[0]
    frame = host.frame(WRITE[Register.MOVESTEPS], 1000)
    answers = {host.raw(frame, 4) for _ in range(3)}
    assert len(answers) == 1
    for _ in range(2):
        host.alive(0.5)
        moved = host.read(Register.ANGLEMOVED)[0] - before
        assert moved == pytest.approx(1000 * 360 / 51200, abs=0.05)
        # By now it is the copy of an older frame.
        assert all(host.raw(frame, 4)[0] & Flags.REFUSED for _ in range(5))


def test_hz04_a_version_1_host_that_dies_while_homing_leaves_a_joint_that_stops() -> None:
    host = Host("j1", armed=False)
    host.bare(WRITE[Register.SETUP], 20, 20)
    while host.bare(READ[Register.PING]).flags & Flags.BUSY:
        host.arm.run(0.05)
    host.bare(WRITE[Register.SETMAXACCELERATION], math.degrees(0.01 * 35))
    host.bare(WRITE[Register.HOME], 1, 10, 30, 15)
    for _ in range(40):
        host.bare(READ[Register.PING])
        host.arm.run(0.05)
    assert host.arm.velocity("j1") > 0.2
    host.arm.run(1.5)
    assert abs(host.field_speed()) < 200.0  # position correction at standstill


@pytest.mark.parametrize("mode", ["velocity", "position", "track", "homing", "relative"])
def test_hz04_silence_stops_every_mode_within_its_time(mode: str) -> None:
    host = _ready()
    angle = host.read(Register.ANGLEMOVED)[0]
    host.write(Register.SETMAXACCELERATION, 5000.0)
    if mode == "velocity":
        host.write(Register.SETRPM, -60.0)
    elif mode == "position":
        host.write(Register.MOVETOANGLE, angle - 3000.0)
    elif mode == "track":
        for step in range(10):
            host.write(Register.TRACK, angle - 3.6 * step, -30.0)
            host.arm.run(0.01)
    elif mode == "homing":
        host.write(Register.HOME, 0, 11, 30, 10)
        host.alive(0.6)
    else:
        host.write(Register.MOVESTEPS, -400000)
    last = host.arm.now()
    host.arm.run(0.05 if mode != "homing" else 0.03)
    assert abs(host.field_speed()) > 1000.0
    # The deceleration has begun at the latest 60 ms and a tick after the last setpoint.
    host.arm.run(max(0.0, last + 0.062 - host.arm.now()))
    first = abs(host.field_speed())
    assert first == 0.0 or abs(host.field_speed()) < first
    host.arm.run(1.0)
    assert host.field_speed() == 0.0
    assert host.fault() is Fault.SETPOINT_LOST
    assert Flags.NOTENABLED in host.flags()
    assert mode != "homing" or Flags.NOTHOMED in host.flags()


def test_hz05_polls_and_junk_do_not_feed_the_watchdog() -> None:
    host = _ready()
    host.write(Register.SETRPM, -60.0)
    for _ in range(30):
        host.read(Register.STATE)
        host.bare(READ[Register.PING])
        host.raw(b"\x99\x01\x02", 1)
        host.arm.run(0.002)
    host.arm.run(0.5)
    assert host.fault() is Fault.SETPOINT_LOST


def test_hz06_after_a_stop_by_silence_no_setpoint_moves_until_acknowledged_and_enabled() -> None:
    host = _ready()
    host.write(Register.SETRPM, -60.0)
    host.arm.run(0.5)
    before = host.field()
    for register, values in (
        (Register.SETRPM, (-60.0,)),
        (Register.MOVETOANGLE, (0.0,)),
        (Register.TRACK, (0.0, 0.0)),
        (Register.TRACKLOAD, (0.0, 0.0)),
        (Register.MOVESTEPS, (500,)),
        (Register.HOME, (1, 11, 30, 10)),
        (Register.SETUP, (20, 20)),
    ):
        assert host.write(register, *values).flags & Flags.REFUSED
    host.alive(0.3)
    assert host.field() == before
    host.write(Register.CLEARFAULT, Fault.SETPOINT_LOST)
    assert host.write(Register.SETRPM, -60.0).flags & Flags.REFUSED
    host.enable()
    for _ in range(20):
        assert not host.write(Register.SETRPM, -60.0).flags & Flags.REFUSED
        host.arm.run(0.01)
    assert host.field() < before - 100


def test_hz07_frames_of_every_length_are_survived_and_move_nothing() -> None:
    host = _ready()
    before = host.field()
    chance = random.Random(7)
    for size in range(1, 33):
        for _ in range(20):
            host.bus.transfer([Transaction(host.address, chance.randbytes(size), 8)])
        host.arm.run(0.002)
    for register in (Register.SETRPM, Register.MOVETOANGLE, Register.HOME):
        for size in range(33):
            frame = bytes((register,)) + bytes(size)
            host.bus.transfer([Transaction(host.address, frame, 4)])
        host.arm.run(0.002)
    host.arm.run(0.2)
    assert abs(host.field() - before) < STILL


def test_hz08_an_unknown_register_is_refused_counted_and_changes_nothing() -> None:
    host = _ready()
    refusals = host.read(Register.FAULT)[4]
    for code in (0x00, 0x01, 0x21, 0x2F, 0x7F, 0xFF):
        assert not host.raw(bytes((code,)), 1)[0] & Flags.BUSY
    assert host.read(Register.FAULT)[4] == refusals + 6
    assert host.state() is JointState.HOLDING


def test_hz09_an_answer_is_ready_when_it_is_asked_for() -> None:
    # Nothing but the wire takes time: the firmware has no printing and stretches no clock.
    host = _ready()
    frame = host.frame(WRITE[Register.MOVETOANGLE], 0.0)
    start = host.arm.now()
    host.raw(frame, 4)
    assert host.arm.now() - start == pytest.approx((30 + 9 * 6 + 9 * 4) / 100e3 + 105e-6, abs=1e-6)


def test_hz10_homing_touches_twice_and_gives_up_where_nothing_is() -> None:
    host = _ready()
    host.arm.remove_stops("j4")
    flags = host.home()
    assert Flags.NOTHOMED in flags
    assert host.fault() is Fault.HOMING_TRAVEL
    assert abs(host.arm.position("j4") - NEAR["j4"]) < 1.15 * 2 * 3.01069


def test_hz10_an_obstacle_that_yields_is_no_home() -> None:
    host = Host("j1")
    host.enable()
    host.arm.add_obstacle("j1", -3.02, 1.0)
    host.write(Register.HOME, 0, 10, 30, 15)
    for _ in range(500):
        host.alive(0.02)
        if host.arm.velocity("j1") > 0.01:  # It has touched and backs off.
            break
    host.arm.clear_obstacles("j1")
    assert Flags.NOTHOMED in host.idle()
    assert host.fault() is Fault.HOMING_DISAGREEMENT


def test_hz11_an_unhomed_joint_says_so() -> None:
    assert Flags.NOTHOMED in Host("j4").flags()


def test_hz12_one_bad_frame_disables_nothing() -> None:
    host = _ready()
    for _ in range(5):
        frame = bytearray(host.frame(READ[Register.STATE]))
        frame[-1] ^= 0xFF
        host.raw(bytes(frame), 13)
    assert Flags.NOTENABLED not in host.flags()
    assert host.read(Register.FAULT)[3] == 5


def test_hz13_a_joint_tells_its_number_and_refuses_what_does_not_fit() -> None:
    for number in range(1, 5):
        host = Host(f"j{number}", armed=False)
        assert host.read(Register.HELLO)[4] == number
    host = _ready()
    message = WRITE[Register.SETUP]
    frame = bytearray(message.encode_v1((20, 20)) + b"\x00")
    frame[1] = 130
    frame[-1] = host.sequence + 1
    whole = bytes(frame) + bytes((crc8(bytes((host.address << 1,)) + bytes(frame)),))
    assert host.raw(whole, 3)[0] & Flags.REFUSED


@pytest.mark.parametrize("wrong", ["coil", "frozen"])
def test_hz14_a_wrong_orientation_is_found_before_it_runs_away(wrong: str) -> None:
    host = Host("j4")
    before = host.arm.position("j4")
    if wrong == "coil":
        # The first check after a boot sets the direction; a later one finds that it has changed.
        host.enable()
        host.arm.reverse_coil("j4")
        host.write(Register.CHECKORIENTATION, 1.0)
    else:
        host.arm.freeze_encoder("j4")
        host.write(Register.SETUP, 20, 20)
    flags = host.idle()
    assert host.fault() is Fault.ORIENTATION
    assert Flags.NOTENABLED in flags
    assert not host.arm.has_torque("j4")
    # Two degrees of the motor and the rotor's displacement when it finds its place.
    assert abs(host.arm.position("j4") - before) < math.radians(7.2) / 12


def test_hz14_a_check_that_stop_breaks_off_enables_nothing() -> None:
    host = Host("j4")
    host.write(Register.SETUP, 20, 20)
    host.arm.run(0.05)
    host.write(Register.STOP, 0)
    host.alive(0.3)
    assert Flags.NOTENABLED in host.flags()
    assert host.write(Register.SETRPM, 10.0).flags & Flags.REFUSED


def test_a_power_stage_that_a_fault_opened_stays_open() -> None:
    host = _ready()
    host.arm.overheat("j4")
    host.arm.run(0.1)
    host.arm.overheat("j4", False)
    for register in (Register.SETCURRENT, Register.SETHOLDCURRENT):
        host.write(register, 30)
        host.arm.run(0.05)
        assert not host.arm.has_torque("j4")
        assert host.fault() is Fault.OVERTEMPERATURE


def test_hz16_a_hung_controller_does_not_leave_the_motor_turning() -> None:
    host = _ready()
    for _ in range(30):
        host.write(Register.SETRPM, -100.0)
        host.arm.run(0.01)
    host.arm.set_watchdog("j4", False)
    host.arm.hang("j4")
    before = host.field()
    host.arm.run(2.0)
    assert host.field_speed() == 0.0
    assert abs(host.field() - before) < 0.2 * 100.0 * RPM
    # With its watchdog the controller restarts, and the power stage opens.
    host = _ready()
    host.write(Register.SETRPM, -100.0)
    host.arm.run(0.02)
    host.arm.hang("j4")
    host.arm.run(0.2)
    assert not host.arm.has_torque("j4")
    hello = host.read(Register.HELLO)
    assert hello[6] == ResetCause.WATCHDOG


def test_hz17_nothing_moves_at_boot_and_a_stuck_encoder_is_found() -> None:
    arm = SimulatedArm(positions=NEAR)
    before = [arm.field(joint) for joint in NEAR]
    for joint in NEAR:
        arm.reset(joint, ResetCause.POWER_ON)
    arm.run(2.0)
    assert [arm.field(joint) for joint in NEAR] == before
    assert not any(arm.has_torque(joint) for joint in NEAR)


def test_numbers_that_are_not_finite_are_refused_by_the_joint_too() -> None:
    host = _ready()
    for value in (math.nan, math.inf, -math.inf):
        host.sequence += 1
        body = bytes((Register.SETRPM,)) + struct.pack("<f", value) + bytes((host.sequence,))
        frame = body + bytes((crc8(bytes((host.address << 1,)) + body),))
        assert host.raw(frame, 3)[0] & Flags.REFUSED
        assert host.read(Register.FAULT)[2] == Refusal.NOT_FINITE
    assert host.state() is JointState.HOLDING
