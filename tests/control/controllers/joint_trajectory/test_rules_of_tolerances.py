"""Rules 29 to 35: tolerances of joints, and reports about violations."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bioscara.control.controllers.joint_trajectory import (
    ErrorCode,
    Goal,
    GoalStatus,
    JointTrajectory,
    Point,
    Tolerance,
)
from bioscara.control.controllers.joint_trajectory.tolerances import (
    ToleranceMonitor,
    TrajectoryResult,
    TrajectoryTolerances,
    Violation,
    choose,
    defaults,
    violated,
)
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    Constraints,
    JointConstraints,
)
from bioscara.planning import Sample
from control.controllers.joint_trajectory.follower import BRAKES, NOTHING, Follower

JOINTS = ("a", "b")
EMPTY = JointTrajectory(JOINTS, ())
FAR = 1e-9
"""A tolerance that no motion keeps [rad or m]."""


def test_rule_29_defaults_check_nothing_but_standstill() -> None:
    assert defaults(JOINTS, Constraints()) == TrajectoryTolerances(
        ((0.0, 0.0, 0.0),) * 2, ((0.0, 0.01, 0.0),) * 2, 0.0
    )
    given = Constraints(joints={"b": JointConstraints(trajectory=0.1, goal=0.2)}, goal_time=3.0)
    assert defaults(JOINTS, given) == TrajectoryTolerances(
        ((0.0, 0.0, 0.0), (0.1, 0.0, 0.0)), ((0.0, 0.01, 0.0), (0.2, 0.01, 0.0)), 3.0
    )


def test_rule_29_a_tolerance_of_0_is_not_checked_and_a_joint_that_moves_has_not_arrived() -> None:
    default = defaults(JOINTS, Constraints())

    def at_end(speed: float) -> TrajectoryResult | None:
        error = Sample((9.0, -9.0), (0.0, speed), (9.0, 9.0))
        monitor = ToleranceMonitor(JOINTS, velocity=True)
        monitor.tolerances = default
        assert monitor.before_the_end(error, 1.0) is None
        return monitor.after_the_end(error, 5.0, stopped=True)

    for speed in (0.011, -0.011):
        assert at_end(speed) is None
    for speed in (0.0099, -0.0099):
        verdict = at_end(speed)
        assert verdict is not None
        assert verdict.status is GoalStatus.SUCCEEDED


def test_rule_30_values_of_the_goal_replace_keep_or_erase() -> None:
    default = TrajectoryTolerances(((0.1, 0.0, 0.0),) * 2, ((0.2, 0.01, 0.0),) * 2, 3.0)
    goal = Goal(
        EMPTY,
        (Tolerance("b", 0.5), Tolerance("a", -1.0)),
        (Tolerance("a", 0.0, -1.0, 4.0),),
        -1.0,
    )
    chosen, warning = choose(goal, JOINTS, default)
    assert chosen == TrajectoryTolerances(
        ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), ((0.2, 0.0, 4.0), (0.2, 0.01, 0.0)), 0.0
    )
    assert warning == ""
    for given, time in ((0.0, 3.0), (0.5, 0.5)):
        assert choose(Goal(EMPTY, (), (), given), JOINTS, default)[0].goal_time == time


@pytest.mark.parametrize(
    ("goal", "why"),
    [
        (Goal(EMPTY, (Tolerance("b", 0.5), Tolerance("a", -2.0))), "a tolerance of -2 for a"),
        (Goal(EMPTY, (), (Tolerance("c", 1.0),)), "'c', which is no joint"),
        (Goal(EMPTY, (), (Tolerance("a", float("nan")),)), "a tolerance of nan for a"),
        (Goal(EMPTY, (Tolerance("b", 0.5),), (), -0.5), "goal_time_tolerance -0.5 s"),
    ],
)
def test_rule_30_an_invalid_tolerance_discards_all(goal: Goal, why: str) -> None:
    default = defaults(JOINTS, Constraints())
    chosen, warning = choose(goal, JOINTS, default)
    assert chosen == default
    assert why in warning


def test_rule_30_the_goal_still_runs(arm: Follower) -> None:
    goal = arm.send(arm.move(), path_tolerance=(Tolerance("j1", FAR), Tolerance("j9", 1.0)))
    assert "'j9'" in arm.jtc.warnings[0]
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED


def test_rule_30_of_many_complaints_about_tolerances_the_latest_are_kept(arm: Follower) -> None:
    for _ in range(500):
        arm.send(arm.move(), goal_time_tolerance=-2.0)
    arm.send(arm.move(), goal_time_tolerance=-3.0)
    assert len(arm.jtc.warnings) <= 100
    assert "-3" in arm.jtc.warnings[-1]


def test_rule_30_defaults_are_those_of_the_parameters_not_of_the_goal_before(
    arm: Follower,
) -> None:
    arm.finish(arm.send(arm.move(), path_tolerance=(Tolerance("j1", FAR),)))
    arm.run(0.3)
    assert arm.finish(arm.send(arm.move())).status is GoalStatus.SUCCEEDED


def test_rule_31_a_path_violation_aborts_with_joint_value_and_limit(arm: Follower) -> None:
    goal = arm.send(arm.move(0.2, 1.0), path_tolerance=(Tolerance("j3", 2e-5),))
    arm.finish(goal)
    assert (goal.status, goal.error_code) == (GoalStatus.ABORTED, ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert goal.text.startswith("Aborted due to path tolerance violation: position of j3 is ")
    assert "2e-05 is allowed" in goal.text
    assert arm.jtc.holding
    assert goal.feedback is not None
    assert abs(goal.feedback.error.positions[2]) > 2e-5
    assert arm.seen[-1].positions == pytest.approx(goal.feedback.actual.positions, abs=5e-4)


def test_rule_31_the_command_of_a_violating_cycle_is_not_written(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(interpolation_method="none", constraints={"j1": {"trajectory": 0.01}})
    start = arm.commanded
    goal = arm.send(Point(0.0, arm.move(0.2).positions), arm.move(0.2, 1.0))
    arm.step()
    assert (goal.status, goal.error_code) == (GoalStatus.ABORTED, ErrorCode.PATH_TOLERANCE_VIOLATED)
    assert arm.commanded == pytest.approx(start, abs=5e-4)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rule_31_both_directions_are_checked_up_to_the_limit(sign: float) -> None:
    limits = ((0.1, 0.2, 0.0),) * 2
    nothing = (0.0, 0.0)

    def judge(position: float, velocity: float) -> Violation | None:
        error = Sample((0.0, sign * position), (0.0, sign * velocity), nothing)
        return violated(limits, error, velocity=True)

    assert judge(0.1, 0.2) is None
    assert judge(0.11, 0.0) == Violation(1, "position", sign * 0.11, 0.1)
    assert judge(0.0, 0.21) == Violation(1, "velocity", sign * 0.21, 0.2)


def test_rule_31_velocity_is_checked_if_it_is_commanded(
    follower: Callable[..., Follower],
) -> None:
    arm = follower()
    goal = arm.send(arm.move(0.2, 1.0), path_tolerance=(Tolerance("j1", 0.0, 1e-6),))
    arm.finish(goal)
    assert goal.error_code is ErrorCode.PATH_TOLERANCE_VIOLATED
    assert "velocity of j1" in goal.text
    arm.close()
    for interfaces in ("command_interfaces", "state_interfaces"):
        arm = follower(**{interfaces: ("position",)})
        goal = arm.send(arm.move(0.2, 1.0), path_tolerance=(Tolerance("j1", 0.0, 1e-6),))
        assert arm.finish(goal).status is GoalStatus.SUCCEEDED
        arm.close()
    follower()


def test_rule_31_an_error_that_is_no_number_is_a_violation() -> None:
    error = Sample((float("nan"), 0.0), (0.0, 0.0), (0.0, 0.0))
    assert violated(((0.1, 0.0, 0.0),) * 2, error, velocity=True) is not None
    assert violated(((0.0, 0.0, 0.0),) * 2, error, velocity=True) is None


def test_rule_32_succeeds_inside_goal_tolerance_not_before_the_last_point(arm: Follower) -> None:
    begin = arm.now
    goal = arm.send(arm.move(0.001, 1.0), goal_tolerance=(Tolerance("j1", 0.5),))
    arm.finish(goal)
    assert 0.995 < arm.now - begin < 1.03
    assert (goal.status, goal.error_code) == (GoalStatus.SUCCEEDED, ErrorCode.SUCCESSFUL)
    assert goal.text == "Goal successfully reached!"


def test_rule_32_succeeds_once_the_joints_have_stood_for_a_tenth_of_a_second(
    follower: Callable[..., Follower],
) -> None:
    # Positions alone: velocities at the end are no error then.
    arm = follower(command_interfaces=("position",), constraints={"stopped_time": 0.1})
    # Twice as fast as the joint can be: the commands arrive long after the last point.
    goal, end = arm.send(arm.move(0.5, 0.5)), arm.now + 0.5
    stood = 0.0
    while not goal.done:
        before = arm.seen[-1]
        now = arm.step()
        still = now.positions == pytest.approx(before.positions, abs=1e-9)
        stood = stood + 0.01 if still else 0.0
        assert arm.now - end < 5.0
    assert arm.now > end + 0.3
    assert stood >= 0.1
    assert (goal.status, goal.text) == (GoalStatus.SUCCEEDED, "Goal successfully reached!")


def test_rule_23_a_cancelled_goal_ends_once_the_joints_stand(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints={"stopped_time": 0.1, **BRAKES})
    goal = arm.send(arm.move(0.5, 2.0))
    arm.run(1.0)
    arm.jtc.cancel(arm.now)
    assert not goal.done
    arm.finish(goal)
    assert goal.status is GoalStatus.CANCELED
    rest = [each.positions for each in arm.seen[-9:]]
    assert rest == [rest[0]] * 9


def test_rule_32_not_while_one_joint_is_outside(arm: Follower) -> None:
    begin = arm.now
    goal = arm.send(
        arm.move(0.2, 0.05), goal_tolerance=(Tolerance("j1", 0.5), Tolerance("j3", 0.003))
    )
    while not goal.done:
        assert goal.feedback is None or arm.now - begin < 5.0
        arm.step()
    assert goal.status is GoalStatus.SUCCEEDED
    assert arm.now - begin > 0.2
    assert goal.feedback is not None
    assert abs(goal.feedback.error.positions[2]) <= 0.003


def test_rule_33_without_goal_time_it_waits_for_ever(arm: Follower) -> None:
    goal = arm.send(arm.move(0.1, 0.5), goal_tolerance=(Tolerance("j1", FAR),))
    arm.run(5.0)
    assert goal.status is GoalStatus.EXECUTING


def test_rule_33_with_goal_time_it_aborts_after_that(arm: Follower) -> None:
    begin = arm.now
    goal = arm.send(
        arm.move(0.1, 0.5), goal_tolerance=(Tolerance("j1", FAR),), goal_time_tolerance=0.4
    )
    arm.finish(goal)
    assert arm.now - begin == pytest.approx(0.91, abs=0.02)
    assert (goal.status, goal.error_code) == (GoalStatus.ABORTED, ErrorCode.GOAL_TOLERANCE_VIOLATED)
    assert goal.text.startswith("Aborted due to goal_time_tolerance exceeding by 0.0")
    assert "position of j1 is " in goal.text
    assert "1e-09 is allowed" in goal.text
    assert arm.jtc.holding


def test_rule_33_goal_time_allows_no_early_success(arm: Follower) -> None:
    begin = arm.now
    goal = arm.send(arm.move(0.001, 1.0), goal_time_tolerance=0.9)
    arm.finish(goal)
    assert arm.now - begin > 0.99


def test_rule_34_trajectories_without_goal_obey_the_same_tolerances(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints={"j1": {"trajectory": 2e-5}})
    arm.jtc.send_trajectory(arm.trajectory(arm.move(0.2, 1.0)), arm.now)
    arm.run(0.9)
    assert arm.jtc.holding
    assert "path tolerance violation: position of j1" in arm.jtc.warnings[0]


def test_rule_34_a_goals_tolerances_end_with_it(arm: Follower) -> None:
    arm.finish(arm.send(arm.move(), path_tolerance=(Tolerance("j1", FAR),)))
    arm.run(0.3)
    arm.jtc.send_trajectory(arm.trajectory(arm.move(0.1, 0.5)), arm.now)
    arm.run(0.7)
    assert not arm.jtc.warnings


def test_rule_35_feedback_and_result_are_there_in_the_cycle_of_their_measurement(
    arm: Follower,
) -> None:
    first, second = arm.move(0.05, 0.5), arm.move(0.1, 1.0)
    goal = arm.send(first, second)
    assert goal.feedback is None
    points = []
    while not goal.done:
        seen = arm.step()
        told = goal.feedback
        assert told is not None
        assert told.time == seen.time
        assert told.actual.positions == seen.measured
        assert told.error.positions == pytest.approx(
            [a - b for a, b in zip(told.desired.positions, told.actual.positions, strict=True)],
            abs=5e-3,
        )
        points.append((told.trajectory_time, told.point))
    assert all(point == (0 if time < 0.5 else 1 if time < 1.0 else 2) for time, point in points)
    assert [time for time, _ in points] == pytest.approx(
        [0.01 * index for index in range(len(points))], abs=1e-6
    )


def test_rule_35_errors_compare_with_the_time_of_the_measurement(arm: Follower) -> None:
    """At 0.3 rad/s a cycle is 3 mrad: far more than the joint's real lag."""
    goal = arm.send(arm.move(0.3, 1.5))
    arm.run(0.75)
    assert goal.feedback is not None
    assert max(map(abs, goal.feedback.error.positions)) < 1.2e-3


def test_rule_35_errors_are_desired_minus_actual_of_velocities_too(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(allow_trajectory_replacement=False)
    start, end = arm.commanded, arm.move(0.3, 1.5)
    arm.send(Point(0.0, start, NOTHING), end)
    arm.run(0.75)
    goal = arm.send(Point(0.0, start, NOTHING), Point(3.0, start, NOTHING))
    arm.step()
    told = goal.feedback
    assert told is not None
    assert told.actual.velocities[0] == pytest.approx(0.3, abs=0.05)
    for desired, actual, error in zip(
        told.desired.velocities, told.actual.velocities, told.error.velocities, strict=True
    ):
        assert error == pytest.approx(desired - actual, abs=0.05)
    assert told.error.velocities[0] == pytest.approx(-0.3, abs=0.1)
