"""Goals that actions wait for."""

from __future__ import annotations

import threading

from bioscara.api import messages as m
from bioscara.ros.controllers.goals import GoalEnds


def ended(number: int) -> m.EndedGoal:
    return m.EndedGoal(number, "a", "succeeded", 0, "")


def test_an_end_that_came_before_the_wait_is_found() -> None:
    goals = GoalEnds()
    goals.take([ended(1), ended(2)])
    assert goals.wait(1, goals.generation).status == "succeeded"


def test_a_wait_ends_with_the_goal() -> None:
    goals, found = GoalEnds(), []
    generation = goals.generation
    waiter = threading.Thread(target=lambda: found.append(goals.wait(3, generation)))
    waiter.start()
    goals.take([ended(2)])
    goals.take([ended(2), ended(3)])
    waiter.join(10.0)
    assert [each.goal for each in found] == [3]


def test_goals_of_an_owner_that_was_lost_are_aborted_and_never_taken_for_those_of_the_next() -> (
    None
):
    goals = GoalEnds()
    before = goals.generation
    goals.take([ended(1)])
    goals.lose("the owner is gone")
    lost = goals.wait(1, before)
    assert (lost.status, lost.error_code, lost.text) == ("aborted", -1, "the owner is gone")
    goals.take([ended(1)])
    assert goals.wait(1, goals.generation).status == "succeeded"
    assert goals.wait(1, before).status == "aborted"
