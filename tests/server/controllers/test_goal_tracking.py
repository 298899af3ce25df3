"""Goals of clients are followed in time, end at rest, and are reported as they are carried out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from client_controllers import POSITION_JTC, VELOCITY_JTC
from server.controllers.goal_tracking import (
    GOALS,
    at_the_limits,
    cancelled,
    fast,
    replaced,
    track,
)

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
