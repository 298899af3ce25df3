"""HOME, SETUP, orientation checks and accelerations wait for rest, from each state of a joint."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import pytest

from bioscara.bus import Transaction
from bioscara.drivers import Joint
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    IncorrectStateError,
    MotionCancelledError,
)
from bioscara.protocol import Flags, Register
from entries import entry
from simulated import NAMES, World

KINDS = {"v2": {}, "v1 frames": {"v1_frames": True}, "original": {"v1": True}}
"""Our firmware, the same as a host of version 1 sees it, and a model of the original one."""
OF_EACH_KIND = pytest.mark.parametrize("kind", list(KINDS))
WATCHED = 1.5
"""How long a joint is watched after a command [s]."""


def standing(kind: str, name: str) -> tuple[World, Joint]:
    """Return a joint in the middle of its range, initialised."""
    world = World(**KINDS[kind])
    joint = world.joints[NAMES.index(name)]
    parameters = joint.parameters
    world.arm.set_position(name, 0.5 * (parameters.lower + parameters.upper))
    world.arm.reset(name)
    world.arm.run(1.0)
    joint.init()
    return world, joint


def away(joint: Joint) -> float:
    """Return the sign of the direction away from the end stop that homing seeks."""
    return -math.copysign(1.0, joint.parameters.homing.velocity)


def drive_away(world: World, joint: Joint, cycles: int = 40) -> None:
    """Drive a joint at full speed; returns when it refuses or ignores that."""
    speed = away(joint) * joint.parameters.max_velocity
    rpm = joint.feedback.transmission.velocity_to_rpm(speed)
    for _ in range(cycles):
        if joint.session.write(Register.SETRPM, rpm).flags & Flags.STALL:
            break
        world.arm.run(0.01)


def move_away(world: World, joint: Joint, cycles: int = 40) -> None:
    """Move a joint towards a far position."""
    joint.read_state()
    span = joint.parameters.upper - joint.parameters.lower
    distance_deg = 6.0 * joint.feedback.transmission.velocity_to_rpm(0.4 * span * away(joint))
    target = joint.feedback.encoder_deg + distance_deg
    for _ in range(cycles):
        try:
            joint.session.write(Register.MOVETOANGLE, target)
        except BioscaraError:
            break
        world.arm.run(0.01)


def put_obstacle(world: World, joint: Joint) -> None:
    near = away(joint) * (2e-4 if joint.parameters.unit == "m" else 0.01)
    world.arm.add_obstacle(joint.name, world.arm.position(joint.name) + near)


# The states in which a command may find a joint.


def disabled(world: World, joint: Joint) -> None:
    pass


def enabled(world: World, joint: Joint) -> None:
    joint.enable()


def in_a_move(world: World, joint: Joint) -> None:
    joint.enable()
    move_away(world, joint)


def at_a_velocity(world: World, joint: Joint) -> None:
    joint.enable()
    drive_away(world, joint)


def homing(world: World, joint: Joint) -> None:
    joint.enable()
    joint.start_homing(away(joint) * abs(joint.parameters.homing.velocity))
    for _ in range(30):
        world.arm.run(0.03)
        joint.keep_alive()


def stopped_while_homing(world: World, joint: Joint) -> None:
    homing(world, joint)
    joint.stop()


def stopped_before_it_homed(world: World, joint: Joint) -> None:
    joint.enable()
    joint.start_homing(away(joint) * abs(joint.parameters.homing.velocity))
    world.arm.run(0.05)
    joint.stop()


def stalled(world: World, joint: Joint) -> None:
    at_a_velocity(world, joint)
    put_obstacle(world, joint)
    if joint.version == 1:  # An original joint rarely notices an obstacle.
        joint.settings.enable_stallguard(1)
    try:
        drive_away(world, joint, 200)
    except BioscaraError:
        assert joint.version == 2
    assert joint.is_stalled()
    world.arm.clear_obstacles(joint.name)


def cleared(world: World, joint: Joint) -> None:
    stalled(world, joint)
    joint.clear_stall()


def stopped(world: World, joint: Joint) -> None:
    at_a_velocity(world, joint)
    joint.stop()


def stopping_slowly(world: World, joint: Joint) -> None:
    joint.enable()
    joint.set_max_acceleration(0.05 * joint.parameters.max_acceleration)
    drive_away(world, joint, 60)
    joint.stop()


def silent(world: World, joint: Joint) -> None:
    at_a_velocity(world, joint)
    world.arm.run(0.075)
    assert joint.get_flags() & Flags.NOTENABLED or kind_of(joint) == "v1 frames"


def silent_and_cleared(world: World, joint: Joint) -> None:
    silent(world, joint)
    if joint.version == 2:
        joint.clear_fault()


def restarted(world: World, joint: Joint) -> None:
    at_a_velocity(world, joint)
    world.arm.reset(joint.name)
    world.arm.run(1.1)


def restarted_and_known(world: World, joint: Joint) -> None:
    restarted(world, joint)
    joint.init()


def blocked_in_a_move(world: World, joint: Joint) -> None:
    in_a_move(world, joint)
    put_obstacle(world, joint)
    move_away(world, joint, 30)
    world.arm.clear_obstacles(joint.name)


def pushed_away(world: World, joint: Joint) -> None:
    # Its ramp runs, to return to its place, though nothing commanded it.
    joint.enable()
    world.arm.push(joint.name, 5.0 * away(joint))
    for _ in range(40):
        world.arm.run(0.02)
        joint.get_flags()
    world.arm.push(joint.name, 0.0)


def moved_by_another_host(world: World, joint: Joint) -> None:
    other = world.joint(joint.parameters)
    other.init()
    at_a_velocity(world, other)
    joint.init()


def homed_by_another_host(world: World, joint: Joint) -> None:
    other = world.joint(joint.parameters)
    other.init()
    homing(world, other)
    joint.init()


STATES = (
    disabled, enabled, in_a_move, at_a_velocity, homing, stopped_while_homing,
    stopped_before_it_homed, stalled, cleared, stopped, stopping_slowly, silent, silent_and_cleared,
    restarted, restarted_and_known, blocked_in_a_move, pushed_away, moved_by_another_host,
    homed_by_another_host,
)  # fmt: skip


def kind_of(joint: Joint) -> str:
    if joint.version == 2:
        return "v2"
    arm = joint.bus._bus._bus.arm  # type: ignore[attr-defined]
    return "original" if joint.name in arm.originals else "v1 frames"


def set_a_low_acceleration(joint: Joint) -> None:
    joint.set_max_acceleration(0.01 * joint.parameters.max_acceleration)


COMMANDS: tuple[Callable[[Joint], None], ...] = (
    Joint.start_homing,
    Joint.enable,
    Joint.check_orientation,
    set_a_low_acceleration,
)


def require_rest_first(
    kind: str, name: str, state: Callable[[World, Joint], None], command: Callable[[Joint], None]
) -> None:
    """Fail unless a joint in a state executes a command from rest, or comes to rest."""
    world, joint = standing(kind, name)
    state(world, joint)
    arm, parameters = world.arm, joint.parameters
    before, at_speed, begin = arm.position(name), arm.velocity(name), arm.now()
    refused = False
    try:
        command(joint)
    except BioscaraError:
        refused = True
    ramp = parameters.max_velocity / parameters.max_acceleration
    assert arm.now() - begin < 2.0 * (ramp + 1.0) + 1.0, "not in the time that its ramp takes"
    path = [arm.position(name)]
    end = arm.now() + WATCHED
    while arm.now() < end:
        arm.run(0.02)
        path.append(arm.position(name))
        try:
            joint.keep_alive()
        except BioscaraError:
            continue
    farthest = max((place - before) * away(joint) for place in path)
    small = 2e-3 if parameters.unit == "m" else 0.06
    if state is homing:
        assert refused, "it is homing"
        assert farthest > 0.0, "and goes on"
        return
    assert farthest <= 0.5 * ramp * max(abs(at_speed), parameters.max_velocity) + small
    speed = -arm.velocity(name) * away(joint)
    if command is Joint.start_homing and not refused:
        assert speed > 0.0, "it does not seek its end stop"
    else:
        assert abs(speed) < 0.02 * parameters.max_velocity
        returned = farthest - (path[-1] - before) * away(joint)
        assert refused or returned <= small, "it returned"  # A belt that was wound up swings back.
    if command is Joint.enable and not refused:
        assert joint.is_enabled()
        assert arm.has_torque(name)


@pytest.mark.parametrize(
    ("kind", "name"), [("v2", "j4"), ("v1 frames", "j4"), ("original", "j4"), ("original", "j1")]
)
def test_each_command_that_needs_rest_waits_for_it_in_each_state(kind: str, name: str) -> None:
    for state in STATES:
        for command in COMMANDS:
            with entry(f"{state.__name__}, {command.__name__}"):
                require_rest_first(kind, name, state, command)


@OF_EACH_KIND
def test_a_stop_before_a_command_takes_the_configured_acceleration_for_once(kind: str) -> None:
    world, joint = standing(kind, "j4")
    stopping_slowly(world, joint)
    own = joint.settings.max_acceleration
    world.tap.calls.clear()
    joint.check_orientation()
    assert [t.write[:1] for call in world.tap.calls for t in call].count(
        bytes((Register.SETMAXACCELERATION,))
    ) == 2
    assert joint.settings.max_acceleration == own
    begin = world.arm.now()
    drive_away(world, joint, 60)
    seen = abs(world.arm.velocity("j4")) / (world.arm.now() - begin)
    assert seen == pytest.approx(own, rel=0.2)


@OF_EACH_KIND
def test_an_enabled_joint_has_the_acceleration_that_its_new_host_believes(kind: str) -> None:
    world, joint = standing(kind, "j4")
    other = world.joint(joint.parameters)
    other.init()
    other.enable()
    other.set_max_acceleration(0.5)
    joint.init()
    begin = world.arm.now()
    drive_away(world, joint, 20)
    seen = abs(world.arm.velocity("j4")) / (world.arm.now() - begin)
    assert seen == pytest.approx(joint.settings.max_acceleration, rel=0.4)


@pytest.mark.parametrize("v1_frames", [False, True], ids=["original", "v1 frames"])
def test_a_version_1_joint_stays_in_position_mode_though_its_acceleration_is_set(
    v1_frames: bool,
) -> None:
    world, joint = standing("v1 frames" if v1_frames else "original", "j4")
    joint.enable()
    before = world.arm.position("j4")
    joint.set_max_acceleration(1.0)
    joint.set_max_velocity(0.5)
    world.arm.run(0.5)
    assert world.arm.position("j4") == pytest.approx(before, abs=1e-3)


@pytest.mark.parametrize("v1_frames", [False, True], ids=["original", "v1 frames"])
def test_a_joint_that_does_not_come_to_rest_is_refused_with_the_remedy(v1_frames: bool) -> None:
    world, joint = standing("v1 frames" if v1_frames else "original", "j4")
    transfer = world.tap.transfer

    def turn(transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        world.arm.set_position("j4", world.arm.position("j4") - 1e-3)
        return transfer(transactions)

    world.tap.transfer = turn  # type: ignore[method-assign]
    begin = world.arm.now()
    with pytest.raises(
        IncorrectStateError,
        match=r"j4: coming to rest before it is enabled did not end within 1\.33 s; keep away",
    ):
        joint.enable()
    assert world.arm.now() - begin < 1.6
    assert world.tap.count(Register.SETUP) == 0
    assert not world.arm.has_torque("j4")


@OF_EACH_KIND
def test_a_joint_whose_stall_was_cleared_moves_where_it_is_commanded(kind: str) -> None:
    for cycles in range(4):
        world, joint = standing(kind, "j4")
        stalled(world, joint)
        world.arm.run(0.004 * cycles)
        joint.clear_stall()
        with entry(cycles):
            joint.read_state()
            before = joint.feedback.encoder_deg
            joint.move_steps(round(-12800 * away(joint)))
            joint.read_state()
            moved = (joint.feedback.encoder_deg - before) * 51200.0 / 360.0
            assert moved == pytest.approx(-12800 * away(joint), abs=100.0)


@OF_EACH_KIND
def test_a_cancelled_move_ends_at_rest(kind: str) -> None:
    world, joint = standing(kind, "j4")
    joint.enable()
    joint.set_max_acceleration(1.0)
    with pytest.raises(MotionCancelledError):
        joint.move_steps(
            round(100_000 * away(joint)), cancel=lambda: abs(joint.last.velocity) > 0.5
        )
    assert abs(world.arm.velocity("j4")) < 0.1
    field = world.arm.field("j4")
    world.arm.run(1.0)
    assert world.arm.field("j4") == pytest.approx(field, abs=40.0)
