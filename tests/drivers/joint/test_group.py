"""Several joints in one call: the cost of a cycle, and the effects of a bad one."""

from __future__ import annotations

import math

import pytest

from bioscara.bus import Direction, When
from bioscara.drivers import Joint, JointSample, Quality, Setpoint, drive, read_states, track
from bioscara.errors import (
    BusUnavailableError,
    InvalidArgumentError,
    JointFaultError,
    JointLostError,
    JointResetError,
    LimitError,
    NotEnabledError,
    NotInitializedError,
)
from bioscara.protocol import JointState, Register
from simulated import World, greeted, ready

BOTH = pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
PERIOD = 0.02


def here(joints: list[Joint]) -> list[Setpoint]:
    """Return setpoints at which the joints are, inside their limits."""
    return [
        Setpoint(
            min(max(joint.get_position(), joint.parameters.lower), joint.parameters.upper), 0.0
        )
        for joint in joints
    ]


def standing(**made: bool) -> tuple[World, list[Joint], list[Setpoint]]:
    """Return all joints, ready, with setpoints at which they stay."""
    world = World(**made)
    joints = world.ready()
    return world, joints, here(joints)


def test_a_cycle_is_one_call_with_one_exchange_per_joint() -> None:
    world, joints, setpoints = standing()
    world.tap.calls.clear()
    samples = track(joints, setpoints)
    assert [[t.write[0] for t in call] for call in world.tap.calls] == [[Register.TRACKLOAD] * 4]
    assert all(isinstance(s, JointSample) and s.quality is Quality.FRESH for s in samples)
    world.tap.calls.clear()
    samples = read_states(joints)
    assert [[t.write[0] for t in call] for call in world.tap.calls] == [[Register.STATE] * 4]
    assert all(isinstance(s, JointSample) and s.state is not None for s in samples)


def test_a_version_1_cycle_is_one_call_too() -> None:
    world, joints, setpoints = standing(v1=True)
    world.tap.calls.clear()
    samples = track(joints, setpoints)
    expected = [Register.MOVETOANGLE, Register.ANGLEMOVED] * 4
    assert [[t.write[0] for t in call] for call in world.tap.calls] == [expected]
    assert all(isinstance(s, JointSample) and s.position is not None for s in samples)
    assert [s.state for s in read_states(joints) if isinstance(s, JointSample)] == [None] * 4


@BOTH
def test_a_ramp_is_followed(v1: bool) -> None:
    world = World(v1=v1)
    joints = world.ready()
    start = [setpoint.position for setpoint in here(joints)]
    speeds = [0.1, -0.01, -0.2, -0.2]
    cycles, duration = 80, 80 * PERIOD
    time = world.arm.now()
    for cycle in range(1, cycles + 1):
        # The setpoint is for the next cycle; smooth at both ends.
        x = min(cycle / (cycles - 10), 1.0)
        share, rate = x * x * (3 - 2 * x), 6 * x * (1 - x) / ((cycles - 10) * PERIOD)
        setpoints = [
            Setpoint(q + v * duration * share, v * duration * rate)
            for q, v in zip(start, speeds, strict=True)
        ]
        outcomes = track(joints, setpoints)
        assert all(isinstance(outcome, JointSample) for outcome in outcomes)
        time += PERIOD
        world.arm.clock.sleep_until(time)
    for joint, setpoint in zip(joints, setpoints, strict=True):
        size = math.radians(10.0) / abs(joint.parameters.reduction)
        assert joint.get_position() == pytest.approx(setpoint.position, abs=size)


@pytest.mark.parametrize("bad", [math.nan, math.inf, 4.0])
def test_one_bad_setpoint_prevents_all_frames(bad: float) -> None:
    world, joints, setpoints = standing()
    world.tap.calls.clear()
    for index in range(4):
        wrong = list(setpoints)
        wrong[index] = Setpoint(bad, 0.0)
        with pytest.raises(InvalidArgumentError, match=f"j{index + 1} position"):
            track(joints, wrong)
        wrong[index] = Setpoint(setpoints[index].position, 3 * bad)
        with pytest.raises(InvalidArgumentError, match=f"j{index + 1} velocity"):
            track(joints, wrong)
    with pytest.raises(InvalidArgumentError, match="3 setpoints for 4 joints"):
        track(joints, setpoints[:3])
    assert world.tap.calls == []
    assert track([], []) == []


@BOTH
def test_a_joint_that_cannot_move_does_not_block_the_others(v1: bool) -> None:
    world, joints, setpoints = standing(v1=v1)
    joints[1].disable()
    world.tap.calls.clear()
    outcomes = track(joints, setpoints)
    assert isinstance(outcomes[1], NotEnabledError)
    assert sum(isinstance(outcome, JointSample) for outcome in outcomes) == 3
    assert all(t.address != 0x12 for call in world.tap.calls for t in call)
    joints[1].deinit()
    assert isinstance(read_states(joints)[1], NotInitializedError)


@BOTH
def test_one_bad_cycle_gives_the_last_sample(v1: bool) -> None:
    world, joints, setpoints = standing(v1=v1)
    before = track(joints, setpoints)
    world.bus.off(When(address=0x13, count=1))
    outcomes = track(joints, setpoints)
    stale = outcomes[2]
    assert isinstance(stale, JointSample)
    assert isinstance(before[2], JointSample)
    assert stale == before[2]._replace(quality=Quality.STALE)
    assert joints[2].cycle.failures == 1
    again = track(joints, setpoints)[2]
    assert isinstance(again, JointSample)
    assert again.quality is Quality.FRESH
    assert joints[2].cycle.bad_cycles == 0


@BOTH
@pytest.mark.parametrize("direction", list(Direction))
def test_a_retry_recovers_the_cycle(v1: bool, direction: Direction) -> None:
    world, joints, setpoints = standing(v1=v1)
    world.bus.lose(direction, When(address=0x13, count=1))
    world.tap.calls.clear()
    outcomes = track(joints, setpoints, retry=True)
    assert all(isinstance(o, JointSample) and o.quality is Quality.FRESH for o in outcomes)
    assert joints[2].cycle.failures == 0
    if not v1 and direction is Direction.BACK:
        # The very same frame, so that the joint answers from memory and executes it once.
        frames = [t for call in world.tap.calls for t in call if t.address == 0x13]
        assert len(frames) == 2
        assert frames[0] == frames[1]


@BOTH
def test_the_third_bad_cycle_in_a_row_is_a_lost_joint(v1: bool) -> None:
    world, joints, setpoints = standing(v1=v1)
    track(joints, setpoints)
    if v1:
        # A joint that does not acknowledge is lost at once: tests/drivers/link/test_original.py.
        world.bus.lose(Direction.OUT, When(address=0x14))
    else:
        world.bus.off(When(address=0x14))
    for _ in range(2):
        outcome = track(joints, setpoints, retry=True)[3]
        assert isinstance(outcome, JointSample)
        assert outcome.quality is Quality.STALE
    for bad in (3, 4):
        outcomes = track(joints, setpoints)
        lost = outcomes[3]
        assert isinstance(lost, JointLostError)
        assert (lost.joint, lost.bad_cycles, lost.address) == ("j4", bad, 0x14)
        assert lost.reason is not None
        assert "injected fault" in str(lost)
        assert sum(isinstance(outcome, JointSample) for outcome in outcomes) == 3
    world.bus.clear()
    assert isinstance(read_states(joints)[3], JointSample)


def test_broken_frames_are_dropped_and_counted() -> None:
    world, joints, setpoints = standing()
    track(joints, setpoints)
    world.bus.flip(Direction.OUT, When(address=0x11, count=1), bit=20)
    outcome = track(joints, setpoints)[0]
    assert isinstance(outcome, JointSample)
    assert outcome.quality is Quality.STALE
    report = joints[0].get_fault()
    assert (report.fault, report.crc_errors) == ("NONE", 1)
    world.bus.flip(Direction.OUT, When(address=0x11, count=1), bit=20)
    retried = track(joints, setpoints, retry=True)[0]
    assert isinstance(retried, JointSample)
    assert retried.quality is Quality.FRESH


def test_a_noisy_bus_moves_nothing_and_loses_little() -> None:
    world, joints, setpoints = standing()
    track(joints, setpoints)
    world.arm.run(0.04)
    before = [world.arm.position(joint.name) for joint in joints]
    flips = [
        world.bus.flip(direction, When(probability=0.03), bits=bits)
        for direction in Direction
        for bits in (1, 2)
    ]
    outcomes = []
    for _ in range(300):
        outcomes += track(joints, setpoints, retry=True)
        world.arm.run(PERIOD)
    world.bus.clear()
    assert all(flip.hits > 20 for flip in flips)
    assert all(isinstance(outcome, JointSample) for outcome in outcomes)
    assert sum(o.quality is Quality.STALE for o in outcomes if isinstance(o, JointSample)) < 60
    for joint, position in zip(joints, before, strict=True):
        size = math.radians(10.0) / abs(joint.parameters.reduction)
        assert world.arm.position(joint.name) == pytest.approx(position, abs=size)
        report = joint.get_fault()
        assert report.fault == "NONE"
        assert report.crc_errors > 0


def test_a_restart_in_a_cycle_is_reported() -> None:
    world, joints, setpoints = standing()
    track(joints, setpoints)
    world.arm.reset("j3")
    world.arm.run(0.05)
    for outcomes in (track(joints, setpoints), track(joints, setpoints), read_states(joints)):
        assert isinstance(outcomes[2], JointResetError)
        assert sum(isinstance(outcome, JointSample) for outcome in outcomes) == 3


def test_a_fault_in_a_cycle_is_reported() -> None:
    world = World()
    joints = world.ready("j4")
    joints[0].set_velocity(-1.0)
    world.arm.run(0.5)
    outcome = track(joints, [Setpoint(2.0)])[0]
    assert isinstance(outcome, JointFaultError)
    assert outcome.fault == "SETPOINT_LOST"
    sample = read_states(joints)[0]
    assert isinstance(sample, JointSample)
    assert sample.state is JointState.FAULTED


def test_a_bad_cycle_without_an_earlier_sample_is_its_error() -> None:
    world, joint = greeted("j1")
    world.bus.off()
    assert not isinstance(read_states([joint])[0], JointSample)


def test_a_bus_that_is_gone_and_joints_of_two_buses() -> None:
    world, other = World(), World()
    joints = world.ready("j3", "j4")
    other.joints[0].init()
    with pytest.raises(InvalidArgumentError, match="another bus"):
        read_states([*joints, other.joints[0]])
    world.bus.unavailable(1)
    with pytest.raises(BusUnavailableError):
        read_states(joints)


def test_a_limit_error_has_the_limits() -> None:
    world = World()
    joints = world.ready("j4")
    with pytest.raises(LimitError) as caught:
        track(joints, [Setpoint(3.2, 0.0)])
    assert (caught.value.name, caught.value.value) == ("j4 position", 3.2)
    assert caught.value.upper == 3.01069


@BOTH
def test_velocities_go_to_all_joints_in_one_call_of_one_exchange_each(v1: bool) -> None:
    world = World(v1=v1)
    joints = world.ready()
    speeds = [0.2, -0.01, -0.5, -0.5]
    for cycle in range(60):
        if cycle == 40:
            before = [world.arm.position(joint.name) for joint in joints]
        start = world.arm.now()
        read_states(joints)
        world.tap.calls.clear()
        outcomes = drive(joints, speeds)
        assert [[t.write[0] for t in call] for call in world.tap.calls] == [[Register.SETRPM] * 4]
        world.arm.clock.sleep_until(start + PERIOD)
    for joint, speed, outcome, at in zip(joints, speeds, outcomes, before, strict=True):
        moved = world.arm.position(joint.name) - at
        assert moved / (20 * PERIOD) == pytest.approx(speed, rel=0.1)
        assert isinstance(outcome, JointSample)
        assert outcome.position == joint.last.position


def test_a_wrong_number_of_velocities_sends_nothing() -> None:
    world = World()
    joints = world.ready("j1", "j3")
    world.tap.calls.clear()
    with pytest.raises(LimitError, match="j3 velocity"):
        drive(joints, [0.1, 99.0])
    with pytest.raises(InvalidArgumentError, match="is nan, which is not a finite number"):
        drive(joints, [math.nan, 0.1])
    with pytest.raises(InvalidArgumentError, match="1 velocities for 2 joints"):
        drive(joints, [0.1])
    assert world.tap.calls == []


@BOTH
def test_a_joint_too_near_its_limit_is_stopped_and_the_others_are_driven(v1: bool) -> None:
    world = World(v1=v1)
    joints = world.ready("j3", "j4")
    stopped = driven = False
    for _ in range(80):
        start = world.arm.now()
        read_states(joints)
        toward, away = drive(joints, [1.0, -1.0])
        stopped = stopped or isinstance(toward, LimitError)
        driven = isinstance(away, JointSample)
        world.arm.clock.sleep_until(start + PERIOD)
    assert stopped
    assert driven
    frames = [t.write for call in world.tap.calls for t in call if t.address == 0x13]
    # With original firmware a speed of zero: STOP would leave its deadman armed.
    ended = bytes((Register.SETRPM, 0, 0, 0, 0)) if v1 else bytes((Register.STOP,))
    assert any(frame.startswith(ended) for frame in frames)
    # The joint's own zero is as good as its homing.
    assert world.arm.position("j3") <= joints[0].parameters.upper + 2e-3
    assert world.arm.velocity("j4") == pytest.approx(-1.0, rel=0.1)


def test_an_old_sample_leaves_less_stopping_distance() -> None:
    _, joint = ready("j3")
    read_states([joint])
    here = joint.get_position()
    speed = 1.0
    # At this distance a fresh sample leaves just enough room, one of 0.1 s ago does not.
    room = speed * 0.06 + speed**2 / (2.0 * joint.parameters.max_acceleration)
    joint.feedback.last = joint.last._replace(
        position=joint.parameters.upper - room - 0.01, velocity=0.0
    )
    assert here < joint.parameters.upper
    assert isinstance(drive([joint], [speed])[0], JointSample)
    joint.feedback.last = joint.last._replace(stamp=joint.clock.now() - 0.1)
    assert isinstance(drive([joint], [speed])[0], LimitError)


def test_setpoints_of_a_joint_found_outside_only_lead_back() -> None:
    _, joint = ready("j3")
    lower = joint.parameters.lower
    joint.limits.start_from(lower - 0.2)
    with pytest.raises(LimitError):
        track([joint], [Setpoint(lower - 0.21)])
    track([joint], [Setpoint(lower - 0.1)])
    with pytest.raises(LimitError):
        track([joint], [Setpoint(lower - 0.15)])
    track([joint], [Setpoint(lower)])
    with pytest.raises(LimitError):
        track([joint], [Setpoint(lower - 0.01)])


def test_a_joint_that_is_not_ready_is_not_driven() -> None:
    world = World()
    joints = world.ready("j3", "j4")
    joints[0].disable()
    read_states(joints)
    world.tap.calls.clear()
    assert isinstance(drive(joints, [-0.1, -0.1])[0], NotEnabledError)
    assert world.tap.count(Register.SETRPM) == 1
