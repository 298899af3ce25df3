"""STOP by every door in every state of a served arm: the true arm decelerates in time."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from functools import partial

import pytest

from bioscara import Robot
from bioscara.errors import OwnerLostError
from hostile import stop_conditions
from hostile.moving_arm import LATENCY
from hostile.stop_doors import DEAD, DOORS, STATES, Rig, measure, rig
from programs import wait_until

SECOND_WAY, RESTART = 1.0, 10.0
"""Longest time to the deceleration on a busy computer: by the second way, and beyond a gateway
that hangs, or without a process for the connections of clients, until these are there again [s]."""
BY_SECOND_WAY = ("clients' process hung", "event loop busy for 1 s", DEAD)
QUICK = (
    ("usual", "`bioscara stop`"),
    ("clients' process hung", "`robot.stop()`"),
    ("clients' process hung", "HTTP"),
)


def limit(state: str, door: str) -> float:
    """Return the longest time to the deceleration [s]."""
    if (state == "gateway hung" and DOORS[door].gateway) or (state, door) == (DEAD, "WebSocket"):
        return RESTART
    return SECOND_WAY if state in BY_SECOND_WAY else LATENCY


@pytest.fixture(scope="module")
def moving() -> Iterator[Rig]:
    with rig("homed") as made:
        yield made


@pytest.mark.parametrize(
    ("state", "door"),
    [
        each if each in QUICK else pytest.param(*each, marks=pytest.mark.thorough)
        for each in ((state, door) for state in STATES for door in DOORS)
    ],
)
def test_a_stop_decelerates_the_arm(moving: Rig, state: str, door: str) -> None:
    assert measure(moving, DOORS[door], state) < limit(state, door)


@pytest.fixture(scope="module")
def not_homed() -> Iterator[Rig]:
    with rig() as made:
        yield made


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("condition", "door"),
    [
        (condition, door)
        for condition in ("planning", "wait", "pause")
        for door in DOORS
        # Ctrl-C in a plan is tested with the sequences.
        if (condition, door) != ("planning", "Ctrl-C")
    ],
)
def test_a_stop_ends_what_the_arm_does(moving: Rig, condition: str, door: str) -> None:
    stop_conditions.measure(moving, DOORS[door], condition)


@pytest.mark.thorough
@pytest.mark.parametrize("door", DOORS)
def test_a_stop_ends_homing(not_homed: Rig, door: str) -> None:
    assert stop_conditions.measure(not_homed, DOORS[door], "homing") < LATENCY


@pytest.mark.thorough
@pytest.mark.parametrize("group", [False, True], ids=["owner", "with its gateway"])
def test_a_suspended_owner_is_reported_beyond_its_gateway(moving: Rig, group: bool) -> None:
    wait_until(moving.answers, "owner and gateway answer")
    token = moving.token["Authorization"].removeprefix("Bearer ")
    suspend = partial(os.killpg if group else os.kill, moving.owner.pid)
    with Robot.connect(moving.origin, token=token) as robot:
        assert robot.state
        suspend(signal.SIGSTOP)
        try:
            time.sleep(0.5)
            begin = time.monotonic()
            with pytest.raises(OwnerLostError):
                _ = robot.state
            assert time.monotonic() - begin < 7.0
        finally:
            suspend(signal.SIGCONT)
