"""One joint against the compiled firmware: life cycle, limits, home, refusals."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from bioscara.bus import Direction, Transaction, When
from bioscara.drivers import Joint, JointSample, Quality, Setpoint, drive, read_states, track
from bioscara.errors import (
    BioscaraError,
    BusTimeoutError,
    CommunicationError,
    CorruptFrameError,
    HomingError,
    IncorrectStateError,
    InvalidArgumentError,
    JointFaultError,
    JointResetError,
    LimitError,
    MotionCancelledError,
    NoAcknowledgeError,
    NotEnabledError,
    NotHomedError,
    NotInitializedError,
    NotSupportedError,
    StalledError,
    WrongJointError,
)
from bioscara.hardware.safe_stop import release, stop_and_disable
from bioscara.protocol import BrakeMode, Capability, Flags, JointState, Register, ResetCause
from entries import entry
from simulated import ARM, World, greeted, home_error, ready

BOTH = pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
STEPS = 12800
HOME = [(p.name, p.home_position) for p in ARM.joints]


@BOTH
def test_init_finds_the_version_and_moves_nothing(v1: bool) -> None:
    world = World(v1=v1)
    joint = world.joints[0]
    before = world.arm.position("j1")
    joint.init()
    assert joint.version == (1 if v1 else 2)
    assert (joint.hello is None) == v1
    assert world.arm.position("j1") == pytest.approx(before, abs=1e-6)
    assert not joint.is_homed()
    assert not joint.is_enabled()
    assert not joint.is_busy()
    assert joint.last.quality is Quality.UNKNOWN
    assert math.isnan(joint.last.velocity)
    with pytest.raises(NotHomedError):
        joint.get_position()
    assert joint.read_state().position is None


def test_init_arms_the_session_and_sets_the_watchdog() -> None:
    world = World()
    earlier = world.joint(ARM.joints[2])
    earlier.init()
    earlier.session.write(Register.WATCHDOG, 200)
    joint = world.joints[2]
    joint.init()
    assert joint.hello is not None
    assert joint.hello.joint == 3
    assert joint.get_flags() & Flags.ARMED
    assert joint.session.read(Register.WATCHDOG).values == (60,)


def test_no_device_at_the_address() -> None:
    world = World()
    joint = world.joint(ARM.joints[0], address=0x15)
    with pytest.raises(NoAcknowledgeError, match=r"j1 \(0x15\).*HELLO"):
        joint.init()


def test_another_joint_at_the_address() -> None:
    world = World()
    joint = world.joint(ARM.joints[0], address=0x12)
    with pytest.raises(WrongJointError, match="reports that it is j2"):
        joint.init()
    with pytest.raises(NotInitializedError):
        joint.enable()


@BOTH
@pytest.mark.parametrize(("index", "home"), list(enumerate(HOME)))
def test_home_sets_the_position_and_disable_removes_the_torque(
    v1: bool, index: int, home: tuple[str, float]
) -> None:
    world = World(v1=v1)
    name, position = home
    joint = world.joints[index]
    seen: list[JointSample] = []
    joint.init()
    joint.home(progress=seen.append)
    assert joint.is_homed()
    assert joint.is_enabled()
    assert joint.readiness.blocking is Register.NONE
    assert any(sample.flags & Flags.BUSY for sample in seen)
    assert all(sample.position is None for sample in seen if sample.flags & Flags.NOTHOMED)
    assert joint.feedback.read_offset() == pytest.approx(position, rel=1e-6)
    error = home_error(name, v1=v1)
    assert joint.get_position() == pytest.approx(world.arm.position(name), abs=error)
    assert abs(joint.get_position() - position) < error + 5e-5
    if not v1:  # An original joint stays where it met the end stop.
        assert abs(joint.get_position() - position) > error / 3.0
        assert joint.parameters.lower < joint.get_position() < joint.parameters.upper
    joint.disable()
    assert not joint.is_enabled()
    world.arm.run(0.2 if v1 else 0.0)
    assert not world.arm.has_torque(name)


@BOTH
def test_a_new_host_knows_the_position_without_homing(v1: bool) -> None:
    world, joint = ready("j4", v1=v1)
    world.arm.run(0.5)  # The belt unwinds.
    position = joint.get_position()
    other = world.joint(ARM.joints[3])
    other.init()
    assert other.is_homed()
    assert other.get_position() == pytest.approx(position, abs=2e-4)


@BOTH
@pytest.mark.parametrize("homed_before", [False, True])
def test_a_home_without_a_stored_offset_does_not_count(v1: bool, homed_before: bool) -> None:
    world = World(v1=v1)
    joint = world.ready("j4")[0] if homed_before else world.joints[3]
    joint.init()
    joint.start_homing()
    while joint.keep_alive() & Flags.BUSY:
        world.arm.run(0.02)
    # The host dies here, before post_homing.
    other = world.joint(ARM.joints[3])
    other.init()
    assert not other.get_flags() & Flags.NOTHOMED
    assert not other.is_homed()
    assert other.read_state().position is None
    with pytest.raises(NotHomedError):
        other.set_position(0.0)


@BOTH
def test_position_and_velocity_are_followed(v1: bool) -> None:
    world, joint = ready("j4", v1=v1)
    target = 2.7
    for _ in range(60):
        joint.set_position(target)
        world.arm.run(0.02)
    assert joint.get_position() == pytest.approx(target, abs=2e-3)
    assert world.arm.position("j4") == pytest.approx(target, abs=5e-3 + home_error("j4", v1=v1))
    for _ in range(40):
        joint.set_velocity(-0.5)
        world.arm.run(0.02)
    assert joint.get_velocity() == pytest.approx(-0.5, rel=0.05)
    joint.stop()
    world.arm.run(0.5)
    assert joint.get_velocity() == pytest.approx(0.0, abs=0.02)


@BOTH
@pytest.mark.parametrize(("index", "share"), [(2, 1.0), (2, 0.05), (3, 0.5), (1, -1.0)])
def test_a_velocity_ends_within_the_limits(v1: bool, index: int, share: float) -> None:
    parameters = ARM.joints[index]
    name, velocity = parameters.name, share * parameters.max_velocity
    near = 0.4 * (parameters.upper - parameters.lower)
    start = parameters.upper - near if share > 0 else parameters.lower + near
    world, joint = ready(name, v1=v1)
    for _ in range(400):
        joint.set_position(start)
        world.arm.run(0.02)

    def run() -> None:
        for _ in range(2000):
            joint.set_velocity(velocity)
            world.arm.run(0.02)

    with pytest.raises(LimitError, match=f"{name} position where.*turn back"):
        run()
    world.arm.run(1.0)
    position = joint.get_position()
    assert parameters.lower <= position <= parameters.upper
    room = parameters.upper - position if share > 0 else position - parameters.lower
    assert room < abs(velocity) * 0.1
    with pytest.raises(LimitError):
        joint.set_velocity(velocity)
    joint.set_velocity(-0.1 * velocity)  # The opposite direction is free.
    world.arm.run(0.02)
    joint.stop()


def test_a_joint_that_brakes_gently_needs_more_room() -> None:
    world, joint = ready("j4")
    upper = joint.parameters.upper
    for _ in range(100):
        joint.set_position(upper - 0.6)
        world.arm.run(0.02)
    joint.set_max_acceleration(1.0)
    joint.set_velocity(0.5)
    with pytest.raises(LimitError, match="j4 position where"):
        joint.set_velocity(1.1)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, 3.1, -3.1])
def test_nothing_is_sent_for_a_bad_setpoint(value: float) -> None:
    world, joint = ready("j4")
    calls = len(world.tap.calls)
    for operation in (joint.set_position, joint.track):
        with pytest.raises(InvalidArgumentError, match="j4 position"):
            operation(value)
    with pytest.raises(InvalidArgumentError, match="j4 velocity"):
        joint.set_velocity(4 * value)
    with pytest.raises(InvalidArgumentError, match="j4 velocity"):
        joint.track(1.0, 4 * value)
    assert len(world.tap.calls) == calls


def test_settings_are_checked() -> None:
    world, joint = greeted("j1")
    calls = len(world.tap.calls)
    cases: list[tuple[Callable[[Any], object], float]] = [
        (joint.settings.set_drive_current, 101),
        (joint.settings.set_hold_current, -1),
        (joint.set_max_acceleration, 2.1),
        (joint.set_max_acceleration, 0.0),
        (joint.set_max_acceleration, math.nan),
        (joint.set_max_velocity, -1.0),
        (joint.set_max_velocity, math.inf),
        (joint.settings.enable_stallguard, 0),
        (joint.settings.enable_stallguard, 256),
        (joint.feedback.store_offset, math.nan),
        (joint.check_orientation, 1.0),
        (joint.start_homing, 0.0),
        (joint.start_homing, 0.9),
    ]
    for operation, value in cases:
        with pytest.raises((InvalidArgumentError, NotEnabledError)):
            operation(value)
    with pytest.raises(ValueError, match="7"):
        joint.settings.set_brake_mode(7)  # type: ignore[arg-type]
    assert len(world.tap.calls) == calls


def test_the_life_cycle_order_is_enforced() -> None:
    world = World()
    joint = world.joints[3]
    with pytest.raises(NotInitializedError):
        joint.set_position(0.0)
    joint.init()
    with pytest.raises(NotEnabledError):
        joint.set_position(0.0)
    joint.enable()
    with pytest.raises(NotHomedError):
        joint.set_position(0.0)
    joint.deinit()
    with pytest.raises(NotInitializedError):
        joint.stop()


def test_settings_reach_the_joint() -> None:
    world, joint = ready("j4")
    joint.set_max_velocity(0.2)
    joint.set_max_acceleration(1.0)
    joint.settings.set_drive_current(25)
    joint.settings.set_brake_mode(BrakeMode.COOL_BRAKE)
    for _ in range(50):
        joint.set_position(2.0)
        world.arm.run(0.02)
    before, start = world.arm.position("j4"), world.arm.now()
    for _ in range(20):
        joint.set_position(2.0)
        world.arm.run(0.02)
    speed = (world.arm.position("j4") - before) / (world.arm.now() - start)
    assert speed == pytest.approx(-0.2, rel=0.05)
    joint.settings.set_hold_current(0)
    assert joint.get_flags() & Flags.NOTENABLED


@BOTH
def test_without_the_closed_loop_a_joint_is_disabled(v1: bool) -> None:
    world, joint = greeted("j1", v1=v1)
    joint.enable()
    joint.settings.disable_closed_loop()
    world.arm.run(0.1)
    assert not joint.is_enabled()
    # Its hold current stays: that alone does not make it count as released.
    assert joint.may_be_energised


def test_steps_can_be_cancelled() -> None:
    world, joint = greeted("j1")
    joint.enable()
    before = world.arm.position("j1")
    with pytest.raises(MotionCancelledError, match="the move was cancelled"):
        joint.move_steps(100 * STEPS, cancel=lambda: abs(joint.last.velocity) > 0.05)
    world.arm.run(0.5)  # the load swings behind its belt
    assert abs(world.arm.velocity("j1")) < 0.01
    displacement = joint.feedback.transmission.microsteps_to_displacement(100 * STEPS)
    assert 0.0 < (world.arm.position("j1") - before) / displacement < 0.5


def test_the_joint_refuses_setpoints_that_the_host_did_not_check() -> None:
    _, joint = greeted("j4")
    with pytest.raises(NotEnabledError, match="SETRPM was refused"):
        joint.session.write(Register.SETRPM, 1.0)
    joint.enable()
    joint.start_homing()
    with pytest.raises(IncorrectStateError, match="MOVETOANGLE was refused"):
        joint.session.write(Register.MOVETOANGLE, 1.0)
    with pytest.raises(IncorrectStateError, match="HOME is running"):
        joint.start_homing()
    joint.stop()
    assert joint.readiness.blocking is Register.NONE


def test_silence_latches_a_fault_that_must_be_cleared() -> None:
    world, joint = ready("j4")
    joint.set_velocity(-1.0)
    world.arm.run(1.0)
    with pytest.raises(JointFaultError) as caught:
        joint.set_velocity(-1.0)
    assert caught.value.fault == "SETPOINT_LOST"
    assert 60 <= caught.value.data <= 63
    with pytest.raises(InvalidArgumentError, match="NONSENSE"):
        joint.clear_fault("NONSENSE")
    joint.clear_fault("SETPOINT_LOST")
    joint.enable()
    assert joint.get_fault().fault == "NONE"
    assert joint.is_homed()


AFTER_A_FAULT: dict[str, Callable[[Joint], object]] = {
    "position": lambda joint: joint.set_position(2.9),
    "velocity": lambda joint: joint.set_velocity(-1.0),
    "steps": lambda joint: joint.move_steps(STEPS),
    "setpoint": lambda joint: joint.track(2.9),
    "check": lambda joint: joint.check_orientation(),
    "enable": lambda joint: joint.enable(),
    "home": lambda joint: joint.home(),
    "start of homing": lambda joint: joint.start_homing(),
    "setpoints": lambda joint: raised(track([joint], [Setpoint(2.9)])[0]),
    "velocities": lambda joint: raised(drive([joint], [-0.1])[0]),
}


def test_a_fault_is_named_by_each_call_that_it_prevents() -> None:
    world, joint = ready("j4")
    joint.set_velocity(-1.0)
    world.arm.run(1.0)
    assert joint.get_flags() & Flags.FAULT
    for name, call in AFTER_A_FAULT.items():
        with entry(name), pytest.raises(JointFaultError) as caught:
            call(joint)
        assert caught.value.fault == "SETPOINT_LOST"
    world.bus.off(When(first=Register.FAULT))
    for name in ("setpoints", "velocities"):
        with entry(name), pytest.raises(NoAcknowledgeError):
            AFTER_A_FAULT[name](joint)


def test_a_homing_that_a_fault_ended_is_not_said_to_be_running() -> None:
    world, joint = greeted("j4")
    joint.start_homing()
    world.arm.run(1.0)
    assert joint.get_flags() & Flags.FAULT
    with pytest.raises(JointFaultError, match="SETPOINT_LOST"):
        joint.enable()


CURRENTS: dict[str, Callable[[Joint], object]] = {
    "hold current": lambda joint: joint.settings.set_hold_current(40),
    "drive current": lambda joint: joint.settings.set_drive_current(40),
    "brake": lambda joint: joint.settings.set_brake_mode(BrakeMode.HARD_BRAKE),
}


@pytest.mark.parametrize("current", list(CURRENTS))
def test_a_disabled_original_joint_with_a_current_may_be_energised_until_it_is_released(
    current: str,
) -> None:
    world, joint = greeted("j4", v1=True)
    CURRENTS[current](joint)
    world.arm.run(0.3)
    assert not joint.is_enabled()
    assert joint.may_be_energised
    if current != "drive current":  # That flows in motion only.
        assert world.arm.has_torque("j4")
    assert release([joint]) == []
    world.arm.run(0.3)
    assert not world.arm.has_torque("j4")
    assert not joint.may_be_energised


def test_a_current_engages_no_disabled_joint_of_version_2() -> None:
    world, joint = greeted("j4")
    for name, current in CURRENTS.items():
        with entry(name):
            current(joint)
            world.arm.run(0.3)
            assert not world.arm.has_torque("j4")
            assert not joint.may_be_energised


def test_the_traceback_of_a_restart_does_not_grow_with_each_call() -> None:
    joint = (world := World()).ready("j4")[0]
    world.arm.reset("j4", ResetCause.BROWN_OUT)
    world.arm.run(0.2)
    lengths = set()
    for _ in range(5):
        with pytest.raises(JointResetError) as raised:
            joint.get_velocity()
        lengths.add(len(raised.traceback))
    # The first call finds the restart, deeper in the driver.
    assert len(lengths) <= 2


@pytest.mark.parametrize("enabled", [True, False])
def test_a_joint_that_restarted_is_not_engaged_by_the_call_that_finds_it(enabled: bool) -> None:
    world = World()
    joint = world.ready("j4")[0] if enabled else world.joints[3]
    joint.init()
    field = world.arm.field("j4")
    world.arm.reset("j4", ResetCause.WATCHDOG)
    world.arm.run(0.5)
    with pytest.raises(JointResetError):
        joint.enable()
    for _ in range(50):
        assert not world.arm.has_torque("j4")
        world.arm.run(0.01)
    assert world.arm.field("j4") == pytest.approx(field, abs=10.0)  # Microsteps.


def restarting_before_setup(world: World, joint: Joint, *, answered: bool) -> None:
    """Let a joint restart between the check before its SETUP and that SETUP, which engages it."""
    transfer = world.tap.transfer

    def restart_first(transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        engages = transactions[0].write[0] == Register.SETUP
        if engages and not world.tap.count(Register.SETUP):
            world.arm.reset(joint.name, ResetCause.BROWN_OUT)
            world.arm.run(0.012)
        results = transfer(transactions)
        if engages and not answered:
            results = [BusTimeoutError("lost", joint.parameters.address)]
        return results

    world.tap.transfer = restart_first  # type: ignore[method-assign]


FINDS: dict[str, Callable[[Joint], object]] = {
    "stop": lambda joint: joint.stop(),
    "flags": lambda joint: joint.get_flags(),
    "cycle": lambda joint: raised(read_states([joint])[0]),
    "release": lambda joint: stop_and_disable([joint]) or joint.get_flags(),
}


def raised(outcome: object) -> None:
    assert isinstance(outcome, BaseException)
    raise outcome


@pytest.mark.parametrize("by", ["enable", *FINDS])
def test_a_joint_that_restarted_and_was_engaged_is_released_at_once(by: str) -> None:
    world, joint = greeted("j4")
    restarting_before_setup(world, joint, answered=by == "enable")
    if by != "enable":
        with pytest.raises(BusTimeoutError):
            joint.enable()
        assert joint.may_be_energised
    world.arm.run(0.002)
    with pytest.raises(JointResetError):
        joint.enable() if by == "enable" else FINDS[by](joint)
    assert world.tap.count(Register.SETUP) >= 1
    world.arm.run(0.3)
    assert not world.arm.has_torque("j4")
    assert release([joint]) == []
    assert not joint.may_be_energised
    del world.tap.transfer
    joint.init()
    joint.enable()
    assert world.arm.has_torque("j4")


def test_a_restarted_joint_that_could_not_be_released_may_be_energised() -> None:
    world, joint = greeted("j4")
    restarting_before_setup(world, joint, answered=True)
    world.bus.off(When(first=Register.SETCURRENT))
    with pytest.raises(JointResetError):
        joint.enable()
    assert joint.may_be_energised
    assert release([joint])[-1].startswith("j4 may be energised: j4: the joint restarted")
    assert joint.may_be_energised
    world.bus.clear()
    joint.init()
    assert release([joint]) == []
    assert not world.arm.has_torque("j4")


def test_a_restart_is_reported_and_never_taken_for_homed() -> None:
    world, joint = ready("j4")
    joint.track(joint.get_position() - 0.01)
    world.arm.reset("j4", ResetCause.BROWN_OUT)
    world.arm.run(0.2)
    with pytest.raises(JointResetError, match="PIN"):
        joint.track(2.9)
    for operation in (joint.get_flags, joint.enable, lambda: joint.set_position(1.0)):
        with pytest.raises(JointResetError):
            operation()
    joint.init()
    assert not joint.is_homed()
    with pytest.raises(NotEnabledError):
        joint.set_position(1.0)
    joint.home()
    assert joint.is_homed()


@BOTH
def test_a_register_in_the_wrong_direction_is_refused_with_the_call_that_fits(v1: bool) -> None:
    joint = World(v1=v1).joints[0]
    joint.init()
    cases: list[tuple[Callable[[Any], object], Register | str, str]] = [
        (joint.session.write, Register.PING, "PING (0x0f) cannot be written; read it: session.re"),
        (joint.session.read, Register.SETRPM, "cannot be read; write it: session.write(Register."),
        (joint.session.read, Register.SETUP, "(Register.SETUP, drive_current, hold_current)"),
        (joint.session.read, Register.NONE, "NONE (0x00) cannot be read; it is never sent"),
        (joint.session.read, "PING", "no register 'PING'; give one of bioscara.protocol.Register"),
    ]
    for call, register, text in cases:
        with pytest.raises(InvalidArgumentError) as refused:
            call(register)
        assert text in str(refused.value)
        assert refused.value.code == -101


def test_check_communication() -> None:
    world, joint = greeted("j1")
    joint.check_communication()
    world.bus.off(When(address=0x11))
    with pytest.raises(NoAcknowledgeError, match=r"j1 \(0x11\), PING"):
        joint.check_communication()


def test_homing_can_be_cancelled() -> None:
    world = World()
    joint = world.joints[0]
    world.arm.set_position("j1", 0.0)
    world.arm.reset("j1")
    joint.init()
    samples: list[JointSample] = []
    with pytest.raises(MotionCancelledError):
        joint.home(progress=samples.append, cancel=lambda: len(samples) > 30)
    assert joint.read_state().state is JointState.HOLDING
    world.arm.run(0.5)
    assert abs(world.arm.velocity("j1")) < 1e-3
    assert joint.get_flags() & Flags.NOTHOMED
    assert joint.readiness.blocking is Register.NONE
    with pytest.raises(IncorrectStateError, match="no homing"):
        joint.post_homing()


@BOTH
def test_functions_are_called_as_documented_or_refused_before_anything_moves(v1: bool) -> None:
    world, joint = greeted("j1", v1=v1)
    joint.enable()
    seen: list[float] = []
    asked: list[float] = []

    def cancel() -> bool:
        asked.append(joint.last.stamp)
        return False

    joint.move_steps(STEPS, lambda sample: seen.append(sample.stamp), cancel)
    assert len(seen) > 1
    assert asked == seen[:-1]  # The last sample is that of the end.
    world.tap.calls.clear()
    begins: list[Callable[..., object]] = [joint.home, partial(joint.move_steps, STEPS)]
    for begin in begins:
        with pytest.raises(InvalidArgumentError, match="cancel is called without arguments: "):
            begin(cancel=lambda sample: sample)
        with pytest.raises(InvalidArgumentError, match="progress is called with the sample: "):
            begin(progress=lambda: None)
    assert world.tap.calls == []


def test_homing_without_end_stop_fails_with_the_fault() -> None:
    world = World()
    joint = world.joints[3]
    world.arm.remove_stops("j4")
    joint.init()
    with pytest.raises(HomingError) as caught:
        joint.home()
    assert (caught.value.fault, caught.value.code) == ("HOMING_TRAVEL", -2)
    assert caught.value.data > 0.0
    assert not joint.is_homed()


@BOTH
def test_an_interrupted_homing_stops(v1: bool) -> None:
    world = World(v1=v1)
    joint = world.joints[0]
    world.arm.set_position("j1", 0.0)
    world.arm.reset("j1")
    joint.init()

    def interrupt(sample: JointSample) -> None:
        if abs(sample.velocity) > 0.02:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        joint.home(progress=interrupt)
    assert world.tap.count(Register.STOP) >= 1
    world.arm.run(2.0)
    assert abs(world.arm.velocity("j1")) < 1e-3


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_move_steps_moves_once_even_if_its_answer_is_lost(v1: bool) -> None:
    world, joint = greeted("j1", v1=v1)
    joint.enable()
    before = world.arm.position("j1")
    world.bus.lose(Direction.BACK, When(first=Register.MOVESTEPS, count=1))
    if v1:
        with pytest.raises(BusTimeoutError, match="may have been executed"):
            joint.move_steps(STEPS)
        world.arm.run(1.0)
        assert world.tap.count(Register.MOVESTEPS) == 1
    else:
        joint.move_steps(STEPS)
        assert world.tap.count(Register.MOVESTEPS) == 2
    moved = world.arm.position("j1") - before
    assert moved == pytest.approx(
        joint.feedback.transmission.microsteps_to_displacement(STEPS), rel=0.1
    )


def test_move_steps_respects_the_limits_of_a_homed_joint() -> None:
    world, joint = ready("j4")
    with pytest.raises(LimitError, match="j4 position"):
        joint.move_steps(51200)
    assert world.tap.count(Register.MOVESTEPS) == 0


@pytest.mark.parametrize("direction", list(Direction))
def test_one_broken_frame_is_repeated_and_executed_once(direction: Direction) -> None:
    world, joint = greeted("j2")
    for register in (Register.PING, Register.STATE, Register.SETMAXACCELERATION):
        for bit in (8, 12, 20):
            flip = world.bus.flip(direction, When(first=register, count=1), bit=bit)
            joint.set_max_acceleration(0.1)
            joint.get_flags()
            joint.read_state()
            assert flip.hits == 1
            world.bus.clear()
    assert joint.get_fault().fault == "NONE"


def test_three_broken_frames_are_an_error() -> None:
    world, joint = greeted("j2")
    flip = world.bus.flip(Direction.BACK, bits=2)
    with pytest.raises(CorruptFrameError, match=r"j2 \(0x12\), PING.*3 tries"):
        joint.get_flags()
    assert flip.hits == 3


def test_disable_tries_every_step() -> None:
    world, joint = greeted("j2")
    joint.enable()
    world.bus.off(When(first=Register.SETHOLDCURRENT))
    world.bus.off(When(first=Register.STATE, count=3))
    with pytest.raises(NoAcknowledgeError, match="STATE"):
        joint.disable()
    assert world.tap.count(Register.SETCURRENT) == 1
    assert world.tap.count(Register.SETBRAKEMODE) == 1
    world.bus.clear()
    assert not joint.is_enabled()


def test_disable_ramps_down_before_it_removes_the_current() -> None:
    world, joint = ready("j4")
    for _ in range(20):
        joint.set_velocity(-2.0)
        world.arm.run(0.02)
    assert abs(world.arm.velocity("j4")) > 1.5
    joint.disable()
    assert joint.read_state().state is JointState.DISABLED
    assert abs(world.arm.velocity("j4")) < 0.01
    assert not world.arm.has_torque("j4")


def test_a_version_1_joint_names_the_firmware_it_lacks() -> None:
    _, joint = ready("j4", v1=True)
    lacking = (joint.get_fault, joint.clear_fault, joint.get_bus_errors)
    for operation in (*lacking, lambda: joint.track(1.0)):
        with pytest.raises(NotSupportedError, match=r"j4: .*firmware 0\.1 or newer"):
            operation()


def test_bus_errors_are_requested_only_from_firmware_that_counts_them() -> None:
    joint = World().ready("j4")[0]
    assert joint.get_bus_errors() == 0
    assert joint.hello is not None
    less = joint.hello.capabilities & ~Capability.BUS_ERRORS
    joint.session.hello = replace(joint.hello, capabilities=less)
    with pytest.raises(NotSupportedError, match="its firmware has no get_bus_errors; flash"):
        joint.get_bus_errors()


def test_the_orientation_check_finds_a_coil_that_was_reversed_later() -> None:
    world, joint = greeted("j4")
    joint.enable()
    world.arm.reverse_coil("j4")
    with pytest.raises(JointFaultError, match="ORIENTATION"):
        joint.check_orientation()
    assert not joint.is_enabled()
    assert not world.arm.has_torque("j4")


@BOTH
def test_the_orientation_check_passes(v1: bool) -> None:
    _, joint = greeted("j4", v1=v1)
    joint.enable()
    joint.check_orientation()
    assert joint.readiness.blocking is Register.NONE


def test_a_delayed_copy_of_arm_does_not_reopen_an_earlier_session() -> None:
    world = World(frequency=None)
    first, second = world.joint(ARM.joints[0]), world.joint(ARM.joints[0])
    first.init()
    late = [t for call in world.tap.calls for t in call if t.write[:1] == bytes((Register.ARM,))]
    world.arm.run(0.1)
    second.init()
    for transaction in late:
        world.bus.transfer([transaction])
    world.arm.run(0.1)
    assert second.get_flags() & Flags.ARMED
    assert second.session.retries == 0
    assert second.get_fault().refusal == "OLD_SEQUENCE"


def test_two_hosts_with_the_same_session_number() -> None:
    world = World(frequency=None)
    first, second = world.joint(ARM.joints[0]), world.joint(ARM.joints[0])
    first.init()
    for _ in range(100):
        first.get_flags()
    second.session._clock = type(
        "Frozen", (), {"now": lambda _: 0.0, "sleep_until": lambda _, __: None}
    )()
    second.init()
    assert second.get_flags() & Flags.ARMED


def test_a_stall_that_was_cleared_stays_cleared_though_the_joint_is_still_pressed() -> None:
    world, joint = ready("j1")
    world.arm.add_obstacle("j1", -2.9)

    def push() -> None:
        for step in range(200):
            joint.track(-3.0 + 0.005 * step, 0.5)
            world.arm.run(0.01)

    with pytest.raises(StalledError):
        push()
    assert joint.is_stalled()
    world.arm.run(0.2)
    joint.disable()
    joint.clear_fault()
    world.arm.run(0.2)
    assert not joint.is_stalled()
    assert not joint.get_flags() & Flags.FAULT
    joint.enable()
    assert joint.is_homed()


SETPOINTS: list[Callable[[Joint], None]] = [
    lambda joint: joint.set_position(-2.9),
    lambda joint: joint.set_velocity(0.1),
    lambda joint: joint.set_velocity(0.0),
    lambda joint: joint.move_steps(STEPS),
]


@pytest.mark.parametrize("v1", [False, True])
@pytest.mark.parametrize("command", [*SETPOINTS, lambda joint: joint.check_orientation()])
def test_a_joint_that_is_not_ready_gets_no_setpoint(
    command: Callable[[Joint], None], v1: bool
) -> None:
    world, joint = ready("j1", v1=v1)
    joint.disable()
    world.tap.calls.clear()
    with pytest.raises(NotEnabledError):
        command(joint)
    assert world.tap.calls == []


@pytest.mark.parametrize("v1", [False, True])
@pytest.mark.parametrize("command", SETPOINTS)
def test_a_motor_that_was_released_unnoticed_is_not_a_success(
    command: Callable[[Joint], None], v1: bool
) -> None:
    world, joint = ready("j1", v1=v1, controllers_fed=True)
    if v1:
        # Another host lets it go.
        world.tap.transfer([Transaction(0x11, bytes((Register.SETCURRENT, 0)), 1)])
    else:
        world.arm.set_supply(False)
    world.arm.run(0.05)
    with pytest.raises(NotEnabledError if v1 else JointFaultError):
        command(joint)


def test_a_move_ended_by_a_fault_raises_the_fault() -> None:
    world, joint = ready("j1", controllers_fed=True)
    with pytest.raises(JointFaultError) as caught:
        joint.move_steps(STEPS, progress=lambda _: world.arm.set_supply(False))
    assert caught.value.fault not in {"", "NONE"}
    assert not joint.is_enabled()


def test_a_restart_between_hello_and_arm_is_reported() -> None:
    world = World()
    joint = world.joints[0]
    transfer = world.tap.transfer

    def restart_first(transactions: Sequence[Transaction]) -> list[bytes | CommunicationError]:
        if transactions[0].write[0] == Register.ARM:
            del world.tap.transfer
            world.arm.reset("j1")
            world.arm.run(0.2)
        return transfer(transactions)

    world.tap.transfer = restart_first  # type: ignore[method-assign]
    with pytest.raises(JointResetError):
        joint.init()
    joint.init()
    assert joint.version == 2


@BOTH
def test_the_homing_offset_of_a_joint_that_is_not_homed_is_refused(v1: bool) -> None:
    world = World(v1=v1)
    joint = world.joints[0]
    with pytest.raises(NotInitializedError):
        joint.feedback.read_offset()
    joint.init()
    for command in (joint.feedback.read_offset, lambda: joint.feedback.store_offset(1.0)):
        with pytest.raises(NotHomedError, match="no homing offset before home"):
            command()
    assert not world.tap.count(Register.HOMEOFFSET)


def test_errors_have_the_codes_of_the_original_driver() -> None:
    world = World()
    joint = world.joints[0]
    codes: list[int] = []

    def provoke(command: Callable[[], object]) -> None:
        with pytest.raises(BioscaraError) as caught:
            command()
        codes.append(caught.value.code)

    absent = world.joint(ARM.joints[0], address=0x15)
    provoke(absent.init)
    provoke(joint.post_homing)
    joint.init()
    provoke(joint.post_homing)
    provoke(joint.get_position)
    provoke(lambda: joint.set_position(0.0))
    provoke(lambda: joint.start_homing(0.0))
    provoke(lambda: joint.start_homing(1e-4))
    provoke(lambda: joint.start_homing(100.0))
    joint.start_homing()
    provoke(joint.start_homing)
    joint.stop()
    assert codes == [-1, -5, -109, -2, -3, -101, -102, -102, -109]


def push(world: World, joint: Joint) -> None:
    """Move j1 from its end stop against an obstacle, for up to 4 s."""
    for _ in range(200):
        joint.set_position(-2.5)
        world.arm.run(0.02)


@BOTH
def test_a_stall_that_is_cleared_lets_the_joint_move_on(v1: bool) -> None:
    world, joint = ready("j1", v1=v1)
    assert joint.get_flags() == joint.get_flags() & Flags.ARMED
    joint.clear_stall()  # There is none: nothing happens.
    if v1:  # An original joint rarely notices an obstacle.
        joint.settings.enable_stallguard(1)
    else:
        world.arm.add_obstacle("j1", -2.9)

    with pytest.raises(StalledError) as caught:
        push(world, joint)
    assert caught.value.code == -4
    world.arm.run(0.5)
    before = joint.get_position()
    joint.clear_stall()
    world.arm.run(0.5)
    assert not joint.is_stalled()
    assert joint.is_enabled()
    assert joint.get_position() == pytest.approx(before, abs=2e-3)
    target = joint.parameters.home_position + 0.05
    for _ in range(100):
        joint.set_position(target)
        world.arm.run(0.02)
    assert joint.get_position() == pytest.approx(target, abs=1e-3)


@pytest.mark.parametrize("kind", [{}, {"v1_frames": True}, {"v1": True}], ids=str)
def test_the_stall_guard_neither_clears_nor_hides_a_stall(kind: dict[str, bool]) -> None:
    world, joint = ready("j1", **kind)
    guard = joint.settings.enable_stallguard
    guard()
    if "v1" in kind:  # An original joint rarely notices an obstacle.
        guard(1)
    else:
        world.arm.add_obstacle("j1", -2.9)
    with pytest.raises(StalledError):
        push(world, joint)
    for threshold in (None, 6, 255):
        world.tap.calls.clear()
        with pytest.raises(StalledError, match=r"j1: the joint stalled; .*clear_stall\(\)"):
            guard(threshold)
        assert world.tap.count(Register.ENABLESTALLGUARD) == 0
        assert joint.is_stalled()
    joint.clear_stall()
    guard()
    assert not joint.is_stalled()


def test_clearing_a_stall_keeps_another_fault() -> None:
    world, joint = ready("j4")
    joint.set_velocity(-0.5)
    world.arm.run(0.3)
    assert joint.get_fault().fault == "SETPOINT_LOST"
    joint.clear_stall()
    world.arm.run(0.5)
    assert joint.get_fault().fault == "SETPOINT_LOST"


def test_an_orientation_check_in_degrees_is_refused_with_the_unit() -> None:
    _, joint = ready("j4")
    with pytest.raises(LimitError, match=r"in rad: 10 degrees are 0\.17453"):
        joint.check_orientation(10)
    joint.check_orientation(0.17453)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (lambda joint: joint.enable(drive_percent=0), "j1 drive current.*disable"),
        (lambda joint: joint.enable(hold_percent=0), "j1 hold current.*disable"),
        (lambda joint: joint.enable(drive_percent=101), "j1 drive current"),
        (lambda joint: joint.check_orientation(math.radians(10.1)), "j1 orientation check angle"),
    ],
)
def test_a_limit_error_names_joint_and_remedy_and_nothing_is_sent(
    command: Callable[[Joint], None], words: str
) -> None:
    world, joint = ready("j1")
    world.tap.calls.clear()
    with pytest.raises(LimitError, match=words):
        command(joint)
    assert world.tap.calls == []


def test_stopping_cannot_be_checked_without_a_position() -> None:
    world, joint = ready("j1")
    sample = joint.read_state()._replace(position=None)
    with pytest.raises(NotHomedError, match="j1: its position is not known"):
        joint.limits.check_stopping(0.1, sample, world.arm.now(), 1.0)


def test_a_released_motor_is_reported_also_near_a_limit() -> None:
    world, joint = ready("j1", v1=True)
    fast = math.copysign(joint.parameters.max_velocity, joint.get_position())
    with pytest.raises(LimitError):
        joint.set_velocity(fast)
    world.tap.transfer([Transaction(0x11, bytes((Register.SETCURRENT, 0)), 1)])
    world.arm.run(0.05)
    with pytest.raises(NotEnabledError):
        joint.set_velocity(fast)
