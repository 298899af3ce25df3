"""The nearest pair of an arm, and its points."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from bioscara.api import messages as m
from bioscara.api.values import scene_value
from bioscara.dashboard.clearance import clearance
from bioscara.model.loading import load_parameters
from bioscara.planning.collision.nearest_points import nearest_points
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.collision.shapes import Prism, ShapeTable, distances
from bioscara.robot.workspace.workspace import Workspace

PARAMETERS = load_parameters()
SIZE, PLACE = st.floats(0.0, 0.3), st.floats(-0.5, 0.5)
PRISM = st.builds(
    lambda x, y, a, b, low, height, radius, yaw: Prism(x, y, a, b, low, low + height, radius, yaw),
    PLACE, PLACE, SIZE, SIZE, PLACE, SIZE, SIZE, st.floats(-3.0, 3.0),
)  # fmt: skip


def workspace(scene: Scene) -> m.WorkspaceState:
    space = Workspace.of(PARAMETERS)
    return m.WorkspaceState(
        revision=1,
        scene=scene_value(scene),
        table=space.table,
        tool=space.tool,
        reduced_speed=True,
        load=None,
        widths=space.widths,
    )


@given(PRISM, PRISM)
def test_nearest_points_are_as_far_apart_as_the_shapes(one: Prism, other: Prism) -> None:
    table = ShapeTable.of([0, 0], [one, other]).shapes
    (distance,) = distances(table.take([0]), table.take([1]))  # type: ignore[arg-type]
    first, second = nearest_points(one, other)
    assert math.dist(first, second) == pytest.approx(max(distance, 0.0), abs=1e-9)
    for shape, (x, y, z) in ((one, first), (other, second)):
        assert shape.low - 1e-12 <= z <= shape.high + 1e-12
        spot = Prism(x, y, 0.0, 0.0, shape.low, shape.low)
        pair = ShapeTable.of([0, 0], [shape, spot]).shapes
        assert distances(pair.take([0]), pair.take([1]))[0] <= 1e-9  # type: ignore[arg-type]


def test_the_clearance_names_the_pair_and_its_points() -> None:
    scene = Scene((Box("rack", (0.05, 0.30, 0.0), (0.15, 0.40, 0.4)),), margin=0.01)
    found = clearance(PARAMETERS, workspace(scene), (0.0, 0.2, 0.0, 0.0))
    assert found.other == "rack"
    assert found.margin == 0.01
    assert found.distance is not None
    assert found.link_point is not None
    assert found.other_point is not None
    assert math.dist(found.link_point, found.other_point) == pytest.approx(found.distance)


def test_above_a_table_its_nearest_point_is_below_the_link() -> None:
    found = clearance(PARAMETERS, workspace(Scene(table_height=0.0)), (0.0, 0.05, 0.0, 0.0))
    assert found.other == "table"
    assert found.link_point is not None
    assert found.other_point == (*found.link_point[:2], 0.0)
    assert found.link_point[2] == pytest.approx(found.distance)


def test_a_zone_to_stay_in_has_a_distance_and_no_points() -> None:
    cell = Box("cell", (-0.45, -0.45, -0.1), (0.45, 0.45, 1.0), keep_in=True)
    found = clearance(PARAMETERS, workspace(Scene((cell,))), (0.0, 0.2, 0.0, 0.0))
    assert (found.other, found.link_point, found.other_point) == ("cell", None, None)
    assert found.distance is not None


@pytest.mark.parametrize("joints", [(), (0.0, None, 0.0, 0.0)])
def test_where_a_position_is_unknown_the_clearance_is(joints: tuple[float | None, ...]) -> None:
    found = clearance(PARAMETERS, workspace(Scene()), joints)
    assert (found.distance, found.link, found.other) == (None, "", "")
