"""The bodies of the arm against its meshes: positions, sizes, and verdicts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

pytest.importorskip("pinocchio", reason="pip install pin: the independent oracle")

import coal

from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.model import load_parameters
from bioscara.model.stl import read_stl
from bioscara.planning.collision.arm_bodies import GRIPPER, WIDTHS, arm_of, frames
from bioscara.planning.collision.margins import OWN_MARGIN
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.shapes import Prism
from planning.limits import LIMITS
from planning.meshes import LINKS, NAMES, gaps, parts_of, places
from planning.scenes import ARM, COUNT, random_joints
from visual_meshes import visual_meshes

Array = npt.NDArray[np.float64]
FIT = 5e-3
"""Largest excess of a body beyond the mesh that it stands for [m]."""
WITHIN = 0.05
"""Distances up to this are compared [m]."""
TOUCH = 1e-6
"""The meshes are rounded to this [m]: so far apart bodies may be whose meshes just touch."""


def placed(link: str, joints: Sequence[float], width: float) -> list[tuple[Prism, Array, Array]]:
    """Return the shapes of a link, with rotation and origin of their frames in the base."""
    x, y, z, cos, sin = (column[:, 0] for column in frames(ARM, np.array([joints])))
    side = {"left_jaw_link": 1.0, "right_jaw_link": -1.0}.get(link)
    bodies = arm_of(ARM.geometry, ARM.tool, GRIPPER, (width, width))
    jaws = [body for body in bodies if body.link == "jaws"]
    own = [body for body in bodies if body.link == NAMES.get(link, link)]
    if side is not None:
        own = jaws[: len(jaws) // 2] if side > 0.0 else jaws[len(jaws) // 2 :]
    return [
        (
            shape,
            np.array(((cos[i], -sin[i], 0.0), (sin[i], cos[i], 0.0), (0.0, 0.0, 1.0))),
            np.array((x[i], y[i], z[i])),
        )
        for body in own
        for i in (body.frame,)
        for shape in body.shapes
    ]


def seen(link: str) -> Array:
    """Return points of all triangles that are seen of a link, in its frame, (n, 3)."""
    triangles = np.concatenate([read_stl(path.read_bytes()) for path in visual_meshes(link)])
    weights = np.array([(a, b, 6 - a - b) for a in range(7) for b in range(7 - a)]) / 6.0
    points: Array = np.einsum("wc,tcx->twx", weights, triangles).reshape(-1, 3)
    return points


def border(shape: Prism) -> Array:
    """Return points of the surface of a shape, (n, 3)."""
    outline = shape.outline()
    heights = np.linspace(shape.low, shape.high, 8)
    sides = [np.column_stack((outline, np.full(len(outline), z))) for z in heights]
    centre = np.array((shape.x, shape.y))
    ends = [
        np.column_stack((centre + share * (outline - centre), np.full(len(outline), z)))
        for z in (shape.low, shape.high)
        for share in (0.0, 0.4, 0.8)
    ]
    return np.concatenate((*sides, *ends))


@pytest.mark.parametrize("link", LINKS)
def test_the_bodies_of_a_link_contain_it_and_are_hardly_larger(link: str) -> None:
    rng = np.random.default_rng(3)
    joints, width = random_joints(rng), float(rng.uniform(*WIDTHS))
    at = places(joints, width)[link]
    points = seen(link) @ at.rotation.T + at.translation
    inside = np.zeros(len(points), dtype=np.bool_)
    parts = [(part, coal.Transform3s(at.rotation, at.translation)) for part in parts_of(link)]
    shapes = placed(link, joints, width)
    assert shapes
    for shape, turn, origin in shapes:
        own = (points - origin) @ turn
        heights = (shape.low - 2e-6 <= own[:, 2]) & (own[:, 2] <= shape.high + 2e-6)
        wider = Prism(
            shape.x, shape.y, shape.half_x, shape.half_y, 0.0, 0.0, shape.radius + 3e-6, shape.yaw
        )
        inside |= heights & wider.covers(own[:, :2])
        for point in border(shape) @ turn.T + origin:
            assert distance(point, parts) < FIT
    assert inside.all()


def distance(point: Array, parts: list[tuple[Any, Any]]) -> float:
    """Return the distance of a point from the nearest of some parts [m]."""
    ball, request, place = coal.Sphere(1e-7), coal.DistanceRequest(), coal.Transform3s()
    place.setTranslation(point)
    return min(
        coal.distance(ball, place, part, at, request, coal.DistanceResult()) for part, at in parts
    )


def test_the_whole_range_of_widths_is_that_of_the_parameters() -> None:
    jaws = load_parameters().gripper
    assert (jaws.lower, jaws.upper) == WIDTHS


def near_itself(rng: np.random.Generator) -> list[float]:
    """Return random joints, mostly with the elbow bent far, where the arm may touch itself."""
    joints = list(random_joints(rng))
    if rng.random() < 0.8:
        joints[2] = float(rng.choice((-1.0, 1.0)) * rng.uniform(2.0, LIMITS[2].upper))
    if rng.random() < 0.3:
        joints[1] = float(rng.uniform(LIMITS[1].lower, 0.1))
    return joints


def random_load(rng: np.random.Generator) -> Prism | None:
    if rng.random() < 0.5:
        return None
    half_x, half_y = rng.uniform(0.005, 0.07, 2).tolist()
    low, high = sorted(rng.uniform(-0.25, 0.1, 2).tolist())
    return Prism(0.119, 0.0, half_x, half_y, low, high + 1e-3, 0.0, float(rng.uniform(-1.5, 1.5)))


def test_the_verdict_agrees_with_dense_samples() -> None:
    """Against the exact meshes: poses in which they touch are refused, free ones pass."""
    rng = np.random.default_rng(6)
    touched = free = 0
    for _ in range(4 * COUNT):
        joints, load = near_itself(rng), random_load(rng)
        low, high = sorted(rng.uniform(*WIDTHS, 2).tolist())
        width = float(rng.uniform(low, high))
        scene = Scene(widths=(width, width) if rng.random() < 0.5 else (low, high))
        if load is not None:
            scene = scene.carrying(load)
        exact = gaps(joints, width, load)
        layout = scene.layout(ARM)
        judged = layout.clearances(ARM, np.array([joints]))[:, 0]
        about = f"{joints}, {low} {width} {high}, {load}: {exact}"
        if min(exact.values()) <= 0.0:
            touched += 1
            assert judged.min() < OWN_MARGIN, about
        # One by one: a pair without an entry here never touches, for any joints.
        for pair, gap in exact.items():
            own = [
                float(value)
                for value, each in zip(judged, layout.pairs, strict=True)
                if {each.link, each.zone} == set(pair)
            ]
            if gap <= 0.0:
                assert own, about
                assert min(own) <= TOUCH, about
            elif own and scene.widths[0] == scene.widths[1] and gap < WITHIN:
                assert min(own) >= gap - FIT, about
        free += judged.min() >= OWN_MARGIN
    assert touched > 0.05 * COUNT
    assert free > 0.05 * COUNT


def test_the_bodies_follow_the_geometry() -> None:
    """The bars of an arm with other lengths are as long, and at its joints."""
    for upper, fore in ((0.25, 0.285), (0.4, 0.2)):
        arm = Scara(Geometry(upper, fore, 0.135), LIMITS, Pose(0.11908, 0.0, -0.14409))
        bodies = arm_of(arm.geometry, arm.tool, GRIPPER, WIDTHS)
        for link, length in (("link_2", upper), ("link_3", fore)):
            ends = [
                shape.x + shape.half_x
                for body in bodies
                if body.link == link
                for shape in body.shapes
            ]
            assert max(ends) == pytest.approx(length, abs=1e-12)


def test_from_home_the_arm_is_clear_of_itself_at_all_widths() -> None:
    homed = [joint.home_position for joint in LIMITS]
    for width in np.linspace(*WIDTHS, 9).tolist():
        clearance = float(Scene(widths=(width, width)).clearance(ARM, [homed])[0])
        exact = gaps(homed, width)
        assert clearance == pytest.approx(exact["link_1", "gripper"], abs=1e-3)
        assert clearance > 0.014
    assert Scene().clearance(ARM, [homed])[0] > 0.014
    assert math.isclose(Scene(margin=0.05).clearance(ARM, [homed])[0] - clearance, 0.045)
