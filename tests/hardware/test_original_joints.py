"""Joints with their original firmware in the hardware component: rules for each cycle."""

from __future__ import annotations

import logging

import pytest

from bioscara import Robot
from bioscara.bus import Transaction
from bioscara.drivers import Quality
from bioscara.errors import JointLostError, NoAcknowledgeError
from bioscara.hardware import ArmHardware, LifecycleState
from bioscara.protocol import Register, ResetCause
from control.control_stack import PARAMETERS
from drivers.link.test_original import Timed
from simulated import World


@pytest.mark.parametrize("period", [0.01, 0.02])
def test_a_homing_in_the_cycle_is_neither_disturbed_nor_waited_for(period: float) -> None:
    world = World(v1=True)
    timed = Timed(world)
    arm = ArmHardware("arm", world.bus, world.arm.clock, PARAMETERS.joints)
    arm.set_state(LifecycleState.ACTIVE)
    arm.prepare_command_mode_switch(("j4/home",), ())
    arm.perform_command_mode_switch(("j4/home",), ())
    arm.commands["j4/home"].value = 1.0
    qualities, longest, cycles = [], 0.0, 0
    while arm.commands["j4/home"].value:
        start = world.arm.now()
        arm.read(start, period)
        arm.write(start, period)
        longest = max(longest, world.arm.now() - start)
        qualities.append(arm.axes[3].sample.quality)
        assert arm.problems == []
        assert arm.axes[0].sample.quality is Quality.FRESH
        world.arm.clock.sleep_until(start + period)
        cycles += 1
        assert cycles < 60.0 / period
    assert arm.axes[3].joint.is_homed()
    timed.require_quiet()
    stale = qualities.count(Quality.STALE)
    assert 1 <= stale <= 25e-3 / period + 1, "left alone, and said so"
    assert longest < 10e-3, "the cycle that commands it included"


@pytest.mark.parametrize("v1", [True, ("j3",)], ids=["all", "j3"])
def test_connecting_waits_for_silent_joints_with_a_warning(
    v1: bool | tuple[str, ...], caplog: pytest.LogCaptureFixture
) -> None:
    world = World(v1=v1)
    world.arm.set_power("j3", on=False)
    arm = ArmHardware("arm", world.bus, world.arm.clock, PARAMETERS.joints)
    begin = world.arm.now()
    with caplog.at_level(logging.WARNING), pytest.raises(NoAcknowledgeError, match="j3"):
        arm.configure()
    assert world.arm.now() - begin > 1.0
    assert [record.message for record in caplog.records] == [
        "no device acknowledges at the address of j3; waiting 1 s, in case the arm was just "
        "switched on"
    ]


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.009, 0.013, 0.018])
def test_a_joint_that_restarts_in_motion_does_not_block_the_bus(delay: float) -> None:
    world = World(v1=True)
    arm = ArmHardware("arm", world.bus, world.arm.clock, PARAMETERS.joints)
    arm.set_state(LifecycleState.ACTIVE)
    problems = []
    for count in range(80):
        start = world.arm.now()
        if count == 5:
            world.arm.run(delay)
            world.arm.reset("j1", ResetCause.BROWN_OUT)
        arm.read(start, 0.02)
        arm.write(start, 0.02)
        problems += arm.problems
        world.arm.clock.sleep_until(start + 0.02)
    assert [type(problem) for problem in problems] == [JointLostError]
    assert [axis.sample.quality for axis in arm.axes[1:]] == [Quality.FRESH] * 3
    arm.deactivate()
    assert not any(world.arm.has_torque(joint.name) for joint in PARAMETERS.joints)


def test_an_arm_of_both_kinds_homes_and_moves() -> None:
    world = World(v1=("j2", "j4"))
    timed = Timed(world)
    with Robot(world.bus, world.arm.clock, PARAMETERS, "an arm of both kinds") as robot:
        robot.home()
        assert [joint.version for joint in robot.joints] == [2, 1, 2, 1]
        robot.move_joints([-2.5, 0.3, 2.2, 2.5], velocity_scaling=0.5)
        assert robot.state.positions == pytest.approx((-2.5, 0.3, 2.2, 2.5), abs=0.02)
    assert not any(world.arm.has_torque(joint.name) for joint in PARAMETERS.joints[:1])
    timed.require_quiet()
    long = [t for _, _, t in timed.frames if t.address in (0x12, 0x14) and too_long(t)]
    assert long == []


def too_long(transaction: Transaction) -> bool:
    """Return whether an original joint would be overrun, or hold the bus."""
    _, write, read = transaction
    if write[0] == Register.HELLO:
        return read > 1
    return len(write) > 5 or read > 5
