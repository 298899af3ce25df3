"""What is left out of a look is too far apart to matter on the way."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bioscara.planning.bodies import WRIST, Body, frames, moving, reaches
from bioscara.planning.layout import Layout
from bioscara.planning.nearby import Nearby
from bioscara.planning.shapes import Prism
from bioscara.planning.zones import Scene
from planning.scenes import ARM, random_joints, random_scene

SEEDS = st.integers(0, 2**32 - 1)


def nearest(layout: Layout, ways: np.ndarray) -> np.ndarray:
    return layout.clearances(ARM, ways).min(axis=0, initial=np.inf)


@given(SEEDS)
@settings(max_examples=30)
def test_what_is_left_out_keeps_the_margin_on_the_way(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene = random_scene(rng)
    for layout in scene.layouts(ARM):
        nearby, here = Nearby(ARM, layout, scene.margin), np.array(random_joints(rng))
        heading = rng.normal(size=4) * [1.0, 0.0, 1.0, 1.0]
        for _ in range(40):
            turns = (heading + rng.normal(size=(6, 4))) * 2e-3
            ways = here + np.cumsum(np.concatenate((np.zeros((1, 4)), turns)), axis=0)
            near = nearby.on(here, float((np.abs(turns) @ layout.reach).sum()))
            kept = scene.margin if near is None else nearest(near, ways)
            gap = np.minimum(kept, scene.margin) - np.minimum(nearest(layout, ways), scene.margin)
            assert np.abs(gap).max() < 1e-12
            here = ways[-1]


@given(SEEDS)
@settings(max_examples=30)
def test_no_point_of_the_arm_goes_further_than_its_reach(seed: int) -> None:
    rng = np.random.default_rng(seed)
    load = Prism(
        *rng.uniform(-0.1, 0.1, 2), *rng.uniform(0.0, 0.2, 2), -0.1, 0.0, 0.01, rng.uniform(-3, 3)
    )
    bodies = moving(ARM.geometry, ARM.tool, (Body("load", WRIST, load),))
    joints = np.array([random_joints(rng) for _ in range(20)])
    turns = 1e-5 * rng.choice([-1.0, 0.0, 1.0], size=(20, 4))
    ways = []
    for body in bodies:
        x, y = body.shape.outline().T
        corners = []
        for q in (joints, joints + turns):
            at = [column[body.frame][:, None] for column in frames(ARM, q)]
            x0, y0, z0, cos, sin = at
            corners.append(
                np.stack(np.broadcast_arrays(x0 + cos * x - sin * y, y0 + sin * x + cos * y, z0))
            )
        ways.append(np.linalg.norm(corners[1] - corners[0], axis=0).max(axis=1))
    assert (np.max(ways, axis=0) <= np.abs(turns) @ reaches(ARM.geometry, bodies) + 1e-13).all()


@given(SEEDS)
@settings(max_examples=30)
def test_some_pairs_are_as_far_apart_as_among_all(seed: int) -> None:
    rng = np.random.default_rng(seed)
    joints = np.array([random_joints(rng) for _ in range(int(rng.choice([3, 700])))])
    for layout in random_scene(rng).layouts(ARM):
        some = np.flatnonzero(rng.random(len(layout.pairs)) < 0.3)
        part = layout.only(some)
        assert part.pairs == tuple(layout.pairs[row] for row in some)
        whole = layout.clearances(ARM, joints, np.inf)[some]
        assert part.clearances(ARM, joints, np.inf) == pytest.approx(whole, abs=1e-12)


def test_in_an_empty_scene_nothing_is_near() -> None:
    around, itself = Scene().layouts(ARM)
    stretched = np.array((0.0, 0.2, 0.0, 0.0))
    assert Nearby(ARM, around, 5e-3).on(stretched, 1.0) is None
    assert Nearby(ARM, itself, 5e-3).on(stretched, 0.1) is None
