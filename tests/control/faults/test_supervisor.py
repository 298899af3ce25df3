"""From a fault to its end: nothing moves unasked, no fault is cleared unseen."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara.control.faults.kinds import ArmFault, FaultKind, Stop, classify
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import (
    BusTimeoutError,
    CommunicationError,
    ControllerError,
    CorruptFrameError,
    FaultedError,
    FollowingError,
    HardwareError,
    HomingError,
    JointFaultError,
    JointLostError,
    NoAcknowledgeError,
    OverrunError,
    RefusedError,
    StalledError,
    SwitchError,
)
from bioscara.hardware import LifecycleState
from control.control_stack import NAMES, NEAR, World
from control.loop.test_loop import come_to_rest, moving
from entries import entry
from flight_records import read_record

FORWARD = "forward_command_controller/ForwardCommandController"


def field(world: World) -> list[float]:
    return [world.arm.field(name) for name in NAMES]


def faulted(folder: Path) -> World:
    world = moving(folder)
    world.supervisor.fault(ControllerError("it broke", "forward"), "forward", world.clock.now())
    return world


def test_every_kind_has_an_action() -> None:
    for kind in list(FaultKind):
        with entry(kind):
            assert kind.action
            assert kind.action in str(ArmFault(kind, "j1", HardwareError("x"), 0.0))


@pytest.mark.parametrize(
    ("cause", "kind"),
    [
        (JointFaultError("x", "j1", "OVERTEMPERATURE"), FaultKind.OVERTEMPERATURE),
        (JointFaultError("x", "j1", "ENCODER"), FaultKind.JOINT_FAULT),
        (StalledError("x", "j1"), FaultKind.STALL),
        (JointLostError("x", 0x11, "j1"), FaultKind.JOINT_LOST),
        (RefusedError("x", 0x11, "OUT_OF_RANGE", "j1"), FaultKind.JOINT_FAULT),
        (NoAcknowledgeError("x", 0x11), FaultKind.BUS_FAILED),
        (OverrunError("x"), FaultKind.OVERRUN),
        (ZeroDivisionError(), FaultKind.CONTROLLER_FAILED),
    ],
)
def test_causes_are_distinguished(cause: BaseException, kind: FaultKind) -> None:
    assert classify(cause) is kind


def test_a_fault_ramps_the_arm_down_and_is_latched_until_it_was_acknowledged_and_recovered(
    tmp_path: Path,
) -> None:
    world = faulted(tmp_path)
    supervisor = world.supervisor
    with pytest.raises(FaultedError, match="coming to rest"):
        supervisor.acknowledge()
    come_to_rest(world)
    for not_yet in (lambda: supervisor.recover(world.clock.now()), supervisor.require_clear):
        with pytest.raises(FaultedError, match="acknowledge"):
            not_yet()
    with pytest.raises(SwitchError, match="it broke"):
        world.switch("forward", off=("hold",))
    before = field(world)
    (fault,) = supervisor.acknowledge()
    assert fault.evidence is not None
    assert fault.evidence.exists()
    assert world.hardware.state is LifecycleState.ACTIVE
    with pytest.raises(SwitchError, match="it broke"):
        world.switch("forward", off=("hold",))
    supervisor.recover(world.clock.now())
    assert supervisor.state is FaultState.CLEAR
    assert world.hardware.state is LifecycleState.INACTIVE
    world.arm.run(0.5)
    assert field(world) == pytest.approx(before, abs=60.0)
    world.hardware.activate()
    world.loop.restart()
    world.run(0.1)
    assert all(axis.homed for axis in world.hardware.axes)
    assert supervisor.state is FaultState.CLEAR


def test_a_joint_that_refuses_a_setpoint_is_named_and_not_the_bus() -> None:
    world = moving()
    world.joint("j1").set_max_velocity(0.01)
    world.run(0.1)
    (fault,) = world.supervisor.faults
    assert (fault.kind, fault.source) == (FaultKind.JOINT_FAULT, "j1")
    assert "OUT_OF_RANGE" in str(fault)


def test_acknowledging_without_a_fault_is_refused() -> None:
    with pytest.raises(FaultedError, match="no fault"):
        World(home=False).supervisor.acknowledge()


def test_evidence_that_cannot_be_written_keeps_the_fault(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    world = faulted(in_the_way / "folder")
    come_to_rest(world)
    with pytest.raises(OSError, match="file"):
        world.supervisor.acknowledge()
    assert world.supervisor.state is FaultState.LATCHED


def test_evidence_shows_the_time_before_the_fault_however_late_it_is_written(
    tmp_path: Path,
) -> None:
    world = faulted(tmp_path)
    struck = world.clock.now()
    come_to_rest(world)
    world.run(30.0)
    (fault,) = world.supervisor.acknowledge()
    record = read_record(fault.evidence)
    assert "it broke" in record.faults[0]
    times = record.times
    assert times[0] < struck < times[-1] < struck + 6.0


def test_evidence_of_before_is_never_replaced(tmp_path: Path) -> None:
    for _ in range(2):
        world = faulted(tmp_path)
        come_to_rest(world)
        world.supervisor.acknowledge()
    assert len(list(tmp_path.glob("*.mcap"))) == 2
    assert not list(tmp_path.glob("*.part"))


def test_a_fault_after_the_acknowledgement_has_to_be_acknowledged_too(tmp_path: Path) -> None:
    world = faulted(tmp_path)
    come_to_rest(world)
    world.supervisor.acknowledge()
    world.supervisor.fault(StalledError("j1 stalled", "j1"), "j1", world.clock.now())
    come_to_rest(world)
    with pytest.raises(FaultedError):
        world.supervisor.recover(world.clock.now())
    first, second = world.supervisor.acknowledge()
    assert len(read_record(first.evidence).faults) == 1
    assert "j1 stalled" in read_record(second.evidence).faults[1]


def test_a_persistent_fault_is_reported_once(tmp_path: Path) -> None:
    world = moving(tmp_path)
    for name in NAMES:
        world.arm.set_power(name, on=False)
    world.run(3.0)
    sources = [(fault.kind, fault.source) for fault in world.supervisor.faults]
    assert len(sources) == len(set(sources)) <= len(NAMES) + 2


def test_a_recovery_that_fails_keeps_the_fault_and_can_be_repeated(tmp_path: Path) -> None:
    world = faulted(tmp_path)
    come_to_rest(world)
    world.supervisor.acknowledge()
    world.bus.off()
    with pytest.raises(Exception, match=r"0x11|j1"):
        world.supervisor.recover(world.clock.now())
    assert world.supervisor.state is FaultState.ACKNOWLEDGED
    world.bus.clear()
    world.arm.run(0.2)
    world.supervisor.recover(world.clock.now())
    assert world.supervisor.state is FaultState.CLEAR


def test_overtemperature_ramps_down_and_then_releases(tmp_path: Path) -> None:
    world = moving(tmp_path)
    world.supervisor.fault(
        JointFaultError("j1 is hot", "j1", "OVERTEMPERATURE"), "j1", world.clock.now()
    )
    assert world.hardware.state is LifecycleState.ACTIVE
    come_to_rest(world)
    assert world.hardware.state is LifecycleState.INACTIVE
    assert not world.arm.has_torque("j1")


def test_the_stop_does_not_raise_whatever_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    world = moving()

    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(world.manager, "take_over", broken)
    world.supervisor.stop(world.clock.now())
    assert world.hardware.state is LifecycleState.INACTIVE
    monkeypatch.setattr(world.manager, "set_hardware_state", broken)
    world.hardware.state = LifecycleState.ACTIVE
    for _ in range(2):
        world.supervisor.crash(RuntimeError("broken"), world.clock.now())
    assert [fault.kind for fault in world.supervisor.faults] == [
        FaultKind.LOOP_FAILED,
        FaultKind.HARDWARE_FAILED,
    ]
    with pytest.raises(FaultedError):
        world.supervisor.require_clear()


def test_every_fault_keeps_the_seconds_before_it_whatever_comes_later(tmp_path: Path) -> None:
    world = moving(tmp_path)
    times = []
    for name in ("j1", "j2"):
        times.append(world.clock.now())
        world.supervisor.fault(FollowingError("it is off", name, 1.0, 0.5), name, times[-1])
        world.run(20.0)
    for fault, struck in zip(world.supervisor.acknowledge(), times, strict=True):
        rows = read_record(fault.evidence).times
        assert rows[0] < struck < rows[-1] + world.loop.period < struck + 6.0


def test_a_joint_that_overheats_after_another_fault_releases_the_arm() -> None:
    world = moving()
    cause = FollowingError("it is off", "j1", 1.0, 0.5)
    world.supervisor.fault(cause, "j1", world.clock.now())
    world.run(1.0)
    world.arm.overheat("j3")
    world.run_until(lambda: len(world.supervisor.faults) > 1)
    come_to_rest(world)
    assert world.supervisor.faults[1].kind is FaultKind.OVERTEMPERATURE
    assert world.hardware.state is not LifecycleState.ACTIVE
    assert not any(world.arm.has_torque(name) for name in NAMES)


def test_a_power_loss_after_another_fault_is_named_and_releases_the_arm() -> None:
    world = moving()
    world.supervisor.fault(ControllerError("it broke", "any"), "any", world.clock.now())
    world.run(2.0)
    for name in NAMES:
        world.arm.set_power(name, on=False)
    world.run(1.0)
    kinds = [fault.kind for fault in world.supervisor.faults]
    assert kinds[:2] == [FaultKind.CONTROLLER_FAILED, FaultKind.POWER_LOST]
    assert world.hardware.state is not LifecycleState.ACTIVE


@pytest.mark.parametrize(
    ("reason", "kind"),
    [
        (NoAcknowledgeError("x", 0x11), FaultKind.POWER_LOST),
        (BusTimeoutError("x", 0x11), FaultKind.JOINT_LOST),
        (CorruptFrameError("x", 0x11), FaultKind.JOINT_LOST),
    ],
)
def test_only_joints_that_do_not_acknowledge_have_lost_their_power(
    reason: CommunicationError, kind: FaultKind
) -> None:
    world = moving()
    for name in NAMES:
        error = JointLostError("x", 0x11, name, 3, reason)
        world.supervisor.fault(error, name, world.clock.now())
    assert world.supervisor.faults[0].kind is kind


@pytest.mark.parametrize(
    ("fault", "kind"),
    [
        ("DRIVER", FaultKind.JOINT_FAULT),
        ("ENCODER", FaultKind.JOINT_FAULT),
        ("OVERTEMPERATURE", FaultKind.OVERTEMPERATURE),
        ("SETPOINT_LOST", FaultKind.SETPOINT_LOST),
        ("HOMING_TRAVEL", FaultKind.HOMING_FAILED),
        ("STALL", FaultKind.HOMING_FAILED),
    ],
)
def test_what_ends_homing_is_a_fault_of_homing_only_where_the_path_may_be_blocked(
    fault: str, kind: FaultKind
) -> None:
    assert classify(HomingError("x", "j1", fault)) is kind


def test_a_lost_joint_without_commands_does_not_let_the_others_fall() -> None:
    world = World(at=NEAR)
    forward = world.load("one", FORWARD, joints=("j1",), interface_name="position")
    world.switch("one")
    forward.command((-1.0,))
    world.run(0.5)
    world.arm.hang("j4")
    world.run(2.0)
    assert world.supervisor.faults[0].kind.stop is Stop.HOLD
    assert world.hardware.state is LifecycleState.ACTIVE
    assert abs(world.arm.velocity("j1")) < 0.01
    assert world.arm.has_torque("j2")


def test_an_idle_homing_controller_does_not_let_the_joints_fall() -> None:
    world = World(at=NEAR)
    world.load("homing", "single_trigger_controller/SingleTriggerController", joints=("j4",))
    forward = world.load("one", FORWARD, joints=("j1",), interface_name="position")
    world.switch("homing", "one")
    forward.command((-1.0,))
    world.run(0.5)
    world.supervisor.fault(ControllerError("it broke", "any"), "any", world.clock.now())
    come_to_rest(world)
    assert world.manager.controller("hold").state is LifecycleState.ACTIVE
    assert all(world.arm.has_torque(name) for name in NAMES)


@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_a_fault_stops_joints_that_are_driven_by_velocity(v1: bool) -> None:
    world = World(v1=v1, at=NEAR)
    forward = world.load("driven", FORWARD, joints=NAMES, interface_name="velocity")
    world.switch("driven")
    forward.command((0.3, 0.0, 0.0, 0.0))
    world.run(1.0)
    assert world.arm.velocity("j1") > 0.2
    world.supervisor.fault(ControllerError("it broke", "any"), "any", world.clock.now())
    come_to_rest(world)
    assert forward.state is LifecycleState.INACTIVE
    assert world.arm.has_torque("j1")


def test_joints_that_could_not_be_released_are_reported_and_released_on_recovery(
    tmp_path: Path,
) -> None:
    world = moving(tmp_path)
    world.bus.off()
    for text in ("first", "second"):
        world.supervisor.crash(RuntimeError(text), world.clock.now())
    world.bus.clear()
    world.run(0.5)
    assert all(world.arm.has_torque(name) for name in NAMES)
    _, release = world.supervisor.acknowledge()
    assert release.kind is FaultKind.HARDWARE_FAILED
    assert all(f"{name} may be energised" in str(release) for name in NAMES)
    world.supervisor.recover(world.clock.now())
    assert not any(world.arm.has_torque(name) for name in NAMES)
    world.hardware.activate()
    world.loop.restart()
    world.run(0.1)
    assert all(axis.homed for axis in world.hardware.axes)


def test_the_way_out_of_a_joint_is_not_the_one_of_the_arm() -> None:
    error = StalledError("j1: x", "j1", remedy="clear_stall()")
    assert str(error) == "j1: x; clear_stall()"
    fault = ArmFault(classify(error), "j1", error, 0.0)
    assert str(fault) == "STALL: j1: x; remove the obstacle"
    assert fault.error() is error
    assert str(error) == "j1: x; remove the obstacle"
    assert str(fault) == "STALL: j1: x; remove the obstacle"
