"""Poses of work frames and of the places of grids are those of the geometry."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given, strategies as st

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.robot.workspace.frames import APART, TILT_MAX, Frame

PLACES, ANGLES = st.floats(-0.5, 0.5), st.floats(-math.pi, math.pi)
POSES = st.builds(Pose, PLACES, PLACES, PLACES, ANGLES)
BENCH = Frame("bench", Pose(0.3, -0.1, 0.02, math.pi / 2))


def same(one: Pose, other: Pose, within: float = 1e-9) -> bool:
    turned = math.remainder(one.yaw - other.yaw, 2.0 * math.pi)
    return math.dist(one[:3], other[:3]) < within and abs(turned) < within


@given(POSES, POSES)
def test_a_pose_in_a_frame_is_composed_in_the_base(frame: Pose, pose: Pose) -> None:
    made = Frame("bench", frame)
    there = made.pose(*pose)
    assert same(made.compose(pose), there)
    # Back by the inverse of the frame, which is another formula.
    assert same(frame.inverse().compose(there), pose)
    assert -math.pi < there.yaw <= math.pi


def test_x_of_a_turned_frame_is_y_of_the_base() -> None:
    assert same(BENCH.pose(0.1, 0.05, 0.01, 0.2), Pose(0.25, 0.0, 0.03, math.pi / 2 + 0.2))


@given(POSES, st.floats(APART, 0.5), st.floats(-0.5, 0.5), st.floats(APART, 0.5), ANGLES)
def test_a_frame_is_found_from_three_of_its_points(
    pose: Pose, x: float, along: float, y: float, yaw: float
) -> None:
    frame = Frame("bench", pose)
    points = frame.pose(0.0, 0.0), frame.pose(x * 1.01, 0.0, 0.0, yaw), frame.pose(along, y * 1.01)
    found = Frame.from_points("bench", *points)
    assert found.name == "bench"
    assert same(found.pose_frame_in_base, pose)


@given(POSES, st.floats(APART * 1.01, 0.5), ANGLES, st.floats(-0.3, 0.3), ANGLES)
def test_the_frame_of_two_points_takes_its_origin_and_x_axis_through_them(
    origin: Pose, distance: float, direction: float, rise: float, yaw: float
) -> None:
    ahead, left = distance * math.cos(direction), distance * math.sin(direction)
    on_x = Pose(origin.x + ahead, origin.y + left, origin.z + rise, yaw)
    frame = Frame.from_points("bench", origin, on_x)
    assert math.dist(frame.pose(0.0, 0.0, 0.0)[:3], origin[:3]) < 1e-12
    # The second point, at the height of the first.
    assert math.dist(frame.pose(distance, 0.0, 0.0)[:3], (*on_x[:2], origin.z)) < 1e-9
    assert abs(math.remainder(frame.pose_frame_in_base.yaw - direction, 2 * math.pi)) < 1e-9


@given(POSES, st.floats(0.0, APART * 0.99), ANGLES, st.floats(-0.3, 0.3))
def test_two_points_too_near_for_a_direction_are_refused(
    origin: Pose, distance: float, direction: float, rise: float
) -> None:
    ahead, left = distance * math.cos(direction), distance * math.sin(direction)
    on_x = Pose(origin.x + ahead, origin.y + left, origin.z + rise)
    with pytest.raises(InvalidArgumentError) as told:
        Frame.from_points("bench", origin, on_x)
    assert str(told.value) == (
        f"frame bench: on_x is {1e3 * math.hypot(on_x.x - origin.x, on_x.y - origin.y):.1f} mm "
        "from the first point in plan view; teach points at least 20 mm apart"
    )


@given(
    POSES, st.floats(0.05, 0.5), st.floats(0.05, 0.5), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)
)
def test_a_tilted_plane_is_refused_with_its_tilt(
    pose: Pose, x: float, y: float, up_x: float, up_y: float
) -> None:
    """Of a plane whose slopes along its axes are given, the tilt is that of its gradient."""
    frame = Frame("bench", pose)
    tilt = math.atan(math.hypot(up_x, up_y))
    assume(abs(tilt - TILT_MAX) > 1e-6)
    points = frame.pose(0.0, 0.0), frame.pose(x, 0.0, up_x * x), frame.pose(0.0, y, up_y * y)
    if tilt < TILT_MAX:
        assert same(Frame.from_points("bench", *points).pose_frame_in_base, pose)
        return
    with pytest.raises(
        InvalidArgumentError, match=r"frame bench: .* tilted by (\S+) degrees"
    ) as told:
        Frame.from_points("bench", *points)
    assert f"tilted by {math.degrees(tilt):.2f} degrees" in str(told.value)


@pytest.mark.parametrize(
    ("on_x", "on_plane", "complaint"),
    [
        (Pose(0.3, 0.1, 0.0), Pose(0.3, 0.3, 0.0), r"on_x is 0\.0 mm from the first p"),
        (Pose(0.3, 0.1, 0.2), Pose(0.3, 0.3, 0.0), r"on_x is 0\.0 mm from the first p"),
        (Pose(0.5, 0.1, 0.0), Pose(0.4, 0.11, 0.0), r"on_plane is 10\.0 mm from the line"),
        (Pose(0.5, 0.1, 0.0), Pose(0.4, 0.0, 0.0), "on_plane is 100 mm to the right of the x axis"),
        ((0.5, 0.1, 0.0), Pose(0.4, 0.3, 0.0), r"on_x is \(0\.5.*give Pose"),
        (Pose(0.5, 0.1, 0.0), Pose(0.4, math.nan, 0.0), "y of frame bench, on_plane is nan"),
        (Pose(500.0, 0.1, 0.0), Pose(0.4, 0.3, 0.0), "are these millimetres"),
    ],
)
def test_points_that_give_no_frame_are_refused(on_x: Pose, on_plane: Pose, complaint: str) -> None:
    with pytest.raises(InvalidArgumentError, match=complaint):
        Frame.from_points("bench", Pose(0.3, 0.1, 0.0), on_x, on_plane)


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ((100.0, 0.0), r"frame bench, x: 100 m .* millimetres"),
        ((0.1, 0.0, math.nan), "frame bench, z is nan"),
        ((0.1, 0.0, 0.0, 90.0), r"frame bench, yaw: 90 rad .* degrees"),
        (("0.1", 0.0), "give a number"),
    ],
)
def test_values_of_another_unit_are_refused(values: tuple[float, ...], complaint: str) -> None:
    with pytest.raises(InvalidArgumentError, match=complaint):
        BENCH.pose(*values)
    with pytest.raises(InvalidArgumentError, match=complaint):
        BENCH.compose(Pose(*(*values, 0.0, 0.0)[:4]))


def test_a_frame_has_a_name_and_a_pose() -> None:
    with pytest.raises(InvalidArgumentError, match="frame name '3': a name begins with a letter"):
        Frame("3", Pose(0.0, 0.0, 0.0))
    with pytest.raises(InvalidArgumentError, match=r"frame bench is \(0, 0, 0\); give Pose"):
        Frame("bench", (0, 0, 0))
    with pytest.raises(InvalidArgumentError, match=r"give Pose\(x, y, z, yaw\)"):
        BENCH.compose((0.1, 0.0, 0.0, 0.0))
