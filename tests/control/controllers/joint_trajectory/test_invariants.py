"""Invariants of the curve, of splicing and of stopping."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import HealthCheck, Phase, given, settings, strategies as st

from bioscara.control.controllers.joint_trajectory import ErrorCode, GoalStatus, Point
from bioscara.control.controllers.joint_trajectory.goal_conversion import Request, prepare
from bioscara.control.controllers.joint_trajectory.goal_messages import JointTrajectory
from bioscara.control.controllers.joint_trajectory.goal_validation import check_form, check_stamp
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator
from bioscara.control.controllers.joint_trajectory.sampler import TrajectorySampler
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.control.controllers.joint_trajectory.upsampling import upsampled
from bioscara.errors import GoalRejectedError
from bioscara.planning import Sample
from control.control_stack import LIMITS, World
from control.controllers.joint_trajectory.follower import BRAKES, MIDDLE, NOTHING, Follower, smooth
from laws import examples

VALUES = st.floats(-3.0, 3.0)
PERIOD = 0.01
ON_THE_ARM = settings(
    max_examples=20,
    phases=[Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    derandomize=True,
)


@st.composite
def points(draw: st.DrawFn, fields: int = 3, count: int = 2) -> list[Point]:
    """Return points of two joints with positions, velocities and, if requested, accelerations."""
    steps = draw(st.lists(st.floats(0.1, 2.0), min_size=count, max_size=6))
    time, made = 0.0, []
    for step in steps:
        time += step
        made.append(Point(time, *(draw(st.tuples(VALUES, VALUES)) for _ in range(fields))))
    return made


def close(left: Sample, right: Sample, fields: int, within: float = 1e-3) -> None:
    for one, other in zip(left[:fields], right[:fields], strict=True):
        assert one == pytest.approx(other, abs=within)


@given(st.integers(1, 3).flatmap(lambda fields: st.tuples(st.just(fields), points(fields))))
def test_the_curve_passes_through_the_given_fields_of_every_point(
    drawn: tuple[int, list[Point]],
) -> None:
    fields, through = drawn
    course = Interpolator(through)
    course.begin(Sample((0.0, 0.0), (0.1, 0.1), (0.0, 0.0)), 0.0)
    for point in through:
        for time in (point.time - 1e-9, point.time):
            close(
                course.sample(time).values,
                Sample(*point[1 : fields + 1], *((),) * (3 - fields)),
                fields,
            )
        assert course.sample(point.time - 1e-9).point + 1 == course.sample(point.time).point


@given(points(3), st.tuples(VALUES, VALUES), st.tuples(VALUES, VALUES))
def test_the_lead_in_begins_in_the_start_state(
    through: list[Point], where: tuple[float, float], speed: tuple[float, float]
) -> None:
    course = Interpolator(through)
    state = Sample(where, speed, (0.0, 0.0))
    course.begin(state, -0.5)
    close(course.sample(-0.5).values, state, 3, 1e-9)


@given(points(1, count=3))
def test_an_upsampled_curve_is_twice_continuous_and_keeps_its_points(through: list[Point]) -> None:
    smoothed = upsampled(through)
    course = Interpolator(smoothed)
    for point, given_point in zip(smoothed, through, strict=True):
        assert point.positions == given_point.positions
    for point in smoothed[1:-1]:
        before, after = (course.sample(point.time + off).values for off in (-1e-7, 1e-7))
        scale = 1.0 + max(map(abs, before.accelerations))
        close(before, after, 3, 1e-4 * scale)


@settings(max_examples=60, phases=[Phase.generate])
@given(
    points(2),
    points(2),
    st.floats(0.05, 2.0),
    st.floats(-1.0, 1.0),
    st.floats(0.1, 1.5),
)
def test_splicing_is_continuous_in_position_and_velocity(
    first: list[Point], second: list[Point], at: float, lead: float, scaling: float
) -> None:
    """For any start time, with points in the future or the past: the command never jumps."""
    parameters = JointTrajectoryParameters.read(
        "t", {"joints": ("a", "b"), "speed_scaling": {"initial_scaling_factor": scaling}}
    )
    lead = max(lead, 2 * PERIOD - second[-1].time)  # a trajectory that has ended already is refused
    first[-1] = first[-1]._replace(velocities=(0.0, 0.0))
    second[-1] = second[-1]._replace(velocities=(0.0, 0.0))
    rest = Sample((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    player = TrajectorySampler(parameters, PERIOD, rest.positions, 100.0)
    player.waiting = Request(Interpolator(first), 0.0, frozenset())
    at = min(at, first[-1].time / scaling - 2 * PERIOD)
    cycles = max(round(at / PERIOD), 1)
    outputs = []
    for cycle in range(1, cycles + 120):
        now = 100.0 + cycle * PERIOD
        if cycle == cycles:
            player.waiting = Request(Interpolator(second), now + lead, frozenset())
        player.advance(now, PERIOD, rest)
        outputs.append((player.ahead(), player.course))
    steepness = {
        id(course): _steepness(course) for course in {id(c): c for _, c in outputs}.values()
    }
    for (one, before), (two, after) in pairwise(outputs):
        # The curve's own motion within a cycle is no jump; the curves may be steep.
        steep = max(steepness[id(before)], steepness[id(after)])
        for joint in range(2):
            step = two.positions[joint] - one.positions[joint]
            mean = (one.velocities[joint] + two.velocities[joint]) / 2.0
            assert abs(step - mean * PERIOD * scaling) <= steep * (PERIOD * scaling) ** 2 + 1e-9
            change = two.velocities[joint] - one.velocities[joint]
            assert abs(change) <= 2.0 * steep * PERIOD * scaling + 1e-9


def commands(
    first: list[Point], others: dict[int, Request], cycles: int, scaling: float
) -> list[Sample]:
    """Return the commands of the joints a and b, which others take over in some cycles."""
    parameters = JointTrajectoryParameters.read(
        "t", {"joints": ("a", "b"), "speed_scaling": {"initial_scaling_factor": scaling}}
    )
    rest = Sample((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    player = TrajectorySampler(parameters, PERIOD, rest.positions, 0.0)
    player.waiting = Request(Interpolator(first), 0.0, frozenset())
    outputs = []
    for cycle in range(cycles):
        player.waiting = others.get(cycle, player.waiting)
        player.advance(cycle * PERIOD, PERIOD, rest)
        outputs.append(player.ahead())
    return outputs


@settings(max_examples=examples(25), phases=[Phase.generate])
@given(
    st.integers(1, 3).flatmap(points),
    st.lists(st.integers(1, 3).flatmap(lambda fields: points(fields, 1)), min_size=1, max_size=3),
    st.integers(1, 40),
    st.sampled_from((0.0, 0.2)),
    st.floats(0.5, 1.5),
)
def test_joints_that_partial_goals_leave_out_are_commanded_as_if_none_had_come(
    first: list[Point], others: list[list[Point]], apart: int, lead: float, scaling: float
) -> None:
    """Joints that partial goals name are commanded as if the goals had named all."""
    cycles = round(first[-1].time / scaling / PERIOD)

    def run(missing: frozenset[int]) -> list[Sample]:
        requests = {}
        for index, each in enumerate(others, 1):
            start = (index * apart * PERIOD + lead) if lead else 0.0
            requests[index * apart] = Request(Interpolator(each), start, missing)
        return commands(first, requests, cycles, scaling)

    partial = run(frozenset({0}))
    alone = commands(first, {}, cycles, scaling)
    jumps = 0
    for one, expected in zip(partial, alone, strict=True):
        assert one.positions[0] == pytest.approx(expected.positions[0], rel=1e-6, abs=1e-6)
        jumps += any(
            values[0] != pytest.approx(wanted[0], rel=1e-6, abs=1e-6)
            for values, wanted in zip(one[1:], expected[1:], strict=True)
        )
    # At a point the derivatives jump: a cycle that falls on it may see either side.
    assert jumps <= len(first)
    if len(others) == 1:
        for one, full in zip(partial, run(frozenset()), strict=True):
            for values, expected in zip(one, full, strict=True):
                assert values[1] == expected[1]


FINITE = st.floats(allow_nan=False, allow_infinity=False)
PAIRS = st.tuples(FINITE, FINITE)


@given(
    st.tuples(PAIRS, st.just(()) | PAIRS, st.just(()) | PAIRS),
    st.floats(0.0, allow_infinity=False),
    FINITE,
    st.booleans(),
)
def test_an_accepted_trajectory_fails_in_no_cycle(
    fields: tuple[tuple[float, ...], ...], time: float, stamp: float, again: bool
) -> None:
    parameters = JointTrajectoryParameters.read(
        "t", {"joints": ("a", "b"), "allow_nonzero_velocity_at_trajectory_end": True}
    )
    here = Sample((0.0, 0.0), (0.1, 0.1), (0.0, 0.0))
    player = TrajectorySampler(parameters, PERIOD, here.positions, 100.0)
    sent = JointTrajectory(("a", "b"), (Point(time, *fields),), stamp)
    running = Interpolator([Point(0.0, (0.0, 0.0)), Point(1.0, (1.0, 1.0))])
    try:
        check_stamp(sent, 100.0)
        prepared = prepare(sent, parameters)
    except GoalRejectedError:
        return
    if again:
        player.waiting = Request(running, 0.0, frozenset())
        player.advance(100.0, PERIOD, here)
    assert prepared.curve is not None
    player.waiting = Request(prepared.curve.course, stamp, frozenset())
    for cycle in range(1, 4):
        player.advance(100.0 + cycle * PERIOD, PERIOD, here)
        player.ahead()


def test_a_stream_of_partial_goals_does_not_grow_the_splice() -> None:
    first = [Point(0.0, (0.0, 0.0), (0.1, 0.0)), Point(100.0, (10.0, 0.0), (0.1, 0.0))]
    goals = {
        cycle: Request(Interpolator([Point(1.0, (9.0, 1.0))]), 0.0, frozenset({0}))
        for cycle in range(1, 3000)
    }
    assert commands(first, goals, 3000, 1.0)[-1].positions[0] == pytest.approx(3.0)


def _steepness(course: Interpolator) -> float:
    """Return the highest acceleration on a course, from a fine sampling, with a margin."""
    begin, end = course.begins, course.duration
    count = 60
    samples = [course.sample(begin + (end - begin) * n / count).values for n in range(count + 1)]
    edges = [course.sample(point.time - 1e-9).values for point in course.points]
    highest = max(abs(a) for values in (*samples, *edges) for a in values.accelerations)
    return 1.2 * highest + 1.0


@pytest.mark.parametrize("ramp", [True, False])
def test_pln5_a_cancel_at_any_instant_stops_within_the_limits(
    follower: Callable[..., Follower], ramp: bool
) -> None:
    # From the measured state a motion would begin with a step by the error at rest.
    arm = follower(constraints=BRAKES if ramp else {}, interpolate_from_desired_state=True)

    @ON_THE_ARM
    @given(st.floats(0.0, 1.3), st.floats(0.0, 0.009), st.sampled_from([0.25, -0.25]))
    def fuzz(at: float, within: float, way: float) -> None:
        way = way if arm.measured[0] * way < 0.0 else -way
        begin = arm.now
        goal = arm.send(arm.move(way, 1.2))
        arm.run(at)
        arm.clock.sleep_until(arm.now + within)
        finished = goal.done
        arm.jtc.cancel(arm.now)
        arm.step()
        speeds = arm.seen[-1].velocities
        for _ in range(150):
            arm.step()
        if not finished:
            assert goal.status is GoalStatus.CANCELED
            assert goal.error_code is ErrorCode.SUCCESSFUL
        assert arm.jtc.holding
        assert arm.seen[-1].velocities == pytest.approx(NOTHING, abs=1e-9)
        assert [axis.velocity.value for axis in arm.world.hardware.axes] == pytest.approx(
            NOTHING, abs=2e-2
        )
        assert arm.commanded == pytest.approx(arm.measured, abs=2e-3)
        assert max(map(abs, speeds)) < 0.5
        smooth(arm, begin, limited=not ramp)
        assert arm.finish(arm.send(arm.move(0.0, 0.2))).status is GoalStatus.SUCCEEDED
        assert not arm.world.supervisor.faults

    fuzz()


@given(st.lists(st.floats(0.0, 5.0), min_size=2, max_size=6))
def test_pln2_times_that_do_not_increase_never_run(times: list[float]) -> None:
    parameters = JointTrajectoryParameters(joints=("a",))
    trajectory = JointTrajectory(("a",), tuple(Point(time, (0.0,)) for time in times))
    if all(one < two for one, two in pairwise(times)):
        check_form(trajectory, parameters)
    else:
        with pytest.raises(GoalRejectedError, match="does not come after"):
            check_form(trajectory, parameters)


def test_pln2_a_start_elsewhere_is_never_executed_raw() -> None:
    """The Robot refuses it; sent to the controller directly it becomes a ramp within the limits."""
    # Driven to and fro at full acceleration, the simulated elbow stalls.
    gentle = [replace(each, max_acceleration=each.max_acceleration / 2) for each in LIMITS.values()]
    arm = Follower(World(at=MIDDLE, joints=gentle))

    @ON_THE_ARM
    @given(st.floats(0.01, 0.3), st.sampled_from([0.0, 0.01, 0.5]))
    def fuzz(off: float, first: float) -> None:
        begin = arm.now
        off = -off if arm.measured[0] > 0.0 else off
        goal = arm.send(arm.move(off)._replace(time=first), arm.move(off * 1.1, first + 1.0))
        arm.finish(goal)
        arm.run(0.5)
        smooth(arm, begin, limited=True)
        assert not arm.world.supervisor.faults

    fuzz()
