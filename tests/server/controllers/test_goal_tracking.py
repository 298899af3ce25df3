"""Goals of clients are followed in time, end at rest, and are reported as they are carried out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from client_controllers import POSITION_JTC, VELOCITY_JTC
from server.controllers.goal_tracking import GOALS, cancelled, track


@pytest.mark.parametrize("goal", GOALS, ids=[each.__name__ for each in GOALS])
@pytest.mark.parametrize("name", [POSITION_JTC, VELOCITY_JTC])
def test_a_goal_is_followed_in_time_and_ends_at_rest(name: str, goal: Callable[..., Any]) -> None:
    row = track(name, goal)
    assert row.status == ("canceled" if goal is cancelled else "succeeded")
    assert row.path < 1.2
    assert row.end < 0.2
    assert row.moved < 0.2
    assert 0.0 < row.late < 0.7
