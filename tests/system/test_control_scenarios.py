"""Rows of the fault table that concern the host, its user and its plans: through the Robot."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bioscara import Robot
from bioscara.control.controllers.joint_trajectory import Goal, GoalStatus, JointTrajectory, Point
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import (
    BioscaraError,
    FaultedError,
    FollowingError,
    GoalAbortedError,
    NotHomedError,
    StalledError,
)
from bioscara.hardware import LifecycleState
from bioscara.model import load_parameters
from bioscara.protocol import Register
from bioscara.report import CycleRecord, Phase
from bioscara.robot.connection.stack import HOLD, TRAJECTORY
from flight_records import read_record
from simulated import home_error, simulated_bus

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
LIMITS = {joint.name: joint for joint in ARM.joints}
START = (-2.5, 0.30, 2.2, 2.5)
GOAL = (-1.5, 0.267, 0.8, 1.0)


class Scene:
    """A homed arm in motion until something happens."""

    def __init__(self, evidence: Path, **options: Any) -> None:
        self.arm, self.bus = simulated_bus(seed=5, frequency=400e3, homed=True, **options)
        self.evidence = evidence
        self.robot = self.host()
        self.records: list[CycleRecord] = []
        self.struck = math.nan
        self.killed = False

    def host(self) -> Robot:
        """A host that starts anew."""
        return Robot(self.bus, self.arm.clock, ARM, "scenario", evidence=self.evidence)

    def move(
        self, event: Callable[[], object] = lambda: None, at: float = 0.7, speed: float = 1.0
    ) -> None:
        """Go from START to GOAL; the event happens during the motion."""
        self.robot.move_joints(START)
        self.struck = math.nan

        def observe(record: CycleRecord) -> None:
            self.records.append(record)
            if record.trajectory_time >= at and math.isnan(self.struck):
                self.struck = self.arm.now()
                event()

        self.robot.move_joints(GOAL, velocity_scaling=speed, on_cycle=observe)

    def moves(self) -> bool:
        return any(
            abs(self.arm.velocity(name)) > 0.02 * LIMITS[name].max_velocity for name in NAMES
        )

    def seconds_to_rest(self) -> float:
        """Let time pass, with no host, until nothing moves; returns how long [s]."""
        begin = self.arm.now()
        while self.moves():
            self.arm.run(0.002)
            assert self.arm.now() - begin < 3.0, "the arm does not come to rest"
        return self.arm.now() - begin


SLOWEST = max(joint.max_velocity / joint.max_acceleration for joint in ARM.joints)
PULL_OUT = 512.0
"""Lead of the field at which a rotor loses it [microsteps]; no stall threshold is below it."""
SWING = 0.25
"""Time in which the belts swing out [s]."""


def scenes(**kinds: dict[str, bool]) -> pytest.MarkDecorator:
    """Run a test on arms of these kinds, by name."""
    return pytest.mark.parametrize("scene", kinds.values(), ids=kinds, indirect=True)


ORIGINAL, FED = {"v1": True}, {"controllers_fed": True}
EITHER = scenes(v2={}, v1=ORIGINAL)


@pytest.fixture
def scene(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Scene]:
    scene = Scene(tmp_path, **getattr(request, "param", {}))
    robot = scene.robot.__enter__()
    robot.enable()
    yield scene
    if not scene.killed:
        robot.__exit__(None, None, None)


def recover(scene: Scene) -> None:
    """Recover from the faults as a person does; nothing may move until enabled."""
    robot, before = scene.robot, [scene.arm.position(name) for name in NAMES]
    with pytest.raises(FaultedError):
        robot.enable()
    with pytest.raises(FaultedError):
        robot.recover()
    faults = robot.acknowledge()
    assert all(fault.evidence is not None and fault.evidence.exists() for fault in faults)
    robot.recover()
    scene.arm.run(0.3)
    after = [scene.arm.position(name) for name in NAMES]
    assert after == pytest.approx(before, abs=2e-3)
    assert robot.faults == ()
    assert not scene.arm.has_torque("j1")
    robot.enable()


class KilledError(BaseException):
    """The host dies here: no line of it runs after this, as far as the arm is concerned."""


def kill(scene: Scene) -> None:
    def die() -> None:
        scene.bus.off()
        raise KilledError

    with pytest.raises(KilledError):
        scene.move(die, random.Random(scene.arm.now()).uniform(0.2, 1.0))
    scene.killed = True


def test_host5_an_arm_whose_computer_froze_waits_at_rest_for_as_long_as_it_takes(
    scene: Scene,
) -> None:
    kill(scene)
    scene.seconds_to_rest()
    scene.arm.run(SWING)
    before = [scene.arm.position(name) for name in NAMES]
    scene.arm.run(60.0)
    assert [scene.arm.position(name) for name in NAMES] == pytest.approx(before, abs=1e-3)
    scene.bus.clear()
    with scene.host() as again:
        assert len(again.faults) == len(NAMES)


def test_host7_a_controller_that_takes_over_at_speed_makes_no_step(scene: Scene) -> None:
    robot, stack = scene.robot, scene.robot.runner.arm.stack
    guards = stack.manager.limiter.joints
    last = dict.fromkeys(NAMES, math.nan)

    def observe(record: CycleRecord) -> None:
        for name in NAMES:
            step = abs(guards[name].reference - last[name])
            assert not step > LIMITS[name].max_velocity * robot.period * 1.001
            last[name] = guards[name].reference
        if record.trajectory_time >= 0.5 and math.isnan(scene.struck):
            scene.struck = scene.arm.now()
            assert scene.moves()
            stack.manager.take_over(HOLD, (TRAJECTORY,), scene.arm.now())

    robot.move_joints(START)
    with pytest.raises(GoalAbortedError):
        robot.move_joints(GOAL, on_cycle=observe)
    scene.arm.run(2 * SWING)
    assert not scene.moves()


@pytest.mark.parametrize(("factor", "at"), [(8.0, 0.3), (12.0, 0.7)])
def test_mec2_friction_that_holds_a_joint_back_is_named_as_its_stall(
    scene: Scene, factor: float, at: float
) -> None:
    with pytest.raises(StalledError) as caught:
        scene.move(lambda: scene.arm.set_friction("j1", factor), at)
    (fault,) = scene.robot.faults
    assert (fault.kind, fault.source) == (FaultKind.STALL, "j1")
    told = re.search(
        r"j1: .*position error (\d+\.?\d*) microsteps.*stall_threshold", str(caught.value)
    )
    assert told is not None
    assert float(told[1]) > PULL_OUT
    scene.arm.run(SWING)
    assert not scene.moves()
    scene.arm.set_friction("j1", 1.0)
    scene.arm.run(SWING)
    recover(scene)


def slow(scene: Scene) -> None:
    """Its acceleration becomes low in motion, which the driver itself would not do."""
    joint = scene.robot.joints[0]
    deg = joint.feedback.transmission.size_to_deg(0.05)
    joint.session.write(Register.SETMAXACCELERATION, deg)


def hung(scene: Scene) -> None:
    """Its loop stands still, nothing restarts it, and its interrupt goes on answering."""
    scene.arm.set_watchdog("j1", on=False)
    scene.arm.hang("j1")


# A hung original joint follows: it takes positions in its interrupt.
@pytest.mark.parametrize(
    ("scene", "strike"),
    [({}, slow), ({}, hung), (ORIGINAL, slow)],
    ids=["v2-slow", "v2-hung", "v1-slow"],
    indirect=["scene"],
)
def test_mec2_a_joint_that_answers_well_but_trails_its_commands_is_noticed_by_the_host(
    scene: Scene, strike: Callable[[Scene], None]
) -> None:
    with pytest.raises(FollowingError) as caught:
        scene.move(lambda: strike(scene), at=0.3)
    error = caught.value
    assert error.joint == "j1"
    assert 0.0 < error.limit < error.error < 1.5 * error.limit
    assert f"{error.error:.4g} rad" in str(error)
    assert f"{error.limit:.4g} rad" in str(error)
    last = [record for record in scene.records if record.phase is Phase.TRAJECTORY][-1]
    off = abs(last.joints[0].reference - last.joints[0].position)
    assert error.error == pytest.approx(
        off, abs=2.0 * LIMITS["j1"].max_velocity * scene.robot.period
    )
    (fault,) = scene.robot.faults
    assert (fault.kind, fault.source) == (FaultKind.FOLLOWING_ERROR, "j1")
    assert fault.time - scene.struck < 1.0
    assert error.message in read_record(fault.evidence).faults[0]
    goal = scene.robot.runner.arm.stack.trajectory.goal
    assert goal is not None
    assert goal.status is GoalStatus.ABORTED
    scene.arm.run(2 * SWING)
    assert not scene.moves()
    scene.arm.hang("j1", on=False)
    scene.arm.run(2 * SWING)
    recover(scene)


def restore(scene: Scene) -> None:
    """Release the emergency stop, and wait until all joints have started."""
    scene.arm.set_supply(True)
    scene.arm.run(1.0)


@scenes(v2={}, v1=ORIGINAL, fed=FED)
def test_usr1_an_emergency_stop_is_named_at_once_and_targets_are_dropped(scene: Scene) -> None:
    with pytest.raises(BioscaraError):
        scene.move(lambda: scene.arm.set_supply(False))
    robot = scene.robot
    fault = robot.faults[0]
    assert fault.kind is FaultKind.POWER_LOST
    assert "emergency stop" in str(fault)
    cycles = 2.1 if scene.arm.controllers_fed else 5.1
    assert fault.time - scene.struck <= cycles * robot.period
    stack = robot.runner.arm.stack
    # Joints that are off cannot be identified.
    off = LifecycleState.INACTIVE if scene.arm.controllers_fed else LifecycleState.UNCONFIGURED
    assert stack.hardware.state is off
    assert not [
        controller
        for controller in stack.manager.controllers
        if controller.state is LifecycleState.ACTIVE and controller.command_interfaces
    ]
    restore(scene)


def look_for_a_while(scene: Scene) -> None:
    for _ in range(12):
        assert scene.robot.state
        scene.arm.run(scene.robot.period)


@scenes(v2={}, v1=ORIGINAL, fed=FED)
def test_usr1_an_emergency_stop_at_rest_is_named_when_it_is_read(scene: Scene) -> None:
    scene.robot.move_joints(START)
    scene.arm.run(1.0)
    scene.arm.set_supply(False)
    scene.arm.run(1.0)
    if scene.arm.controllers_fed:
        here = scene.robot.state.positions[0]
        assert here == pytest.approx(scene.arm.position("j1"), abs=5e-3)
    else:
        # Bad cycles are bridged for 0.1 s at most.
        with pytest.raises(FaultedError, match="emergency stop"):
            look_for_a_while(scene)
    assert scene.robot.faults[0].kind is FaultKind.POWER_LOST
    restore(scene)


@scenes(v1_fed=ORIGINAL | FED)
def test_usr1_an_emergency_stop_at_rest_is_nothing_that_original_joints_report(
    scene: Scene,
) -> None:
    scene.robot.move_joints(START)
    scene.arm.run(1.0)
    scene.arm.set_supply(False)
    scene.arm.run(1.0)
    error = 5e-3 + home_error("j1", v1=True)
    assert scene.robot.state.positions[0] == pytest.approx(scene.arm.position("j1"), abs=error)
    assert scene.robot.faults == ()


@scenes(v1_fed=ORIGINAL | FED)
def test_usr2_original_joints_whose_motors_alone_have_no_supply_stop_trailing(
    scene: Scene,
) -> None:
    with pytest.raises(BioscaraError):
        scene.move(lambda: scene.arm.set_supply(False))
    robot = scene.robot
    # Nothing else informs the host; a joint may find a stall before.
    assert robot.faults[0].kind in {FaultKind.FOLLOWING_ERROR, FaultKind.STALL}
    assert robot.faults[0].time - scene.struck < 1.0
    scene.arm.run(1.0)
    restore(scene)
    recover(scene)
    assert all(scene.arm.has_torque(name) for name in NAMES)
    robot.move_joints(GOAL)
    error = 5e-3 + home_error("j1", v1=True)
    assert scene.arm.position("j1") == pytest.approx(GOAL[0], abs=error)


@scenes(fed=FED)
def test_usr2_controllers_that_stay_on_keep_the_home_and_nothing_moves_on_return(
    scene: Scene,
) -> None:
    with pytest.raises(BioscaraError):
        scene.move(lambda: scene.arm.set_supply(False))
    scene.arm.run(1.0)
    before = [scene.arm.position(name) for name in NAMES]
    restore(scene)
    assert not any(scene.arm.has_torque(name) for name in NAMES)
    with pytest.raises(FaultedError):
        scene.robot.move_joints(GOAL)
    after = [scene.arm.position(name) for name in NAMES]
    assert after == pytest.approx(before, abs=1e-6)
    recover(scene)
    assert all(axis.homed for axis in scene.robot.runner.arm.session.hardware.axes)
    scene.robot.move_joints(GOAL)
    assert scene.arm.position("j1") == pytest.approx(GOAL[0], abs=5e-3)


@EITHER
def test_usr2_after_an_emergency_stop_all_joints_restart_and_the_arm_is_homed_again(
    scene: Scene,
) -> None:
    with pytest.raises(BioscaraError):
        scene.move(lambda: scene.arm.set_supply(False))
    assert scene.robot.faults[0].kind is FaultKind.POWER_LOST
    scene.arm.run(1.0)
    before = [scene.arm.position(name) for name in NAMES]
    restore(scene)
    after = [scene.arm.position(name) for name in NAMES]
    v1 = bool(scene.arm.originals)
    # An original joint turns its motor by a degree and back when it starts.
    assert after == pytest.approx(before, abs=5e-3 if v1 else 1e-6)
    recover(scene)
    with pytest.raises(NotHomedError):
        scene.robot.move_joints(GOAL)
    scene.robot.home()
    scene.robot.move_joints(GOAL)
    error = 5e-3 + home_error("j1", v1=v1)
    assert scene.arm.position("j1") == pytest.approx(GOAL[0], abs=error)


def push(scene: Scene, until: float) -> None:
    """Push the wrist by hand, no faster than a person would."""
    begin = scene.arm.now()
    while scene.arm.position("j4") < until:
        scene.arm.push("j4", 0.4 if scene.arm.velocity("j4") < 1.0 else 0.0)
        scene.arm.run(0.005)
        assert scene.arm.now() - begin < 60.0, "the hand is too weak"
    scene.arm.push("j4", 0.0)


def test_usr3_a_joint_that_was_pushed_by_hand_is_followed_and_held_where_it_is(
    scene: Scene,
) -> None:
    scene.move()
    robot = scene.robot
    robot.disable()
    push(scene, GOAL[3] + 0.3)
    scene.arm.run(0.5)
    there = scene.arm.position("j4")
    assert robot.state.positions[3] == pytest.approx(there, abs=5e-3)
    robot.enable()
    assert scene.arm.position("j4") == pytest.approx(there, abs=5e-3)
    robot.move_joints(GOAL)
    assert scene.arm.position("j4") == pytest.approx(GOAL[3], abs=5e-3)


def test_usr3_a_joint_that_was_pushed_beyond_its_limit_moves_only_back(scene: Scene) -> None:
    scene.move()
    robot, limit = scene.robot, LIMITS["j4"]
    robot.disable()
    scene.arm.remove_stops("j4")
    push(scene, limit.upper + 0.01)
    scene.arm.run(0.5)
    beyond = scene.arm.position("j4")
    assert beyond > limit.upper
    robot.enable()
    furthest = [beyond]
    robot.move_joints(
        GOAL,
        velocity_scaling=0.5,
        on_cycle=lambda _: furthest.append(scene.arm.position("j4")),
    )
    assert max(furthest) < beyond + 5e-3
    assert scene.arm.position("j4") == pytest.approx(GOAL[3], abs=5e-3)


def test_a_fault_can_be_acknowledged_at_once_the_arm_comes_to_rest_first(scene: Scene) -> None:
    robot, stack = scene.robot, scene.robot.runner.arm.stack
    robot.move_joints(START)
    goal = Goal(JointTrajectory(NAMES, (Point(4.0, GOAL),)))
    stack.trajectory.send_goal(goal, scene.arm.now())
    for _ in range(150):
        stack.loop.step()
    assert scene.moves()
    stack.supervisor.fault(StalledError("it stalled", "j1"), "j1", scene.arm.now())
    (fault,) = robot.acknowledge()
    assert fault.evidence is not None
    scene.arm.run(2 * SWING)
    assert not scene.moves()
    robot.recover()
    robot.move_joints(GOAL)
