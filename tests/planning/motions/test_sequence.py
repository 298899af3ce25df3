import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from bioscara.errors import InvalidArgumentError, UnreachableError
from bioscara.kinematics import Geometry, Joints, Pose, Scara, batch
from bioscara.planning.limits import ToolLimits
from bioscara.planning.motions.sequence import sequence
from bioscara.planning.motions.waypoints import Motion, Waypoint, approach, retract
from bioscara.planning.paths.blending import rounded
from bioscara.planning.paths.segments import Line
from bioscara.planning.topp.topp import parameterise
from bioscara.planning.trajectory.validation import check
from planning.limits import LIMITS

ARM = Scara(Geometry(0.329476, 0.285, 0.135), LIMITS)
START = ARM.solve(Pose(0.45, 0.0, 0.2, 0.2), (0.0, 0.1, 1.0, 0.0))
PTP, LIN, CIRC = Motion.PTP, Motion.LIN, Motion.CIRC
RECTANGLE = [Pose(x, y, 0.2) for x, y in ((0.5, -0.2), (0.5, 0.2), (0.4, 0.2), (0.4, -0.2))]


def motion_of(trajectory):
    """Times each millisecond, and the tool's poses and velocities there."""
    times = np.arange(0.0, trajectory.duration + 1e-3, 1e-3)
    positions, rates, _ = trajectory.sample_many(times)
    return times, batch.forward(ARM, positions), batch.tool_speeds(ARM, positions, rates)


def nearest(poses, pose) -> float:
    return float(np.linalg.norm(poses[:, :3] - pose[:3], axis=1).min())


def test_a_rectangle_with_rounded_corners():
    ways = [Waypoint(pose, blend=0.01) for pose in RECTANGLE[:3]] + [Waypoint(RECTANGLE[3])]
    start = ARM.solve(RECTANGLE[3], START)
    trajectory, warnings = sequence(ARM, start, ways, LIMITS)
    assert warnings == ()
    assert check(trajectory, LIMITS) == []
    _, poses, speeds = motion_of(trajectory)
    assert speeds.max() <= 0.25 * (1 + 1e-6)
    # It slows down for the corners, but stops at none.
    assert speeds[50:-50].min() > 0.03
    for pose in RECTANGLE[:3]:
        assert 1e-3 < nearest(poses, pose) <= 0.01
    assert nearest(poses, RECTANGLE[3]) < 1e-9
    stopping, _ = sequence(ARM, start, [Waypoint(pose) for pose in RECTANGLE], LIMITS)
    assert trajectory.duration < stopping.duration
    _, poses, _ = motion_of(stopping)
    assert max(nearest(poses, pose) for pose in RECTANGLE) < 1e-5


places = st.builds(
    Pose, st.floats(0.3, 0.5), st.floats(-0.25, 0.25), st.floats(0.16, 0.3), st.floats(-0.5, 0.5)
)
ways = st.builds(
    Waypoint,
    places,
    st.sampled_from((LIN, LIN, PTP)),
    st.just(0.0) | st.floats(1e-3, 0.1),
    st.none(),
    st.floats(0.1, 1.0),
)


@given(st.lists(ways, min_size=1, max_size=4))
@settings(max_examples=25, deadline=None)
def test_every_waypoint_is_passed_within_its_blend_and_every_limit_kept(wanted):
    fixed = []
    for way, following in zip(wanted, (*wanted[1:], None), strict=True):
        rests = following is None or PTP in (way.motion, following.motion)
        fixed.append(replace(way, blend=0.0) if rests else way)
    assume(all(math.dist(a.pose[:3], b.pose[:3]) > 1e-3 for a, b in pairwise(fixed)))
    trajectory, _ = sequence(ARM, START, fixed, LIMITS)
    assert check(trajectory, LIMITS) == []
    _, poses, speeds = motion_of(trajectory)
    assert speeds.max() <= 0.25 * (1 + 1e-6)
    for way in fixed:
        assert nearest(poses, way.pose) <= way.blend + 3e-4  # motion of the tool in 1 ms
    yaws = np.diff(poses[:, 3])
    assert np.abs(np.remainder(yaws + math.pi, 2 * math.pi) - math.pi).max() < 0.02


def test_each_segment_has_its_speed_and_a_blend_the_lower_one():
    goals = (Pose(0.45, 0.2, 0.2, 0.2), Pose(0.35, 0.2, 0.2, 0.2))
    ways = [Waypoint(goals[0], blend=0.02), Waypoint(goals[1], velocity_scaling=0.1)]
    trajectory, _ = sequence(ARM, START, ways, LIMITS)
    _, poses, speeds = motion_of(trajectory)
    slow = poses[:, 1] > 0.2 - 0.02 + 1e-6
    assert speeds[slow].max() <= 0.025 * 1.01
    assert speeds[~slow].max() == pytest.approx(0.25, rel=1e-2)


@pytest.mark.parametrize("count", [4, 60])
def test_a_low_speed_or_many_lines_keep_the_tool_on_its_lines(count):
    """The slow line takes a thousand times its least duration: the rest needs points too."""
    places = np.random.default_rng(3).uniform((0.3, -0.2, 0.16), (0.45, 0.2, 0.3), (count, 3))
    corners = np.vstack((ARM.forward(START)[:3], places))
    speeds = [0.001 if index == 2 else 1.0 for index in range(count)]
    ways = [
        Waypoint(Pose(*place), blend=0.005, velocity_scaling=speed)
        for place, speed in zip(places.tolist(), speeds, strict=True)
    ]
    trajectory, _ = sequence(ARM, START, [*ways[:-1], replace(ways[-1], blend=0.0)], LIMITS)
    fast = np.diff(trajectory.times, append=np.inf) < 0.5
    times = (trajectory.times[fast, None] + np.linspace(0.0, 0.1, 5)).ravel()
    poses = batch.forward(ARM, trajectory.sample_many(times)[0])[:, None, :3]
    begins, lines = corners[:-1], np.diff(corners, axis=0)
    share = ((poses - begins) * lines).sum(axis=2) / (lines**2).sum(axis=1)
    nearest = begins + np.clip(share, 0.0, 1.0)[..., None] * lines
    beside = np.linalg.norm(poses - nearest, axis=2).min(axis=1)
    corner = np.linalg.norm(poses - corners, axis=2).min(axis=1) <= 0.005
    assert (~corner).sum() > 100 * count / 4
    assert beside[~corner].max() < 1e-6


def test_the_tool_may_turn_on_the_spot():
    here = ARM.forward(START)
    ways = [Waypoint(here._replace(yaw=here.yaw + 0.5)), Waypoint(here, blend=0.01), Waypoint(A)]
    trajectory, _ = sequence(ARM, START, ways, LIMITS)
    _, poses, _ = motion_of(trajectory)
    assert poses[:, 3].max() == pytest.approx(here.yaw + 0.5, abs=1e-6)


@pytest.mark.parametrize("tool", [ToolLimits(), ToolLimits(*[math.inf] * 4)])
@pytest.mark.parametrize("left", [1e-11, 1e-10, 1e-9, 2e-9, 1e-8, 1e-7, 1e-6, 5e-6, 2e-5])
def test_blends_may_almost_meet(left, tool):
    """The rest left between them may last less than the interval of two points of a trajectory."""
    ways = [
        Waypoint(Pose(0.5, 0.1, 0.2, 0.2), blend=0.05 - left),
        Waypoint(Pose(0.4, 0.1, 0.2, 0.2), blend=0.05, velocity_scaling=0.9),
        Waypoint(Pose(0.4, 0.0, 0.2, 0.2), velocity_scaling=0.5),
    ]
    start = ARM.solve(Pose(0.5, 0.0, 0.2, 0.2), START)
    trajectory, _ = sequence(ARM, start, ways, LIMITS, tool)
    check(trajectory, LIMITS)
    for waypoint in ways:
        assert nearest(motion_of(trajectory)[1], waypoint.pose) <= 0.05
    close, _ = sequence(ARM, start, [replace(ways[0], blend=0.05), *ways[1:]], LIMITS, tool)
    assert trajectory.duration == pytest.approx(close.duration, rel=1e-2)


def test_radii_that_do_not_fit_shrink_and_say_so():
    ways = [Waypoint(Pose(0.45, 0.1, 0.2, 0.2), blend=0.08), Waypoint(Pose(0.35, 0.1, 0.2, 0.2))]
    trajectory, warnings = sequence(ARM, START, ways, LIMITS)
    (text,) = warnings
    assert "waypoint 0: blend 0.08 m" in text
    assert "0.05 m is used" in text
    assert nearest(motion_of(trajectory)[1], ways[0].pose) <= 0.05


def test_radii_that_just_fit_are_no_warning():
    ways = [Waypoint(Pose(0.45, 0.02 * n, 0.2, 0.2), blend=0.01) for n in range(1, 9)]
    _, warnings = sequence(ARM, START, [*ways, Waypoint(Pose(0.45, 0.2, 0.2, 0.2))], LIMITS)
    assert warnings == ()


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("noise", [0.0, 1e-15, -1e-15])
def test_half_a_turn_goes_in_the_direction_of_its_sign(direction, noise):
    start = ARM.solve(Pose(0.4, 0.0, 0.2, 0.0), START)._replace(j4=-1.4 * direction)
    here = ARM.forward(start)
    turned = here.yaw + direction * math.pi + noise
    ways = [Waypoint(here._replace(x=0.45, yaw=turned), blend=0.01), Waypoint(here)]
    trajectory, _ = sequence(ARM, start, ways, LIMITS)
    turn = trajectory.positions[:, [0, 2, 3]].sum(axis=1) - here.yaw
    assert (direction * turn).max() > 2.0
    assert (direction * turn).min() > -1e-9


def test_an_arc_between_lines_with_blends():
    ways = [
        Waypoint(Pose(0.45, 0.1, 0.2, 0.2), blend=0.02),
        Waypoint(Pose(0.35, 0.1, 0.2, 0.2), CIRC, 0.02, Pose(0.4, 0.15, 0.2)),
        Waypoint(Pose(0.35, 0.0, 0.2, 0.2)),
    ]
    trajectory, warnings = sequence(ARM, START, ways, LIMITS)
    assert warnings == ()
    _, poses, speeds = motion_of(trajectory)
    assert speeds[30:-30].min() > 0.01
    assert nearest(poses, Pose(0.4, 0.15, 0.2)) < 1e-3
    assert check(trajectory, LIMITS) == []


def test_approach_and_retract_are_straight_near_the_target():
    target, above = Pose(0.4, 0.1, 0.19, 0.3), Pose(0.0, 0.0, 0.05)
    ways = [*approach(target, above, velocity_scaling=0.1), retract(target, above)]
    trajectory, _ = sequence(ARM, START, ways, LIMITS)
    _, poses, speeds = motion_of(trajectory)
    assert nearest(poses, target) < 1e-5
    low = poses[:, 2] < 0.199
    assert np.abs(poses[low, :2] - target[:2]).max() < 1e-6
    down = low & (np.arange(len(poses)) < poses[:, 2].argmin())
    # A tenth of the lift's limit, which is slower than the tool may be.
    assert speeds[down].max() == pytest.approx(0.1 * LIMITS[1].max_velocity, rel=1e-3)


def test_the_approach_is_in_the_frame_of_the_target():
    target = Pose(0.4, 0.1, 0.2, math.pi / 2)
    first, last = approach(target, Pose(-0.05, 0.0, 0.0))
    assert (first.motion, last.motion) == (PTP, LIN)
    assert first.pose == pytest.approx((0.4, 0.05, 0.2, math.pi / 2))


A, B, C = RECTANGLE[:3]


@pytest.mark.parametrize(
    ("ways", "text"),
    [
        ([], "at least one"),
        ([Waypoint(A), Waypoint(A)], r"waypoint 1: .* 0 m and 0 rad .* leave it out"),
        ([Waypoint(A, PTP), Waypoint(A, PTP)], r"waypoint 1: .* leave it out"),
        ([Waypoint(A), Waypoint(B._replace(z=math.nan))], "waypoint 1: z of the pose is nan"),
        (
            [Waypoint(A), Waypoint(B, CIRC, 0.0, C._replace(x=math.inf))],
            "waypoint 1: x of the via is inf",
        ),
        ([Waypoint(A, blend=-0.01), Waypoint(B)], r"waypoint 0: blend -0.01 m"),
        ([Waypoint(A, blend=math.nan), Waypoint(B)], "waypoint 0: blend is nan"),
        (
            [Waypoint(A, blend=1e-5), Waypoint(B)],
            r"waypoint 0: blend 1e-05 m is less",
        ),
        (
            [Waypoint(A, blend=0.01), Waypoint(A._replace(x=0.4999))],
            r"waypoint 0: blend 0.01 m, but .* only 0.0001 m",
        ),
        ([Waypoint(A, blend=10.0), Waypoint(B)], r"waypoint 0: blend 10 m .* millimetres"),
        (
            [Waypoint(A), Waypoint(B, CIRC, 0.0, Pose(500.0, 100.0, 200.0))],
            r"waypoint 1: x of the via is 500 m; are these millimetres",
        ),
        ([Waypoint(A), Waypoint(B._replace(yaw=90.0))], r"waypoint 1: .* degrees"),
        ([Waypoint((0.5, 0.0, 0.2))], r"waypoint 0: the pose is \(.*give Pose\("),
        ([Waypoint(A), Waypoint(B, blend=0.01)], r"waypoint 1: blend 0.01 m, .* ends there"),
        ([Waypoint(A, PTP, 0.01), Waypoint(B)], r"waypoint 0: blend 0.01 m, .* PTP"),
        ([Waypoint(A, LIN, 0.01), Waypoint(B, PTP)], r"waypoint 0: blend 0.01 m, .* PTP"),
        (
            [Waypoint(A, velocity_scaling=0.0)],
            r"waypoint 0: velocity_scaling 0.0 is outside 0.001 .. 1",
        ),
        ([Waypoint(A, velocity_scaling=1e-120)], r"waypoint 0: velocity_scaling 1e-120 is outside"),
        (
            [Waypoint(A), Waypoint(B, velocity_scaling=10.0)],
            r"waypoint 1: velocity_scaling 10.0 is outside",
        ),
        ([Waypoint(A, CIRC)], "waypoint 0: an arc needs via"),
        ([Waypoint(A, LIN, 0.0, B)], "waypoint 0: via does not belong to LIN"),
        (
            [Waypoint(A), Waypoint(B, CIRC, 0.0, Pose(0.5, 0.1, 0.2))],
            r"waypoint 1: .* on one line: via is 0 m",
        ),
        ([Waypoint(A), Waypoint(A, CIRC, 0.0, B)], r"waypoint 1: .* two arcs"),
    ],
)
def test_bad_waypoints_are_refused_with_their_number(ways, text):
    with pytest.raises(InvalidArgumentError, match=text):
        sequence(ARM, START, ways, LIMITS)


@pytest.mark.parametrize(
    ("pose", "text"),
    [
        (Pose(0.7, 0.0, 0.2), r"waypoint 1: .* 0.0855 m beyond the reach"),
        (Pose(400.0, 100.0, 200.0), r"waypoint 1: .* millimetres"),
        (Pose(0.4, 0.1, 0.9), r"waypoint 1: .* j2"),
    ],
)
def test_a_waypoint_out_of_reach_is_refused_with_its_number(pose, text):
    with pytest.raises(UnreachableError, match=text):
        sequence(ARM, START, [Waypoint(A), Waypoint(pose)], LIMITS)


def test_a_path_that_the_arm_cannot_follow_is_refused_with_its_waypoint():
    behind = ARM.forward(Joints(START.j1 + 3.0, START.j2, START.j3, START.j4))
    with pytest.raises(InvalidArgumentError, match="waypoint 1: "):
        sequence(ARM, START, [Waypoint(A, blend=0.01), Waypoint(behind)], LIMITS)


def test_a_start_outside_the_limits_is_refused():
    with pytest.raises(InvalidArgumentError, match=r"start of the sequence: .*j1"):
        sequence(ARM, START._replace(j1=9.0), [Waypoint(A)], LIMITS)


def test_limits_of_the_tool_are_those_given():
    trajectory, _ = sequence(ARM, START, [Waypoint(A, PTP), Waypoint(B)], LIMITS, ToolLimits(0.1))
    assert motion_of(trajectory)[2].max() == pytest.approx(0.1, rel=1e-3)


def test_yaw_goes_on_across_the_half_turn():
    # Seen from a base that is turned, the same poses have yaws on both sides of pi.
    turned = Pose(0.1, -0.2, 0.05, math.pi - 0.1)
    arm = Scara(ARM.geometry, LIMITS, base=turned)

    def seen(pose: Pose) -> Pose:
        there = turned.compose(pose)
        return there._replace(yaw=math.remainder(there.yaw, 2 * math.pi))

    goals = (Pose(0.45, 0.1, 0.2, -0.1), Pose(0.35, 0.1, 0.2, 0.4), Pose(0.35, -0.1, 0.2, -0.2))
    ways = [Waypoint(goal, blend=0.02) for goal in goals[:2]] + [Waypoint(goals[2])]
    plain, _ = sequence(ARM, START, ways, LIMITS)
    ways = [replace(way, pose=seen(way.pose)) for way in ways]
    other, _ = sequence(arm, START, ways, LIMITS)
    assert other.duration == pytest.approx(plain.duration, rel=1e-6)
    at = np.linspace(0.0, plain.duration, 200)
    assert np.allclose(other.sample_many(at)[0], plain.sample_many(at)[0], atol=1e-5)


def test_the_tool_reverses_before_it_reaches_the_turning_point():
    there, back = Pose(0.45, 0.15, 0.2, 0.2), Pose(0.45, 0.05, 0.2, 0.2)
    trajectory, _ = sequence(ARM, START, [Waypoint(there, blend=0.02), Waypoint(back)], LIMITS)
    _, poses, _ = motion_of(trajectory)
    assert 0.15 - 0.02 <= poses[:, 1].max() < 0.15
    assert np.abs(poses[:, 0] - 0.45).max() < 1e-6
    assert check(trajectory, LIMITS) == []


def test_a_share_for_each_segment_is_the_share_for_all_where_they_are_equal():
    here = ARM.forward(START)
    segments = [Line(here, A), Line(A, B)]
    path = rounded(segments, [0.01]).path
    one = parameterise(ARM, path, START, LIMITS, velocity_scaling=0.4)
    each = parameterise(ARM, path, START, LIMITS, velocity_scaling=[0.4, 0.4, 0.4])
    assert each.duration == pytest.approx(one.duration, rel=1e-9)
    with pytest.raises(
        InvalidArgumentError, match="2 shares of the speed do not fit the 3 segments"
    ):
        parameterise(ARM, path, START, LIMITS, velocity_scaling=[0.4, 0.4])
    with pytest.raises(InvalidArgumentError, match=r"velocity_scaling 1.5 is outside"):
        parameterise(ARM, path, START, LIMITS, velocity_scaling=[0.4, 1.5, 1.0])


def test_a_sequence_with_stops_is_its_motions_planned_one_by_one():
    ways = [
        Waypoint(A, PTP),
        Waypoint(B, velocity_scaling=0.5),
        Waypoint(C, CIRC, 0.0, Pose(0.46, 0.22, 0.2)),
    ]
    whole, _ = sequence(ARM, START, ways, LIMITS)
    joints, begin = START, 0.0
    for way in ways:
        alone, _ = sequence(ARM, joints, [way], LIMITS)
        at = np.linspace(0.0, alone.duration, 50)
        positions, velocities, _ = whole.sample_many(begin + at)
        assert np.allclose(alone.sample_many(at)[0], positions, atol=1e-9)
        assert np.allclose(alone.sample_many(at)[1], velocities, atol=1e-9)
        joints, begin = Joints(*alone.positions[-1].tolist()), begin + alone.duration
    assert whole.duration == pytest.approx(begin)
