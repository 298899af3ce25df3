"""Mass properties against their textbook formulas."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st
from tools.meshes import doubled_areas, filled, shell, triangles, weigh

from bioscara.model.solids import box, capsule, cylinder, prism

lengths = st.floats(0.01, 0.5)
places = st.floats(-0.5, 0.5)


@given(lengths, lengths, lengths, places, places, places)
def test_a_box_has_the_inertia_of_a_box(
    a: float, b: float, c: float, x: float, y: float, z: float
) -> None:
    mass, centre, inertia = weigh([filled(box((x, y, z), (x + a, y + b, z + c)), 1000.0)])
    assert mass == pytest.approx(1000.0 * a * b * c)
    assert centre == pytest.approx((x + a / 2, y + b / 2, z + c / 2), abs=1e-9)
    expected = mass / 12 * np.diag((b * b + c * c, a * a + c * c, a * a + b * b))
    assert inertia == pytest.approx(expected, abs=1e-9 * max(mass, 1.0))


@given(lengths, lengths, lengths)
def test_a_shell_is_the_difference_of_two_boxes_for_thin_walls(
    a: float, b: float, c: float
) -> None:
    wall = 1e-5
    thin = weigh([shell(box((-a, -b, -c), (a, b, c)), 1000.0, wall)])
    half = wall / 2
    outer = filled(box((-a - half, -b - half, -c - half), (a + half, b + half, c + half)), 1000.0)
    inner = filled(box((-a + half, -b + half, -c + half), (a - half, b - half, c - half)), -1000.0)
    hollow = weigh([outer, inner])
    assert thin.mass == pytest.approx(hollow.mass, rel=5e-3)
    assert thin.inertia == pytest.approx(hollow.inertia, rel=1e-2, abs=1e-9)


def test_a_shell_is_never_heavier_than_the_solid() -> None:
    plate = box((0, 0, 0), (0.1, 0.1, 0.002))
    assert shell(plate, 1240.0, 0.004).mass == filled(plate, 1240.0).mass


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_every_solid_is_closed_and_faces_outwards(axis: str) -> None:
    outline = ((0.0, 0.0), (0.2, 0.0), (0.1, 0.3))
    for solid, volume in (
        (prism(outline, -0.1, 0.4, axis), 0.03 * 0.5),
        (cylinder((0.1, 0.2), 0.05, 0.0, 0.3, axis), np.pi * 0.05**2 * 0.3),
        (capsule(0.1, 0.3, 0.05, 0.0, 0.3), (np.pi * 0.05**2 + 0.02) * 0.3),
    ):
        assert doubled_areas(triangles(solid)).sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
        assert filled(solid, 1.0).mass == pytest.approx(volume, rel=0.01)
