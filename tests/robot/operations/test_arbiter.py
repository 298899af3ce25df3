"""Several threads and one arm: one call uses it, the others read it, stop it or are refused."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import pytest

from bioscara import Robot
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import (
    BusyError,
    MotionCancelledError,
)
from bioscara.kinematics import Pose
from bioscara.planning import Trajectory
from bioscara.planning.collision.scene import Scene
from bioscara.planning.motions.jog import JointVelocity
from bioscara.report import CycleRecord, Phase
from bioscara.robot.arm import Arm
from bioscara.robot.operations import arbiter
from bioscara.robot.operations.arbiter import Arbiter
from bioscara.robot.operations.between_cycles import BetweenCycles
from bioscara.sim import SimulatedArm
from robot.bench import GOAL, START, Bench, Other
from simulated import NAMES, NEAR, simulated_bus

POSE = Pose(0.45, -0.20, 0.25)
MOMENT = 0.2
"""Time in which a forbidden event must not happen [s]; too short a time only hides it."""


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Bench]:
    made = Bench(simulated_bus(seed=2, homed=True, at=START).arm, tmp_path)
    with made.robot as robot:
        robot.move_joints(START)
        yield made


STAND = Trajectory(NAMES, (0.0, 1.0), (START, START))
CALLS: dict[str, Callable[[Robot], object]] = {
    "home()": lambda robot: robot.home(),
    "move_joints()": lambda robot: robot.move_joints(START),
    "execute()": lambda robot: robot.execute(robot.plan.move_joints(START)),
    "follow()": lambda robot: robot.follow(STAND),
    "jog()": lambda robot: robot.jog(lambda: None),
    "move_to()": lambda robot: robot.move_to(POSE),
    "move_linear()": lambda robot: robot.move_linear(POSE),
    "move_circular()": lambda robot: robot.move_circular(POSE, POSE),
    "move_named()": lambda robot: robot.move_named("home"),
    "move_sequence()": lambda robot: robot.move_sequence([]),
    "enable()": lambda robot: robot.enable(),
    "disable()": lambda robot: robot.disable(),
    "acknowledge()": lambda robot: robot.acknowledge(),
    "recover()": lambda robot: robot.recover(),
    "setting reduced_speed": lambda robot: setattr(robot, "reduced_speed", False),
    "setting scene": lambda robot: setattr(robot, "scene", Scene(table_height=1.0)),
    "setting table": lambda robot: setattr(robot, "table", robot.table),
    "setting tool": lambda robot: setattr(robot, "tool", "fingers"),
}
WITH_THE_GRIPPER: dict[str, Callable[[Robot], object]] = {
    "gripper.enable()": lambda robot: robot.gripper.enable(),
    "gripper.disable()": lambda robot: robot.gripper.disable(),
    "gripper.move()": lambda robot: robot.gripper.move(0.06),
}


def test_rule_43_a_call_during_another_call_is_refused(scene: Bench) -> None:
    mover, gate, _ = scene.held_motion()
    for name, call in CALLS.items():
        with pytest.raises(BusyError) as refused:
            call(scene.robot)
        text = str(refused.value)
        assert text.startswith(f"{name} refused: move_joints() has been running for "), text
        assert text.endswith("in thread other; wait for its end, or end it with stop()")
        assert refused.value.running == "move_joints()"
        assert refused.value.duration >= 0.0
    scene.robot.stop()
    gate.open()
    assert isinstance(mover.end(), MotionCancelledError)
    assert set(scene.bus.users[-20:]) == {"other"}
    before = scene.where()
    scene.pass_time()
    assert scene.where() == pytest.approx(before, abs=1e-3)
    assert scene.robot.reduced_speed
    scene.robot.move_joints(START)


def test_reading_the_state_during_a_motion_does_not_use_the_bus(scene: Bench) -> None:
    mover, gate, records = scene.held_motion()
    robot = scene.robot
    transfers, now = len(scene.bus.users), scene.arm.now()
    scene.arm.run(0.02)
    for _ in range(3):
        assert robot.state.positions == tuple(j.position for j in records[-1].joints)
        assert robot.pose == robot.kinematics.forward(robot.state.positions)
        assert robot.faults == ()
        assert robot.speed_override == 1.0
    robot.plan.move_joints(START)
    assert len(scene.bus.users) == transfers
    assert scene.arm.now() == pytest.approx(now + 0.02)
    gate.open()
    assert mover.end() is None


def test_a_late_reading_by_an_observer_does_not_use_the_bus(scene: Bench) -> None:
    transfers: list[int] = []

    def observe(record: CycleRecord) -> None:
        if record.phase is Phase.TRAJECTORY and not transfers:
            scene.arm.run(0.03)
            before = len(scene.bus.users)
            assert scene.robot.state.time == record.start + scene.robot.runner.arm.session.begin
            transfers.append(len(scene.bus.users) - before)

    scene.robot.move_joints(GOAL, on_cycle=observe)
    assert transfers == [0]


def test_a_call_that_is_being_refused_does_not_make_the_work_before_it_a_late_cycle(
    scene: Bench,
) -> None:
    """The loop is restarted after work between cycles unless another operation is admitted."""
    robot, others = scene.robot, list[Other]()
    admission = robot.runner.arm.arbiter._admission

    def work(arm: Arm) -> None:
        admission.acquire()
        others.append(Other(lambda: robot.move_joints(GOAL)))
        while len(arm.begun) < 2:
            time.sleep(1e-3)
        scene.arm.run(0.5)

    try:
        robot.runner.execute(BetweenCycles("work", work))
    finally:
        admission.release()
    assert others[0].end() is None
    assert robot.faults == ()


def test_the_slow_release_of_the_joints_after_a_fault_is_no_fault_of_the_loop(
    tmp_path: Path,
) -> None:
    scene = Bench(SimulatedArm(seed=2, positions=NEAR, controllers_fed=True), tmp_path)
    with scene.robot as robot:
        robot.enable()
        robot.gripper.enable()
        scene.arm.set_supply(on=False)
        for _ in range(30):
            robot.runner.step(idle=True)
        kinds = [fault.kind for fault in robot.faults]
    assert kinds[0] is FaultKind.POWER_LOST
    assert FaultKind.OVERRUN not in kinds


def test_the_speed_can_be_changed_from_another_thread(scene: Bench) -> None:
    mover, gate, records = scene.held_motion()
    scene.robot.speed_override = 0.5
    gate.open()
    assert mover.end() is None
    assert scene.robot.runner.arm.stack.trajectory.scaling == 0.5
    slow, _ = len(records), records.clear()
    scene.robot.speed_override = 1.0
    scene.robot.move_joints(START, on_cycle=records.append)
    assert slow > 1.5 * len(records)


def test_two_concurrent_readings_use_the_bus_one_after_the_other(scene: Bench) -> None:
    first, gate = scene.held_transfer(lambda: scene.robot.state)
    second = Other(lambda: scene.robot.pose, "second")
    assert not second.ends_within(MOMENT)
    gate.open()
    assert first.end() is None
    assert second.end() is None
    assert scene.bus.overlaps == 0
    assert "second" not in scene.bus.users, "it was asked a moment ago"


def test_a_call_waits_for_a_reading_in_progress_and_can_be_stopped(
    scene: Bench,
) -> None:
    looking, gate = scene.held_transfer(lambda: scene.robot.state)
    before = scene.where()
    mover = Other(lambda: scene.robot.move_joints(GOAL), "mover")
    assert not mover.ends_within(MOMENT)
    scene.robot.stop()
    gate.open()
    assert looking.end() is None
    assert isinstance(mover.end(), MotionCancelledError)
    assert scene.bus.overlaps == 0
    assert scene.where() == pytest.approx(before, abs=1e-3)


MOVING = ("home()", "move_joints()", "follow()", "jog()", "move_linear()")


@pytest.mark.parametrize("name", MOVING)
def test_a_stop_before_the_first_cycle_is_not_lost(scene: Bench, name: str) -> None:
    """The call has begun: it plans, or engages the joints."""
    scene.robot.disable()
    other, gate = scene.held_transfer(lambda: CALLS[name](scene.robot))
    before = scene.where()
    scene.robot.stop()
    gate.open()
    assert isinstance(other.end(), MotionCancelledError)
    scene.pass_time()
    assert scene.where() == pytest.approx(before, abs=5e-3)
    assert not any(scene.arm.has_torque(name) for name in ("j1", "j3", "j4")) or name == "home()"


def test_a_stop_at_the_end_of_a_call_is_still_raised(scene: Bench) -> None:
    scene.robot.disable()
    other, gate = scene.held_transfer(scene.robot.enable)
    scene.robot.stop()
    gate.open()
    error = other.end()
    assert isinstance(error, MotionCancelledError)
    assert str(error) == "enable() was stopped before anything moved"
    assert not any(map(scene.arm.has_torque, NAMES))
    scene.robot.move_joints(START)


def test_stopped_jaws_stay_at_their_width(scene: Bench) -> None:
    scene.robot.gripper.move(0.06)
    other, gate = scene.held_transfer(lambda: scene.robot.gripper.move(0.11))
    scene.robot.stop()
    gate.open()
    error = other.end()
    assert isinstance(error, MotionCancelledError)
    assert str(error) == "gripper.move() was stopped before anything moved"
    assert scene.robot.gripper.width == pytest.approx(0.06, abs=5e-3)


def test_after_a_stopped_motion_the_jaws_can_be_moved(scene: Bench) -> None:
    with pytest.raises(MotionCancelledError, match="s into the trajectory"):
        scene.robot.move_joints(GOAL, on_cycle=lambda _: scene.robot.stop())
    scene.robot.gripper.move(0.06)
    assert scene.robot.gripper.width == pytest.approx(0.06, abs=5e-3)


def test_the_error_of_a_stopped_jog_names_the_jog(scene: Bench) -> None:
    def stop() -> JointVelocity:
        scene.robot.stop()
        return JointVelocity()

    with pytest.raises(MotionCancelledError, match="interrupted while jogging"):
        scene.robot.jog(stop)


@pytest.mark.parametrize("observer_fails", [False, True])
def test_however_often_ctrl_c_is_pressed_the_arm_ramps_down(
    scene: Bench, observer_fails: bool
) -> None:
    """Without setpoints the joints would stop autonomously, with a fault and each on its own."""
    pressed = len(scene.bus.users) + 120
    scene.bus.ctrl_c = {pressed + 9 * number for number in range(4)}
    phases: list[Phase] = []

    def observe(record: CycleRecord) -> None:
        phases.append(record.phase)
        if observer_fails and record.phase is Phase.STOPPING:
            raise ZeroDivisionError

    with pytest.raises(KeyboardInterrupt):
        scene.robot.move_joints(GOAL, on_cycle=observe)
    assert len(scene.bus.users) > max(scene.bus.ctrl_c), "it was at rest too early"
    assert Phase.TRAJECTORY in phases
    scene.arm.run(0.1)
    assert scene.speed() < 0.02
    assert scene.robot.faults == ()
    scene.robot.move_joints(START)


def look(scene: Bench) -> None:
    """Read the state of the arm for a while, which runs cycles."""
    for _ in range(60):
        scene.arm.run(0.05)
        assert scene.robot.state


MOTIONS = {
    "move_joints()": (JointTrajectoryController, lambda robot: robot.move_joints(GOAL)),
    "home()": (HomingController, lambda robot: robot.home()),
    "gripper.move()": (GripperActionController, lambda robot: robot.gripper.move(0.1)),
}


@pytest.mark.parametrize("name", MOTIONS)
@pytest.mark.parametrize("place", [0, 2, 8])
def test_ctrl_c_anywhere_leaves_no_active_goal(
    scene: Bench, name: str, place: int, tmp_path: Path
) -> None:
    """Any later cycle would carry the goal on, also one that only reads the state."""
    controller, move = MOTIONS[name]
    accepting, accepted, passed = controller.send_goal.__code__, False, 0

    def trace(frame: FrameType, event: str, _: object) -> Callable[..., object] | None:
        nonlocal accepted, passed
        if frame.f_code is accepting:
            accepted = event == "return"
        elif accepted and event == "call":
            passed += 1
        if accepted and passed == place:
            raise KeyboardInterrupt
        return trace if frame.f_code is accepting else None

    if name == "home()":
        scene = Bench(SimulatedArm(seed=2, positions=NEAR), tmp_path / "unhomed")
        scene.robot.__enter__()
    robot = scene.robot
    robot.gripper.move(0.05)
    look(scene)
    before = sys.gettrace()
    sys.settrace(trace)
    try:
        with pytest.raises(KeyboardInterrupt):
            move(robot)
    finally:
        sys.settrace(before)
    where = scene.where()
    look(scene)
    assert scene.where() == pytest.approx(where, abs=0.01)
    assert robot.gripper.width == pytest.approx(0.05)
    if name == "home()":
        robot.__exit__(None, None, None)


def test_ctrl_c_anywhere_releases_the_arbiter() -> None:
    free, places, uses = Arbiter(), 0, 0

    def use() -> None:
        nonlocal uses
        with free.claimed("use()"):
            uses += 1

    def interrupt(place: int) -> Callable[[FrameType, str, object], None]:
        passed = 0

        def trace(frame: FrameType, event: str, _: object) -> None:
            # Python checks for signals where a function is entered.
            nonlocal passed
            if frame.f_code.co_filename in {arbiter.__file__, threading.__file__, __file__}:
                passed += 1
                if passed == place + 1:
                    raise KeyboardInterrupt

        return trace

    before = sys.gettrace()
    while True:
        try:
            sys.settrace(interrupt(places))
            use()
        except KeyboardInterrupt:
            places += 1
        else:
            break
        finally:
            sys.settrace(before)
        assert not free.running, places
    assert places > 5
    assert uses > 1


def test_a_second_shutdown_waits_for_the_first(scene: Bench) -> None:
    first, gate = scene.held_transfer(scene.robot.shutdown)
    second = Other(lambda: scene.robot.__exit__(None, None, None), "second")
    assert not second.ends_within(MOMENT)
    assert not scene.bus.closed
    with pytest.raises(BusyError, match=r"refused: shutdown\(\)"):
        scene.robot.home()
    gate.open()
    assert first.end() is None
    assert second.end() is None
    assert "second" not in scene.bus.users
