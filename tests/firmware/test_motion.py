"""Homing, stall detection and tracking of the compiled firmware, in numbers."""

from __future__ import annotations

import math
import random

import pytest

from bioscara.drivers import Joint, Setpoint, track
from bioscara.drivers.joint.sample import JointSample
from bioscara.model import load_parameters
from bioscara.protocol import Fault, Flags, Register
from bioscara.sim import FirmwareBus, SimulatedArm
from firmware.host import Host

ARM = load_parameters()
RPM_PER_RAD_S = 30.0 / math.pi
CREEP = 200.0  # microsteps/s: position correction at standstill


@pytest.mark.parametrize("seed", range(6))
def test_the_arm_homes_from_any_pose_within_two_minutes_and_where_it_should(seed: int) -> None:
    chance = random.Random(seed)
    poses = {j.name: chance.uniform(j.lower + 1e-3, j.upper - 1e-3) for j in ARM.joints}
    arm = SimulatedArm(seed=seed, positions=poses)
    bus = FirmwareBus(arm)
    joints = {j.name: Joint(bus, arm.clock, j) for j in ARM.joints}
    begin = arm.now()
    for name in ARM.homing_order:
        joints[name].init()
        joints[name].home()
    assert arm.now() - begin < 120.0
    # Belts wind up under friction, and encoders err by up to 0.75 degrees of the motor.
    for name, room in (("j1", 2e-3), ("j2", 1e-4), ("j3", 2e-3), ("j4", 3e-3)):
        assert joints[name].get_position() == pytest.approx(arm.position(name), abs=room)


def _running(joint: str, speed: float) -> Host:
    """Return a host whose motor turns at ``speed`` [rad/s], watched for stalls."""
    arm = SimulatedArm(positions={joint: 0.0})
    arm.remove_stops(joint)
    host = Host(joint, arm)
    host.enable()
    host.write(Register.ENABLESTALLGUARD, 6)
    host.write(Register.SETMAXVELOCITY, 20000.0)
    host.write(Register.SETMAXACCELERATION, math.degrees(30.0))
    _keep(host, speed, 0.6 + speed / 30.0)
    return host


def _keep(host: Host, speed: float, seconds: float) -> None:
    end = host.arm.now() + seconds
    while host.arm.now() < end:
        host.write(Register.SETRPM, speed * RPM_PER_RAD_S)
        host.arm.run(0.005)


@pytest.mark.parametrize(("speed", "most"), [(6.0, 0.4), (26.0, 0.1), (70.0, 0.1)])
def test_a_blocked_motor_is_found_stalled_in_time(speed: float, most: float) -> None:
    host = _running("j4", speed)
    assert Flags.STALL not in host.flags()
    host.arm.add_obstacle("j4", host.arm.position("j4") + 0.01)
    blocked = math.inf
    for _ in range(2000):
        host.write(Register.SETRPM, speed * RPM_PER_RAD_S)
        if abs(host.arm.velocity("j4")) < 0.3 * speed / 12 and blocked == math.inf:
            blocked = host.arm.now()
        if Flags.STALL in host.flags():
            break
    assert host.fault() is Fault.STALL
    assert host.arm.now() - blocked < most


@pytest.mark.parametrize("joint", ["j1", "j3", "j4"])
def test_no_stall_is_seen_while_running_healthy_through_the_resonance(joint: str) -> None:
    host = _running(joint, 8.0)
    for speed in (12.0, 14.0, 15.0, 16.0, 17.0, 18.0, 19.0, 20.0, 21.0, 22.0, 24.0, 30.0, 15.0):
        _keep(host, speed, 0.4)
    assert host.fault() is Fault.NONE
    assert Flags.STALL not in host.flags()


def _ramp_error(*, v1: bool) -> float:
    speed, period = 0.314, 0.02
    arm = SimulatedArm(v1=v1, positions={"j1": -3.0})
    joint = Joint(FirmwareBus(arm), arm.clock, ARM.joints[0])
    joint.init()
    joint.home()
    joint.set_max_acceleration(1.57)
    start, begin, due = joint.get_position() + 0.005, arm.now(), arm.now()
    errors = []
    while (now := arm.now()) - begin < 3.0:
        ahead = 0.0 if v1 else period
        (sample,) = track([joint], [Setpoint(start + speed * (now - begin + ahead), speed)])
        assert isinstance(sample, JointSample), sample
        if now - begin > 1.5 and sample.position is not None:
            errors.append(start + speed * (sample.stamp - begin) - sample.position)
        due += period
        arm.clock.sleep_until(due)
    return sum(errors) / len(errors)


def test_tracking_has_no_lag_where_streamed_positions_have_the_lag_of_the_law() -> None:
    assert abs(_ramp_error(v1=False)) < 2e-3
    law = 0.314**2 / (2 * 1.57) + 0.314 * 0.02
    assert _ramp_error(v1=True) == pytest.approx(law, rel=0.1)


def test_homing_can_be_cancelled_at_any_time() -> None:
    for moment in (0.05, 0.5, 2.0, 4.0, 5.0, 5.5, 6.0):
        arm = SimulatedArm(positions={"j3": 1.0})
        host = Host("j3", arm)
        host.enable()
        host.write(Register.HOME, 1, 11, 25, 10)
        host.alive(moment)
        host.write(Register.STOP, 0)
        arm.run(0.3)
        flags = host.flags()
        # The mean: the joint still takes single steps to its place.
        assert abs(host.field_speed(0.1)) < CREEP
        assert Flags.BUSY not in flags
        assert Flags.NOTHOMED in flags
