"""Answers that must not be trusted, and a joint that was absent for long."""

from __future__ import annotations

import pytest

from bioscara.bus import Direction, FaultyBus, When
from bioscara.drivers import Joint, JointSample, Quality, Setpoint, read_states, track
from bioscara.errors import (
    CorruptFrameError,
    JointResetError,
    RefusedError,
)
from bioscara.protocol import JointState, Register
from simulated import ARM, World, greeted, ready

ADDRESS = 0x11
ANGLE = When(address=ADDRESS, first=Register.ANGLEMOVED, count=1)
EXPONENT_BIT = 25
"""Of an ANGLEMOVED answer, counted from its first bit: doubles or halves the angle."""
STALL_BIT = 39


def still(joint: Joint) -> Setpoint:
    """Return the setpoint at which the joint is, inside its limits."""
    lower, upper = joint.parameters.lower, joint.parameters.upper
    return Setpoint(min(max(joint.get_position(), lower), upper))


def ready_away_from_home(world: World) -> Joint:
    """Return j1 where an angle that is doubled or halved is far off."""
    (joint,) = world.ready("j1")
    for _ in range(30):
        joint.set_position(-2.9)
        world.arm.run(0.02)
    return joint


@pytest.mark.parametrize("cycles", [119, 126, 127, 128, 129, 200, 255, 256, 300])
def test_stop_and_disable_reach_a_joint_that_missed_many_frames(cycles: int) -> None:
    world, joint = ready("j1", frequency=None)
    setpoint = still(joint)
    away = world.bus.off(When(address=ADDRESS))
    for _ in range(cycles):
        track([joint], [setpoint])
    away.cancel()
    joint.stop()
    world.arm.run(0.005)
    assert joint.read_state().state is JointState.STOPPING
    joint.disable()
    assert not world.arm.has_torque("j1")
    assert joint.is_homed()


@pytest.mark.parametrize("cycles", [119, 128, 200, 300])
def test_cycles_continue_with_a_joint_that_missed_many_frames(cycles: int) -> None:
    world, joint = ready("j1", frequency=None)
    away = world.bus.off(When(address=ADDRESS))
    for _ in range(cycles):
        read_states([joint])
    away.cancel()
    read_states([joint])
    [sample] = read_states([joint])
    assert isinstance(sample, JointSample)
    assert sample.quality is Quality.FRESH


@pytest.mark.parametrize("cycles", [125, 200])
def test_a_joint_that_restarted_while_it_missed_many_frames_is_not_armed_again(cycles: int) -> None:
    world, joint = ready("j1", frequency=None)
    away = world.bus.off(When(address=ADDRESS))
    for _ in range(cycles):
        read_states([joint])
    world.arm.reset("j1")
    world.arm.run(0.2)
    away.cancel()
    world.tap.calls.clear()
    with pytest.raises(JointResetError, match="reset cause PIN"):
        joint.read_state()
    assert world.tap.count(Register.ARM) == 0
    with pytest.raises(JointResetError):
        joint.stop()


@pytest.mark.parametrize("away", range(115, 128))
def test_a_relative_move_keeps_its_sequence_number_in_repetitions(away: int) -> None:
    world, joint = greeted("j1", frequency=None)
    joint.enable()
    absent = world.bus.off(When(address=ADDRESS))
    for _ in range(away):
        read_states([joint])
    absent.cancel()
    world.bus.lose(Direction.BACK, When(first=Register.MOVESTEPS, count=2))
    world.tap.calls.clear()
    joint.session.write(Register.MOVESTEPS, 512)
    moves = [t.write for call in world.tap.calls for t in call if t.write[0] == Register.MOVESTEPS]
    assert len(moves) == 3
    assert len(set(moves)) == 1


def test_a_corrupted_repetition_keeps_its_sequence_number() -> None:
    world, joint = greeted("j1", frequency=None)
    joint.enable()
    world.bus.lose(Direction.BACK, When(first=Register.MOVESTEPS, count=1))
    # In the steps: 7 bits of address and 8 of the register go before them.
    world.bus.flip(Direction.OUT, When(first=Register.MOVESTEPS, after=1, count=1), bit=20)
    world.tap.calls.clear()
    joint.move_steps(512)
    moves = [t.write for call in world.tap.calls for t in call if t.write[0] == Register.MOVESTEPS]
    assert len(moves) == 3
    assert len({frame[-2] for frame in moves}) == 1


@pytest.mark.parametrize("seed", range(10))
def test_homing_whose_answer_was_lost_is_not_started_again(seed: int) -> None:
    world, joint = greeted("j4", frequency=None)
    corrupted = FaultyBus(world.tap, seed)
    joint = Joint(corrupted, world.arm.clock, joint.parameters)
    joint.init()
    joint.enable()
    corrupted.lose(Direction.BACK, When(first=Register.HOME, count=1))
    corrupted.flip(Direction.OUT, When(first=Register.HOME, after=1, count=1))
    joint.home()
    assert joint.is_homed()


def test_a_corrupted_frame_costs_one_more_exchange() -> None:
    world = World()
    joints = world.ready()
    setpoints = [still(joint) for joint in joints]
    # In the position: 7 bits of address and 8 of the register go before it.
    world.bus.flip(Direction.OUT, When(address=ADDRESS, first=Register.TRACKLOAD, count=1), bit=20)
    world.tap.calls.clear()
    samples = track(joints, setpoints, retry=True)
    assert all(isinstance(s, JointSample) and s.quality is Quality.FRESH for s in samples)
    sent = [(t.address, t.write[0]) for call in world.tap.calls for t in call]
    assert sent == [
        (joint.parameters.address, Register.TRACKLOAD) for joint in [*joints, joints[0]]
    ]


def test_a_frame_that_is_refused_twice_raises_the_reason() -> None:
    _, joint = ready("j1")
    [outcome] = track([joint], [Setpoint(0.0)], retry=True)
    assert isinstance(outcome, RefusedError)
    assert outcome.reason == "OUT_OF_RANGE"


@pytest.mark.parametrize("bit", [EXPONENT_BIT, STALL_BIT])
def test_a_cycle_with_an_implausible_version_1_answer_keeps_the_last_sample(bit: int) -> None:
    world = World(v1=True)
    joint = ready_away_from_home(world)
    setpoint = still(joint)
    for _ in range(3):
        [before] = track([joint], [setpoint])
        world.arm.run(0.02)
    world.bus.flip(Direction.BACK, ANGLE, bit=bit)
    [during] = track([joint], [setpoint])
    [after] = track([joint], [setpoint])
    assert isinstance(before, JointSample)
    assert isinstance(during, JointSample)
    assert isinstance(after, JointSample)
    assert (before.quality, during.quality) == (Quality.FRESH, Quality.STALE)
    assert during.position == before.position
    assert after.quality is Quality.FRESH
    assert after.position == pytest.approx(before.position, abs=1e-3)


def test_an_implausible_version_1_answer_is_requested_again() -> None:
    world = World(v1=True)
    joint = ready_away_from_home(world)
    position = joint.read_state().position
    for request in (joint.get_position, lambda: joint.read_state().position):
        world.bus.clear()
        world.bus.flip(Direction.BACK, ANGLE, bit=EXPONENT_BIT)
        assert request() == pytest.approx(position, abs=1e-3)


@pytest.mark.parametrize("bit", range(32))
def test_a_corrupted_homing_offset_is_not_used(bit: int) -> None:
    world, joint = ready("j1", v1=True)
    position = joint.get_position()
    world.bus.flip(Direction.BACK, When(first=Register.HOMEOFFSET, count=1), bit=bit)
    another = world.joint(ARM.joints[0])
    another.init()
    assert another.get_position() == pytest.approx(position, abs=1e-3)


def test_a_homing_offset_that_differs_at_each_reading_is_an_error() -> None:
    world = World(v1=True)
    world.ready("j1")
    world.bus.flip(Direction.BACK, When(first=Register.HOMEOFFSET))
    another = world.joint(ARM.joints[0])
    with pytest.raises(CorruptFrameError, match="homing offset reads differently each time"):
        another.init()
    assert another.version == 0
