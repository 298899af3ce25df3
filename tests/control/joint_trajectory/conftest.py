from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import pytest

from control.joint_trajectory.follower import MIDDLE, Follower
from control.world import PARAMETERS, World

GENTLE = tuple(
    replace(joint, max_acceleration=joint.max_acceleration / 2.0) for joint in PARAMETERS.joints
)
"""Flung to and fro at all of its acceleration, the simulated elbow stalls; that is not tried here."""
_homed: list[World] = []


@pytest.fixture
def follower() -> Iterator[Callable[..., Follower]]:
    """Make controllers on an arm that is shared by all tests and brought back by each."""
    if not _homed:
        _homed.append(World(at=MIDDLE, joints=GENTLE))
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
