from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from control.control_stack import World
from control.controllers.joint_trajectory.follower import MIDDLE, Follower

_homed: list[World] = []


@pytest.fixture
def follower() -> Iterator[Callable[..., Follower]]:
    """Make controllers on an arm that all tests share; each test returns it to the middle."""
    if not _homed:
        _homed.append(World(at=MIDDLE))
    made: list[Follower] = []

    def make(**parameters: object) -> Follower:
        made.append(Follower(_homed[0], **parameters))
        return made[-1]

    yield make
    world = _homed[0]
    if world.supervisor.state.value != "clear" or not made:
        if made:
            _homed.clear()
        return
    made[-1].close()


@pytest.fixture
def arm(follower: Callable[..., Follower]) -> Follower:
    """A controller with default parameters that takes positions and velocities."""
    return follower()
