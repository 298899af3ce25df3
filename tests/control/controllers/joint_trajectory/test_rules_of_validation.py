"""Rules 1 to 10: valid and invalid trajectories."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import pytest

from bioscara.control.controllers.joint_trajectory import Goal, GoalStatus, JointTrajectory, Point
from bioscara.control.controllers.joint_trajectory.goal_validation import (
    arranged,
    check_form,
    check_limits,
    check_stamp,
    ranges,
)
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator
from bioscara.control.controllers.joint_trajectory.splicing import Spliced
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.errors import GoalRejectedError
from bioscara.model import JointParameters
from control.control_stack import BOTH, LIMITS, NAMES
from control.controllers.joint_trajectory.follower import NOTHING, Follower

JOINTS = ("a", "b")
HERE = (7.0, 8.0)


def validate(
    trajectory: JointTrajectory,
    parameters: JointTrajectoryParameters,
    now: float,
    commanded: tuple[float, ...],
    measured: tuple[float, ...],
    limits: Mapping[str, JointParameters],
) -> tuple[Point, ...]:
    """Make all checks of a trajectory, and return its points in the order of the joints."""
    check_form(trajectory, parameters)
    check_stamp(trajectory, now)
    points = arranged(trajectory, parameters, commanded)
    within = ranges(points, len(parameters.joints))
    check_limits(points, within, parameters, limits, commanded, measured)
    return points


def check(
    *points: Point, names: tuple[str, ...] = JOINTS, stamp: float = 0.0, now: float = 100.0, **more
) -> tuple[Point, ...]:
    parameters = JointTrajectoryParameters(joints=JOINTS, **more)
    return validate(JointTrajectory(names, points, stamp), parameters, now, HERE, HERE, {})


def refused(*points: Point, match: str, **more) -> None:
    with pytest.raises(GoalRejectedError, match=match):
        check(*points, **more)


GOOD = Point(1.0, (1.0, 2.0))


def test_rule_01_goals_and_trajectories_are_refused_while_inactive(arm: Follower) -> None:
    arm.world.switch(off=("jtc",))
    with pytest.raises(GoalRejectedError, match="jtc is inactive: activate it first"):
        arm.send(arm.move())
    with pytest.raises(GoalRejectedError, match="jtc is inactive"):
        arm.jtc.send_trajectory(arm.trajectory(arm.move()), arm.now)
    assert arm.jtc.goal is None


def test_rule_02_names_fit_the_joints_in_any_order() -> None:
    for partial in (False, True):
        refused(
            GOOD,
            names=(),
            match="names no joints; name a, b",
            allow_partial_joints_goal=partial,
        )
    refused(GOOD, names=("a",), match="leaves out b")
    refused(GOOD, names=("a", "bb"), match="bb is not a joint .* did you mean b")
    refused(GOOD, names=("a", "a"), match="a is named twice")
    moving = {"allow_nonzero_velocity_at_trajectory_end": True}
    points = check(Point(1.0, (1.0, 2.0), (5.0, 6.0), (3.0, 4.0)), names=("b", "a"), **moving)
    assert points == (Point(1.0, (2.0, 1.0), (6.0, 5.0), (4.0, 3.0)),)


def test_rule_03_no_points_are_refused_and_the_motion_goes_on(arm: Follower) -> None:
    refused(match="has no points")
    goal = arm.send(arm.move())
    arm.run(0.3)
    with pytest.raises(GoalRejectedError, match="no points"):
        arm.jtc.send_trajectory(arm.trajectory(), arm.now)
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED


def test_rule_04_the_end_is_at_rest_unless_motion_is_allowed() -> None:
    moving = Point(1.0, (1.0, 2.0), (0.0, 1e-3))
    refused(moving, match=r"b ends at 0.001 rad/s or m/s, 1.19e-07 is the most")
    refused(Point(1.0, (1.0, 2.0), (-1e-3, 0.0)), match=r"a ends at -0.001 rad/s or m/s")
    refused(GOOD, moving._replace(time=2.0), match="b ends at 0.001")
    refused(Point(1.0, (1.0, 2.0), (0.0, 1.2e-7)), match="b ends at 1.2e-07")
    assert check(moving, GOOD._replace(time=2.0))
    assert check(Point(1.0, (1.0, 2.0), (0.0, -1.19e-7)))
    assert check(GOOD)
    assert check(moving, allow_nonzero_velocity_at_trajectory_end=True)


def test_rule_05_a_stamp_is_refused_only_when_all_has_passed() -> None:
    refused(GOOD, stamp=98.5, match=r"ended 0.500 s ago")
    refused(GOOD, stamp=math.nan, match="stamp nan")
    assert check(GOOD, stamp=0.0)
    assert check(GOOD, stamp=99.5)
    assert check(GOOD, stamp=200.0)


def test_rule_05_a_start_in_the_past_is_joined_midway(arm: Follower) -> None:
    start, end = arm.commanded, arm.move(0.1, 2.0)
    arm.send(Point(0.0, start, NOTHING), end, stamp=arm.now - 1.0)
    arm.step()
    assert arm.jtc.feedback is not None
    assert arm.jtc.feedback.trajectory_time == pytest.approx(1.0, abs=0.011)
    assert arm.jtc.feedback.desired.positions[0] == pytest.approx(start[0] + 0.05, abs=1e-3)


def test_rule_06_times_increase_strictly() -> None:
    refused(GOOD, GOOD, match="point 1: time_from_start 1 s does not come after 1 s")
    refused(GOOD, Point(0.5, (0.0, 0.0)), match="point 1: time_from_start 0.5 s")
    refused(GOOD, GOOD._replace(time=3.0), GOOD._replace(time=2.0), match="point 2: time_from_sta")
    refused(Point(-0.1, (0.0, 0.0)), match="point 0: time_from_start -0.1 s")
    assert check(Point(0.0, (0.0, 0.0)), GOOD)


def test_rule_07_fields_are_full_or_empty() -> None:
    refused(Point(1.0), match="point 0: it has no positions")
    refused(Point(1.0, (1.0,)), match="point 0: 1 positions for 2 joints")
    refused(Point(1.0, (1.0, 2.0), (0.0,)), match="point 0: 1 velocities for 2 joints")
    refused(Point(1.0, (1.0, 2.0), (), (1.0,) * 3), match="3 accelerations for 2 joints")
    refused(
        Point(1.0), allow_integration_in_goal_trajectories=True, match="nor anything to integrate"
    )


def test_rule_07_missing_values_are_integrated_by_the_trapezoid_rule() -> None:
    points = check(
        Point(1.0, (), (), (2.0, -2.0)),
        Point(2.0, (), (), (-2.0, 2.0)),
        Point(3.0, (), (0.0, 0.0)),
        allow_integration_in_goal_trajectories=True,
        allow_nonzero_velocity_at_trajectory_end=True,
    )
    assert [point.velocities for point in points] == [(1.0, -1.0), (1.0, -1.0), (0.0, 0.0)]
    assert [point.positions for point in points] == [(7.5, 7.5), (8.5, 6.5), (9.0, 6.0)]


def test_rule_07_joints_in_another_order_are_integrated_from_where_they_are() -> None:
    [point] = check(
        Point(1.0, (), (2.0, 0.0)),
        names=("b", "a"),
        allow_integration_in_goal_trajectories=True,
        allow_nonzero_velocity_at_trajectory_end=True,
    )
    assert point == Point(1.0, (7.0, 9.0), (0.0, 2.0))


def test_rule_07_missing_velocities_of_a_point_count_as_zero_for_the_next() -> None:
    points = check(
        Point(1.0, (1.0, 2.0)),
        Point(2.0, (), (2.0, 2.0)),
        allow_integration_in_goal_trajectories=True,
        allow_nonzero_velocity_at_trajectory_end=True,
    )
    assert points == (Point(1.0, (1.0, 2.0)), Point(2.0, (2.0, 3.0), (2.0, 2.0)))


def test_rule_07_nothing_is_integrated_unless_allowed() -> None:
    point = Point(1.0, (1.0, 2.0), (), (3.0, 4.0))
    assert check(point) == (point,)


def test_rule_08_effort_is_refused() -> None:
    refused(GOOD._replace(effort=(1.0, 1.0)), match="point 0: effort cannot be commanded")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["positions", "velocities", "accelerations"])
def test_rule_09_stricter_nothing_but_finite_numbers(field: str, value: float) -> None:
    refused(
        GOOD._replace(**{field: (0.0, value)}),
        match=f"point 0: {field} of b is {value}; every value must be finite",
    )
    refused(GOOD._replace(time=value), match="time_from_start")


@pytest.mark.parametrize(("far", "seconds"), [(0.2, 1e-150), (0.2, 1e-200)])
def test_rule_09_stricter_points_that_no_curve_can_join_are_refused(
    arm: Follower, far: float, seconds: float
) -> None:
    points = (
        Point(0.0, NOTHING, NOTHING, NOTHING),
        Point(seconds, (far,) * 4, NOTHING, NOTHING),
    )
    with pytest.raises(GoalRejectedError, match="no curve can be computed between the points"):
        arm.send(*points)


@pytest.mark.parametrize(
    ("stamp", "point", "complaint"),
    [
        (1e200, Point(1.0, NOTHING, NOTHING), r"stamp 1e\+200 s is more than 1e\+06 s after now"),
        (0.0, Point(1e200, NOTHING, NOTHING), r"point 0: time_from_start 1e\+200 s is beyond"),
        (0.0, Point(1.0, (-1e300,) * 4), r"point 0: positions of j1 is -1e\+300, beyond 1e\+06"),
        (0.0, Point(1.0, NOTHING, NOTHING, (1e300,) * 4), "point 0: accelerations of j1"),
    ],
)
def test_rule_09_stricter_numbers_to_which_no_cycle_can_draw_a_curve_are_refused(
    arm: Follower, stamp: float, point: Point, complaint: str
) -> None:
    with pytest.raises(GoalRejectedError, match=complaint):
        arm.send(point, stamp=stamp)
    arm.run(0.1)
    assert arm.world.supervisor.faults == []


J1, J2 = LIMITS["j1"], LIMITS["j2"]
SLACK = 0.9e-6
"""Share of a limit by which rounding may exceed it."""


def within(
    *points: Point,
    commanded: tuple[float, ...] = (0.0, 0.1),
    measured: tuple[float, ...] = (0.0, 0.1),
    **more,
) -> tuple[Point, ...]:
    parameters = JointTrajectoryParameters(
        joints=("j1", "j2"), allow_nonzero_velocity_at_trajectory_end=True, **more
    )
    sent = JointTrajectory(("j1", "j2"), points)
    return validate(sent, parameters, 100.0, commanded, measured, LIMITS)


@pytest.mark.parametrize(
    ("point", "why"),
    [
        (
            Point(1.0, (90.0, 0.1)),
            f"point 1: positions of j1 is 90 rad, outside {J1.lower:g} .. {J1.upper:g} rad; "
            "angles are in rad, not in degrees",
        ),
        (
            Point(1.0, (0.0, 150.0)),
            f"point 1: positions of j2 is 150 m, outside {J2.lower:g} .. {J2.upper:g} m; "
            "lengths are in m, not in mm",
        ),
        (Point(1.0, (-1e5, 0.1)), "positions of j1 is -100000 rad"),
        (
            Point(1.0, (0.0, 0.1), (0.0, -25.0)),
            f"velocities of j2 is -25 m/s, outside {-J2.max_velocity:g} .. {J2.max_velocity:g} m/s",
        ),
        (
            Point(1.0, (0.0, 0.1), (0.0, 0.0), (1e5, 0.0)),
            f"accelerations of j1 is 100000 rad/s^2, outside {-J1.max_acceleration:g} .. ",
        ),
    ],
)
def test_pln1_a_point_beyond_a_limit_is_refused_with_value_limit_and_unit(
    point: Point, why: str
) -> None:
    with pytest.raises(GoalRejectedError) as caught:
        within(Point(0.5, (0.0, 0.1)), point)
    assert why in str(caught.value)


def test_pln1_the_limit_itself_is_accepted_despite_rounding() -> None:
    for share in (1.0, 1.0 + SLACK):
        for sign in (1.0, -1.0):
            point = Point(
                1.0,
                tuple(
                    (joint.lower + joint.upper) / 2.0
                    + sign * share * (joint.upper - joint.lower) / 2.0
                    for joint in (J1, J2)
                ),
                tuple(sign * share * joint.max_velocity for joint in (J1, J2)),
                tuple(sign * share * joint.max_acceleration for joint in (J1, J2)),
            )
            assert within(point) == (point,)


def test_pln1_integrated_values_are_checked_too() -> None:
    fast = Point(10.0, (), (J1.max_velocity, 0.0))
    with pytest.raises(GoalRejectedError, match="point 0: positions of j1 is"):
        within(fast, allow_integration_in_goal_trajectories=True)


@pytest.mark.parametrize("known", ["commanded", "measured"])
def test_pln1_from_beyond_a_limit_a_goal_leads_back_but_no_farther(known: str) -> None:
    pushed = J1.upper + 0.05
    back = (Point(0.0, (pushed, 0.1)), Point(1.0, (pushed - 0.1, 0.1)))
    assert within(*back, **{known: (pushed, 0.1)}) == back
    with pytest.raises(GoalRejectedError, match="positions of j1"):
        within(*back)
    with pytest.raises(GoalRejectedError, match="positions of j1"):
        within(Point(1.0, (pushed + 0.01, 0.1)), **{known: (pushed, 0.1)})
    unknown = (math.nan, math.nan)
    with pytest.raises(GoalRejectedError, match="positions of j1"):
        within(Point(1.0, (pushed, 0.1)), commanded=unknown, measured=unknown)


@pytest.mark.parametrize("kinds", [("position",), BOTH, ("velocity",)])
def test_pln1_every_goal_is_checked_and_a_running_one_continues(
    follower: Callable[..., Follower], kinds: tuple[str, ...]
) -> None:
    gains = {name: {"p": 2.0, "ff_velocity_scale": 1.0} for name in NAMES}
    arm = follower(command_interfaces=kinds, gains=gains if kinds == ("velocity",) else {})
    start = Point(0.0, arm.measured, NOTHING)
    goal = arm.send(start, start._replace(time=1.0, positions=(0.2, *start.positions[1:])))
    arm.run(0.2)
    beyond = Point(1.0, (LIMITS["j1"].upper + 0.01, *start.positions[1:]))
    with pytest.raises(GoalRejectedError, match="positions of j1"):
        arm.send(beyond)
    with pytest.raises(GoalRejectedError, match="positions of j1"):
        arm.jtc.send_trajectory(arm.trajectory(beyond), arm.now)
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED


def test_rule_10_joints_that_a_partial_goal_leaves_out_stay() -> None:
    point = Point(1.0, (1.0,), (0.0,), (3.0,))
    points = check(point, names=("b",), allow_partial_joints_goal=True)
    assert points == (Point(1.0, (7.0, 1.0), (0.0, 0.0), (0.0, 3.0)),)
    points = check(Point(1.0, (1.0,)), names=("b",), allow_partial_joints_goal=True)
    assert points == (Point(1.0, (7.0, 1.0)),)


def test_rule_10_left_out_joints_continue_the_running_trajectory(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(allow_partial_joints_goal=True)
    start, end = arm.commanded, arm.move(0.2, 3.0)
    arm.send(Point(0.0, start, NOTHING), end)
    arm.run(1.0)
    goal = arm.jtc.send_goal(
        Goal(JointTrajectory(("j1",), (Point(1.0, (start[0],), (0.0,)),))), arm.now
    )
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    assert arm.measured[0] == pytest.approx(start[0], abs=2e-3)
    assert arm.measured[1:] == pytest.approx(end.positions[1:], abs=2e-3)
    assert arm.seen[-1].time - arm.seen[0].time == pytest.approx(3.0, abs=0.1)


def test_rule_10_left_out_joints_pass_all_remaining_points(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(allow_partial_joints_goal=True)
    here = arm.commanded
    points = [
        Point(time, (here[0] + way, *here[1:]), (speed, 0.0, 0.0, 0.0))
        for time, way, speed in ((1, 0.25, 0.25), (2, 0.5, 0.0), (3, 0.25, -0.25), (4, 0.0, 0.0))
    ]
    arm.send(*points)
    arm.run(0.1)
    other = JointTrajectory(("j4",), (Point(3.5, (here[3] + 0.1,)),))
    goal = arm.jtc.send_goal(Goal(other), arm.now)
    begin = arm.now - 0.1
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    for point in points:
        seen = min(arm.seen, key=lambda each: abs(each.time - begin - point.time))
        assert seen.measured[0] == pytest.approx(point.positions[0], abs=0.01)
    assert arm.commanded == pytest.approx((*here[:3], here[3] + 0.1))


def test_rule_10_left_out_joints_hold_their_commanded_positions(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(allow_partial_joints_goal=True, interpolation_method="none")
    arm.send(Point(0.0, arm.move(0.2).positions))
    arm.run(0.15)
    commanded = arm.commanded
    assert commanded[2] != pytest.approx(arm.measured[2], abs=1e-3)
    arm.jtc.send_goal(Goal(JointTrajectory(("j1",), (Point(0.0, (commanded[0],)),))), arm.now)
    arm.step()
    assert arm.jtc.feedback is not None
    assert arm.jtc.feedback.desired.positions == commanded


def test_rule_10_left_out_joints_go_from_point_to_point_without_interpolation(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(allow_partial_joints_goal=True, interpolation_method="none")
    start, there = arm.commanded, arm.move(0.01, 1.0)
    arm.send(Point(0.5, start, NOTHING), there)
    arm.run(0.2)
    new = JointTrajectory(("j1",), (Point(0.5, (start[0] + 0.02,), (0.0,)),))
    goal = arm.jtc.send_goal(Goal(new), arm.now)
    arm.run(0.3)
    assert goal.feedback is not None
    assert goal.feedback.desired.positions == pytest.approx(start, abs=1e-3)
    arm.finish(goal)
    assert arm.commanded == pytest.approx((start[0] + 0.02, *there.positions[1:]), abs=1e-9)


def test_rule_10_left_out_joints_continue_also_if_the_new_start_is_past(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(allow_partial_joints_goal=True)
    start, end = arm.commanded, arm.move(0.2, 3.0)
    arm.send(Point(0.0, start, NOTHING), end)
    arm.run(1.0)
    new = JointTrajectory(("j1",), (Point(1.0, (start[0],), (0.0,)),), arm.now - 0.5)
    goal = arm.jtc.send_goal(Goal(new), arm.now)
    arm.run(0.5)
    # A cubic is at 1/2 of its displacement after half of its time.
    assert arm.commanded[3] == pytest.approx((start[3] + end.positions[3]) / 2.0, abs=1e-3)
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    assert arm.seen[-1].time - arm.seen[0].time == pytest.approx(3.0, abs=0.1)


def test_rule_10_the_new_ones_joints_wait_at_their_end_for_the_others() -> None:
    running = Interpolator([Point(0.0, (0.0, 0.0), (1.0, 1.0)), Point(4.0, (4.0, 4.0), (0.0, 0.0))])
    new = Interpolator([Point(1.0, (5.0, 9.0), (0.0, 0.0)), Point(2.0, (6.0, 9.0), (0.0, 0.0))])
    spliced = Spliced(new, {1}, running, 1.0)
    assert (spliced.duration, spliced.end) == (3.0, (6.0, 4.0))
    for time in (1.0, 1.7, 2.0, 2.5, 3.0):
        values = spliced.sample(time).values
        assert values.positions[0] == new.sample(time).values.positions[0]
        assert values.positions[1] == running.sample(time + 1.0).values.positions[1]
    assert spliced.sample(2.5).values.velocities[0] == 0.0
