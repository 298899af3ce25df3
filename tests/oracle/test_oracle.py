"""The judge itself: the pairs it checks, the hits it finds, and which links can meet at all."""

from __future__ import annotations

import itertools
from collections import defaultdict

import numpy as np
import pinocchio as pin
import pytest
from tools.meshes import triangles

from bioscara.model import load_parameters
from bioscara.model.parts import drawing
from bioscara.model.stl import read_stl
from bioscara.model.urdf import DESCRIPTION, URDF
from oracle.oracle import HAND, JOINED, LINKS, Oracle, load, solids
from oracle.plant import CARRYING, ELBOW, LOWER, UPPER
from oracle.solids import bulge, solid, split, volume
from visual_meshes import visual_meshes

JAWS = load_parameters().gripper
HOME = (-3.04568, 0.33792, 2.62565, 3.00842)
SINCE_HOME = (-2.9065, 0.3267, 2.4011, 1.1802)
"""A place to which the joints, moving together from home, lead a jaw through the column."""


def test_the_meshes_come_apart_into_the_convex_parts_of_the_drawing() -> None:
    drawn = {link.name: link for link in drawing(load_parameters().geometry)}
    assert {part.link for part in solids()} == set(LINKS) == set(drawn)
    for name, link in drawn.items():
        surfaces = [
            surface
            for path in visual_meshes(name)
            for surface in split(read_stl(path.read_bytes()))
        ]
        assert len(surfaces) == len(link.parts)
        assert max(bulge(surface) for surface in surfaces) < 5e-6
        expected = sum(volume(triangles(part.solid)) for part in link.parts)
        assert sum(map(volume, surfaces)) == pytest.approx(expected, rel=1e-3)


def test_a_mesh_that_is_open_is_refused() -> None:
    mesh = read_stl((DESCRIPTION / "meshes/visual/link_3_printed.stl").read_bytes())
    with pytest.raises(ValueError, match="closed"):
        split(mesh[:-1])


def test_a_solid_inside_a_solid_is_a_hit() -> None:
    """The surfaces of the meshes do not cross there."""
    small = [[x, y, z] for x in (0.1, 0.11) for y in (0.0, 0.01) for z in (0.12, 0.13)]
    hidden = Oracle([load(small)], pairs=[("link_3", "load")])
    # At the wrist turned back, the load is inside the bar of the forearm.
    (hit,) = hidden.hits([(0.0, 0.2, 0.0, 3.0)], 0.08)
    assert hit.links == ("link_3", "load")
    assert hit.distance < -5e-3


def test_boxes_leave_nothing_out() -> None:
    """Against every pair of solids, checked one by one by pinocchio's own geometry."""
    model = pin.buildModelFromUrdf(str(URDF))
    bodies, parts = pin.GeometryModel(), solids()
    for number, part in enumerate(parts):
        frame = model.getFrameId(part.link)
        bodies.addGeometryObject(
            pin.GeometryObject(
                f"{number}",
                model.frames[frame].parentJoint,
                frame,
                model.frames[frame].placement,
                solid(part.link, part.corners).shape,
            )
        )
    judge, rng = Oracle(), np.random.default_rng(3)
    for i, k in itertools.combinations(range(len(parts)), 2):
        if frozenset((parts[i].link, parts[k].link)) not in JOINED and (
            parts[i].link != parts[k].link
        ):
            bodies.addCollisionPair(pin.CollisionPair(i, k))
    data, found = model.createData(), bodies.createData()
    joints = rng.uniform(LOWER, UPPER, (300, 4))
    joints[:, 2] = rng.choice((-1.0, 1.0), 300) * rng.uniform(1.8, UPPER[2], 300)
    widths = rng.uniform(JAWS.lower, JAWS.upper, 300)
    expected = set()
    for row, (arm, width) in enumerate(zip(joints, widths, strict=True)):
        q = np.empty(model.nq)
        values = (*arm, width, 0.5 * width, -0.5 * width)
        names = ("j1", "j2", "j3", "j4", "gripper", "gripper_l_mimic", "gripper_r_mimic")
        for name, value in zip(names, values, strict=True):
            q[model.joints[model.getJointId(name)].idx_q] = value
        pin.computeDistances(model, data, bodies, found, q)
        for pair, result in zip(bodies.collisionPairs, found.distanceResults, strict=True):
            if result.min_distance < -1e-6:
                links = parts[pair.first].link, parts[pair.second].link
                expected.add((row, frozenset(links)))
    hits = {(hit.row, frozenset(hit.links)) for hit in judge.hits(joints, widths)}
    assert len(expected) > 20
    assert hits == expected


def test_the_defect_that_it_was_made_for() -> None:
    """Together from home the joints lead a jaw 14 mm into the column, at ends that are free."""
    judge = Oracle()
    way = np.linspace(HOME, SINCE_HOME, 400)
    for width in (0.04, 0.08, 0.112):
        hit = min(judge.hits(way, width), key=lambda each: each.distance)
        assert hit.links[0] == "link_1"
        assert hit.links[1] in HAND
        assert hit.distance < -6e-3
        assert not judge.colliding(way[[0, -1]], width).any()


def test_only_the_hand_can_meet_the_arm_and_only_base_and_column() -> None:
    """The six pairs that the SRDF leaves enabled, at every width, are all that there are."""
    rng, count = np.random.default_rng(1), 20_000
    joints = rng.uniform(LOWER, UPPER, (count, 4))
    widths = rng.uniform(JAWS.lower, JAWS.upper, count)
    met = defaultdict(list)
    for hit in Oracle().hits(joints, widths):
        met[hit.links].append(hit.row)
    assert set(met) == set(itertools.product(("base_link", "link_1"), HAND))
    for rows in met.values():
        assert widths[rows].min() < JAWS.lower + 0.01
        assert widths[rows].max() > JAWS.upper - 0.01


def test_an_open_elbow_is_clear_of_everything() -> None:
    rng, count = np.random.default_rng(2), 20_000
    joints = rng.uniform(LOWER, UPPER, (count, 4))
    for judge, elbow in ((Oracle(), np.pi / 2.0), (CARRYING, ELBOW)):
        joints[:, 2] = rng.choice((-1.0, 1.0), count) * rng.uniform(elbow - 0.3, elbow, count)
        widths = rng.uniform(JAWS.lower, JAWS.upper, count)
        assert not judge.colliding(joints, widths).any()


def test_home_is_free_at_every_width() -> None:
    widths = np.linspace(JAWS.lower, JAWS.upper, 81)
    judge = Oracle(pairs=[(one, other) for one in LINKS[:2] for other in LINKS[3:]])
    clear = judge.clearances([HOME] * len(widths), widths, 0.03)
    assert clear.min() == pytest.approx(15.0e-3, abs=0.1e-3)
