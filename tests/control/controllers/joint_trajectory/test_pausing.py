"""A scaling of 0 brings the joints to rest on their path as a cancel does; the goal stays."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from bioscara.control.controllers.joint_trajectory import (
    ErrorCode,
    Goal,
    GoalHandle,
    GoalStatus,
    JointTrajectory,
    Point,
)
from bioscara.control.controllers.joint_trajectory.goal_conversion import Request
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator
from bioscara.control.controllers.joint_trajectory.sampler import TrajectorySampler
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.planning import Sample, Trajectory, point_to_point
from bioscara.robot.planner import ACCELERATION_SHARE
from control.controllers.joint_trajectory.follower import BRAKES, NOTHING, Follower, alone, smooth
from laws import examples
from planning.limits import LIMITS, NAMES
from planning.scenes import random_joints

PERIOD = 0.01
PLANNED = [
    replace(limit, max_acceleration=ACCELERATION_SHARE * limit.max_acceleration) for limit in LIMITS
]
MOST = np.array([limit.max_acceleration for limit in LIMITS])
FASTEST = np.array([limit.max_velocity for limit in LIMITS])
GENTLE: dict[str, Any] = {**BRAKES, "least_time_on_cancel": 0.27}
"""Constraints of an arm whose belts swing."""
LEASTS = st.sampled_from([0.0, 0.27])


class Sampled:
    """A sampler without an arm, on a motion from rest to rest; and its commands since."""

    def __init__(
        self, seed: int, least: float, scaling: float = 1.0, *, collision_checked: bool = True
    ) -> None:
        rng = np.random.default_rng(seed)
        self.move: Trajectory = point_to_point(
            NAMES, random_joints(rng), random_joints(rng), PLANNED
        )
        values = {
            "joints": NAMES,
            "constraints": {**BRAKES, "least_time_on_cancel": least},
            "speed_scaling": {"initial_scaling_factor": scaling},
        }
        parameters = JointTrajectoryParameters.read("jtc", values)
        start = tuple(self.move.positions[0].tolist())
        self.player = TrajectorySampler(parameters, PERIOD, start, 0.0)
        course = Interpolator(JointTrajectory.of(self.move).points)
        self.player.waiting = Request(course, 0.0, frozenset(), collision_checked)
        self._start = Sample(start, (0.0,) * 4, (0.0,) * 4)
        self._cycles = 0
        self.positions: list[tuple[float, ...]] = []
        self.velocities: list[tuple[float, ...]] = []
        self.scalings: list[float] = []

    def run(self, cycles: int) -> None:
        for _ in range(cycles):
            self._cycles += 1
            self.player.advance(self._cycles * PERIOD, PERIOD, self._start)
            ahead, pace = self.player.ahead(), self.player.commanded_pace
            self.scalings.append(self.player.scaling)
            self.positions.append(ahead.positions)
            self.velocities.append(tuple([pace * value for value in ahead.velocities]))

    def assert_on_the_curve(self) -> None:
        curve = self.move.sample_many(np.linspace(0.0, self.move.duration, 4000))[0]
        apart = [np.abs(curve - row).max(axis=1).min() for row in self.positions]
        assert max(apart) < 5e-3


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0), st.floats(0.05, 1.0), LEASTS)
def test_a_pause_commands_what_a_cancel_commands(
    seed: int, share: float, scaling: float, least: float
) -> None:
    runs = []
    for pauses in (True, False):
        arm = Sampled(seed, least, scaling)
        arm.run(1 + int(share * arm.move.duration / scaling / PERIOD))
        if pauses:
            arm.player.scale(0.0)
        else:
            arm.player.brake()
        arm.run(200)
        assert arm.player.paused is pauses
        assert arm.player.at_rest is not pauses
        runs.append((arm.positions, arm.velocities))
    np.testing.assert_allclose(runs[0], runs[1], rtol=0.0, atol=1e-9)
    assert not np.any(runs[0][1][-1])


@given(
    st.integers(0, 2**32 - 1),
    st.lists(
        st.tuples(st.integers(1, 60), st.sampled_from([0.0, 0.0, 0.3, 1.0])),
        min_size=1,
        max_size=8,
    ),
    LEASTS,
    st.booleans(),
)
@settings(max_examples=examples(10))
def test_any_change_of_the_scaling_stays_on_the_path_and_within_the_limits(
    seed: int, changes: list[tuple[int, float]], least: float, collision_checked: bool
) -> None:
    arm = Sampled(seed, least, collision_checked=collision_checked)
    arm.run(20)
    before = arm.player.time
    for cycles, factor in changes:
        arm.player.scale(factor)
        arm.run(cycles)
        assert arm.player.time >= before
        before = arm.player.time
    arm.player.scale(0.0)
    arm.run(150)
    assert arm.player.paused
    assert arm.player.scaling == 0.0
    assert not any(arm.velocities[-1])
    arm.player.scale(1.0)
    assert not arm.player.paused
    arm.run(round((arm.move.duration + 2.0) / PERIOD))
    assert arm.positions[-1] == pytest.approx(arm.move.positions[-1])
    arm.assert_on_the_curve()
    # Apart from the deceleration, the scaling rises at 1 per second.
    changes_of_velocity = np.abs(np.diff(arm.velocities, axis=0)) / PERIOD
    assert (changes_of_velocity <= 1.05 * MOST + 1.1 * FASTEST).all()


@pytest.mark.parametrize("soon", range(1, 12))
def test_a_factor_during_the_deceleration_counts_once_the_joints_rest(soon: int) -> None:
    straight, arm = Sampled(3, 0.27), Sampled(3, 0.27)
    for each in (straight, arm):
        each.run(round(arm.move.duration / 2.0 / PERIOD))
        each.player.scale(0.0)
    straight.run(40)
    arm.run(soon)
    arm.player.scale(1.0)
    arm.run(40 - soon)
    rest = straight.scalings.index(0.0)
    assert arm.positions[: rest + 1] == straight.positions[: rest + 1]
    arm.run(200)
    paces = arm.scalings[rest:]
    assert paces[0] == 0.0
    assert paces[-1] == 1.0
    # As after any other change of the factor the pace rises gradually, by 1 per second at most.
    rises = np.diff(paces)
    assert (rises >= 0.0).all()
    assert rises.max() <= 1.001 * PERIOD
    assert np.diff(rises).max() <= 1.001 * PERIOD**2 / 0.27


def running(arm: Follower, seconds: float = 2.0, **values: Any) -> GoalHandle:
    """Send a goal of 0.4 rad and follow it for half of its time."""
    goal = arm.jtc.send_goal(
        Goal(arm.trajectory(Point(0.0, arm.commanded, NOTHING), arm.move(0.4, seconds)), **values),
        arm.now,
    )
    arm.run(seconds / 2.0)
    return goal


def come_to_rest(arm: Follower) -> None:
    for _ in range(40):
        arm.step()
        if arm.jtc.paused:
            return
    raise AssertionError("not paused within 0.4 s")


@pytest.mark.parametrize("kinds", [("position",), ("position", "velocity")])
@pytest.mark.parametrize("collision_checked", [True, False])
def test_rule_18_a_paused_goal_stands_on_its_path_and_goes_on(
    follower: Callable[..., Follower], kinds: tuple[str, ...], *, collision_checked: bool
) -> None:
    arm = follower(
        command_interfaces=kinds,
        constraints={**GENTLE, "goal_time": 0.5},
        cmd_timeout=1.0,
        interpolate_from_desired_state=True,
    )
    before, begin = arm.interventions, arm.now
    goal = running(arm, collision_checked=collision_checked)
    start = arm.seen[3].positions
    arm.jtc.set_scaling(0.0)
    assert not arm.jtc.paused
    come_to_rest(arm)
    state = arm.jtc.controller_state
    assert state is not None
    assert state.speed_scaling_factor == arm.jtc.scaling == 0.0
    stood = arm.commanded
    arm.run(3.0)
    assert arm.jtc.paused
    assert not goal.done
    assert arm.commanded == stood
    assert arm.measured == pytest.approx(stood, abs=2e-3)
    assert arm.jtc.feedback is not None
    assert arm.jtc.feedback.trajectory_time == state.trajectory_time
    assert arm.jtc.feedback.desired.positions == pytest.approx(stood)
    arm.jtc.set_scaling(1.0)
    assert not arm.jtc.paused
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    assert arm.interventions == before
    # Every joint travels its share of the path all the time.
    way = np.array(goal.goal.trajectory.points[-1].positions) - start
    for each in arm.seen[3:]:
        shares = (np.array(each.positions) - start) / way
        assert shares.max() - shares.min() < 1e-6
    if "velocity" in kinds:
        smooth(arm, begin)
    if "velocity" in kinds and collision_checked:
        for one, two, three in zip(arm.seen[90:], arm.seen[91:], arm.seen[92:160], strict=False):
            mean = (three.positions[0] - one.positions[0]) / (three.time - one.time)
            assert two.velocities[0] == pytest.approx(mean, abs=3e-3)


def test_a_goal_that_is_not_collision_checked_leaves_its_path_when_cancelled_but_not_when_paused(
    follower: Callable[..., Follower],
) -> None:
    off = {}
    for pauses in (True, False):
        arm = follower(constraints=GENTLE, interpolate_from_desired_state=True)
        goal = running(arm, 1.6)
        start = np.array(goal.goal.trajectory.points[0].positions)
        way = np.array(goal.goal.trajectory.points[-1].positions) - start
        arm.jtc.set_scaling(0.0) if pauses else arm.jtc.cancel(arm.now)
        since = len(arm.seen)
        arm.run(0.4)
        shares = np.array([(np.array(each.positions) - start) / way for each in arm.seen])
        off[pauses] = np.ptp(shares, axis=1).max()
        # As fast as the slowest joint can: nothing bends here.
        rest = next(i for i, row in enumerate(arm.seen[since:]) if not any(row.velocities))
        assert rest * PERIOD < 0.27
        if pauses:
            arm.close()
    assert off[True] < 1e-6
    assert off[False] > 1e-3


@pytest.mark.parametrize("early", [0.02, 0.05, 0.1, 0.2])
def test_a_pause_just_before_the_end_gives_no_verdict_until_it_goes_on(
    follower: Callable[..., Follower], early: float
) -> None:
    arm = follower(constraints={**GENTLE, "goal_time": 0.3})
    end = arm.move(0.2, 1.0)
    path = arm.trajectory(Point(0.0, arm.commanded, NOTHING), end)
    goal = arm.jtc.send_goal(Goal(path, collision_checked=True), arm.now)
    arm.run(1.0 - early)
    arm.jtc.set_scaling(0.0)
    arm.run(2.0)
    assert arm.jtc.paused
    assert goal.status is GoalStatus.EXECUTING
    arm.jtc.set_scaling(1.0)
    assert arm.finish(goal, 2.0).status is GoalStatus.SUCCEEDED
    assert arm.measured == pytest.approx(end.positions, abs=2e-3)


def test_a_pause_while_the_end_is_awaited_stops_the_time_of_the_goal(
    follower: Callable[..., Follower],
) -> None:
    constraints = {**GENTLE, "goal_time": 0.5, "j1": {**BRAKES["j1"], "goal": 1e-9}}
    arm = follower(constraints=constraints)
    goal = arm.send(arm.move(0.1, 0.5))
    arm.run(0.7)
    arm.jtc.set_scaling(0.0)
    arm.run(2.0)
    assert arm.jtc.paused
    assert not goal.done
    arm.jtc.set_scaling(1.0)
    assert arm.finish(goal, 0.5).error_code is ErrorCode.GOAL_TOLERANCE_VIOLATED


@pytest.mark.parametrize("cycles", [1, 10, 100])
def test_the_path_is_judged_during_a_pause(cycles: int) -> None:
    brakes = {"max_deceleration_on_cancel": 2.0, "trajectory": 0.05}
    jtc, positions, velocities = alone(
        ("position",), constraints={"decelerate_on_cancel": True, "a": brakes, "b": brakes}
    )
    for state in (*positions, *velocities):
        state.value = 0.0
    for command in jtc.command_handles:
        command.value = 0.0
    jtc.on_activate(0.0)
    points = (Point(0.0, (0.0,) * 2), Point(10.0, (1.0,) * 2))
    goal = jtc.send_goal(Goal(JointTrajectory(("a", "b"), points)), 0.0)
    times = (PERIOD * cycle for cycle in range(1000))

    def follow(cycles: int, off: float = 0.0) -> None:
        for time in itertools.islice(times, cycles):
            jtc.update(time, PERIOD)
            for state, command in zip(positions, jtc.command_handles, strict=True):
                state.value = command.value + off

    follow(100)
    jtc.set_scaling(0.0)
    follow(cycles)
    assert not goal.done
    follow(2, 0.06)
    assert goal.error_code is ErrorCode.PATH_TOLERANCE_VIOLATED
    assert jtc.holding
    assert not jtc.paused


@pytest.mark.parametrize("collision_checked", [True, False])
@pytest.mark.parametrize("after", [0.01, 0.05, 0.1, 0.6])
def test_a_cancel_during_a_pause_does_not_move_the_place_of_rest(
    follower: Callable[..., Follower], after: float, *, collision_checked: bool
) -> None:
    arm = follower(constraints=GENTLE)
    before, begin = arm.interventions, arm.now
    goal = running(arm, collision_checked=collision_checked)
    arm.jtc.set_scaling(0.0)
    arm.step()
    stop = arm.jtc._sampler and arm.jtc._sampler._pausing
    assert stop is not None
    arm.run(after)
    arm.jtc.cancel(arm.now)
    assert goal.status is GoalStatus.CANCELED
    arm.run(0.5)
    assert arm.jtc.at_rest
    assert not arm.jtc.paused
    assert arm.commanded == pytest.approx(stop.end, abs=1e-9)
    assert arm.interventions == before
    smooth(arm, begin)
    arm.jtc.set_scaling(1.0)
    assert arm.finish(arm.send(arm.move(-0.05, 0.5))).status is GoalStatus.SUCCEEDED


@pytest.mark.parametrize("after", [0.05, 0.6])
def test_a_deactivation_during_a_pause_leaves_positions_as_they_are(
    follower: Callable[..., Follower], after: float
) -> None:
    arm = follower(constraints=GENTLE)
    goal = running(arm)
    arm.jtc.set_scaling(0.0)
    last = arm.run(after)[-1]
    arm.world.switch(off=("jtc",))
    assert goal.status is GoalStatus.ABORTED
    assert arm.commanded == last.positions
    assert not arm.jtc.paused
    arm.run(0.5)
    arm.world.switch("jtc")
    assert arm.finish(arm.send(arm.move(0.05, 0.5))).status is GoalStatus.SUCCEEDED


@pytest.mark.parametrize("after", [0.0, 0.05, 0.1, 0.6])
@pytest.mark.parametrize("partial", [True, False])
def test_a_goal_that_comes_during_a_pause_is_paused_and_takes_over_without_a_step(
    follower: Callable[..., Follower], after: float, *, partial: bool
) -> None:
    arm = follower(constraints=GENTLE, allow_partial_joints_goal=True)
    before, begin = arm.interventions, arm.now
    first = running(arm)
    arm.jtc.set_scaling(0.0)
    arm.run(after)
    end = arm.move(-0.1, 1.5)
    names = NAMES[:1] if partial else NAMES
    point = Point(end.time, end.positions[: len(names)], NOTHING[: len(names)])
    goal = arm.jtc.send_goal(Goal(arm.trajectory(point, names=names)), arm.now)
    assert first.status is GoalStatus.ABORTED
    arm.run(0.4)
    stood = arm.commanded
    assert arm.jtc.paused
    arm.run(2.0)
    assert arm.commanded == stood
    assert not goal.done
    arm.jtc.set_scaling(1.0)
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
    assert arm.measured[0] == pytest.approx(end.positions[0], abs=2e-3)
    if partial:
        assert arm.measured[2] == pytest.approx(
            first.goal.trajectory.points[-1].positions[2], abs=2e-3
        )
    assert arm.interventions == before
    smooth(arm, begin)


def test_a_share_that_changes_during_a_pause_counts_from_then_on(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints=GENTLE)
    goal = running(arm, 4.0)
    arm.jtc.set_scaling(0.0)
    arm.run(0.1)
    arm.jtc.slow_down(0.5)
    come_to_rest(arm)
    arm.jtc.set_scaling(0.8)
    arm.run(1.5)
    assert arm.jtc.scaling == pytest.approx(0.4)
    arm.jtc.slow_down(1.0)
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED


@pytest.mark.parametrize("after", [0.05, 0.6])
def test_a_collision_stop_ends_a_pause(follower: Callable[..., Follower], after: float) -> None:
    arm = follower(constraints=GENTLE)
    goal = running(arm)
    arm.jtc.set_scaling(0.0)
    arm.run(after)
    rest = dict(zip(NAMES, arm.commanded, strict=True))
    arm.jtc.on_collision_stop("a wall", rest)
    assert (goal.status, goal.text) == (GoalStatus.ABORTED, "a wall")
    # A goal that is cancelled at once begins no ramp on the path that ended.
    arm.send(arm.move(0.05, 1.0))
    arm.jtc.cancel(arm.now)
    arm.run(0.3)
    assert not arm.jtc.paused
    assert arm.jtc.holding
    assert arm.commanded == pytest.approx(tuple(rest.values()))


def test_other_changes_of_the_factor_are_as_gradual_as_ever(
    follower: Callable[..., Follower],
) -> None:
    arm = follower(constraints=GENTLE)
    goal = running(arm, 4.0)
    scalings = [arm.jtc.scaling]
    arm.jtc.set_scaling(0.1)
    for _ in range(130):
        arm.step()
        scalings.append(arm.jtc.scaling)
    assert scalings[-1] == pytest.approx(0.1)
    assert max(one - two for one, two in itertools.pairwise(scalings)) <= 1.001 * PERIOD
    assert scalings[60] > 0.4
    arm.jtc.set_scaling(1.0)
    assert arm.finish(goal).status is GoalStatus.SUCCEEDED
