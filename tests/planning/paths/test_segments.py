import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.planning.paths.segments import LEVER, Arc, Joined, Line, Path

lengths = st.floats(-0.6, 0.6)
poses = st.builds(Pose, lengths, lengths, st.floats(0.0, 0.4), st.floats(-4.0, 4.0))


def apart(a: Pose, b: Pose) -> float:
    return math.dist(a[:3], b[:3])


def sampled(path: Path, count: int = 41):
    return path.sample(np.linspace(0.0, path.length, count))


def derivatives_agree(path: Path) -> None:
    """First and second derivative are those of the poses."""
    step = 1e-5 * path.length
    s = np.linspace(2 * step, path.length - 2 * step, 37)
    s = s[[all(abs(at - b) > 2 * step for b in path.breaks) for at in s]]
    here, after, before = path.sample(s), path.sample(s + step), path.sample(s - step)
    scale = 1.0 + np.abs(here.second).max()
    assert np.allclose((after.poses - before.poses) / (2 * step), here.first, atol=1e-6 * scale)
    assert np.allclose((after.first - before.first) / (2 * step), here.second, atol=1e-4 * scale**2)


def arc_of(start: Pose, via: Pose, goal: Pose) -> Arc:
    assume(apart(start, goal) > 1e-3)
    a, b = np.subtract(via, start)[:3], np.subtract(goal, start)[:3]
    assume(np.linalg.norm(np.cross(a, b)) / np.linalg.norm(b) > 1e-3)
    return Arc.through(start, via, goal)


@given(poses, poses)
def test_a_line_is_straight_and_even(start, goal):
    assume(apart(start, goal) > 1e-4)
    line = Line(start, goal)
    turn = math.remainder(goal.yaw - start.yaw, 2 * math.pi)
    assert line.length == pytest.approx(max(apart(start, goal), LEVER * abs(turn)))
    poses, first, second = sampled(line)
    assert np.allclose(poses[0], start, atol=1e-12)
    assert np.allclose(poses[-1, :3], goal[:3], atol=1e-12)
    assert math.cos(poses[-1, 3] - goal.yaw) == pytest.approx(1.0)
    assert abs(poses[-1, 3] - poses[0, 3]) <= math.pi + 1e-9
    assert (np.linalg.norm(first[:, :3], axis=1) <= 1.0 + 1e-9).all()
    assert (np.abs(first[:, 3]) <= 1.0 / LEVER + 1e-9).all()
    assert not second.any()
    derivatives_agree(line)


@given(poses, poses, poses)
def test_an_arc_stays_on_its_circle_and_passes_its_points(start, via, goal):
    arc = arc_of(start, via, goal)
    poses, first, second = sampled(arc, 201)
    assert np.allclose(poses[0], start, atol=1e-9)
    assert np.allclose(poses[-1, :3], goal[:3], atol=1e-9)
    tolerance = 1e-9 * (1 + arc.radius)
    assert np.allclose(np.linalg.norm(poses[:, :3] - arc.centre, axis=1), arc.radius, tolerance)
    plane = np.cross(np.subtract(via, start)[:3], np.subtract(goal, start)[:3])
    plane /= np.linalg.norm(plane)
    assert np.allclose((poses[:, :3] - start[:3]) @ plane, 0.0, atol=tolerance)
    # The via point is as close to some sample as samples are to each other.
    step = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1).max()
    assert np.linalg.norm(poses[:, :3] - via[:3], axis=1).min() <= step
    speed = np.linalg.norm(first[:, :3], axis=1)
    assert np.allclose(speed, speed[0])
    assert speed[0] <= 1.0 + 1e-9
    assert np.allclose(np.linalg.norm(second[:, :3], axis=1) / speed**2, 1.0 / arc.radius)
    assert np.ptp(first[:, 3]) == 0.0
    derivatives_agree(arc)


def test_a_known_half_circle():
    arc = Arc.through(Pose(0.3, 0.1, 0.2), Pose(0.4, 0.0, 0.2), Pose(0.3, -0.1, 0.2, 0.5))
    assert arc.length == pytest.approx(math.pi * 0.1)
    assert np.allclose(arc.centre, (0.3, 0.0, 0.2))
    assert np.allclose(sampled(arc, 3).poses[1], (0.4, 0.0, 0.2, 0.25))


def test_an_arc_on_which_the_tool_turns_much_is_as_long_as_the_turn():
    arc = Arc.through(
        Pose(0.3, 0.01, 0.2), Pose(0.31, 0.0, 0.2, 9.0), Pose(0.3, -0.01, 0.2, math.pi - 0.1)
    )
    assert arc.length == pytest.approx((math.pi - 0.1) * LEVER)
    assert sampled(arc, 3).poses[1] == pytest.approx((0.31, 0.0, 0.2, (math.pi - 0.1) / 2))


def test_the_tool_can_turn_on_the_spot():
    line = Line(Pose(0.3, 0.1, 0.2, 0.0), Pose(0.3, 0.1, 0.2, -1.5))
    assert line.length == pytest.approx(1.5 * LEVER)
    assert np.allclose(sampled(line, 3).poses[:, 3], (0.0, -0.75, -1.5))


def test_the_shorter_turn_is_taken_across_the_half_circle():
    poses = sampled(Line(Pose(0.3, 0.1, 0.2, 3.0), Pose(0.4, 0.1, 0.2, -3.0))).poses
    assert poses[-1, 3] == pytest.approx(2 * math.pi - 3.0)


@given(poses, poses, poses, st.floats(0.0, 0.4), st.floats(0.6, 1.0))
def test_parts_joined_again_are_the_whole(start, via, goal, begin, end):
    arc = arc_of(start, via, goal)
    cuts = [0.0, begin * arc.length, end * arc.length, arc.length]
    parts = [arc.part(a, b) for a, b in itertools.pairwise(cuts) if b > a]
    joined = Joined(parts)
    assert joined.length == pytest.approx(arc.length)
    assert joined.breaks == pytest.approx(np.cumsum([part.length for part in parts])[:-1])
    for one, other in zip(sampled(joined), sampled(arc), strict=True):
        assert np.allclose(one, other, atol=1e-9 * (1 + np.abs(other).max()))


def test_a_seam_of_line_and_arc_is_a_break():
    line = Line(Pose(0.3, -0.1, 0.2), Pose(0.3, 0.0, 0.2))
    arc = Arc.through(Pose(0.3, 0.0, 0.2), Pose(0.2, 0.1, 0.2), Pose(0.1, 0.0, 0.2))
    joined = Joined((line, arc))
    assert joined.breaks == (pytest.approx(0.1),)
    assert joined.length == pytest.approx(0.1 + 0.1 * math.pi)
    derivatives_agree(joined)


def test_segments_that_do_not_follow_each_other_are_refused():
    first = Line(Pose(0.3, 0.0, 0.2), Pose(0.4, 0.0, 0.2))
    with pytest.raises(InvalidArgumentError, match=r"segment 1 .* begins 0.05 .* segment 0"):
        Joined((first, Line(Pose(0.45, 0.0, 0.2), Pose(0.5, 0.0, 0.2))))
    with pytest.raises(InvalidArgumentError, match=r"segment 1 .* leaves the direction .* round"):
        Joined((first, Line(Pose(0.4, 0.0, 0.2), Pose(0.4, 0.1, 0.2))))
    with pytest.raises(InvalidArgumentError, match="at least one"):
        Joined(())


@given(poses, st.floats(-7.0, 7.0))
def test_the_same_pose_twice_is_refused(pose, turns):
    again = pose._replace(yaw=pose.yaw + 2 * math.pi * round(turns))
    with pytest.raises(InvalidArgumentError, match="the same pose"):
        Line(pose, again)


@given(poses, poses, st.floats(-1.0, 2.0))
@settings(max_examples=50)
def test_points_on_one_line_make_no_arc(start, goal, where):
    assume(apart(start, goal) > 1e-3)
    via = Pose(*(a + where * (b - a) for a, b in zip(start, goal, strict=True)))
    with pytest.raises(InvalidArgumentError, match=r"on one line: via is .* m beside"):
        Arc.through(start, via, goal)
    with pytest.raises(InvalidArgumentError, match="two arcs"):
        Arc.through(start, goal, start)


@given(poses, poses, poses, st.integers(0, 2), st.integers(0, 3))
@settings(max_examples=50)
def test_values_that_are_not_finite_are_named(start, via, goal, which, field):
    three = [start, via, goal]
    three[which] = three[which]._replace(**{Pose._fields[field]: math.nan})
    text = f"{Pose._fields[field]} of the {('start', 'via', 'goal')[which]} is nan"
    with pytest.raises(InvalidArgumentError, match=text):
        Arc.through(*three)
