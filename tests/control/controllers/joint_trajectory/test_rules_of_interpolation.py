"""Rules 11 to 19: the curve through the points, and the time on it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from hypothesis import given, strategies as st
from numpy.polynomial import Polynomial

from bioscara.control.controllers.joint_trajectory import GoalStatus, Point
from bioscara.control.controllers.joint_trajectory.goal_messages import JointTrajectory
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator
from bioscara.control.controllers.joint_trajectory.upsampling import timed, upsampled
from bioscara.errors import GoalRejectedError
from bioscara.planning import Sample
from control.control_stack import NAMES
from control.controllers.joint_trajectory.follower import NOTHING, Follower


def test_rule_11_a_quintic_a_cubic_or_a_line_by_what_both_ends_have() -> None:
    points = [
        Point(0.0, (0.0,)),
        Point(1.0, (2.0,), (0.0,)),
        Point(2.0, (3.0,), (0.0,), (0.0,)),
        Point(3.0, (4.0,), (0.0,), (0.0,)),
    ]
    course = Interpolator(points)
    assert course.sample(0.25).values == Sample((0.5,), (2.0,), (0.0,))
    cubic = course.sample(1.25).values
    assert cubic.positions == pytest.approx((2.0 + 3 * 0.25**2 - 2 * 0.25**3,))
    assert cubic.velocities == pytest.approx((6 * 0.25 - 6 * 0.25**2,))
    assert cubic.accelerations == pytest.approx((6 - 12 * 0.25,))
    quintic = course.sample(2.25).values
    assert quintic.positions == pytest.approx((3.0 + 10 * 0.25**3 - 15 * 0.25**4 + 6 * 0.25**5,))
    line = Interpolator([points[1], Point(3.0, (4.0,))]).sample(1.5).values
    assert line == Sample((2.5,), (1.0,), (0.0,))


@pytest.mark.parametrize("fields", [2, 3])
@given(
    coefficients=st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6),
    begin=st.floats(-1.0, 1.0),
    share=st.floats(0.0, 1.0),
)
def test_rule_11_the_curve_is_the_polynomial_of_what_both_ends_have(
    fields: int, coefficients: list[float], begin: float, share: float
) -> None:
    curve = Polynomial(coefficients[: 2 * fields])
    derivatives = [curve.deriv(order) if order else curve for order in range(3)]
    ends = [
        Point(time, *((float(each(time)),) for each in derivatives[:fields]))
        for time in (begin, begin + 1.5)
    ]
    at = begin + 1.4999 * share
    values = Interpolator(ends).sample(at).values
    assert [value for (value,) in values] == pytest.approx(
        [float(each(at)) for each in derivatives], abs=1e-8
    )


def test_rule_12_before_the_first_point_it_comes_from_the_start_state() -> None:
    state = Sample((1.0,), (0.5,), (0.0,))
    cubic, line = Interpolator([Point(1.0, (2.0,), (0.0,))]), Interpolator([Point(1.0, (2.0,))])
    for course in (cubic, line):
        course.begin(state, 0.0)
        assert course.sample(0.0).values.positions == (1.0,)
        assert course.sample(1.0).values.positions == (2.0,)
    assert cubic.sample(0.0).values.velocities == (0.5,)
    assert line.sample(0.0).values.velocities == (1.0,)


def test_rule_12_the_start_state_is_measured(arm: Follower) -> None:
    handle = arm.send(arm.move(0.1, 1.0))
    arm.step()
    feedback = arm.jtc.feedback
    assert feedback is not None
    assert feedback.desired.positions == feedback.actual.positions == arm.measured
    assert arm.finish(handle).status is GoalStatus.SUCCEEDED


def test_rule_12_the_start_state_is_commanded_if_configured(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(interpolate_from_desired_state=True, allow_trajectory_replacement=False)
    arm.send(arm.move(0.2, 1.0))
    before = arm.run(0.5)[-1]
    arm.send(arm.move(-0.1, 1.0))
    arm.step()
    assert arm.jtc.feedback is not None
    assert arm.jtc.feedback.desired.positions == pytest.approx(before.positions, abs=1e-9)
    assert arm.jtc.feedback.desired.velocities == pytest.approx(before.velocities, abs=1e-9)


def test_rule_12_it_creeps_towards_the_first_point_while_it_waits_for_the_stamp(
    arm: Follower,
) -> None:
    start, goal = arm.commanded, arm.move(0.1, 1.0)
    handle = arm.send(goal, stamp=arm.now + 1.0)
    arm.run(1.0)
    assert arm.commanded[0] == pytest.approx((start[0] + goal.positions[0]) / 2.0, abs=2e-3)
    begin = arm.now
    arm.finish(handle)
    assert arm.now - begin == pytest.approx(1.0, abs=0.03)


def test_rule_13_a_first_point_at_time_zero_is_stepped_to_within_the_limits(
    arm: Follower,
) -> None:
    goal = arm.move(0.02)
    arm.send(goal._replace(time=0.0), arm.move(0.02, 2.0))
    arm.step()
    assert arm.jtc.feedback is not None
    assert arm.jtc.feedback.desired.positions == goal.positions
    assert arm.commanded != pytest.approx(goal.positions, abs=1e-3)
    assert arm.interventions > 0


def test_rule_14_after_the_last_point_it_stays_there_at_rest() -> None:
    course = Interpolator([Point(0.0, (0.0,), (0.0,)), Point(1.0, (2.0,), (1.0,))])
    assert course.sample(1.0).values == Sample((2.0,), (1.0,), (0.0,))
    assert course.sample(1.5).values == Sample((2.0,), (0.0,), (0.0,))
    assert course.sample(1.5).point == 2


def test_rule_15_without_interpolation_the_next_point_is_output() -> None:
    points = [Point(1.0, (1.0,)), Point(2.0, (2.0,)), Point(3.0, (5.0,))]
    course = Interpolator(points, interpolate=False)
    course.begin(Sample((0.5,), (9.0,), (0.0,)), 0.0)
    outputs = [course.sample(time).values.positions[0] for time in (0.0, 0.9, 1.1, 2.5, 3.5)]
    assert outputs == [0.5, 0.5, 2.0, 5.0, 5.0]
    assert course.sample(0.9).values.velocities == (0.0,)


def test_rule_15_the_arm_goes_from_point_to_point(follower: Callable[..., Follower]) -> None:
    arm = follower(interpolation_method="none")
    start, goal = arm.commanded, arm.move(0.01, 0.5)
    handle = arm.send(goal)
    assert arm.run(0.45)[-1].positions == pytest.approx(start, abs=1e-4)
    assert arm.finish(handle).status is GoalStatus.SUCCEEDED
    arm.run(0.5)
    assert arm.measured == pytest.approx(goal.positions, abs=2e-3)


def test_rule_16_the_command_is_one_cycle_ahead_of_the_desired_state(arm: Follower) -> None:
    arm.send(arm.move(0.1, 1.0))
    arm.run(0.3)
    for _ in range(20):
        commanded = arm.step()
        arm.world.loop.step()
        feedback = arm.jtc.feedback
        assert feedback is not None
        assert feedback.desired.positions == pytest.approx(commanded.positions, abs=1e-6)
        assert feedback.desired.velocities == pytest.approx(commanded.velocities, abs=1e-5)


def test_rule_17_a_revolute_joint_takes_the_plain_difference(arm: Follower) -> None:
    """No joint of the arm is continuous: a goal beyond half a turn is not wrapped."""
    goal = arm.move(0.0, 8.0)
    goal = goal._replace(positions=(*goal.positions[:3], 2.9))
    handle = arm.send(goal)
    arm.run(0.1)
    arm.finish(handle)
    assert all(
        after.positions[3] >= before.positions[3] - 1e-4 for before, after in pairwise(arm.seen)
    )
    there = arm.move(0.0, 9.0)._replace(positions=(*goal.positions[:3], -2.9))
    back = arm.send(there._replace(time=0.0), there)
    arm.step()
    assert back.feedback is not None
    assert back.feedback.error.positions[3] == pytest.approx(-5.8, abs=0.01)
    arm.finish(back)
    assert arm.measured[3] == pytest.approx(-2.9, abs=2e-3)


def test_rule_18_the_factor_scales_the_time_and_zero_pauses(arm: Follower) -> None:
    handle = arm.send(arm.move(0.2, 2.0))
    arm.run(0.5)
    arm.jtc.set_scaling(0.0)
    arm.run(1.1)
    feedback = arm.jtc.feedback
    assert feedback is not None
    arm.run(1.0)
    assert arm.jtc.feedback is not None
    assert arm.jtc.feedback.trajectory_time == feedback.trajectory_time
    assert arm.seen[-1].velocities == NOTHING
    arm.jtc.set_scaling(1.0)
    assert arm.finish(handle).status is GoalStatus.SUCCEEDED


def test_rule_18_a_half_is_half_as_fast(follower: Callable[..., Follower]) -> None:
    arm = follower(speed_scaling={"initial_scaling_factor": 0.5})
    begin, handle = arm.now, arm.send(arm.move(0.1, 1.0))
    arm.run(1.0)
    assert handle.feedback is not None
    assert handle.feedback.desired.velocities[0] == pytest.approx(0.15, abs=1e-3)
    assert handle.feedback.error.velocities[0] == pytest.approx(0.0, abs=0.02)
    assert arm.finish(handle).status is GoalStatus.SUCCEEDED
    assert arm.now - begin == pytest.approx(2.0, abs=0.03)
    state = arm.jtc.controller_state
    assert state is not None
    assert state.speed_scaling_factor == 0.5


@pytest.mark.parametrize("kinds", [("velocity",), ("position", "velocity")])
def test_rule_18_commanded_velocities_are_scaled_too(
    follower: Callable[..., Follower], kinds: tuple[str, ...]
) -> None:
    gains = {name: {"ff_velocity_scale": 1.0} for name in NAMES}
    scaling = {"initial_scaling_factor": 0.5}
    arm = follower(command_interfaces=kinds, gains=gains, speed_scaling=scaling)
    start = arm.measured
    arm.send(Point(0.0, start, NOTHING), Point(2.0, (start[0] + 0.2, *start[1:]), NOTHING))
    arm.run(1.0)
    seen = arm.step()
    planned = arm.jtc.query_state(seen.time + 0.01).velocities[0]
    assert planned > 0.1
    assert seen.velocities[0] == pytest.approx(0.5 * planned, abs=1e-9)


def test_rule_18_a_change_of_the_factor_steps_no_velocity(arm: Follower) -> None:
    before = arm.interventions
    handle = arm.send(arm.move(0.3, 2.0))
    arm.run(0.7)
    arm.jtc.set_scaling(0.3)
    arm.run(0.9)
    arm.jtc.set_scaling(1.2)
    assert arm.finish(handle).status is GoalStatus.SUCCEEDED
    assert arm.interventions == before


@pytest.mark.parametrize("sent_first", [False, True])
@pytest.mark.parametrize("factor", [0.0, 0.25, 1.5])
def test_rule_18_motion_starts_at_the_factor_that_was_chosen_at_rest(
    arm: Follower, factor: float, sent_first: bool
) -> None:
    before, goal = arm.interventions, arm.move(0.3, 3.0)
    if sent_first:
        handle = arm.send(goal)
        arm.jtc.set_scaling(factor)
    else:
        arm.jtc.set_scaling(factor)
        handle = arm.send(goal)
    begin = arm.step().time
    for _ in range(100):
        time = arm.step().time - begin
        assert handle.feedback is not None
        assert handle.feedback.trajectory_time == pytest.approx(time * factor)
    assert arm.interventions == before


@pytest.mark.parametrize("factor", [-0.1, float("nan"), float("inf")])
def test_rule_18_a_negative_factor_is_refused_and_changes_nothing(
    arm: Follower, factor: float
) -> None:
    with pytest.raises(GoalRejectedError, match="speed scaling"):
        arm.jtc.set_scaling(factor)
    arm.run(0.2)
    assert arm.jtc.scaling == 1.0


def test_rule_19_positions_alone_get_the_velocities_of_a_smooth_spline() -> None:
    rows = ((0.0, 0.0), (1.0, 1.0), (2.5, 0.0), (2.8, 0.7), (4.0, -1.0))
    points = [Point(time, (position, 1.0)) for time, position in rows]
    smooth = upsampled(points)
    assert smooth[0].velocities == smooth[-1].velocities == (0.0, 0.0)
    assert [point.velocities[1] for point in smooth] == [0.0] * 5
    assert [point._replace(velocities=()) for point in smooth] == points
    course = Interpolator(smooth)
    for time, _ in rows[1:-1]:
        left, right = course.sample(time - 1e-9).values, course.sample(time + 1e-9).values
        assert left.velocities == pytest.approx(right.velocities, abs=1e-6)
        assert left.accelerations == pytest.approx(right.accelerations, abs=1e-6)


@pytest.mark.parametrize("field", ["velocities", "accelerations"])
def test_rule_19_points_that_have_more_than_positions_stay_as_they_are(field: str) -> None:
    points = (Point(0.0, (0.0,)), Point(1.0, (1.0,))._replace(**{field: (0.5,)}))
    assert upsampled(points) == points


def test_rule_19_points_without_times_come_at_the_policys_frequency() -> None:
    points = tuple(Point(0.0, (float(n),)) for n in range(3))
    trajectory = JointTrajectory(("a",), points, 5.0)
    assert [point.time for point in timed(trajectory, 4.0).points] == [0.25, 0.5, 0.75]
    assert timed(trajectory, 4.0).stamp == 5.0
    assert timed(trajectory, 0.0) is trajectory
    given = JointTrajectory(("a",), (points[0], points[1]._replace(time=1.0)))
    assert timed(given, 4.0) is given


def test_rule_19_concerns_trajectories_without_a_goal_only(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(positions_upsampling={"enable": True, "policy_frequency": 5.0})
    points = [Point(0.0, arm.move(way).positions) for way in (0.005, 0.02, 0.035, 0.04)]
    with pytest.raises(GoalRejectedError, match="does not come after"):
        arm.send(*points)
    before = arm.interventions
    arm.jtc.send_trajectory(arm.trajectory(*points), arm.now)
    arm.run(1.0)
    assert arm.commanded == pytest.approx(points[-1].positions, abs=1e-9)
    assert arm.interventions == before
    start = arm.commanded
    goal = arm.send(Point(0.0, start), Point(1.0, arm.move(0.1).positions))
    arm.run(0.1)
    assert goal.feedback is not None
    assert goal.feedback.desired.velocities[0] == pytest.approx(0.1)


def test_rule_19_without_enable_points_need_times(follower: Callable[..., Follower]) -> None:
    arm = follower(positions_upsampling={"policy_frequency": 5.0})
    points = [Point(0.0, arm.move(way).positions) for way in (0.005, 0.02)]
    with pytest.raises(GoalRejectedError, match="does not come after"):
        arm.jtc.send_trajectory(arm.trajectory(*points), arm.now)
