"""Connecting: once, with notification of systemd, and after latched faults of the joints."""

from __future__ import annotations

import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from bioscara.control.faults.kinds import FaultKind
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import (
    BusyError,
    FaultedError,
    JointFaultError,
    LifecycleError,
    MotionCancelledError,
    RecordingError,
    StalledError,
)
from bioscara.hardware import LifecycleState
from bioscara.model import load_parameters
from bioscara.protocol import Flags
from bioscara.sim import SimulatedArm
from flight_records import read_record
from robot.bench import Bench, Gate, Other
from simulated import NEAR

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)


@pytest.fixture
def made(tmp_path: Path) -> Bench:
    """A robot that is not connected yet."""
    return Bench(SimulatedArm(seed=2, positions=NEAR), tmp_path / "evidence")


def latches(scene: Bench) -> list[bool]:
    return [bool(joint.get_flags() & Flags.FAULT) for joint in scene.robot.joints]


def leave_a_fault(scene: Bench) -> None:
    """Let a host find J3 too hot, and disconnect."""
    with Bench(scene.arm, scene.folder).robot as before:
        before.enable()
        scene.arm.overheat("j3")
        scene.arm.run(0.5)
        scene.arm.overheat("j3", False)


def test_a_fault_latched_in_a_joint_before_connecting_is_a_fault_of_the_arm(made: Bench) -> None:
    leave_a_fault(made)
    before = made.where()
    with made.robot as robot:
        (fault,) = robot.faults
        assert (fault.kind, fault.source) == (FaultKind.OVERTEMPERATURE, "j3")
        assert robot.runner.arm.stack.supervisor.state is FaultState.LATCHED
        for call in (robot.enable, robot.home, robot.gripper.enable):
            with pytest.raises(FaultedError, match=r"OVERTEMPERATURE: j3.*acknowledge\(\)"):
                call()
        (fault,) = robot.acknowledge()
        record = read_record(fault.evidence)
        assert record.faults[0].startswith("OVERTEMPERATURE: j3")
        assert len(record.times) >= 1, "where it was found"
        assert latches(made) == [False, False, True, False]
        robot.recover()
        assert robot.faults == ()
        assert not any(latches(made))
        assert made.where() == pytest.approx(before, abs=1e-6)
        robot.enable()


def test_a_stalled_version_1_joint_is_a_fault_on_connecting(tmp_path: Path) -> None:
    scene = Bench(SimulatedArm(seed=2, positions=NEAR, v1=True), tmp_path)
    with scene.robot as robot:
        robot.home()
        scene.arm.add_obstacle("j1", -2.5)
        with pytest.raises(StalledError, match=r"^j1: .*; remove the obstacle \("):
            robot.move_joints((-1.0, 0.3, 1.0, 1.0))
    scene.arm.clear_obstacles("j1")
    with Bench(scene.arm, tmp_path).robot as robot:
        assert [(fault.kind, fault.source) for fault in robot.faults] == [(FaultKind.STALL, "j1")]
        with pytest.raises(FaultedError, match="STALL"):
            robot.home()
        robot.acknowledge()
        robot.recover()
        robot.enable()


def test_a_latched_fault_is_kept_until_its_evidence_is_written(made: Bench) -> None:
    leave_a_fault(made)
    made.folder.write_text("")
    with made.robot as robot:
        with pytest.raises(RecordingError, match=r"evidence.* make the folder writable"):
            robot.acknowledge()
        with pytest.raises(FaultedError, match="acknowledge"):
            robot.recover()
        assert latches(made) == [False, False, True, False]
        assert len(robot.faults) == 1


def break_encoder(arm: SimulatedArm) -> None:
    arm.corrupt_encoder("j3")
    arm.run(0.5)
    arm.corrupt_encoder("j3", False)


def restart(arm: SimulatedArm) -> None:
    arm.reset("j3")
    arm.run(0.5)


@pytest.mark.parametrize(
    ("happen", "kind"),
    [(break_encoder, FaultKind.JOINT_FAULT), (restart, FaultKind.JOINT_RESET)],
)
def test_a_failure_of_a_released_joint_is_detected_and_recoverable(
    made: Bench, happen: Callable[[SimulatedArm], None], kind: FaultKind
) -> None:
    with made.robot as robot:
        robot.enable()
        robot.disable()
        happen(made.arm)
        with pytest.raises(FaultedError, match=f"{kind.name}: j3"):
            robot.enable()
        assert [(fault.kind, fault.source) for fault in robot.faults] == [(kind, "j3")]
        with pytest.raises(FaultedError, match=kind.name):
            robot.enable()
        robot.acknowledge()
        robot.recover()
        robot.enable()


def test_a_joint_that_cannot_be_enabled_is_a_recoverable_fault(tmp_path: Path) -> None:
    made = Bench(SimulatedArm(seed=2, positions=NEAR, controllers_fed=True), tmp_path)
    with made.robot as robot:
        made.arm.set_supply(False)
        with pytest.raises(
            JointFaultError,
            match=r"^j1: .*DRIVER \(data .\); release the emergency stop or restore the supply",
        ):
            robot.enable()
        assert robot.faults[0].source == "j1"
        made.arm.set_supply(True)
        with pytest.raises(FaultedError, match="DRIVER"):
            robot.enable()
        robot.acknowledge()
        robot.recover()
        robot.enable()


def test_a_robot_that_is_connected_refuses_to_connect_and_stays_connected(made: Bench) -> None:
    with made.robot as robot:
        robot.enable()
        with pytest.raises(LifecycleError, match="connected already"):
            robot.open()
        assert not made.bus.closed
        assert robot.runner.arm.stack.hardware.state is LifecycleState.ACTIVE
        robot.disable()
    assert made.bus.closed
    with pytest.raises(LifecycleError, match="make another"), made.robot:
        pytest.fail("entered again")


def test_of_two_threads_only_one_connects(made: Bench) -> None:
    gate = made.bus.gates["other"] = Gate()
    first = Other(made.robot.__enter__)
    gate.reached()
    with pytest.raises(BusyError, match="connecting has been running"), made.robot:
        pytest.fail("entered twice")
    assert not made.bus.closed
    gate.open()
    assert first.end() is None
    made.robot.enable()
    made.robot.__exit__(None, None, None)


def test_a_stop_while_connecting_leaves_the_robot_disconnected(made: Bench) -> None:
    gate = made.bus.gates["other"] = Gate()
    other = Other(made.robot.__enter__)
    gate.reached()
    made.robot.stop()
    gate.open()
    assert isinstance(other.end(), MotionCancelledError)
    assert made.bus.closed


def test_systemd_is_notified_on_connecting_and_on_each_reading(
    made: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def heard() -> list[bytes]:
        told = []
        while True:
            try:
                told.append(systemd.recv(99))
            except BlockingIOError:
                return told

    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        systemd.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "2000000")
        with made.robot as robot:
            assert heard() == [b"READY=1", b"WATCHDOG=1"]
            made.pass_time()
            assert heard() == []
            assert robot.state
            assert heard() == [b"WATCHDOG=1"]


def test_warnings_are_reported(made: Bench) -> None:
    with made.robot as robot:
        assert robot.warnings == ()
        robot.runner.arm.warn("slow")
        assert robot.warnings == ("slow",)
