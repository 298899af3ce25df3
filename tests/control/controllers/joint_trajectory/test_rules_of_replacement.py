"""Rules 20 to 28: one trajectory after another, cancel, hold."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from bioscara.control.controllers.joint_trajectory import (
    ErrorCode,
    Goal,
    GoalStatus,
    JointTrajectory,
    Point,
    Tolerance,
)
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator
from bioscara.errors import GoalRejectedError
from bioscara.planning import Sample
from control.control_stack import LIMITS, NAMES
from control.controllers.joint_trajectory.follower import BRAKES, NOTHING, Follower, alone, smooth


def running(arm: Follower, way: float = 0.2) -> tuple[Point, Point]:
    """Send a trajectory of two points over two seconds and let half of it pass."""
    points = Point(0.0, arm.commanded, NOTHING), arm.move(way, 2.0)
    arm.send(*points)
    arm.run(1.0)
    return points


def test_rule_20_a_new_trajectory_goes_on_from_the_old_one(arm: Follower) -> None:
    before, begin = arm.interventions, arm.now
    running(arm)
    goal = arm.send(arm.move(-0.05, 1.5))
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    assert arm.interventions == before
    smooth(arm, begin)


def test_rule_20_the_old_one_is_kept_up_to_the_stamp(arm: Follower) -> None:
    before, begin = arm.interventions, arm.now
    _, end = running(arm)
    # Where the old one is half done at a second, and at 27/32 of its distance at one and a half.
    new = arm.move(-0.05, 1.5)
    goal = arm.send(new, stamp=arm.now + 0.5)
    for cycle in range(49):
        arm.step()
        assert goal.feedback is not None
        assert goal.feedback.trajectory_time == pytest.approx(1.0 + 0.01 * cycle, abs=1e-3)
    arm.step()
    start = arm.seen[0].positions
    way = end.positions[0] - start[0]
    assert arm.commanded[0] == pytest.approx(start[0] + way * 27 / 32, abs=way * 0.02)
    assert goal.feedback is not None
    assert goal.feedback.point == 0 or goal.feedback.trajectory_time >= 0.0
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    assert arm.measured == pytest.approx(new.positions, abs=2e-3)
    assert arm.interventions == before
    smooth(arm, begin)


def test_rule_20_points_before_now_are_passed_over_without_a_step(arm: Follower) -> None:
    before, begin = arm.interventions, arm.now
    running(arm)
    far = arm.move(0.3, 0.2)
    goal = arm.send(far, arm.move(0.0, 2.5), stamp=arm.now - 0.5)
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    assert arm.interventions == before
    smooth(arm, begin)


def test_rule_20_a_start_that_waits_outlives_the_end_of_the_old_one(arm: Follower) -> None:
    _, end = running(arm)
    new = arm.move(-0.05, 1.0)
    goal = arm.send(new, stamp=arm.now + 1.5)
    arm.run(1.4)
    assert arm.commanded == pytest.approx(end.positions)
    assert goal.status is GoalStatus.EXECUTING
    arm.finish(goal)
    assert arm.measured == pytest.approx(new.positions, abs=2e-3)


@pytest.mark.parametrize("pushed", [0.06, -0.06])
def test_rule_20_the_path_is_judged_while_a_start_outlasts_the_old_one(pushed: float) -> None:
    jtc, positions, velocities = alone(("position",), constraints={"b": {"trajectory": 0.05}})
    for handle in (*positions, *velocities):
        handle.value = 0.0
    for command in jtc.command_handles:
        command.value = 0.0
    jtc.on_activate(0.0)
    jtc.send_goal(
        Goal(JointTrajectory(("a", "b"), (Point(0.0, (0.0,) * 2), Point(1.0, (0.0,) * 2)))), 0.0
    )
    jtc.update(0.5, 0.5)
    goal = jtc.send_goal(Goal(JointTrajectory(("a", "b"), (Point(1.0, (0.0,) * 2),), 3.0)), 0.5)
    jtc.update(2.0, 1.5)
    assert goal.status is GoalStatus.EXECUTING
    positions[1].value = pushed
    jtc.update(2.5, 0.5)
    assert (goal.status, goal.error_code) == (GoalStatus.ABORTED, ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert jtc.holding


def test_rule_20_without_replacement_it_starts_from_the_measured_state(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(allow_trajectory_replacement=False)
    running(arm)
    measured = arm.measured
    goal = arm.send(arm.move(-0.05, 1.5), stamp=arm.now + 0.5)
    arm.step()
    assert goal.feedback is not None
    assert goal.feedback.desired.positions == pytest.approx(goal.feedback.actual.positions)
    assert goal.feedback.desired.positions == pytest.approx(measured, abs=5e-3)
    assert goal.feedback.trajectory_time == pytest.approx(-0.5, abs=0.011)


def test_rule_20_one_of_a_single_point_is_replaced_at_once(arm: Follower) -> None:
    arm.send(arm.move(0.2, 2.0))
    arm.run(1.0)
    goal = arm.send(arm.move(-0.05, 1.5), stamp=arm.now + 0.5)
    arm.step()
    assert goal.feedback is not None
    assert goal.feedback.desired.positions == goal.feedback.actual.positions
    assert goal.feedback.trajectory_time == pytest.approx(-0.5, abs=0.011)


def test_rule_20_a_ramp_to_rest_is_replaced_at_once(follower: Callable[..., Follower]) -> None:
    arm = follower(constraints=BRAKES)
    running(arm, 0.4)
    arm.jtc.cancel(arm.now)
    arm.step()
    goal = arm.send(arm.move(0.1, 1.5))
    arm.step()
    assert goal.feedback is not None
    assert goal.feedback.desired.positions == goal.feedback.actual.positions
    assert goal.feedback.desired.velocities != NOTHING


def test_rule_20_one_that_is_over_when_it_is_taken_leaves_the_joints_at_its_end() -> None:
    course = Interpolator([Point(0.0, (0.0,), (0.0,)), Point(1.0, (2.0,), (0.0,))])
    now = 1.0 - 5e-7
    course.begin(Sample((0.5,), (0.0,), (0.0,)), now, bridge=True)
    assert course.sample(now).values.positions == pytest.approx((2.0,))


def test_rule_21_one_that_is_refused_leaves_the_one_that_runs_alone(arm: Follower) -> None:
    first = arm.send(arm.move())
    arm.run(0.2)
    with pytest.raises(GoalRejectedError, match="no points"):
        arm.send()
    assert first.status is GoalStatus.EXECUTING
    assert arm.finish(first).status is GoalStatus.SUCCEEDED


def test_rule_21_a_new_goal_aborts_the_one_that_runs(arm: Follower) -> None:
    first = arm.send(arm.move())
    arm.run(0.2)
    second = arm.send(arm.move())
    assert (first.status, first.error_code) == (GoalStatus.ABORTED, ErrorCode.INVALID_GOAL)
    assert first.text == "Current goal preempted by new incoming action."
    assert arm.finish(second).status is GoalStatus.SUCCEEDED


def test_rule_22_a_goal_is_evaluated_on_a_trajectory_sent_during_it(arm: Follower) -> None:
    goal = arm.send(arm.move(0.1, 1.0))
    arm.run(0.3)
    new = arm.move(-0.05, 2.0)
    arm.jtc.send_trajectory(arm.trajectory(new), arm.now)
    arm.run(1.9)
    assert goal.status is GoalStatus.EXECUTING
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    assert arm.measured == pytest.approx(new.positions, abs=2e-3)


def test_rule_22_the_goal_keeps_its_tolerances(arm: Follower) -> None:
    goal = arm.send(arm.move(0.0, 1.0), path_tolerance=(Tolerance("j1", 2e-5),))
    arm.jtc.send_trajectory(arm.trajectory(arm.move(0.2, 1.0)), arm.now)
    assert arm.finish(goal).error_code is ErrorCode.PATH_TOLERANCE_VIOLATED


@pytest.mark.parametrize(
    "constraints",
    [
        {},
        {**BRAKES, "decelerate_on_cancel": False},
        {**BRAKES, "j4": {"max_deceleration_on_cancel": 0.0}},
    ],
    ids=["default", "no ramp", "no deceleration of j4"],
)
def test_rule_23_cancel_holds_the_position_measured_at_that_moment(
    follower: Callable[..., Follower], constraints: dict[str, Any]
) -> None:
    arm = follower(constraints=constraints)
    goal = arm.send(arm.move(0.2, 2.0))
    arm.run(1.0)
    measured = arm.measured
    arm.jtc.cancel(arm.now)
    assert (goal.status, goal.error_code, goal.text) == (GoalStatus.CANCELED, 0, "")
    arm.run(1.5)
    assert arm.commanded == pytest.approx(measured, abs=1e-9)
    assert arm.measured == pytest.approx(measured, abs=2e-3)
    assert arm.jtc.holding


def test_rule_23_cancel_ramps_down_at_the_given_deceleration(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints=BRAKES)
    before = arm.interventions
    goal = arm.send(arm.move(0.4, 2.0))
    last = arm.run(1.0)[-1]
    arm.jtc.cancel(arm.now)
    assert goal.status is GoalStatus.CANCELED
    arm.run(1.5)
    for index, name in enumerate(NAMES):
        speed, limit = last.velocities[index], LIMITS[name].max_acceleration
        way = speed * abs(speed) / (2.0 * limit)
        assert arm.commanded[index] == pytest.approx(last.positions[index] + way, abs=1e-9)
        assert arm.seen[-1].velocities[index] == 0.0
    assert arm.interventions == before


@pytest.mark.parametrize("scaling", [0.4, 1.5])
def test_rule_23_the_ramp_starts_at_the_scaled_speed(
    follower: Callable[..., Follower], scaling: float
) -> None:
    arm = follower(constraints=BRAKES, speed_scaling={"initial_scaling_factor": scaling})
    before = arm.interventions
    arm.send(arm.move(0.3, 3.0))
    arm.run(1.0)
    begin = arm.seen[-3].time
    arm.jtc.cancel(arm.now)
    arm.run(1.0)
    smooth(arm, begin)
    assert arm.interventions == before


def test_rule_24_deactivation_aborts_and_leaves_positions_as_they_are(arm: Follower) -> None:
    goal = arm.send(arm.move(0.05, 1.0))
    last = arm.run(0.5)[-1]
    arm.world.switch(off=("jtc",))
    assert (goal.status, goal.error_code) == (GoalStatus.ABORTED, ErrorCode.INVALID_GOAL)
    assert goal.text == "Current goal cancelled during deactivate transition."
    assert arm.commanded == last.positions
    assert arm.measured != pytest.approx(last.positions, abs=1e-4)
    assert [axis.velocity_command.value for axis in arm.world.hardware.axes] == [0.0] * 4


def test_rule_25_activation_holds_the_last_command(arm: Follower) -> None:
    commanded = arm.commanded
    arm.world.switch(off=("jtc",))
    arm.world.switch("jtc")
    arm.run(0.3)
    assert arm.jtc.holding
    assert arm.commanded == pytest.approx(arm.seen[-2].positions)
    assert arm.commanded == pytest.approx(commanded, abs=1e-3)


@pytest.mark.parametrize("last", [True, False])
@pytest.mark.parametrize(
    ("commands", "known"), [((0.7, 0.8), True), ((0.7, math.nan), False), ((-math.inf, 0.8), False)]
)
def test_rule_25_last_commands_are_held_if_all_are_numbers(
    commands: tuple[float, float], known: bool, last: bool
) -> None:
    jtc, positions, _ = alone(
        ("position",), set_last_command_interface_value_as_state_on_activation=last
    )
    for handle, value in zip(jtc.command_handles, commands, strict=True):
        handle.value = value
    for state in positions:
        state.value = 0.25
    jtc.on_activate(0.0)
    jtc.update(0.01, 0.01)
    held = commands if known and last else (0.25, 0.25)
    assert tuple(handle.value for handle in jtc.command_handles) == held


def test_rule_25_activation_resets_the_pid() -> None:
    jtc, positions, velocities = alone(("velocity",), gains={"a": {"i": 5.0}})
    for state in (*positions, *velocities):
        state.value = 0.0
    jtc.on_activate(0.0)
    positions[0].value = -1.0
    for cycle in range(3):
        jtc.update(0.01 * cycle, 0.01)
    assert jtc.command_handles[0].value > 0.05
    jtc.on_deactivate(0.03)
    jtc.on_activate(0.04)
    jtc.update(0.05, 0.01)
    assert jtc.command_handles[0].value == 0.0


def test_rule_25_else_the_measured_positions_are_held(follower: Callable[..., Follower]) -> None:
    arm = follower(set_last_command_interface_value_as_state_on_activation=False)
    arm.world.switch(off=("jtc",))
    measured = arm.measured
    arm.world.switch("jtc")
    arm.step()
    assert arm.jtc.feedback is not None
    assert arm.jtc.feedback.desired.positions == pytest.approx(measured, abs=1e-6)


def test_rule_26_holding_checks_no_tolerance_and_never_ends(
    follower: Callable[..., Follower],
) -> None:
    tight = {name: {"trajectory": 1e-7, "goal": 1e-7} for name in NAMES}
    arm = follower(constraints={"goal_time": 0.1, **tight}, cmd_timeout=0.2)
    arm.run(1.0)
    assert arm.jtc.holding
    assert not arm.jtc.warnings


def test_rule_27_the_last_point_is_held_after_success(arm: Follower) -> None:
    last = arm.move()
    arm.finish(arm.send(last))
    arm.run(0.2)
    assert arm.commanded == last.positions
    assert arm.seen[-1].velocities == NOTHING


def test_rule_27_the_measured_state_is_held_after_a_violation(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints={"j1": {"trajectory": 1e-5}})
    goal = arm.send(arm.move(0.2, 1.0))
    arm.finish(goal)
    assert goal.status is GoalStatus.ABORTED
    feedback = arm.jtc.feedback
    assert feedback is not None
    arm.run(1.0)
    assert arm.commanded == pytest.approx(feedback.actual.positions, abs=1e-6)


def test_rule_28_a_trajectory_that_is_never_reached_is_given_up(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints={"goal_time": 0.0, "j1": {"goal": 1e-9}}, cmd_timeout=0.5)
    arm.jtc.send_trajectory(arm.trajectory(arm.move(0.05, 0.5)), arm.now)
    last = arm.run(0.9)[-1].positions
    assert not arm.jtc.holding
    while not arm.jtc.holding:
        seen = arm.step()
    assert seen.time - arm.seen[0].time == pytest.approx(1.0, abs=0.05)
    assert seen.measured != last
    assert seen.positions == pytest.approx(seen.measured, abs=1e-9)
    assert "command timeout, 0.5 s after the last point" in arm.jtc.warnings[0]
    goal = arm.send(arm.move(0.05, 0.5))
    assert arm.finish(goal).error_code is ErrorCode.GOAL_TOLERANCE_VIOLATED


@pytest.mark.parametrize(("goal_time", "ignored"), [(0.49, False), (0.5, True), (0.51, True)])
def test_rule_28_a_timeout_counts_only_beyond_goal_time(
    follower: Callable[..., Follower], goal_time: float, ignored: bool
) -> None:
    arm = follower(constraints={"goal_time": goal_time}, cmd_timeout=0.5)
    assert [f"goal_time {goal_time:g} s" in text for text in arm.jtc.warnings] == [True] * ignored


def test_rule_28_a_timeout_within_goal_time_is_ignored_with_a_warning(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints={"goal_time": 1.0, "j1": {"goal": 1e-9}}, cmd_timeout=0.5)
    assert "cmd_timeout 0.5 s is ignored" in arm.jtc.warnings[0]
    arm.jtc.send_trajectory(arm.trajectory(arm.move(0.05, 0.5)), arm.now)
    arm.run(1.3)
    assert not arm.jtc.holding
