"""The arm as one object, on the compiled firmware, in virtual time."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import (
    BioscaraError,
    FaultedError,
    GripperError,
    HomingError,
    MotionCancelledError,
    MotionTimeoutError,
    NotHomedError,
    NotInitializedError,
    NotSupportedError,
    StalledError,
    TrajectoryError,
)
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, point_to_point
from bioscara.planning.motions.tool_speed import COMMANDED_SPEED
from bioscara.report import CycleRecord, Phase
from bioscara.robot.connection.devices import simulated_devices
from bioscara.sim import BenchBus, FirmwareBus
from flight_records import read_record
from simulated import home_error, simulated_robot

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
START = (-2.0, 0.30, 2.0, 2.0)


class Scene:
    """A robot, and the simulated arm behind it."""

    def __init__(self, evidence: Path, at: Sequence[float] | None = None, **options: bool) -> None:
        self.arm, _, self.robot = simulated_robot(evidence, homed=at is not None, at=at, **options)

    def speeds(self) -> list[float]:
        """Speeds once the belts have swung out."""
        self.arm.run(0.5)
        return [abs(self.arm.velocity(name)) for name in NAMES]


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Scene]:
    made = Scene(tmp_path)
    with made.robot:
        yield made


@pytest.fixture
def homed(tmp_path: Path) -> Iterator[Scene]:
    made = Scene(tmp_path, START)
    with made.robot:
        made.robot.move_joints(START)
        yield made


def test_connecting_moves_nothing_and_positions_are_unknown(scene: Scene) -> None:
    before = [scene.arm.position(name) for name in NAMES]
    state = scene.robot.state
    assert state.names == NAMES
    assert all(math.isnan(position) for position in state.positions)
    assert [scene.arm.position(name) for name in NAMES] == pytest.approx(before, abs=1e-6)


def test_a_homed_arm_knows_its_position_and_reaches_its_goal(homed: Scene) -> None:
    assert homed.robot.state.positions == pytest.approx(START, abs=2e-3)
    for name, position in zip(NAMES, START, strict=True):
        assert homed.arm.position(name) == pytest.approx(position, abs=5e-3)
    homed.robot.move_joints([-1.9, 0.29, 1.9, 1.9], velocity_scaling=0.5)
    assert homed.robot.state.positions == pytest.approx([-1.9, 0.29, 1.9, 1.9], abs=2e-3)


def test_homing_twice_homes_once(homed: Scene) -> None:
    before = homed.arm.now()
    homed.robot.home()
    assert homed.arm.now() - before < 0.1


def test_motion_before_homing_is_refused(scene: Scene) -> None:
    with pytest.raises(NotHomedError, match="j1"):
        scene.robot.move_joints(START)
    assert max(scene.speeds()) < 1e-3


@pytest.mark.parametrize(
    ("positions", "complaint"),
    [
        ((0.0, 0.1, 0.0), "3 positions for 4 joints"),
        ((4.0, 0.1, 0.0, 0.0), "j1: goal 4 rad is outside"),
        ((0.0, 100.0, 0.0, 0.0), "j2: goal 100 m is outside"),
        ((0.0, 0.1, math.nan, 0.0), "j3"),
    ],
)
def test_pln1_a_goal_beyond_the_limits_is_refused_before_anything_moves(
    homed: Scene, positions: tuple[float, ...], complaint: str
) -> None:
    before = homed.robot.state.positions
    with pytest.raises(TrajectoryError, match=complaint):
        homed.robot.move_joints(positions)
    assert homed.robot.state.positions == pytest.approx(before, abs=1e-4)


def test_pln2_a_trajectory_that_starts_elsewhere_is_refused_with_numbers(homed: Scene) -> None:
    far = point_to_point(NAMES, (-1.9, 0.30, 2.0, 2.0), (-1.5, 0.30, 2.0, 2.0), ARM.joints)
    with pytest.raises(TrajectoryError, match=r"j1 is at -2\.0\d* rad .* starts at -1\.9"):
        homed.robot.follow(far)
    homed.robot.follow(far, approach=True)
    assert homed.robot.state.positions[0] == pytest.approx(-1.5, abs=2e-3)


def test_a_trajectory_for_one_joint_holds_the_others(homed: Scene) -> None:
    homed.robot.follow(point_to_point(("j1",), START[:1], (-1.9,), ARM.joints[:1]))
    assert homed.robot.state.positions == pytest.approx((-1.9, *START[1:]), abs=2e-3)


def test_pln2_a_small_gap_is_joined_by_a_ramp(homed: Scene) -> None:
    near = point_to_point(NAMES, (-1.99, 0.301, 2.01, 2.01), (-1.8, 0.30, 2.0, 2.0), ARM.joints)
    records: list[CycleRecord] = []
    homed.robot.follow(near, on_cycle=records.append)
    assert {record.phase for record in records} >= {Phase.APPROACH, Phase.TRAJECTORY}
    speeds = [record.joints[0].reference_velocity for record in records]
    steps = [abs(b - a) for a, b in pairwise(speeds)]
    assert max(steps) <= ARM.joints[0].max_acceleration * 0.01 * 1.1


def test_a_trajectory_beyond_a_limit_is_refused(homed: Scene) -> None:
    fast = Trajectory(("j2",), (0.0, 1.0), ((0.30,), (0.20,)))
    with pytest.raises(TrajectoryError, match=r"j2.*0\.02"):
        homed.robot.follow(fast)


def stop_after(homed: Scene, cycles: int, end: type[BaseException] | None) -> list[CycleRecord]:
    records: list[CycleRecord] = []

    def observe(record: CycleRecord) -> None:
        records.append(record)
        if len(records) == cycles:
            if end is not None:
                raise end
            homed.robot.stop()

    with pytest.raises((MotionCancelledError, KeyboardInterrupt)):
        homed.robot.move_joints((-1.0, 0.28, 1.0, 1.0), on_cycle=observe)
    return records


@pytest.mark.parametrize("fails_in", [Phase.TRAJECTORY, Phase.STOPPING])
def test_the_error_of_an_observer_is_raised_once_the_arm_is_at_rest(
    homed: Scene, fails_in: Phase
) -> None:
    homed.robot.move_joints(START)
    failed = []

    def observe(record: CycleRecord) -> None:
        if late and homed.robot.clock.now() > begin + 2.5:
            homed.robot.stop()
        if failed or (record.phase is fails_in and record.trajectory_time > 0.7):
            failed.append(record)
            raise OSError("No space left on device")

    late = fails_in is Phase.STOPPING
    begin = homed.robot.clock.now()
    with pytest.raises(OSError, match="No space"):
        homed.robot.move_joints((-1.0, 0.28, 0.5, 0.5), velocity_scaling=0.3, on_cycle=observe)
    stack = homed.robot.runner.arm.stack
    for axis in stack.hardware.axes:
        assert abs(axis.sample.velocity) < 0.01 * axis.velocity_limit
    assert max(homed.speeds()) < 1e-3
    assert homed.robot.faults == ()


@pytest.mark.parametrize(
    ("cycles", "end"), [(1, None), (30, KeyboardInterrupt), (80, None), (150, KeyboardInterrupt)]
)
def test_pln5_every_aborted_motion_ramps_down_to_rest(
    homed: Scene, cycles: int, end: type[BaseException] | None
) -> None:
    records = stop_after(homed, cycles, end)
    assert max(homed.speeds()) < 0.02
    stopping = [record for record in records if record.phase is Phase.STOPPING]
    assert stopping
    for index, joint in enumerate(ARM.joints):
        speeds = [record.joints[index].reference_velocity for record in records[cycles - 1 :]]
        steps = [abs(b - a) for a, b in pairwise(speeds)]
        assert max(steps) <= joint.max_acceleration * 0.01 * 2.0
    homed.robot.move_joints(START)
    assert homed.robot.state.positions == pytest.approx(START, abs=2e-3)


def test_a_motion_that_exceeds_its_timeout_ends_at_rest(homed: Scene) -> None:
    with pytest.raises(MotionTimeoutError, match=r"0\.5 s"):
        homed.robot.move_joints((-1.0, 0.28, 1.0, 1.0), timeout=0.5)
    assert max(homed.speeds()) < 0.02
    with pytest.raises(ValueError, match="timeout"):
        homed.robot.move_joints(START, timeout=0.0)


def test_the_chosen_speed_holds_from_the_first_cycle_of_a_motion(homed: Scene) -> None:
    homed.robot.speed_override = 0.1
    records: list[CycleRecord] = []
    homed.robot.move_joints((-1.5, 0.25, 0.8, 1.0), on_cycle=records.append)
    for index, joint in enumerate(ARM.joints):
        fastest = max(abs(record.joints[index].reference_velocity) for record in records)
        assert 0.0 < fastest <= 0.1 * joint.max_velocity * 1.02


def test_the_tool_speed_is_limited_unless_reduced_speed_is_off(homed: Scene) -> None:
    goal = (-0.5, 0.30, 0.5, 0.5)

    def fastest() -> float:
        records: list[CycleRecord] = []
        homed.robot.move_joints(goal, on_cycle=records.append)
        homed.robot.move_joints(START)
        return max(
            homed.robot.kinematics.tool_speed(
                [joint.position for joint in record.joints],
                [joint.reference_velocity for joint in record.joints],
            )
            for record in records
            if record.phase is Phase.TRAJECTORY
        )

    assert fastest() == pytest.approx(COMMANDED_SPEED, rel=0.02)
    homed.robot.reduced_speed = False
    assert fastest() > 0.4


@pytest.mark.parametrize("v1", [False, True])
def test_a_simulated_arm_may_start_homed_until_its_joints_restart(v1: bool, tmp_path: Path) -> None:
    devices = simulated_devices(ARM, v1=v1, seed=3, homed=True)
    assert isinstance(devices.bus, BenchBus)
    arm = devices.bus.bench._arm
    with Robot(**devices._asdict(), parameters=ARM, evidence=tmp_path) as first:
        assert first.is_homed
        for joint, position in zip(first.joints, first.state.positions, strict=True):
            error = home_error(joint.name, v1=v1)
            assert position == pytest.approx(arm.position(joint.name), abs=error)
    arm.reset("j3")
    arm.run(1.0)
    with Robot(FirmwareBus(arm), arm.clock, ARM, "simulated", evidence=tmp_path) as second:
        assert [joint.name for joint in second.joints if not joint.is_homed()] == ["j3"]


def test_a_gripper_whose_width_was_not_stored_on_release_works_again(
    tmp_path: Path,
) -> None:
    with Robot.simulated(evidence=tmp_path) as robot:
        robot.gripper.move(0.05)
        file = robot.runner.arm.session.gripper._gripper._file
        full = file.with_name(file.name + ".new")
        full.mkdir()
        with pytest.raises(GripperError, match="width cannot be kept"):
            robot.gripper.disable()
        assert robot._servo.pulse() is None  # type: ignore[attr-defined]
        full.rmdir()
        assert robot.gripper.move(0.06).result().reached_goal


def test_a_stop_before_a_motion_does_not_affect_it(homed: Scene) -> None:
    homed.robot.stop()
    homed.robot.move_joints([-1.95, 0.30, 2.0, 2.0])
    assert homed.robot.state.positions[0] == pytest.approx(-1.95, abs=2e-3)


def test_a_disabled_and_enabled_arm_is_still_homed(homed: Scene) -> None:
    homed.robot.disable()
    assert not any(homed.arm.has_torque(name) for name in ("j1", "j3", "j4"))
    homed.robot.enable()
    assert homed.robot.state.positions[0] == pytest.approx(START[0], abs=0.02)
    homed.robot.move_joints(START)


def test_homing_cancelled_between_two_joints_does_not_begin_the_next(scene: Scene) -> None:
    scene.robot.enable()
    homing, before = scene.robot.runner.arm.stack.homing, scene.arm.position("j1")

    def observe(_: CycleRecord) -> None:
        goal = homing.goal
        if (
            goal is not None
            and goal.current == "j2"
            and goal.progress is not None
            and goal.progress.elapsed > 0.1
            and not any(handle.value for handle in homing.command_handles)
        ):
            scene.robot.stop()

    with pytest.raises(MotionCancelledError):
        scene.robot.home(on_cycle=observe)
    assert scene.arm.position("j1") == pytest.approx(before, abs=1e-3)
    scene.robot.home()
    assert not any(map(math.isnan, scene.robot.state.positions))


def test_a_late_host_during_homing_is_not_reported_as_a_blocked_joint(scene: Scene) -> None:
    cycles = itertools.count()

    def late(_: object) -> None:
        if next(cycles) == 60:
            # Longer than the joint waits, shorter than the limit for a lost cycle.
            scene.arm.run(0.058)

    with pytest.raises(HomingError, match=r"SETPOINT_LOST.*find out why the host stopped"):
        scene.robot.home(on_cycle=late)
    assert scene.robot.faults[0].kind is FaultKind.SETPOINT_LOST


def test_a_stall_stops_the_arm_and_is_recovered_in_three_steps(
    homed: Scene, tmp_path: Path
) -> None:
    homed.arm.add_obstacle("j1", -1.7)
    with pytest.raises(StalledError) as stall:
        homed.robot.move_joints((-1.0, 0.28, 1.0, 1.0))
    assert max(homed.speeds()) < 0.05
    (evidence,) = tmp_path.glob("fault-stall-*.mcap")
    assert stall.value.evidence == str(evidence)
    assert re.match(r"j1: .*; remove the obstacle \(", text := str(stall.value))
    assert text.endswith(f" (evidence: {evidence})")
    assert str(evidence) in repr(homed.robot.faults)
    assert read_record(evidence).faults[0].startswith("STALL")
    with pytest.raises(FaultedError, match="STALL") as refused:
        homed.robot.move_joints(START)
    assert refused.value.evidence == str(evidence)
    assert str(evidence) in str(refused.value)
    with pytest.raises(FaultedError, match="acknowledge"):
        homed.robot.recover()
    (fault,) = homed.robot.acknowledge()
    assert fault.kind is FaultKind.STALL
    assert fault.evidence == evidence
    homed.robot.recover()
    homed.arm.clear_obstacles("j1")
    assert homed.robot.faults == ()
    homed.robot.move_joints(START)
    assert homed.robot.state.positions == pytest.approx(START, abs=2e-3)


def test_usr3_after_a_pause_the_state_is_current(tmp_path: Path) -> None:
    homed = Scene(tmp_path, START, controllers_fed=True)
    with homed.robot:
        homed.robot.move_joints(START)
        homed.arm.set_supply(on=False)
        for _ in range(100):
            homed.arm.push("j4", 0.3 if homed.arm.velocity("j4") < 1.0 else 0.0)
            homed.arm.run(0.01)
        homed.arm.push("j4", 0.0)
        homed.arm.run(1.0)
        there = homed.arm.position("j4")
        assert there > START[3] + 0.3
        state = homed.robot.state
        assert state.positions[3] == pytest.approx(there, abs=5e-3)
        assert all(stamp >= state.time for stamp in state.stamps)


def test_fw1_after_a_joint_restarted_the_pose_is_unknown_until_it_is_homed(homed: Scene) -> None:
    homed.arm.run(1.0)
    homed.arm.reset("j1")
    homed.arm.run(1.0)
    # Not "home() first", which is refused until the fault is dealt with.
    with pytest.raises(FaultedError, match=r"acknowledge\(\) and recover\(\)"):
        _ = homed.robot.pose
    assert math.isnan(homed.robot.state.positions[0])
    homed.robot.acknowledge()
    with pytest.raises(FaultedError, match=r"; then recover\(\) \("):
        homed.robot.unfold()
    homed.robot.recover()
    with pytest.raises(NotHomedError, match="j1"):
        _ = homed.robot.pose
    homed.robot.home()
    assert homed.robot.state.positions[0] == pytest.approx(homed.arm.position("j1"), abs=5e-3)


def test_after_a_failed_recovery_every_call_names_the_fault_and_remedy(
    homed: Scene,
) -> None:
    homed.arm.set_power("j2", False)
    with pytest.raises(BioscaraError):
        homed.robot.move_joints(START)
    homed.robot.acknowledge()
    with pytest.raises(BioscaraError):
        homed.robot.recover()
    homed.arm.run(0.1)
    for call in (
        lambda: homed.robot.state,
        lambda: homed.robot.pose,
        lambda: homed.robot.move_joints(START),
    ):
        with pytest.raises(FaultedError, match=r"j2.*recover\(\)"):
            call()
    homed.arm.set_power("j2", True)
    homed.arm.run(0.5)
    homed.robot.recover()
    assert math.isnan(homed.robot.state.positions[1])


def test_use_outside_a_with_statement_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NotInitializedError, match="with"):
        Scene(tmp_path).robot.home()


def test_a_closed_robot_says_what_to_do_and_shows_it(tmp_path: Path) -> None:
    robot = Robot.simulated(evidence=tmp_path)
    with pytest.raises(NotInitializedError, match=r"not connected: open\(\) it"):
        robot.home()
    robot.open()
    assert repr(robot) == "<Robot simulation, in this process, disabled, not homed>"
    assert repr(robot.gripper) == "<RobotGripper not driven>"
    assert repr(robot.plan) == "<Planner tool fingers, reduced speed, 0 zones>"
    robot.close()
    assert repr(robot) == "<Robot simulation, in this process, closed>"
    for call in (robot.home, robot.open):
        with pytest.raises(BioscaraError, match="the robot was closed; make another one"):
            call()


def test_a_simulated_arm_fails_at_rest_and_in_a_callback_of_its_motion(tmp_path: Path) -> None:
    with Robot.simulated(homed=True, evidence=tmp_path) as robot:
        robot.enable()
        robot.simulate_fault("reset", "j3")
        with pytest.raises(BioscaraError):
            robot.move_relative(z=-0.02)
        assert robot.faults[0].kind is FaultKind.JOINT_RESET
        robot.acknowledge()
        robot.recover()
        robot.home()

        def fail(record: CycleRecord) -> None:
            if record.phase is Phase.TRAJECTORY and not robot.faults:
                robot.simulate_fault("supply")

        with pytest.raises(BioscaraError):
            robot.unfold(on_cycle=fail)
        assert FaultKind.POWER_LOST in {fault.kind for fault in robot.faults}
        robot.simulate_fault("clear")
        robot.clock.sleep_until(robot.clock.now() + 0.1)
        robot.acknowledge()
        robot.recover()
        # The controllers restarted with their supply.
        with pytest.raises(NotHomedError):
            robot.unfold()


def test_a_brown_out_is_over_after_its_time(tmp_path: Path) -> None:
    with Robot.simulated(homed=True, evidence=tmp_path) as robot:
        robot.enable()
        robot.simulate_fault("brown_out", value=0.3)
        with pytest.raises(BioscaraError):
            robot.unfold()
        robot.acknowledge()
        begin = robot.clock.now()
        while robot.clock.now() < begin + 0.35:
            robot.clock.sleep_until(robot.clock.now() + 0.05)
        robot.recover()
        robot.enable()


def test_an_arm_that_is_not_simulated_here_does_not_fail(scene: Scene) -> None:
    # As of a real arm.
    bus = FirmwareBus(scene.arm)
    robot = Robot(bus, scene.robot.clock, ARM, "on another bus")
    with robot, pytest.raises(NotSupportedError, match="real, or simulated by another process"):
        robot.simulate_fault("hang", "j3")
