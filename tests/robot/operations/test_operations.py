"""An operation as its user sees it, whichever thread steps it: the caller's own or the arm's."""

from __future__ import annotations

import asyncio
import math
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

import pytest

from bioscara import Robot
from bioscara.errors import (
    BusyError,
    FaultedError,
    JointLostError,
    LifecycleError,
    MotionCancelledError,
    MotionTimeoutError,
    NotInitializedError,
    NotSupportedError,
    ZoneError,
)
from bioscara.hardware import GripperHardware
from bioscara.planning import Trajectory
from bioscara.planning.motions.jog import JointVelocity
from bioscara.report import CycleRecord, Phase
from bioscara.robot.operations.between_cycles import BetweenCycles
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory, checked
from bioscara.robot.operations.motions.home import Home
from bioscara.robot.operations.motions.jog import Jog
from bioscara.robot.operations.motions.move_gripper import MoveGripper
from bioscara.robot.operations.operation import OnCycle, Operation
from bioscara.robot.operations.running import Status
from robot.bench import GOAL, LONG, START, Bench, Gate, Other
from simulated import ARM, simulated_bus

T = TypeVar("T")
CLEAR_IF_CLOSED = (0.0, 0.0539, -2.2885, -1.0958)
"""A position that is free with the gripper closed, not with it open."""
BEFORE_IT = (0.0, 0.0539, 0.0, 0.0)


class Way:
    """A robot, and one of the ways in which its operations are stepped."""

    def __init__(self, scene: Bench, *, watched: bool) -> None:
        self.scene, self.robot, self.watched = scene, scene.robot, watched

    def run(self, operation: Operation[T]) -> T:
        """Carry out an operation to its end and return its result."""
        runner = self.robot.runner
        if not self.watched:
            return runner.execute(operation)
        runner.start(operation)
        return operation.result(LONG)

    def pass_time(self) -> None:
        """Let a second pass on the clock of the arm."""
        end = self.scene.arm.now() + 1.0
        if self.watched:
            until(lambda: self.scene.arm.now() > end)
        else:
            self.scene.arm.run(1.0)

    def goes_on(self) -> None:
        """Require that the arm is at rest and can be used."""
        assert max(map(abs, self.robot.state.velocities)) < 0.02
        assert self.robot.faults == ()
        self.run(move(START))
        assert self.robot.state.positions == pytest.approx(START, abs=2e-3)


def move(goal: tuple[float, ...] = GOAL, on_cycle: OnCycle | None = None) -> FollowTrajectory:
    return FollowTrajectory(
        "move_joints()", lambda planner: planner.move_joints(goal), on_cycle=on_cycle
    )


class At:
    """Records the cycles of an operation, and acts at the end of some of them."""

    def __init__(self, **actions: Callable[[], object]) -> None:
        self.records: list[CycleRecord] = []
        self._actions = {int(key.removeprefix("cycle_")): act for key, act in actions.items()}

    def __call__(self, record: CycleRecord) -> None:
        self.records.append(record)
        if act := self._actions.pop(len(self.records), None):
            act()

    def speed(self) -> float:
        """Return the highest commanded speed of the last cycle."""
        return max(abs(joint.reference_velocity) for joint in self.records[-1].joints)


def elsewhere(task: Callable[[], T]) -> Callable[[], T]:
    """Return a call that carries out a task in another thread, and raises its error."""

    def call() -> T:
        results: list[T] = []
        if (error := Other(lambda: results.append(task())).end()) is not None:
            raise error
        return results[0]

    return call


def until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < end, "it never happened"
        time.sleep(1e-3)


@contextmanager
def connected(
    folder: Path, *, watched: bool, homed: bool = True, at: tuple[float, ...] = START
) -> Iterator[Way]:
    scene = Bench(simulated_bus(seed=2, homed=homed, at=at).arm, folder)
    with scene.robot as robot:
        if homed:
            robot.gripper.move(0.05)
            robot.move_joints(at)
        if watched:
            robot.watch()
        yield Way(scene, watched=watched)


BOTH = pytest.mark.parametrize("watched", [False, True], ids=["in its caller", "watched"])


@pytest.fixture(params=[False, True], ids=["in its caller", "watched"])
def watched(request: pytest.FixtureRequest) -> bool:
    return bool(request.param)


@pytest.fixture
def way(watched: bool, tmp_path: Path) -> Iterator[Way]:
    with connected(tmp_path, watched=watched) as made:
        yield made


@pytest.fixture
def narrow(watched: bool, tmp_path: Path) -> Iterator[Way]:
    """Stands in front of a place that is free only with the jaws closed."""
    with connected(tmp_path, watched=watched, at=BEFORE_IT) as made:
        yield made


@pytest.fixture
def unhomed(watched: bool, tmp_path: Path) -> Iterator[Way]:
    with connected(tmp_path, watched=watched, homed=False) as made:
        yield made


def test_homing_homes_one_joint_after_the_other_while_the_jaws_may_move(
    unhomed: Way,
) -> None:
    progress, records = list[float](), list[float]()
    jaws: list[Operation[Any]] = []

    def close() -> None:
        jaws.append(unhomed.robot.gripper.move(0.06, wait=False))

    at = At(cycle_30=elsewhere(close))

    def observe(record: CycleRecord) -> None:
        at(record)
        progress.append(homing.progress)
        records.append(record.progress)
        assert homing.status is Status.RUNNING

    homing = Home(on_cycle=observe)
    assert homing.status is Status.WAITING
    unhomed.run(homing)
    assert progress == sorted(progress)
    assert progress == records
    assert (progress[0], progress[-1]) == (0.0, 1.0)
    assert {int(4.0 * share) for share in progress if 4.0 * share % 1.0} == {0, 1, 2, 3}
    assert (homing.status, homing.progress) == (Status.SUCCEEDED, 1.0)
    assert unhomed.robot.is_homed
    assert jaws[0].result(LONG).reached_goal
    assert unhomed.robot.gripper.widths == pytest.approx((0.06, 0.06), abs=1e-6)


def test_homing_cannot_be_paused_but_stopped(unhomed: Way) -> None:
    def act() -> None:
        with pytest.raises(NotSupportedError, match=r"home\(\) cannot be paused; cancel\(\)"):
            homing.pause()
        homing.cancel()

    homing = Home(on_cycle=At(cycle_30=act))
    with pytest.raises(MotionCancelledError, match="interrupted while homing j2"):
        unhomed.run(homing)
    assert homing.status is Status.CANCELLED
    unhomed.run(Home())
    assert unhomed.robot.is_homed


def test_a_motion_reports_its_progress_and_reaches_its_goal(way: Way) -> None:
    progress: list[float] = []

    def observe(record: CycleRecord) -> None:
        progress.append(motion.progress)
        assert motion.status is Status.RUNNING
        assert way.robot.is_moving

    motion = move(on_cycle=observe)
    assert (motion.status, motion.progress) == (Status.WAITING, 0.0)
    way.run(motion)
    assert progress == sorted(progress)
    assert progress[0] < 0.05
    assert progress[-1] == pytest.approx(1.0, abs=0.01)
    assert (motion.status, motion.progress) == (Status.SUCCEEDED, 1.0)
    assert repr(motion) == "<move_joints() succeeded, 100%>"
    assert way.robot.state.positions == pytest.approx(GOAL, abs=2e-3)
    assert not way.robot.is_moving


def test_a_jog_moves_until_its_source_ends(way: Way) -> None:
    left = [JointVelocity(0.2)] * 100
    jog = Jog(lambda: left.pop() if left else None)
    way.run(jog)
    assert jog.status is Status.SUCCEEDED
    assert 0.05 < way.robot.state.positions[0] - START[0] < 0.25
    way.goes_on()


def test_the_jaws_move_while_the_arm_moves(way: Way) -> None:
    jaws: list[Operation[Any]] = []
    together: list[int] = []

    def begin() -> None:
        jaws.append(way.robot.gripper.move(0.09, wait=False))

    at = At(cycle_30=elsewhere(begin))

    def observe(record: CycleRecord) -> None:
        at(record)
        together.append(len(way.robot.runner.arm.operations))

    way.run(move(on_cycle=observe))
    assert jaws[0].result(LONG).reached_goal
    assert way.robot.gripper.width == pytest.approx(0.09, abs=1e-5)
    assert set(together) == {1, 2}
    assert together[-1] == 1, "the jaws take as long as the arm"
    assert way.robot.state.positions == pytest.approx(GOAL, abs=2e-3)


def test_the_jaws_do_not_move_during_a_jog(way: Way) -> None:
    refused: list[BaseException] = []

    def begin() -> None:
        with pytest.raises(BusyError, match=r"gripper\.move\(\) refused: jog\(\) has") as error:
            way.robot.gripper.move(0.09)
        refused.append(error.value)

    left = [JointVelocity(0.1)] * 50
    way.run(Jog(lambda: left.pop() if left else None, on_cycle=At(cycle_20=elsewhere(begin))))
    assert refused
    assert way.robot.gripper.widths == pytest.approx((0.05, 0.05), abs=1e-6)


@pytest.mark.parametrize("on_the_ramp", [False, True])
def test_jaws_that_would_touch_the_arm_later_in_its_motion_do_not_move(
    narrow: Way, on_the_ramp: bool
) -> None:
    """Also not where a ramp to the start of a trajectory would be too narrow."""
    refused: list[BaseException] = []

    def begin() -> None:
        with pytest.raises(ZoneError, match="jaws comes too near") as error:
            narrow.robot.gripper.move(0.11)
        refused.append(error.value)

    at, goal = At(cycle_5=elsewhere(begin)), CLEAR_IF_CLOSED
    if on_the_ramp:
        # From beyond the narrow place back: the trajectory itself is free at every width.
        narrow.run(move(CLEAR_IF_CLOSED))
        names = tuple(joint.name for joint in ARM.joints)
        goal = BEFORE_IT
        stand = Trajectory(names, (0.0, 0.5), (goal, goal))
        motion = FollowTrajectory(
            "follow()", lambda planner: checked(stand, planner), approach=True, on_cycle=at
        )
    else:
        motion = move(goal, on_cycle=at)
    narrow.run(motion)
    assert refused
    assert narrow.robot.state.positions == pytest.approx(goal, abs=2e-3)
    assert narrow.robot.gripper.widths == pytest.approx((0.05, 0.05), abs=1e-6)


def test_a_motion_keeps_clear_of_jaws_that_are_opening(narrow: Way) -> None:
    refused: list[BaseException] = []

    def begin() -> None:
        with pytest.raises(ZoneError, match="jaws comes too near") as error:
            narrow.robot.move_joints(CLEAR_IF_CLOSED)
        refused.append(error.value)

    narrow.run(MoveGripper(0.11, on_cycle=At(cycle_1=elsewhere(begin))))
    assert refused
    narrow.run(MoveGripper(0.05))
    narrow.run(move(CLEAR_IF_CLOSED))


def after(
    monkeypatch: pytest.MonkeyPatch, seam: tuple[type, str], act: Callable[[], object]
) -> None:
    """Act in another thread at the first end of a method."""
    original, acts = getattr(*seam), [act]

    def method(self: object, *given: object) -> object:
        result = original(self, *given)
        if acts:
            elsewhere(acts.pop())()
        return result

    monkeypatch.setattr(*seam, method)


def test_the_arm_begins_to_move_right_after_the_jaws(way: Way) -> None:
    for width, goal in ((0.09, GOAL), (0.06, START)):
        jaws = way.robot.gripper.move(width, wait=False)
        way.run(move(goal))
        assert jaws.result(LONG).reached_goal
        assert way.robot.gripper.widths == pytest.approx((width, width), abs=1e-5)
        assert way.robot.state.positions == pytest.approx(goal, abs=2e-3)


@pytest.mark.parametrize("seam", [(MoveGripper, "prepare"), (GripperHardware, "keep")])
def test_a_motion_that_begins_before_the_jaws_move_keeps_clear_of_their_travel(
    narrow: Way, seam: tuple[type, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    refused: list[BaseException] = []

    def begin() -> None:
        with pytest.raises(ZoneError, match="jaws comes too near") as error:
            narrow.robot.move_joints(CLEAR_IF_CLOSED)
        refused.append(error.value)

    after(monkeypatch, seam, begin)
    narrow.run(MoveGripper(0.11))
    assert refused


def test_jaws_that_were_stopped_before_they_moved_count_as_where_they_were(narrow: Way) -> None:
    jaws = MoveGripper(0.11)
    narrow.robot.runner.begin(jaws)
    assert narrow.robot.gripper.widths == pytest.approx((0.05, 0.11), abs=1e-6)
    jaws.cancel()
    narrow.run(move(CLEAR_IF_CLOSED[:1] + BEFORE_IT[1:]))
    with pytest.raises(MotionCancelledError):
        jaws.result(LONG)
    assert narrow.robot.gripper.widths == pytest.approx((0.05, 0.05), abs=1e-6)


def test_the_arm_does_not_wait_for_the_disk_that_stores_the_width(
    way: Way, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, keep = move(), GripperHardware.keep

    def slowly(self: GripperHardware, width: float | None = None) -> None:
        until(lambda: motion.progress > 0.2)
        keep(self, width)

    after(monkeypatch, (MoveGripper, "prepare"), lambda: way.robot.runner.start(motion))
    monkeypatch.setattr(GripperHardware, "keep", slowly)
    assert way.run(MoveGripper(0.09)).reached_goal
    motion.result(LONG)
    assert way.robot.state.positions == pytest.approx(GOAL, abs=2e-3)


def test_jaws_that_were_not_driven_do_not_open_against_the_arm_that_just_moves_off(
    narrow: Way, monkeypatch: pytest.MonkeyPatch
) -> None:
    narrow.run(move(CLEAR_IF_CLOSED))
    narrow.robot.gripper.disable()
    motion = move(BEFORE_IT)
    after(monkeypatch, (MoveGripper, "prepare"), lambda: narrow.robot.runner.start(motion))
    with pytest.raises(ZoneError, match="jaws comes too near"):
        narrow.run(MoveGripper(0.11))
    motion.result(LONG)
    assert narrow.robot.gripper.widths == pytest.approx((0.05, 0.05), abs=1e-6)


def test_a_paused_motion_comes_to_rest_on_its_path_and_continues_from_there(way: Way) -> None:
    rest: list[tuple[float, ...]] = []

    def pause() -> None:
        motion.pause()
        motion.pause()
        assert motion.status is Status.PAUSED

    def observe(record: CycleRecord) -> None:
        at(record)
        if motion.paused and at.speed() == 0.0:
            rest.append(tuple(joint.reference for joint in record.joints))
            if len(rest) == 30:
                motion.resume()
                motion.resume()
                assert motion.status is Status.RUNNING

    at = At(cycle_100=pause)
    motion = move(on_cycle=observe)
    way.run(motion)
    assert len(rest) == 30
    assert rest[-1] == pytest.approx(rest[0], abs=1e-9)
    assert math.dist(rest[0], START) > 0.01
    assert math.dist(rest[0], GOAL) > 0.1
    assert motion.status is Status.SUCCEEDED
    assert way.robot.state.positions == pytest.approx(GOAL, abs=2e-3)


def test_a_paused_jog_comes_to_rest_and_goes_on(way: Way) -> None:
    rest = 0

    def velocities() -> JointVelocity | None:
        return JointVelocity(0.2) if len(at.records) < 300 else None

    def observe(record: CycleRecord) -> None:
        nonlocal rest
        at(record)
        rest += jog.paused and abs(record.joints[0].velocity) < 0.01

    def pause() -> None:
        jog.pause()

    def resume() -> None:
        jog.resume()

    at = At(cycle_50=pause, cycle_200=resume)
    jog = Jog(velocities, on_cycle=observe)
    way.run(jog)
    assert rest > 30
    assert 0.15 < way.robot.state.positions[0] - START[0] < 0.4


def test_a_cancelled_motion_ends_at_rest_and_its_result_is_the_reason(way: Way) -> None:
    def cancel() -> None:
        motion.cancel()
        motion.cancel()
        assert motion.status is Status.STOPPING
        for call in (motion.pause, motion.resume):
            with pytest.raises(LifecycleError, match=r"move_joints\(\) is being stopped"):
                call()

    at = At(cycle_100=cancel)
    motion = move(on_cycle=at)
    with pytest.raises(MotionCancelledError, match="s into the trajectory"):
        way.run(motion)
    assert motion.status is Status.CANCELLED
    assert Phase.STOPPING in {record.phase for record in at.records}
    for _ in range(2):
        with pytest.raises(MotionCancelledError):
            motion.result()
    assert repr(motion).startswith("<move_joints() cancelled, ")
    way.goes_on()


@pytest.mark.parametrize(
    ("whose", "how"), [("its own", "stop"), ("of the robot", "cancel"), ("of the robot", "stop")]
)
def test_a_stop_ends_a_pause(way: Way, whose: str, how: str) -> None:
    def pause() -> None:
        (way.robot.pause if whose == "of the robot" else motion.pause)()

    def end() -> None:
        assert at.speed() == 0.0
        (way.robot.stop if how == "stop" else motion.cancel)()

    at = At(cycle_100=pause, cycle_250=end)
    motion = move(on_cycle=at)
    with pytest.raises(MotionCancelledError):
        way.run(motion)
    assert motion.status is Status.CANCELLED
    way.robot.stop()
    way.goes_on()


def test_a_motion_begun_while_the_robot_is_paused_says_so_and_waits(way: Way) -> None:
    def resume() -> None:
        assert way.robot.state.positions == pytest.approx(START, abs=2e-3)
        way.robot.resume()

    way.robot.pause()
    way.run(move(on_cycle=At(cycle_50=resume)))
    assert way.robot.warnings[-1] == "move_joints() begins paused: it moves after resume()"
    assert way.robot.state.positions == pytest.approx(GOAL, abs=2e-3)


def test_what_begins_at_an_override_of_zero_names_its_remedy(way: Way) -> None:
    def release() -> None:
        way.robot.resume()
        assert way.robot.state.positions == pytest.approx(START, abs=2e-3)
        way.robot.speed_override = 1.0

    way.robot.speed_override = 0.0
    way.run(move(on_cycle=At(cycle_50=release)))
    warning = "move_joints() begins paused: it moves after a speed_override above 0"
    assert way.robot.warnings[-1] == warning


def test_a_jog_begun_while_the_robot_is_paused_says_so(way: Way) -> None:
    velocities = iter([JointVelocity(j1=0.2)] * 20)
    way.robot.pause()
    way.run(Jog(lambda: next(velocities, None)))
    assert "its velocities move nothing before resume()" in way.robot.warnings[-1]
    assert way.robot.state.positions == pytest.approx(START, abs=2e-3)
    way.robot.resume()


def test_homing_begun_while_the_robot_is_paused_waits_or_is_stopped(unhomed: Way) -> None:
    arm, robot = unhomed.scene.arm, unhomed.robot
    before = arm.position("j2")

    def resume() -> None:
        assert arm.position("j2") == pytest.approx(before, abs=1e-4)
        robot.resume()

    robot.pause()
    with pytest.raises(MotionCancelledError):
        unhomed.run(Home(on_cycle=At(cycle_30=robot.stop)))
    robot.pause()
    unhomed.run(Home(on_cycle=At(cycle_150=resume)))
    assert "home() begins paused: it moves after resume()" in robot.warnings
    assert robot.is_homed


def test_after_its_end_a_motion_cannot_be_paused_or_changed(way: Way) -> None:
    motion = move()
    way.run(motion)
    for name in ("pause", "resume"):
        with pytest.raises(LifecycleError, match=rf"^{name}\(\): move_joints\(\) has ended \(succ"):
            getattr(motion, name)()
    motion.cancel()
    assert motion.status is Status.SUCCEEDED
    assert motion.result() is None
    with pytest.raises(LifecycleError, match="was begun already; each motion is a new operation"):
        way.run(motion)


def test_a_running_motion_is_not_begun_again_and_goes_on(way: Way) -> None:
    def again() -> None:
        with pytest.raises(LifecycleError, match="was begun already"):
            way.robot.runner.execute(motion)

    motion = move(on_cycle=At(cycle_30=elsewhere(again)))
    way.run(motion)
    assert way.robot.state.positions == pytest.approx(GOAL, abs=2e-3)


@pytest.mark.parametrize("wait", [False, True])
def test_a_second_operation_on_a_device_is_refused_and_names_the_first(
    way: Way, wait: bool
) -> None:
    def begin() -> None:
        with pytest.raises(BusyError, match=r"home\(\) refused: move_joints\(\) has been") as arm:
            way.robot.home(wait=wait)
        assert arm.value.running == "move_joints()"
        jaws = way.robot.gripper.move(0.07, wait=False)
        with pytest.raises(BusyError, match=r"gripper\.move\(\) refused: gripper\.move\(\) has"):
            way.robot.gripper.move(0.08, wait=wait)
        handles.append(jaws)

    handles: list[Operation[Any]] = []
    way.run(move(on_cycle=At(cycle_30=elsewhere(begin))))
    assert handles[0].result(LONG).reached_goal
    assert way.robot.gripper.width == pytest.approx(0.07, abs=1e-5)


def test_a_handle_outlives_the_connection(way: Way) -> None:
    done, cancelled = move(), move(START, on_cycle=lambda _: way.robot.stop())
    way.run(done)
    with pytest.raises(MotionCancelledError):
        way.run(cancelled)
    way.robot.close()
    assert (done.status, done.progress, done.result()) == (Status.SUCCEEDED, 1.0, None)
    assert cancelled.status is Status.CANCELLED
    assert 0.0 <= cancelled.progress <= 1.0
    assert "cancelled" in repr(cancelled)
    with pytest.raises(MotionCancelledError):
        cancelled.result()
    with pytest.raises(LifecycleError, match="has ended"):
        done.pause()
    done.cancel()


def test_closing_first_brings_a_moving_arm_to_rest(way: Way) -> None:
    closing: list[Other] = []

    def close() -> None:
        closing.append(Other(way.robot.close, "closing"))
        until(lambda: motion.claim.stopped)

    at = At(cycle_100=close)
    motion = move(on_cycle=at)
    with pytest.raises(MotionCancelledError):
        way.run(motion)
    assert closing[0].end() is None
    assert at.records[-1].phase is Phase.STOPPING
    assert at.speed() == 0.0
    assert way.scene.bus.closed
    assert not any(way.scene.arm.has_torque(name) for name in ("j1", "j3", "j4"))
    until(lambda: not any(each.name == "bioscara-arm" for each in threading.enumerate()))


def test_closing_while_only_the_jaws_move_ends_them(way: Way) -> None:
    """The thread that closes stepped them until the arm's motion ended."""
    jaws: list[Operation[Any]] = []

    def observe(record: CycleRecord) -> None:
        if record.phase is Phase.SETTLING and not jaws:
            elsewhere(lambda: jaws.append(way.robot.gripper.move(0.11, wait=False)))()

    way.run(move(on_cycle=observe))
    way.robot.close()
    assert jaws[0].done
    assert way.scene.bus.closed


@pytest.mark.parametrize("kind", [ZeroDivisionError, SystemExit, KeyboardInterrupt])
def test_an_exception_of_a_callback_is_raised_once_the_arm_is_at_rest(
    way: Way, kind: type[BaseException]
) -> None:
    def fail() -> None:
        raise kind

    at = At(cycle_100=fail)
    motion = move(on_cycle=at)
    with pytest.raises(kind):
        way.run(motion)
    assert motion.status is Status.FAILED
    assert at.records[-1].phase is Phase.STOPPING
    assert at.speed() == 0.0
    way.goes_on()


CALLS: dict[str, Callable[[Robot, Operation[Any]], object]] = {
    "move_joints()": lambda robot, _: robot.move_joints(START),
    "home()": lambda robot, _: robot.home(wait=False),
    "gripper.move()": lambda robot, _: robot.gripper.move(0.06),
    "setting scene": lambda robot, _: setattr(robot, "scene", robot.scene),
    "shutdown()": lambda robot, _: robot.close(),
    "waiting for move_joints()": lambda _, motion: motion.result(),
}


def test_a_callback_that_would_wait_for_its_own_motion_is_refused(way: Way) -> None:
    def call() -> None:
        for name, each in CALLS.items():
            with pytest.raises(BusyError, match="refused inside move_joints") as refused:
                each(way.robot, motion)
            assert str(refused.value).startswith(name)
        CALLS["home()"](way.robot, motion)

    motion = move(on_cycle=At(cycle_50=call))
    with pytest.raises(BusyError, match=r"home\(\) refused inside move_joints"):
        way.run(motion)
    way.goes_on()


def test_waiting_for_a_motion_can_end_before_it(way: Way) -> None:
    gate, begun = Gate(), list[Operation[Any]]()
    handle = way.robot.move_joints(GOAL, on_cycle=At(cycle_30=gate.wait), wait=False)
    begun.append(handle)
    gate.reached()
    assert not handle.wait(0.0)
    with pytest.raises(MotionTimeoutError, match=r"has not ended within 0 s; it goes on"):
        handle.result(0.0)
    gate.open()
    assert handle.result(LONG) is None


@pytest.mark.parametrize("how", ["in the motion", "for its result"])
def test_ctrl_c_while_another_thread_moves_the_arm_stops_it(tmp_path: Path, how: str) -> None:
    main = threading.main_thread().ident
    assert main is not None
    with connected(tmp_path, watched=True) as way:
        at = At(cycle_100=lambda: signal.pthread_kill(main, signal.SIGINT))
        wait = how == "in the motion"
        with pytest.raises(KeyboardInterrupt):
            way.robot.move_joints(GOAL, on_cycle=at, wait=wait).result(LONG)
        until(lambda: not way.robot.is_moving)
        assert at.records[-1].phase is Phase.STOPPING
        assert at.speed() == 0.0
        assert len(at.records) < 300
        way.goes_on()


@contextmanager
def entering(function: str, act: Callable[[], object]) -> Iterator[None]:
    """Act where this thread enters a function for the first time."""

    def trace(frame: FrameType, event: str, _: object) -> None:
        if frame.f_code.co_qualname.endswith(function):
            sys.settrace(None)
            act()

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        yield
    finally:
        sys.settrace(before)


@pytest.mark.parametrize(
    "where", ["Turn.take", "._end", "._call_back", "Turn.notify", "._forget_ended"]
)
def test_ctrl_c_in_the_moment_in_which_a_motion_ends_is_raised(tmp_path: Path, where: str) -> None:
    def press() -> None:
        raise KeyboardInterrupt

    with connected(tmp_path, watched=False) as way:
        with entering(where, press), pytest.raises(KeyboardInterrupt):
            way.run(move())
        way.goes_on()


def test_a_signal_that_ends_a_motion_before_it_began_is_raised(tmp_path: Path) -> None:
    # Its handler stops the motion, which another thread ends before the handler raises.
    def end() -> None:
        way.robot.stop()
        motion.step()
        raise SystemExit(143)

    motion = move()
    with connected(tmp_path, watched=False) as way:
        with entering("Turn.take", end), pytest.raises(SystemExit, match="143"):
            way.run(motion)
        assert motion.status is Status.CANCELLED
        way.goes_on()


def test_joints_may_be_disabled_and_enabled_while_the_jaws_move(way: Way) -> None:
    for switch, width in ((way.robot.disable, 0.11), (way.robot.enable, 0.05)):
        moving = threading.Event()
        jaws = way.robot.gripper.move(width, wait=False, on_cycle=lambda _, at=moving: at.set())
        assert moving.wait(LONG)
        switch()
        assert jaws.result(LONG).reached_goal
        assert way.robot.faults == ()


def test_a_motion_ends_if_no_cycle_can_run_any_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_: float) -> None:
        raise OSError("the clock is broken")

    with connected(tmp_path, watched=False) as way:
        clock = way.scene.arm.clock
        at = At(cycle_30=lambda: monkeypatch.setattr(clock, "sleep_until", fail))
        with pytest.raises(OSError, match="the clock is broken"):
            way.run(move(on_cycle=at))
        monkeypatch.undo()
        # Without setpoints the joints have stopped themselves.
        way.pass_time()
        assert way.scene.speed() < 0.02
        assert [len(at.records), way.robot.runner.arm.operations] == [30, ()]
        assert way.robot.acknowledge()
        way.robot.recover()
        way.goes_on()


def test_a_fault_of_a_standing_arm_is_noticed_while_it_is_watched(tmp_path: Path) -> None:
    with connected(tmp_path, watched=True) as way:
        robot, arm = way.robot, way.scene.arm
        arm.set_power("j2", False)
        until(lambda: robot.faults)
        assert robot.faults[0].source == "j2"
        with pytest.raises(FaultedError, match="j2"):
            robot.home()
        arm.set_power("j2", True)
        robot.acknowledge()
        way.pass_time()
        robot.recover()
        robot.home()
        assert robot.is_homed


# In asyncio.


@BOTH
def test_a_motion_can_be_awaited_by_two_tasks(tmp_path: Path, watched: bool) -> None:
    async def wait_for(motion: Operation[None]) -> Status:
        await motion
        return motion.status

    async def main(robot: Robot) -> None:
        motion = robot.move_joints(GOAL, wait=False)
        told = await asyncio.gather(wait_for(motion), wait_for(motion))
        assert told == [Status.SUCCEEDED, Status.SUCCEEDED]
        assert await motion is None, "it has ended"

    with connected(tmp_path, watched=watched) as way:
        asyncio.run(asyncio.wait_for(main(way.robot), LONG))
        assert way.robot.state.positions == pytest.approx(GOAL, abs=2e-3)


@BOTH
def test_cancelling_a_task_that_awaits_a_motion_first_brings_the_arm_to_rest(
    tmp_path: Path, watched: bool
) -> None:
    """However often it is cancelled; another task that awaits the motion gets its error."""

    async def wait_for(motion: Operation[None]) -> None:
        try:
            await motion
        except asyncio.CancelledError:
            assert motion.done
            assert motion.status is Status.CANCELLED
            raise

    async def main(robot: Robot) -> None:
        gate = Gate()
        at = At(cycle_100=gate.wait)
        motion = robot.move_joints(GOAL, on_cycle=at, wait=False)
        tasks = [asyncio.create_task(wait_for(motion)) for _ in range(2)]
        await asyncio.to_thread(gate.reached)
        for _ in range(3):
            tasks[0].cancel()
            await asyncio.sleep(0.0)
        assert not tasks[0].done()
        assert not motion.done
        gate.open()
        with pytest.raises(asyncio.CancelledError):
            await tasks[0]
        with pytest.raises(MotionCancelledError):
            await tasks[1]
        assert at.speed() == 0.0

    with connected(tmp_path, watched=watched) as way:
        asyncio.run(asyncio.wait_for(main(way.robot), LONG))
        way.goes_on()


@BOTH
def test_a_motion_goes_on_when_the_event_loop_of_a_task_is_closed(
    tmp_path: Path, watched: bool
) -> None:
    async def wait_for(motion: Operation[None]) -> None:
        await motion

    with connected(tmp_path, watched=watched) as way:
        gate, loop = Gate(), asyncio.new_event_loop()
        motion = way.robot.move_joints(GOAL, on_cycle=At(cycle_30=gate.wait), wait=False)
        others = threading.Event()
        motion.when_done(others.set)
        task = loop.create_task(wait_for(motion))
        gate.reached()
        loop.run_until_complete(asyncio.sleep(0.0))
        loop.close()
        gate.open()
        assert motion.result(LONG) is None
        assert others.wait(LONG), "whoever else waits is notified"
        assert not task.done()
        way.goes_on()


@BOTH
def test_a_lost_joint_fails_the_motion_with_the_error_of_the_joint(
    tmp_path: Path, watched: bool
) -> None:
    with connected(tmp_path, watched=watched) as way:
        arm = way.scene.arm
        motion = move(on_cycle=At(cycle_30=lambda: arm.set_power("j2", False)))
        with pytest.raises(JointLostError, match="j2"):
            way.run(motion)
        assert motion.status is Status.FAILED
        assert isinstance(motion.error, JointLostError)
        assert way.robot.faults[0].source == "j2"
        arm.set_power("j2", True)
        way.pass_time()


def test_work_between_cycles_that_do_not_come_is_refused() -> None:
    with Robot.simulated(homed=True) as robot:
        robot.watch()
        assert robot.runner.between_cycles("a question", lambda: 3) == 3
    with pytest.raises(NotInitializedError, match="the robot was closed"):
        robot.runner.between_cycles("a question", lambda: 3)


def test_work_between_cycles_ends_with_the_shutdown(monkeypatch: pytest.MonkeyPatch) -> None:
    question = BetweenCycles("a question", lambda _: 3, frozenset())
    with Robot.simulated(homed=True) as robot:
        shutdown = robot.runner.arm.session.shutdown

        def late() -> list[str]:
            # Begun by another thread when no cycle comes any more.
            thread = threading.Thread(target=robot.runner.begin, args=(question,))
            thread.start()
            thread.join()
            return shutdown()

        monkeypatch.setattr(robot.runner.arm.session, "shutdown", late)
    with pytest.raises(NotInitializedError, match="a question: the arm was shut down"):
        question.result(1.0)
