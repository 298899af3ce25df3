"""Verdicts of the stop guard against a dense check of the path to a state and to rest."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

from bioscara.errors import InvalidArgumentError, ZoneError
from bioscara.kinematics import Joints
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.collision.stop_guard import StopGuard
from bioscara.planning.collision.swept import SLACK
from planning.scenes import ARM, random_joints, random_scene

COUNT = int(os.environ.get("BIOSCARA_RANDOM_MOVES", "300"))
START = Joints(0.3, 0.2, 0.8, -0.5)
WALL = Scene((Box("wall", (0.3, 0.62, 0.0), (0.7, 0.9, 0.6)),))


def clearances(scene: Scene, rows: np.ndarray) -> np.ndarray:
    """Return the distances of all pairs, exact where they are below the margin."""
    return scene.layout(ARM).clearances(ARM, rows, scene.margin + SLACK)


def scene_reach() -> np.ndarray:
    """Return the largest displacement of a point of the arm per movement of each joint."""
    return np.array(StopGuard(ARM, WALL).reach)


def test_it_agrees_with_dense_samples_of_random_motions() -> None:
    rng = np.random.default_rng(11)
    weight = 4.0 * scene_reach()
    passed = refused = 0
    while passed + refused < COUNT:
        scene = random_scene(rng)
        room, before = StopGuard(ARM, scene), np.array(random_joints(rng))
        for _ in range(10):
            step, way = rng.normal(size=(2, 4)) * [0.05, 0.01, 0.05, 0.1]
            here, rest = before + step, before + step + way * rng.uniform(0.0, 4.0)
            dense = np.concatenate([np.linspace(before, here, 60), np.linspace(here, rest, 300)])
            pairs = clearances(scene, dense)
            worst = float((pairs - np.minimum(pairs[:, :1], scene.margin)).min())
            try:
                free = room.check((before, here, rest))
            except ZoneError:
                refused += 1
                assert worst < SLACK + 2e-4
            else:
                passed += 1
                assert worst >= -2.0 * SLACK
                beside = dense + rng.uniform(-1.0, 1.0, dense.shape) * max(free, 0.0) / weight
                pairs = clearances(scene, beside)
                assert free <= 0.0 or pairs.min() >= scene.margin - 2.0 * SLACK
                before = here
    assert min(passed, refused) > 0.1 * COUNT


def test_paths_that_are_not_straight_pass_only_in_free_space() -> None:
    room, near = StopGuard(ARM, WALL), (0.36, *START[1:])
    room.check((START, START, (0.31, *START[1:])), together=False)
    room.check((near, near, near))
    with pytest.raises(ZoneError, match="wall"):
        room.check((START, near, (0.6, *START[1:])), together=False)


def test_a_pair_below_the_margin_may_move_apart_but_not_closer() -> None:
    scene = Scene((Box("reader", (0.3, 0.45, 0.0), (0.7, 0.8, 0.6)),), margin=0.02)
    room = StopGuard(ARM, scene)
    assert scene.clearance(ARM, [START]) < 0.0
    away, nearer = (START.j1 - 0.1, *START[1:]), (START.j1 + 0.1, *START[1:])
    room.check((START, START, START))
    room.check((START, away, away))
    with pytest.raises(ZoneError, match="reader before it can come to rest"):
        room.check((START, nearer, nearer))


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("which", range(3))
def test_an_unknown_position_does_not_pass(value: float, which: int) -> None:
    states = [START, START, START]
    states[which] = START._replace(j4=value)
    with pytest.raises(InvalidArgumentError, match="finite"):
        StopGuard(ARM, WALL).check(states)
