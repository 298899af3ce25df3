"""Goals of clients are followed in time, end at rest, and are reported as they are carried out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import pytest

from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point
from bioscara.errors import GoalRejectedError
from client_controllers import JOINTS, POSITION_JTC, VELOCITY_JTC, Site
from served import HALF
from server.controllers.goal_tracking import (
    GOALS,
    Send,
    at_the_limits,
    cancelled,
    fast,
    quintic,
    replaced,
    track,
    tracked,
)
from simulated import ARM

CASES = [
    *((POSITION_JTC, goal) for goal in GOALS),
    *((VELOCITY_JTC, goal) for goal in (fast, replaced, at_the_limits)),
]


@pytest.mark.parametrize(("name", "goal"), CASES, ids=lambda case: getattr(case, "__name__", case))
def test_a_goal_is_followed_in_time_and_ends_at_rest(name: str, goal: Callable[..., Any]) -> None:
    row = track(name, goal)
    assert row.status == ("canceled" if goal is cancelled else "succeeded")
    assert row.path < 1.2
    assert row.end < 0.2
    assert row.moved < 0.2
    assert 0.0 < row.late < 0.7


@pytest.mark.parametrize("name", [POSITION_JTC, VELOCITY_JTC])
@pytest.mark.parametrize("seconds", [1.0, 2.0, 4.0, 8.0])
def test_a_goal_without_velocities_takes_the_time_that_it_asks_for(
    name: str, seconds: float
) -> None:
    def moved(_: Site, here: Sequence[float], send: Send) -> float:
        """Most of a speed that the tool may have."""
        share = min(0.25 * seconds, 1.0)
        there = tuple(a + share * b for a, b in zip(here, (0.2, 0.008, 0.2, 0.2), strict=True))
        send([Point(seconds, there)])
        return seconds

    row = track(name, moved)
    assert row.status == "succeeded"
    # And the time in which it has stood.
    assert row.took < seconds + 0.25
    assert row.path < 1.2


@pytest.mark.parametrize("stamped", [False, True])
@pytest.mark.parametrize("name", [POSITION_JTC, VELOCITY_JTC])
def test_the_arm_does_not_swing_back_after_a_cancel(name: str, *, stamped: bool) -> None:
    # So slowly that each request comes in time.
    with tracked(name, speed=4.0) as (site, cycles):
        begin = site.robot.state.positions
        for there, after in ((0.4, 0.5), (0.0, 0.8), (0.4, 1.2), (0.0, 0.0)):
            first, here = len(cycles), site.robot.state.positions
            end = (begin[0] + there, *begin[1:])
            stamp = site.newest.time + 1.0 if stamped else 0.0
            goal = Goal(JointTrajectory(JOINTS, quintic(here, end, 3.0), stamp))
            number = site.robot.controllers.follow(name, goal)
            if after:
                site.moving()
                site.passed(after)
            site.robot.controllers.cancel(name, number)
            assert site.ended(number).status == "canceled"
            site.passed(2.0)
            way = [abs(cycle.measured[0] - here[0]) for cycle in cycles[first:]]
            assert max(way) - way[-1] < (2e-3 if stamped else 1e-3)
            # Cancelled before it began: without motion.
            assert (max(way) > 1e-3) == bool(after)


@pytest.mark.parametrize("name", [POSITION_JTC, VELOCITY_JTC])
def test_a_joint_that_rests_beyond_a_limit_may_stay_and_return(name: str) -> None:
    joints = [
        replace(each, lower=HALF[1] + 1e-4) if each.name == "j2" else each for each in ARM.joints
    ]
    with tracked(name, replace(ARM, joints=tuple(joints))) as (site, _):

        def status(*points: Point) -> str:
            trajectory = JointTrajectory(JOINTS, points)
            number = site.robot.controllers.follow(name, Goal(trajectory))
            return site.ended(number).status

        def measured(*by: float) -> tuple[float, ...]:
            here = site.robot.state.positions
            return tuple(a + b for a, b in zip(here, by, strict=True))

        assert measured(0, 0, 0, 0)[1] < HALF[1] + 1e-4
        assert status(Point(2.0, measured(0.1, 0, 0, 0))) == "succeeded"
        # As measured a moment ago, and by a margin of the measurement farther out.
        assert status(Point(1.0, measured(0, -5e-6, 0, 0)), Point(3.0, measured(-0.1, 0, 0, 0)))
        here = measured(0, 0, 0, 0)
        assert status(*quintic(here, measured(0.1, 0, 0, 0), 3.0)) == "succeeded"
        assert site.robot.state.positions[1] == pytest.approx(here[1], abs=2e-5)
        with pytest.raises(GoalRejectedError, match="positions of j2 is"):
            status(Point(2.0, measured(0, -2e-3, 0, 0)))
        assert status(Point(2.0, measured(0, 0.01, 0, 0))) == "succeeded"
