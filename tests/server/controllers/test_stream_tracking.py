"""Streams of single points are followed: as far, in time, within limits, and to the last one."""

from __future__ import annotations

import random

import pytest

from bioscara.control.controllers.joint_trajectory import Point
from client_controllers import POSITION_JTC
from server.controllers.stream_tracking import AHEAD, CONTROLLERS, FORMS, Followed, Owner, follow

FARTHER = [pytest.param(each, marks=pytest.mark.thorough) for each in (0.01, 0.034)]
USUAL = sorted({*AHEAD} - {0.01, 0.034})


def expect(row: Followed, lag: float = 0.25) -> None:
    """Require what docs/ros2.md promises of each stream."""
    assert 0.97 < row.amplitude < 1.03, row
    assert row.lag < lag, row
    assert row.acceleration < 1.0 + 1e-3, row
    assert row.end < 1.0, row
    assert not row.warnings


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("ahead", [*USUAL, *FARTHER])
def test_a_stream_is_followed(name: str, form: str, ahead: float) -> None:
    expect(follow(name, form, ahead))


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("ahead", [*USUAL, *FARTHER])
def test_a_stream_with_losses_is_followed_to_its_last_point(name: str, ahead: float) -> None:
    seed = 7
    chance = random.Random(seed)
    kept = [chance.random() >= 0.3 for _ in range(1000)]
    some = follow(name, "velocities", ahead, arrives=lambda _, due: kept[round(due / 0.02)])
    expect(some, 1.0)
    # Gaps of 0.3 s.
    expect(follow(name, "positions", ahead, arrives=lambda _, due: due % 0.9 < 0.6), 1.0)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_stream_that_is_too_fast_is_reported_once_and_keeps_the_limits(name: str) -> None:
    row = follow(name, "positions", 0.02, faster=10.0)
    assert row.acceleration < 1.0 + 1e-3
    (warning,) = row.warnings
    assert "too fast for the joints or the tool" in warning


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_stream_is_cancelled_paused_replaced_and_goes_on(name: str) -> None:
    rested = []

    def arrives(owner: Owner, due: float) -> bool:
        controller, here = owner.controller, owner.controller.commanded
        if due == 1.0:
            controller.cancel(owner.now())
        elif due == 2.0:
            owner.scale(0.0)
        elif due == 2.98:
            rested.append(controller.at_rest)
            owner.scale(1.0)
        elif due == 4.0 and name == POSITION_JTC:
            # The arm comes to rest first: raw commands are averaged from rest on.
            owner.send(Point(0.5, here), Point(1.0, here))
        return not 4.0 <= due < 4.4

    row = follow(name, "positions", 0.02, arrives=arrives)
    assert rested == [True]
    assert row.acceleration < 1.0 + 1e-3
    assert row.end < 1.0
