"""Leaving: no joint stays energised without a report of it, after any loss of communication."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from bioscara import Robot
from bioscara.bus import FaultyBus, Transaction, When
from bioscara.errors import BioscaraError, HardwareError, InvalidArgumentError, LifecycleError
from bioscara.hardware import LifecycleState
from bioscara.model import load_parameters
from bioscara.robot import runner as runner_module
from bioscara.sim import FirmwareBus, SimulatedArm
from simulated import NEAR, simulated_robot

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
START = (-2.0, 0.30, 2.0, 2.0)
J2 = When(address=ARM.joints[1].address)


class Scene:
    """A robot that is connected, and the simulated arm and bus behind it."""

    def __init__(self, folder: Path, *, v1: bool) -> None:
        self.arm, self.bus, self.robot = simulated_robot(folder, v1=v1)

    def energised(self) -> list[str]:
        self.arm.run(1.0)
        return [name for name in NAMES if self.arm.has_torque(name)]


@pytest.fixture(params=[False, True], ids=["v2", "v1"])
def scene(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Scene]:
    made = Scene(tmp_path, v1=request.param)
    made.robot.__enter__()
    made.robot.enable()
    assert made.energised() == list(NAMES)
    yield made
    made.bus.clear()
    made.robot.__exit__(None, None, None)


def disabled_in_vain(scene: Scene) -> None:
    scene.bus.off()
    with pytest.raises(BioscaraError):
        scene.robot.disable()


def look_until_it_is_noticed(scene: Scene) -> None:
    for _ in range(100):
        scene.arm.run(0.03)
        with suppress(BioscaraError):
            _ = scene.robot.state
    assert scene.robot.faults


def all_lost(scene: Scene) -> None:
    scene.bus.off()
    look_until_it_is_noticed(scene)


def not_recovered(scene: Scene) -> None:
    scene.bus.off(J2)
    look_until_it_is_noticed(scene)
    scene.robot.acknowledge()
    with pytest.raises(BioscaraError):
        scene.robot.recover()


LOSSES = pytest.mark.parametrize("lose", [disabled_in_vain, all_lost, not_recovered])


@LOSSES
def test_joints_left_energised_are_reconnected_and_released(
    scene: Scene, lose: Callable[[Scene], None]
) -> None:
    lose(scene)
    scene.bus.clear()
    assert scene.robot.shutdown() == []
    assert scene.energised() == []


@LOSSES
def test_joints_that_cannot_be_reconnected_are_reported(
    scene: Scene, lose: Callable[[Scene], None]
) -> None:
    lose(scene)
    told = [problem for problem in scene.robot.shutdown() if "may be energised" in problem]
    assert [sentence[:2] for sentence in told] == scene.energised() != []


def test_disabling_again_releases_the_remaining_joints(scene: Scene) -> None:
    disabled_in_vain(scene)
    with pytest.raises(HardwareError, match="j1 may be energised"):
        scene.robot.disable()
    scene.bus.clear()
    scene.robot.disable()
    assert scene.energised() == []
    scene.robot.enable()
    assert scene.energised() == list(NAMES)


def test_a_homed_joint_left_energised_is_released(tmp_path: Path) -> None:
    scene = Scene(tmp_path, v1=False)
    with scene.robot as robot:
        robot.home()
        disabled_in_vain(scene)
        scene.bus.clear()
    assert scene.energised() == []


def test_joints_left_energised_by_another_program_are_released(scene: Scene) -> None:
    with Robot(FirmwareBus(scene.arm), scene.arm.clock, ARM, "next") as after:
        assert after._arm.stack.hardware.state is LifecycleState.INACTIVE
    assert scene.energised() == []


def test_nothing_is_sent_to_joints_that_were_never_enabled(tmp_path: Path) -> None:
    scene = Scene(tmp_path, v1=False)
    with scene.robot as robot:
        scene.bus.off()
        assert robot.shutdown() == []


def test_leaving_reports_joints_that_stay_energised(tmp_path: Path) -> None:
    scene = Scene(tmp_path, v1=False)
    robot = scene.robot.__enter__()
    robot.enable()
    scene.bus.off()
    with pytest.raises(HardwareError) as caught:
        robot.__exit__(None, None, None)
    assert scene.energised() == list(NAMES)
    assert all(f"{name} may be energised" in str(caught.value) for name in NAMES)


def test_leaving_by_an_error_reports_them_in_a_note(tmp_path: Path) -> None:
    scene = Scene(tmp_path, v1=False)
    robot = scene.robot.__enter__()
    robot.enable()
    scene.bus.off()
    error = ZeroDivisionError()
    robot.__exit__(type(error), error, None)
    assert scene.energised() == list(NAMES)
    assert all(f"{name} may be energised" in error.__notes__[0] for name in NAMES)


class Impatient(FaultyBus):
    """A bus on which Ctrl-C comes in at the transfers that are named."""

    presses: tuple[int, ...] = ()
    used = 0

    def transfer(self, transactions: Sequence[Transaction]):  # type: ignore[no-untyped-def]
        self.used += 1
        if self.used in self.presses:
            raise KeyboardInterrupt
        return super().transfer(transactions)


LEAVING: list[Callable[[Robot], object]] = [
    lambda robot: robot.__exit__(None, None, None),
    lambda robot: robot.shutdown(),
    lambda robot: robot.disable(),
]


@pytest.mark.parametrize("leave", LEAVING, ids=["with", "shutdown", "disable"])
@pytest.mark.parametrize("v1", [False, True], ids=["v2", "v1"])
def test_ctrl_c_anywhere_during_release_leaves_no_joint_energised(
    tmp_path: Path, leave: Callable[[Robot], object], *, v1: bool
) -> None:
    arm = SimulatedArm(seed=2, positions=NEAR, v1=v1)
    for first in range(1, 1000, 2 if v1 else 1):
        bus = Impatient(FirmwareBus(arm), seed=1, clock=arm.clock)
        robot = Robot(bus, arm.clock, ARM, "leaving", evidence=tmp_path).__enter__()
        robot.enable()
        # Twice in the same step now and then.
        bus.used, bus.presses = 0, (first, first + 1 + first % 3)
        interrupted = False
        try:
            leave(robot)
        except KeyboardInterrupt:
            interrupted = True
        bus.presses = ()
        arm.run(0.5)
        assert [name for name in NAMES if arm.has_torque(name)] == [], first
        assert robot.shutdown() == []
        if not interrupted:
            break
    assert 2 * len(NAMES) < first < 999


@pytest.mark.parametrize("leave", LEAVING[:2], ids=["with", "shutdown"])
@pytest.mark.parametrize("where", ["shutdown", "joints", "release", "stop_and_disable"])
def test_ctrl_c_anywhere_before_release_is_raised(
    tmp_path: Path, leave: Callable[[Robot], object], where: str
) -> None:
    scene = Scene(tmp_path, v1=False)
    robot = scene.robot.__enter__()
    robot.enable()

    def press(frame: FrameType, event: str, _: object) -> None:
        if frame.f_code.co_name == where:
            sys.settrace(None)
            raise KeyboardInterrupt

    before = sys.gettrace()
    try:
        sys.settrace(press)
        with pytest.raises(KeyboardInterrupt):
            leave(robot)
    finally:
        sys.settrace(before)
    if leave is not LEAVING[0]:
        assert robot.shutdown() == []
    assert scene.energised() == []


@pytest.mark.parametrize("patience", [0.0, 15.0], ids=["too long", "a moment"])
def test_ctrl_c_ends_the_wait_for_a_callback_that_never_returns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, patience: float
) -> None:
    """But not while the call may still be bringing the arm to rest."""
    monkeypatch.setattr(runner_module, "_PATIENCE", patience)
    robot = (scene := Scene(tmp_path, v1=False)).robot.__enter__()
    entered, end, pressed = threading.Event(), threading.Event(), threading.Event()

    def hang(_: object) -> None:
        entered.set()
        end.wait(5.0)

    def home() -> None:
        with suppress(BioscaraError):
            robot.home(on_cycle=hang)

    def press(frame: FrameType, event: str, _: object) -> None:
        caller = frame.f_back
        if frame.f_code.co_name == "wait" and caller and caller.f_code.co_name == "_seize":
            pressed.set()
            sys.settrace(None)
            raise KeyboardInterrupt

    def let_go() -> None:
        pressed.wait(10.0)
        if patience:
            end.set()

    threads = [threading.Thread(target=each, daemon=True) for each in (home, let_go)]
    for thread in threads:
        thread.start()
    assert entered.wait(10.0)
    before = sys.gettrace()
    try:
        sys.settrace(press)
        with pytest.raises(KeyboardInterrupt):
            robot.__exit__(None, None, None)
    finally:
        sys.settrace(before)
    assert (not robot.runner.arm.arbiter.running) is bool(patience), "it was waited for, or not"
    end.set()
    for thread in threads:
        thread.join(10.0)
    robot.__exit__(None, None, None)
    assert scene.energised() == []


@pytest.mark.parametrize("priority", [0, 100, "high", 1.5, True])
def test_a_priority_that_cannot_be_used_is_refused_before_the_loop_begins(
    tmp_path: Path, priority: Any
) -> None:
    with simulated_robot(tmp_path).robot as robot:
        with pytest.raises(InvalidArgumentError, match="priority"):
            robot.watch(priority=priority)
        assert not robot.runner.watched


def test_a_watched_robot_is_not_opened_again(tmp_path: Path) -> None:
    with simulated_robot(tmp_path).robot as robot:
        robot.watch()
        with pytest.raises(LifecycleError, match="connected already"):
            robot.open()
