"""The controllers behave as the parameter file states."""

from __future__ import annotations

from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.errors import GoalAbortedError, HomingError
from bioscara.model import ArmParameters, load_parameters, loading
from bioscara.robot.connection.stack import HOLD
from simulated import simulated_robot

TEXT = Path(loading.__file__).with_name("parameters.yaml").read_text()


def changed(folder: Path, *values: tuple[str, str]) -> ArmParameters:
    text = TEXT
    for old, new in values:
        assert text.count(old) == 1
        text = text.replace(old, new)
    file = folder / "arm.yaml"
    file.write_text(text)
    return load_parameters(file)


def robot_of(parameters: ArmParameters, folder: Path) -> Robot:
    return simulated_robot(folder, parameters=parameters).robot


@pytest.mark.parametrize(("v1", "rate"), [(True, 40), (False, 80)])
def test_each_value_arrives_at_its_controller(tmp_path: Path, v1: bool, rate: int) -> None:
    arm = changed(
        tmp_path,
        ("version_1: 50 ", "version_1: 40 "),
        ("version_2: 100 ", "version_2: 80 "),
        ("allow_partial_joints_goal: true", "allow_partial_joints_goal: false"),
        ("at_trajectory_end: true", "at_trajectory_end: false"),
        ("stopped_velocity_tolerance: 0.0", "stopped_velocity_tolerance: 0.03"),
        ("goal_time: 2.0", "goal_time: 1.5"),
        ("on_cancel_share: 1.0", "on_cancel_share: 0.5"),
        ("j1: {trajectory: 0.0, goal: 0.01}", "j1: {trajectory: 0.11, goal: 0.12}"),
        ("j2: {trajectory: 0.0, goal: 5.0e-4}", "j2: {trajectory: 0.21, goal: 0.22}"),
        ("j3: {trajectory: 0.0, goal: 0.01}", "j3: {trajectory: 0.31, goal: 0.32}"),
        ("j4: {trajectory: 0.0, goal: 0.01}", "j4: {trajectory: 0.41, goal: 0.42}"),
        ("timeout: 300.0", "timeout: 200.0"),
        ("max_travel_share: 1.15", "max_travel_share: 1.5"),
        ("max_deceleration_share: 1.0", "max_deceleration_share: 0.25"),
        ("max_velocity: 0.07               # m/s", "max_velocity: 0.2 # m/s"),
        ("goal_tolerance: 0.001", "goal_tolerance: 0.002"),
        ("allow_stalling: false", "allow_stalling: true"),
        ("stall_velocity_threshold: 0.001", "stall_velocity_threshold: 0.004"),
        ("stall_timeout: 1.0", "stall_timeout: 2.0"),
    )
    limits = {joint.name: joint.max_acceleration for joint in arm.joints}
    spans = {joint.name: joint.upper - joint.lower for joint in arm.joints}
    with Robot.simulated(arm, v1=v1, evidence=tmp_path) as robot:
        stack = robot.runner.arm.stack
        assert stack.manager.rate == rate
        following, homing = stack.trajectory.parameters, stack.homing.parameters
        assert not following.allow_partial_joints_goal
        assert not following.allow_nonzero_velocity_at_trajectory_end
        assert following.constraints.stopped_velocity_tolerance == 0.03
        assert following.constraints.goal_time == 1.5
        for number, name in enumerate(limits, 1):
            own = following.constraints.of(name)
            assert own.trajectory == pytest.approx(number / 10 + 0.01)
            assert own.goal == pytest.approx(number / 10 + 0.02)
            assert own.max_deceleration_on_cancel == 0.5 * limits[name]
        assert homing.timeout == 200.0
        assert homing.max_travel == tuple(1.5 * spans[name] for name in arm.homing_order)
        hold = stack.manager.controller(HOLD).parameters
        assert hold.max_deceleration == tuple(0.25 * limit for limit in limits.values())
        jaws = stack.gripper.parameters
        assert (jaws.velocity_limit, jaws.goal_tolerance, jaws.allow_stalling) == (0.2, 0.002, True)
        assert (jaws.stall_velocity_threshold, jaws.stall_timeout) == (0.004, 2.0)


def test_homing_times_out_as_the_file_says(tmp_path: Path) -> None:
    arm = changed(tmp_path, ("timeout: 300.0", "timeout: 1.5"))
    with (
        robot_of(arm, tmp_path) as robot,
        pytest.raises(HomingError, match=r"j2 was not homed within the timeout of 1\.5 s"),
    ):
        robot.home()


def test_a_trajectory_fails_at_the_tolerance_that_the_file_says(tmp_path: Path) -> None:
    tight = ("j3: {trajectory: 0.0, ", "j3: {trajectory: 1.0e-6, ")
    with robot_of(changed(tmp_path, tight), tmp_path) as robot:
        robot.home()
        here = robot.state.positions
        with pytest.raises(GoalAbortedError, match=r"j3"):
            robot.move_joints((*here[:2], here[2] - 0.3, here[3]))
