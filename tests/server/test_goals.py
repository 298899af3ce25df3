"""Which goals an owner keeps, and for how long."""

from __future__ import annotations

import pytest

from bioscara import InvalidArgumentError, Robot
from bioscara.api import messages as m
from bioscara.remote.link import OwnerLink
from bioscara.server import goals
from served import HALF, NAME, arm_served


def test_the_trajectories_of_the_latest_goals_are_kept_and_the_results_of_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(goals, "TRAJECTORIES", 2)
    with arm_served(at=HALF) as served, Robot.connect(f"arm:{NAME}") as robot:
        for _ in range(4):
            robot.move_relative(z=0.001)
        link = OwnerLink(NAME, lambda _: None, lambda _: None)
        link.open()
        try:
            listed = link.request(m.ListGoals())
            assert isinstance(listed, m.GoalList)
            ended = [(goal.goal, goal.status) for goal in listed.goals]
            last = served.owner.goals.last
            assert ended == [(number, "succeeded") for number in range(last - 3, last + 1)]
            durations = [goal.duration for goal in listed.goals]
            assert min(durations) > 0.0
            for number in (last - 1, last):
                answer = link.request(m.GetTrajectories(number))
                assert isinstance(answer, m.GoalTrajectories)
                assert len(answer.trajectories[0].times) > 2
            with pytest.raises(InvalidArgumentError, match=f"of goal {last - 3} are not kept"):
                link.request(m.GetTrajectories(last - 3))
        finally:
            link.close()
