"""Laws of stopping, pausing and speed that hold at every instant, not only at the usual ones."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest
from tests.control.world import LIMITS, NAMES, NEAR, PARAMETERS, World

from bioscara.bus import FaultyBus
from bioscara.control.faults import FaultKind, Stop
from bioscara.control.homing_controller import HomingController
from bioscara.control.joint_trajectory import (
    Goal,
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.control.supervisor import FaultState
from bioscara.errors import (
    ControllerError,
    FollowingError,
    GoalRejectedError,
    InvalidArgumentError,
    MotionCancelledError,
    MotionTimeoutError,
    OverrunError,
)
from bioscara.hardware import State
from bioscara.report import CycleRecord
from bioscara.robot import Robot
from bioscara.sim import FirmwareBus, SimulatedArm

AT = {"j1": -2.0, "j2": 0.25, "j3": 1.5, "j4": 1.5}
HERE = tuple(AT.values())
START, END = (-2.5, 0.30, 2.2, 2.5), (-1.5, 0.25, 0.8, 1.0)


def arm_and_robot(folder: Path) -> tuple[SimulatedArm, Robot]:
    arm = SimulatedArm(seed=5, positions=NEAR, frequency=400e3)
    bus = FaultyBus(FirmwareBus(arm), seed=5, clock=arm.clock)
    return arm, Robot(bus, arm.clock, PARAMETERS, "review", evidence=folder)


def follower(world: World, **values: object) -> JointTrajectoryController:
    """A trajectory controller that is active."""
    made = world.load(
        "jtc",
        "joint_trajectory_controller/JointTrajectoryController",
        joints=NAMES,
        command_interfaces=world.commanded,
        fallback_controllers=("hold",),
        **values,
    )
    assert isinstance(made, JointTrajectoryController)
    world.switch("jtc")
    world.run(0.1)
    return made


def homer(world: World, *joints: str) -> HomingController:
    """A homing controller that is active."""
    kind = "single_trigger_controller/SingleTriggerController"
    made = world.load("homing", kind, joints=joints)
    assert isinstance(made, HomingController)
    world.switch("homing")
    world.run(0.1)
    return made


def test_homing_that_is_cancelled_before_its_first_cycle_moves_nothing(tmp_path: Path) -> None:
    arm, robot = arm_and_robot(tmp_path)
    with robot:
        robot.enable()
        before = arm.position("j2")
        with pytest.raises(MotionCancelledError):
            robot.home(cancelled=lambda: True)
        assert arm.position("j2") == pytest.approx(before, abs=1e-4)


def test_homing_that_is_cancelled_between_two_joints_does_not_begin_the_next(
    tmp_path: Path,
) -> None:
    arm, robot = arm_and_robot(tmp_path)
    with robot:
        robot.enable()
        homing, before = robot._running().homing, arm.position("j1")

        def cancelled() -> bool:
            goal = homing.goal
            return (
                goal is not None
                and goal.current == "j2"
                and goal.progress is not None
                and goal.progress.elapsed > 0.1
                and not any(handle.value for handle in homing.command_handles)
            )

        with pytest.raises(MotionCancelledError):
            robot.home(cancelled=cancelled)
        assert arm.position("j1") == pytest.approx(before, abs=1e-3)


def test_a_homing_controller_that_stays_active_takes_no_goal_while_a_fault_is_latched() -> None:
    world = World(home=False)
    homing = homer(world, "j2", "j1")
    world.supervisor.fault(ControllerError("broken", "any"), "any", world.clock.now())
    world.run(0.5)
    assert world.supervisor.state is FaultState.LATCHED
    before = world.arm.position("j2")
    with suppress(GoalRejectedError):
        homing.send_goal({"j2": 1.0})
    world.run(1.0)
    assert world.arm.position("j2") == pytest.approx(before, abs=1e-4)


def test_homing_with_a_timeout_that_makes_no_sense_leaves_nothing_behind(tmp_path: Path) -> None:
    arm, robot = arm_and_robot(tmp_path)
    with robot:
        robot.enable()
        with pytest.raises(InvalidArgumentError):
            robot.home(timeout=-1.0)
        before = arm.position("j2")
        for _ in range(50):
            assert robot.state
            arm.run(0.021)
        assert arm.position("j2") == pytest.approx(before, abs=1e-4)


def test_a_motion_at_speed_zero_does_not_begin(tmp_path: Path) -> None:
    arm, robot = arm_and_robot(tmp_path)
    with robot:
        robot.home()
        robot.move_joints(START)
        before = [arm.position(name) for name in NAMES]
        robot.speed = 0.0
        with pytest.raises(MotionTimeoutError):
            robot.move_joints(END, timeout=2.0)
        assert [arm.position(name) for name in NAMES] == pytest.approx(before, abs=2e-3)


def test_the_chosen_speed_holds_from_the_first_cycle_of_a_motion(tmp_path: Path) -> None:
    _, robot = arm_and_robot(tmp_path)
    with robot:
        robot.home()
        robot.move_joints(START)
        robot.speed = 0.1
        fastest = dict.fromkeys(NAMES, 0.0)

        def observe(_: CycleRecord) -> None:
            for name, guard in robot._running().manager.limiter.guards.items():
                fastest[name] = max(fastest[name], abs(guard.speed))

        robot.move_joints(END, 1.0, observe)
        for name, limits in LIMITS.items():
            assert fastest[name] <= 0.1 * limits.max_velocity * 1.02


def test_a_late_loop_that_recovers_after_its_trajectory_controller_left_is_no_fault() -> None:
    world = World(at=AT)
    follower(world)
    world.run(1.1)
    for _ in range(12):
        world.run(0.1)
        world.arm.run(0.025)
    assert any("LATE" in text for text in world.supervisor.warnings)
    world.switch("hold", off=("jtc",))
    world.run(2.0)
    assert world.supervisor.faults == []


def test_a_late_loop_never_makes_motion_faster_than_was_chosen() -> None:
    world = World(at=AT)
    controller = follower(world)
    controller.set_scaling(0.2)
    world.run(0.05)
    late = OverrunError("late")
    world.supervisor.fault(late, "loop", world.clock.now(), FaultKind.LATE)
    world.run(1.2)
    assert controller.scaling <= 0.2 + 1e-9
    world.supervisor.full_speed()
    world.run(1.2)
    assert controller.scaling == pytest.approx(0.2)


def test_joints_that_a_partial_goal_leaves_out_go_on_along_their_own_points() -> None:
    world = World(at=AT)
    controller = follower(world, allow_partial_joints_goal=True)
    points = tuple(
        Point(time, (HERE[0] + way, *HERE[1:]), (speed, 0.0, 0.0, 0.0))
        for time, way, speed in ((1, 0.25, 0.25), (2, 0.5, 0.0), (3, 0.25, -0.25), (4, 0.0, 0.0))
    )
    controller.send_goal(Goal(JointTrajectory(NAMES, points)), world.clock.now())
    world.run(0.1)
    other = JointTrajectory(("j4",), (Point(3.9, (HERE[3] + 0.1,), (0.0,)),))
    controller.send_goal(Goal(other), world.clock.now())
    farthest = 0.0
    for _ in range(450):
        world.loop.step()
        farthest = max(farthest, world.arm.position("j1") - HERE[0])
    assert farthest == pytest.approx(0.5, abs=0.02)


def test_a_joint_that_overheats_after_another_fault_releases_the_arm_as_if_it_were_the_first() -> (
    None
):
    world = World(at=AT)
    follower(world)
    cause = FollowingError("it is off", "j1", 1.0, 0.5)
    world.supervisor.fault(cause, "j1", world.clock.now())
    world.run(1.0)
    world.arm.overheat("j3")
    world.run_until(lambda: len(world.supervisor.faults) > 1)
    world.run(6.0)
    assert world.supervisor.faults[1].kind is FaultKind.OVERTEMPERATURE
    assert world.hardware.state is not State.ACTIVE
    assert not any(world.arm.has_torque(name) for name in NAMES)


def test_the_seconds_before_the_first_fault_are_kept_whatever_comes_later(tmp_path: Path) -> None:
    world = World(at=AT, folder=tmp_path)
    follower(world)
    first = world.clock.now()
    world.supervisor.fault(FollowingError("first", "j1", 1.0, 0.5), "j1", first)
    world.run(20.0)
    now = world.clock.now()
    world.supervisor.fault(FollowingError("second", "j2", 1.0, 0.5), "j2", now)
    world.run(1.0)
    evidence = world.supervisor.acknowledge()[0].evidence
    assert evidence is not None
    lines = [line for line in evidence.read_text().splitlines() if line[0] != "#"]
    assert float(lines[1].split(",")[0]) <= first


def test_a_velocity_controller_that_was_told_nothing_does_not_keep_the_arm_moving() -> None:
    world = World(at=AT)
    controller = follower(world)
    away = Point(2.0, (HERE[0] + 1.0, *HERE[1:]))
    controller.send_goal(Goal(JointTrajectory(NAMES, (away,))), world.clock.now())
    world.run(1.0)
    kind = "forward_command_controller/ForwardCommandController"
    world.load("velocities", kind, joints=NAMES, interface_name="velocity")
    world.switch("velocities", off=("jtc",))
    world.run(3.0)
    assert abs(world.arm.velocity("j1")) < 0.02 * LIMITS["j1"].max_velocity


def test_a_joint_that_nobody_commands_and_is_lost_does_not_let_the_others_fall() -> None:
    world = World(at=AT)
    kind = "forward_command_controller/ForwardCommandController"
    forward = world.load("one", kind, joints=("j1",), interface_name="position")
    world.switch("one")
    forward.command((-1.0,))
    world.run(0.5)
    world.arm.hang("j4")
    world.run(2.0)
    assert world.supervisor.faults[0].kind.stop is Stop.HOLD
    assert world.hardware.state is State.ACTIVE
    assert world.arm.has_torque("j2")


@pytest.mark.parametrize(("stamp", "time"), [(1e200, 1.0), (0.0, 1e200)])
def test_a_goal_whose_curve_no_number_can_hold_is_rejected_not_a_fault(
    stamp: float, time: float
) -> None:
    world = World(at=AT)
    controller = follower(world)
    point = Point(time, HERE, (0.0,) * 4)
    with suppress(GoalRejectedError):
        controller.send_goal(Goal(JointTrajectory(NAMES, (point,), stamp)), world.clock.now())
    world.run(0.2)
    assert world.supervisor.faults == []


def test_warnings_of_goals_do_not_fill_the_memory() -> None:
    world = World(at=AT)
    controller = follower(world)
    goal = Goal(JointTrajectory(NAMES, (Point(1.0, HERE),)), goal_time_tolerance=-2.0)
    for _ in range(500):
        controller.send_goal(goal, world.clock.now())
    assert len(controller.warnings) <= 100


def test_joints_that_could_not_be_released_are_told_of() -> None:
    world = World(at=AT)
    follower(world)
    world.bus.off()
    for text in ("first", "second"):
        world.supervisor.crash(RuntimeError(text), world.clock.now())
    world.bus.clear()
    world.run(0.5)
    assert all(world.arm.has_torque(name) for name in NAMES)
    told = [*map(str, world.supervisor.faults), *world.supervisor.warnings]
    assert any("energised" in each for each in told)
