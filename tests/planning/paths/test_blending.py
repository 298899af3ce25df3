import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from bioscara.kinematics import Pose
from bioscara.kinematics.pose import wrapped
from bioscara.planning.paths.blending import rounded
from bioscara.planning.paths.segments import LEVER, Arc, Line
from laws import examples
from planning.paths.test_segments import apart, derivatives_agree, poses, sampled


@st.composite
def chains(draw):
    """Segments from pose to pose, lines and arcs, with the radii of their corners."""
    here, segments = draw(poses), []
    for _ in range(draw(st.integers(1, 4))):
        goal = draw(poses)
        assume(apart(here, goal) > 1e-2)
        via = draw(st.none() | poses)
        if via is None:
            segment = Line(here, goal)
        else:
            a, b = np.subtract(via, here)[:3], np.subtract(goal, here)[:3]
            assume(np.linalg.norm(np.cross(a, b)) / np.linalg.norm(b) > 1e-2)
            segment = Arc.through(here, via, goal)
        segments.append(segment)
        here = goal._replace(yaw=here.yaw + wrapped(goal.yaw - here.yaw))
    radii = draw(
        st.lists(st.floats(1e-4, 0.5), min_size=len(segments) - 1, max_size=len(segments) - 1)
    )
    return segments, radii


@given(chains())
@settings(max_examples=examples(80), deadline=None)
def test_a_rounded_path_is_smooth_and_stays_near_its_corners(chain):
    segments, radii = chain
    path, fitted, corners = rounded(segments, radii)
    for before, after in pairwise(path.segments):
        last, following = before.sample([before.length]), after.sample([0.0])
        for one, other in zip(last, following, strict=True):
            assert np.allclose(one, other, rtol=1e-6, atol=1e-9 * max(1.0, np.abs(one).max()))
    for index, (radius, corner) in enumerate(zip(fitted, corners, strict=True)):
        pose = segments[index + 1].sample([0.0]).poses[0]
        near = path.sample(np.linspace(corner - radius, corner + radius, 201)).poses
        assert np.linalg.norm(near[:, :3] - pose[:3], axis=1).max() <= radius + 1e-9
        assert np.abs(near[:, 3] - pose[3]).max() <= radius / LEVER + 1e-9
    assert np.allclose(sampled(path).poses[0], segments[0].sample([0.0]).poses[0])
    assert np.allclose(sampled(path).poses[-1], segments[-1].sample([segments[-1].length]).poses[0])
    assert path.length == pytest.approx(sum(segment.length for segment in segments))


@given(chains())
@settings(max_examples=100, deadline=None)
def test_radii_are_kept_where_they_fit_and_half_a_segment_where_not(chain):
    segments, radii = chain
    for index, (asked, got) in enumerate(zip(radii, rounded(segments, radii).radii, strict=True)):
        half = min(segments[index].length, segments[index + 1].length) / 2
        assert got == min(asked, half)


@given(st.floats(0.0, math.pi), st.floats(1e-3, 0.04))
def test_between_lines_the_tool_is_never_faster_than_on_them(angle, radius):
    corner = Pose(0.4, 0.0, 0.2)
    goal = Pose(0.4 + 0.1 * math.cos(angle), 0.1 * math.sin(angle), 0.2)
    path, _, (middle,) = rounded((Line(Pose(0.3, 0.0, 0.2), corner), Line(corner, goal)), (radius,))
    _, first, second = sampled(path, 501)
    assert np.linalg.norm(first[:, :3], axis=1).max() <= 1.0 + 1e-9
    # The smooth step is steepest at its middle: 3/4 of the change of direction per radius.
    assert np.linalg.norm(second[:, :3], axis=1).max() <= 1.5 * math.sin(angle / 2) / radius + 1e-6
    at_middle = path.sample([middle]).poses[0, :3]
    assert math.dist(at_middle, corner[:3]) == pytest.approx(
        3 / 8 * radius * math.sin(angle / 2), abs=1e-9
    )
    derivatives_agree(path)


def test_blends_that_meet_in_the_middle_of_a_segment_leave_nothing_of_it():
    a, b, c, d = (Pose(x, y, 0.2) for x, y in ((0.3, 0.0), (0.4, 0.0), (0.4, 0.1), (0.3, 0.1)))
    path, radii, _ = rounded((Line(a, b), Line(b, c), Line(c, d)), (0.5, 0.5))
    assert radii == pytest.approx((0.05, 0.05))
    assert path.breaks == pytest.approx((0.05, 0.15, 0.25))
