"""Laws of stopping, pausing and speed that hold at every instant, not only at the usual ones."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest
from tests.control.world import LIMITS, NAMES, NEAR, PARAMETERS, World

from bioscara.bus import FaultyBus
from bioscara.control.joint_trajectory import (
    Goal,
    JointTrajectory,
    JointTrajectoryController,
    Point,
)
from bioscara.errors import (
    GoalRejectedError,
    GripperError,
    InvalidArgumentError,
    MotionTimeoutError,
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


@pytest.mark.parametrize("v1", [False, True])
@pytest.mark.parametrize("pause", [0.3, 1.0, 2.5])
def test_a_host_that_was_held_up_does_not_skip_the_way_that_it_missed(
    pause: float, *, v1: bool
) -> None:
    world = World(v1=v1, at=AT)
    controller = follower(world)
    # j3 stands at first, so it does not miss the setpoints of the pause and stays engaged.
    end = (*HERE[:2], HERE[2] - 0.9, HERE[3])
    points = (Point(1.5, HERE), Point(4.5, end))
    controller.send_goal(Goal(JointTrajectory(NAMES, points)), world.clock.now())
    world.run(1.45)
    before = world.arm.position("j3")
    world.arm.run(pause)
    world.run(1.0)
    assert world.supervisor.faults
    assert world.arm.position("j3") == pytest.approx(before, abs=0.03)


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


def test_an_observer_that_fails_does_not_keep_the_arm_from_ramping_down(tmp_path: Path) -> None:
    arm, robot = arm_and_robot(tmp_path)
    with robot:
        robot.home()
        robot.move_joints(START)

        def observe(record: CycleRecord) -> None:
            if record.trajectory_time > 0.7:
                raise OSError("No space left on device")

        with pytest.raises(OSError, match="No space"):
            robot.move_joints(END, 1.0, observe)
        for name in NAMES:
            assert abs(arm.velocity(name)) < 0.02 * LIMITS[name].max_velocity
        assert robot.faults == ()


def test_a_full_disk_does_not_let_go_of_what_the_gripper_holds(tmp_path: Path) -> None:
    with Robot.simulated(evidence=tmp_path) as robot:
        robot.gripper.move(0.05)
        file = robot.gripper._hardware._gripper._file
        blocked = file.with_name(file.name + ".new")
        blocked.mkdir()
        with pytest.raises(GripperError):
            robot.gripper.move(0.06)
        blocked.rmdir()
        assert robot._servo.pulse() is not None  # type: ignore[attr-defined]


def test_a_gripper_whose_width_could_not_be_kept_works_again_afterwards(tmp_path: Path) -> None:
    with Robot.simulated(evidence=tmp_path) as robot:
        robot.gripper.move(0.05)
        file = robot.gripper._hardware._gripper._file
        blocked = file.with_name(file.name + ".new")
        blocked.mkdir()
        with pytest.raises(GripperError):
            robot.gripper.move(0.06)
        blocked.rmdir()
        if robot.faults:
            robot.acknowledge()
            robot.recover()
        assert robot.gripper.move(0.06).reached_goal


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


def test_a_cycle_that_was_interrupted_is_no_fault_of_the_loop() -> None:
    world = World(at=AT)
    controller = follower(world)
    away = Point(2.0, (HERE[0] + 1.0, *HERE[1:]))
    controller.send_goal(Goal(JointTrajectory(NAMES, (away,))), world.clock.now())
    world.run(1.0)
    transfer = world.hardware.joints[0].bus.transfer

    def interrupted(transactions: object) -> None:
        world.bus.transfer = transfer
        raise KeyboardInterrupt

    world.bus.transfer = interrupted  # type: ignore[assignment,method-assign]
    with pytest.raises(KeyboardInterrupt):
        world.loop.step()
    world.run(1.0)
    assert world.supervisor.faults == []
    assert world.hardware.state is State.ACTIVE
