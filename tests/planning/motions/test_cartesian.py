"""Lines and arcs of the tool: on the path, at the limits, or refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings, strategies as st

from bioscara.errors import (
    InvalidArgumentError,
    PathError,
    TrajectoryError,
    UnreachableError,
)
from bioscara.kinematics import Geometry, Joints, Pose, Scara, batch
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, check
from bioscara.planning.limits import ToolLimits
from bioscara.planning.motions.cartesian import circular, linear
from bioscara.planning.paths.inverse_kinematics import along
from bioscara.planning.paths.segments import Arc, Joined, Line, Path
from bioscara.planning.topp.topp import parameterise
from laws import examples
from planning.limits import LIMITS

PARAMETERS = load_parameters()
BARE = Scara(Geometry(*(getattr(PARAMETERS.geometry, name) for name in Geometry._fields)), LIMITS)
TOOLED = Scara(BARE.geometry, LIMITS, tool=Pose(0.119, 0.02, -0.144, 0.3), base=Pose(1, 2, 0.5, 2))
FREE = ToolLimits(math.inf, math.inf, math.inf, math.inf)
FROM, TO = Pose(0.45, -0.20, 0.25), Pose(0.35, 0.30, 0.28)
REACH = BARE.geometry.upper_arm + BARE.geometry.forearm
FOLDED = BARE.geometry.upper_arm - BARE.geometry.forearm
WITHOUT_STOPS = tuple(
    replace(limit, lower=-10.0, upper=10.0) if limit.unit == "rad" else limit for limit in LIMITS
)
WIDE = Scara(BARE.geometry, WITHOUT_STOPS)

angles = st.tuples(
    st.floats(-2.8, 2.8), st.floats(0.02, 0.32), st.floats(0.2, 2.5), st.floats(-2.5, 2.5)
)
elbows = st.sampled_from((1.0, -1.0))


def furthest_wrist(kinematics: Scara, path: Path) -> float:
    """Return the largest distance of the wrist from the column on the path [m]."""
    poses = path.sample(np.linspace(0.0, path.length, 2001)).poses
    offset = np.exp(1j * (poses[:, 3] - kinematics.tool.yaw)) * complex(
        kinematics.tool.x, kinematics.tool.y
    )
    wrist = poses[:, 0] + 1j * poses[:, 1] - offset
    return float(np.abs(wrist - complex(kinematics.base.x, kinematics.base.y)).max())


def exceeded(trajectory: Trajectory, kinematics: Scara, tool: ToolLimits) -> float:
    """Return the largest ratio of any limited quantity to its limit, each 1 ms or less often."""
    step = max(1e-3, trajectory.duration / 20_000)
    times = np.append(np.arange(0.0, trajectory.duration, step), trajectory.duration - 1e-9)
    states = trajectory.sample_many(times)
    velocity, acceleration = batch.tool_motion(kinematics, *states)
    return max(
        *(
            float(np.abs(states[1][:, joint]).max()) / limit.max_velocity
            for joint, limit in enumerate(kinematics.limits)
        ),
        *(
            float(np.abs(states[2][:, joint]).max()) / limit.max_acceleration
            for joint, limit in enumerate(kinematics.limits)
        ),
        float(np.linalg.norm(velocity[:, :3], axis=1).max()) / tool.speed,
        float(np.linalg.norm(acceleration[:, :3], axis=1).max()) / tool.acceleration,
        float(np.abs(velocity[:, 3]).max()) / tool.yaw_speed,
        float(np.abs(acceleration[:, 3]).max()) / tool.yaw_acceleration,
    )


def beside(trajectory: Trajectory, kinematics: Scara, path: Path) -> float:
    """Return the deviation of the poses from the path [m or rad]."""
    poses = batch.forward(
        kinematics, trajectory.sample_many(np.linspace(0, trajectory.duration, 301))[0]
    )
    poses[:, 3] += path.sample([0.0]).poses[0, 3] - poses[0, 3]
    grid = np.linspace(0.0, path.length, 1001)
    way = path.sample(grid).poses
    nearest = grid[[int(np.abs(way - pose).max(axis=1).argmin()) for pose in poses]]
    for _ in range(3):
        at, first, _ = path.sample(nearest)
        nearest += ((poses - at) * first).sum(axis=1) / (first**2).sum(axis=1)
    return float(np.abs(poses - path.sample(nearest).poses).max())


@pytest.mark.parametrize("branch", [0, 1])
def test_the_line_of_the_reference_is_as_fast_as_its_dense_solution(branch: int) -> None:
    start = BARE.inverse(FROM)[branch]
    trajectory = linear(BARE, start, TO, LIMITS, FREE)
    assert trajectory.duration <= 1.01 * (1.797, 1.8375)[branch]
    assert exceeded(trajectory, BARE, FREE) <= 1.0 + 1e-6
    assert check(trajectory, LIMITS) == []
    assert beside(trajectory, BARE, Line(FROM, TO)) < 1e-7


def toppra_duration(kinematics: Scara, path: Path, start: Joints) -> float:
    """Return the duration that toppra finds for the joint path on a fine grid [s]."""
    toppra = pytest.importorskip("toppra")
    toppra.setup_logging("ERROR")
    way = np.linspace(0.0, path.length, 401)
    spline = toppra.SplineInterpolator(way, along(kinematics, path.sample(way), start).joints)
    constraints = [
        toppra.constraint.JointVelocityConstraint(
            [[-x.max_velocity, x.max_velocity] for x in LIMITS]
        ),
        toppra.constraint.JointAccelerationConstraint(
            [[-x.max_acceleration, x.max_acceleration] for x in LIMITS]
        ),
    ]
    ends = 0.5 * path.length * (1.0 - np.cos(np.linspace(0.0, math.pi, 1001)))
    instance = toppra.algorithm.TOPPRA(
        constraints, spline, gridpoints=ends, parametrizer="ParametrizeConstAccel"
    )
    return float(instance.compute_trajectory().duration)


@pytest.mark.parametrize("branch", [0, 1])
@pytest.mark.parametrize(
    "path",
    [
        Line(FROM, TO),
        Line(Pose(0.2, -0.3, 0.2, 0.3), Pose(0.2, 0.3, 0.2, 1.5)),
        Arc.through(FROM, Pose(0.5, 0.1, 0.25), TO),
    ],
)
def test_toppra_finds_nothing_faster(path: Path, branch: int) -> None:
    start = BARE.inverse(Pose(*path.sample([0.0]).poses[0].tolist()))[branch]
    own = parameterise(BARE, path, start, LIMITS, FREE).duration
    peer = toppra_duration(BARE, path, start)
    assert 0.998 * peer <= own <= 1.005 * peer


@given(angles, angles, elbows, st.booleans(), st.booleans())
@settings(max_examples=examples(30), deadline=None)
def test_every_line_keeps_every_limit_and_stays_on_it(
    first: tuple[float, ...], last: tuple[float, ...], elbow: float, tooled: bool, capped: bool
) -> None:
    arm, tool = (TOOLED if tooled else BARE), (ToolLimits() if capped else FREE)
    start = Joints(first[0], first[1], elbow * first[2], first[3])
    here = arm.forward(start)
    goal = arm.forward((last[0], last[1], elbow * last[2], last[3]))
    assume(math.dist(here, goal) > 1e-3)
    path = Line(here, goal)
    try:
        trajectory = linear(arm, start, goal, LIMITS, tool)
    except UnreachableError:
        return
    assert exceeded(trajectory, arm, tool) <= 1.0 + 1e-6
    check(trajectory, LIMITS)
    assert beside(trajectory, arm, path) < 1e-6
    ends = batch.forward(arm, trajectory.positions[[0, -1]])
    assert np.allclose(ends[:, :3], [here[:3], goal[:3]], atol=1e-9)
    assert not trajectory.velocities[[0, -1]].any()


@given(angles, st.floats(-0.1, 0.1), st.floats(0.02, 0.1), st.floats(-1.5, 1.5), st.booleans())
@settings(max_examples=examples(25), deadline=None)
def test_every_arc_keeps_every_limit_and_stays_on_it(
    first: tuple[float, ...], lift: float, size: float, turn: float, capped: bool
) -> None:
    tool = ToolLimits() if capped else FREE
    start = Joints(*first)
    here = TOOLED.forward(start)
    via = here._replace(x=here.x + size, y=here.y + size, z=here.z + 0.3 * lift)
    goal = Pose(here.x + size, here.y - size, here.z + lift, here.yaw + turn)
    try:
        trajectory = circular(TOOLED, start, via, goal, LIMITS, tool)
    except UnreachableError:
        return
    assert exceeded(trajectory, TOOLED, tool) <= 1.0 + 1e-6
    assert beside(trajectory, TOOLED, Arc.through(here, via, goal)) < 1e-6


def test_the_tool_speed_is_used_and_kept() -> None:
    start = BARE.solve(FROM, (0, 0, 1, 0))
    trajectory = linear(BARE, start, TO, LIMITS)
    times = np.arange(0.0, trajectory.duration, 1e-3)
    positions, velocities, _ = trajectory.sample_many(times)
    speeds = batch.tool_speeds(BARE, positions, velocities)
    assert speeds.max() <= 0.25 * (1.0 + 1e-6)
    assert np.median(speeds) > 0.2499


@pytest.mark.parametrize(
    "tool", [ToolLimits(speed=5e-4), ToolLimits(yaw_speed=2e-3), ToolLimits(acceleration=1e-6)]
)
def test_low_tool_limits_are_not_reported_as_a_singularity(tool: ToolLimits) -> None:
    """Limits of the tool may be low; only a path that the joints cannot follow is refused."""
    start = Joints(0.0, 0.2, 1.0, 0.0)
    here = BARE.forward(start)
    goal = Pose(here.x, here.y - 0.05, here.z - 0.01, here.yaw + 0.5)
    via = Pose(here.x - 0.02, here.y - 0.03, here.z, here.yaw)
    for motion in (
        linear(BARE, start, goal, LIMITS, tool),
        circular(BARE, start, via, goal, LIMITS, tool),
    ):
        assert 0.98 < exceeded(motion, BARE, tool) <= 1.0 + 1e-5


def test_a_turn_on_the_spot_keeps_the_tool_there_and_uses_the_yaw_speed() -> None:
    start = TOOLED.inverse(Pose(1.1, 1.6, 0.7, 2.0))[0]
    here = TOOLED.forward(start)
    trajectory = linear(TOOLED, start, here._replace(yaw=here.yaw + 0.8), LIMITS)
    poses = batch.forward(
        TOOLED, trajectory.sample_many(np.arange(0, trajectory.duration, 1e-3))[0]
    )
    assert np.abs(poses[:, :3] - here[:3]).max() < 1e-7
    assert exceeded(trajectory, TOOLED, ToolLimits()) <= 1.0 + 1e-6
    assert trajectory.duration < 1.005 * (0.8 / 1.57 + 1.57 / 6.0)


def test_limits_hold_across_a_break_of_the_curvature() -> None:
    a, b, c = Pose(0.45, -0.2, 0.2), Pose(0.45, 0.0, 0.2), Pose(0.35, 0.1, 0.2)
    middle = Pose(0.35 + 0.1 * math.cos(0.5), 0.1 * math.sin(0.5), 0.2)
    path = Joined((Line(a, b), Arc.through(b, middle, c), Line(c, Pose(0.2, 0.1, 0.2))))
    start = BARE.inverse(a)[1]
    for tool in (FREE, ToolLimits()):
        trajectory = parameterise(BARE, path, start, LIMITS, tool)
        assert exceeded(trajectory, BARE, tool) <= 1.0 + 1e-6
        assert beside(trajectory, BARE, path) < 1e-6
    # Half a metre at 0.25 m/s: the breaks cost next to nothing.
    assert trajectory.duration < path.length / 0.25 + 1.0


def test_a_share_of_the_speed_is_the_same_motion_in_more_time() -> None:
    start = BARE.solve(FROM, (0, 0, 1, 0))
    whole, half = (linear(BARE, start, TO, LIMITS, velocity_scaling=speed) for speed in (1.0, 0.5))
    assert half.duration == pytest.approx(2.0 * whole.duration)
    assert np.array_equal(half.positions, whole.positions)


@pytest.mark.parametrize("distance", [1e-3, 1e-4, 1e-6])
def test_near_the_folded_arm_a_line_slows_down(distance: float) -> None:
    start = WIDE.inverse(Pose(FOLDED + distance, -0.3, 0.25))[1]
    goal = Pose(FOLDED + distance, 0.3, 0.25)
    trajectory = linear(WIDE, start, goal, WITHOUT_STOPS, FREE)
    assert exceeded(trajectory, WIDE, FREE) <= 1.0 + 1e-6
    assert beside(trajectory, WIDE, Line(WIDE.forward(start), goal)) < 1e-6
    positions, velocities, _ = trajectory.sample_many(np.arange(0, trajectory.duration, 1e-4))
    inside = np.abs(batch.forward(WIDE, positions)[:, 1]) < 0.2
    speeds = batch.tool_speeds(WIDE, positions[inside], velocities[inside])
    # The elbow's second derivative grows with the root of the distance: so does the square of
    # the speed that its acceleration allows.
    assert speeds.min() < 0.3 * distance**0.25 < 0.3 * speeds.max()


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 0.0])
def test_a_line_may_end_nearly_stretched(distance: float) -> None:
    start = BARE.solve(Pose(0.3, -0.2, 0.25), (0, 0, 1, 0))
    trajectory = linear(BARE, start, Pose(REACH - distance, 0.0, 0.25), LIMITS, FREE)
    assert exceeded(trajectory, BARE, FREE) <= 1.0 + 1e-6
    assert trajectory.duration < 2.0


def test_where_slowing_down_does_not_help_the_largest_speed_is_reported() -> None:
    x = FOLDED + 1e-9
    start = WIDE.inverse(Pose(x, -0.3, 0.25))[1]
    with pytest.raises(PathError, match=r"0\.3000 m along .* m/s at most .* PTP") as caught:
        linear(WIDE, start, Pose(x, 0.3, 0.25), WITHOUT_STOPS, FREE)
    assert caught.value.segment == 0
    assert caught.value.joint in {"j1", "j3", "j4"}
    assert caught.value.position == pytest.approx(0.3, abs=1e-3)
    assert 0.0 < caught.value.largest_speed < 1e-3
    assert "other side" not in str(caught.value)


@settings(max_examples=examples(8))
@given(
    st.sampled_from((BARE, TOOLED)),
    st.sampled_from((FREE, ToolLimits())),
    st.floats(-2.0, 2.0),
    st.floats(-1.5, 1.5),
    st.tuples(st.floats(-0.5, 0.5), st.floats(0.02, 0.32), st.floats(-1.5, 1.5), st.floats(-1, 1)),
)
@example(TOOLED, FREE, 0.0, 1.5, (0.0, 0.25, 1.0, 1.0))
def test_a_line_may_begin_and_end_stretched(
    kinematics: Scara, tool: ToolLimits, j1: float, j4: float, turned: tuple[float, ...]
) -> None:
    straight = Joints(j1, 0.2, 0.0, j4)
    bent = Joints(*(a + b for a, b in zip((j1, 0.0, 0.0, j4), turned, strict=True)))
    assume(abs(bent.j3) > 0.1)
    far, near = kinematics.forward(straight), kinematics.forward(bent)
    for start, goal in ((straight, near), (bent, far)):
        path = Line(kinematics.forward(start), goal)
        # A tool that turns about its offset can lead the wrist outwards.
        beyond = furthest_wrist(kinematics, path) - REACH
        if beyond > 1e-5:
            with pytest.raises(PathError, match="beyond the reach"):
                linear(kinematics, start, goal, LIMITS, tool)
            continue
        assume(beyond < 1e-9)
        trajectory = linear(kinematics, start, goal, LIMITS, tool)
        assert trajectory.positions[0] == pytest.approx(start, abs=1e-12)
        reached = kinematics.forward(trajectory.positions[-1].tolist())
        assert max(abs(a - b) for a, b in zip(reached[:3], goal[:3], strict=True)) < 1e-9
        assert exceeded(trajectory, kinematics, tool) <= 1.0 + 1e-6
        assert check(trajectory, LIMITS) == []
        assert beside(trajectory, kinematics, path) < 1e-6


def test_a_line_between_stretched_ends_takes_little_longer_than_one_next_to_it() -> None:
    def duration(radius: float) -> float:
        start, goal = (Pose(radius * math.cos(a), radius * math.sin(a), 0.2) for a in (-0.5, 0.5))
        return linear(BARE, BARE.solve(start, (-0.5, 0.2, 0.1, 0.0)), goal, LIMITS).duration

    assert duration(REACH - 1e-9) < duration(REACH) < duration(REACH - 1e-9) + 0.05


@pytest.mark.parametrize("yaw", [-2.8, 2.8])
def test_from_stretched_the_elbow_goes_to_the_side_of_the_goal(yaw: float) -> None:
    goal = Pose(0.5, 0.0, 0.2, yaw)
    side = BARE.solve(goal, (0.0, 0.065, 0.0, 0.0)).j3
    trajectory = linear(BARE, Joints(0.0, 0.065, 0.0, 0.0), goal, LIMITS)
    assert trajectory.positions[-1][2] == pytest.approx(side)
    assert (trajectory.positions[1:, 2] * side > 0.0).all()


def test_the_stretched_arm_is_not_led_through_nor_around() -> None:
    ends = [Pose(REACH * math.cos(a), REACH * math.sin(a), 0.2) for a in (-0.5, 0.0, 0.5)]
    with pytest.raises(PathError, match=r"stretched or folded .* PTP") as caught:
        circular(BARE, BARE.solve(ends[0], (-0.5, 0.2, 0.0, 0.0)), *ends[1:], LIMITS, FREE)
    assert caught.value.largest_speed == 0.0
    assert "other side" not in str(caught.value)
    start = WIDE.inverse(Pose(FOLDED, -0.3, 0.25))[1]
    with pytest.raises(PathError, match=r"0\.3\d* m along .* PTP"):
        linear(WIDE, start, Pose(FOLDED, 0.3, 0.25), WITHOUT_STOPS, FREE)


def touching(radius: float, inward: float, begin: float) -> Trajectory:
    """Plan an arc that comes this near to the end of the reach, where the elbow reverses."""

    def at(angle: float) -> Pose:
        centre = REACH - inward - radius
        return Pose(centre + radius * math.cos(angle), radius * math.sin(angle), 0.2)

    start = BARE.solve(at(begin), (0.0, 0.1, 0.3, 0.0))
    return circular(BARE, start, at(begin + 1.5), at(begin + 1.7), LIMITS, FREE)


@pytest.mark.parametrize("begin", [-1.0, -0.7])
@pytest.mark.parametrize("radius", [0.02, 0.1])
@pytest.mark.parametrize("inward", [-1e-13, 0.0, 1e-14, 1e-13, 1e-12, 1e-11])
def test_an_arc_that_touches_the_end_of_the_reach_is_refused(
    inward: float, radius: float, begin: float
) -> None:
    with pytest.raises(PathError, match=r"stretched or folded") as caught:
        touching(radius, inward, begin)
    assert caught.value.largest_speed < 1e-3


@pytest.mark.parametrize("begin", [-1.0, -0.7])
@pytest.mark.parametrize("radius", [0.02, 0.1])
@pytest.mark.parametrize("inward", [1e-9, 1e-8, 1e-7])
def test_an_arc_that_almost_touches_the_reach_is_slow_only_there(
    inward: float, radius: float, begin: float
) -> None:
    assert touching(radius, inward, begin).duration < 2.0


def test_a_goal_of_the_other_elbow_names_joint_and_alternatives() -> None:
    start = BARE.inverse(Pose(0.4, 0.0, 0.2, 1.8))[0]
    goal = Pose(-0.35, 0.4, 0.2, -1.3)
    assert not BARE.beyond(BARE.solve(goal, start))
    with pytest.raises(PathError, match=r"m along the path of .* beyond its range") as caught:
        linear(BARE, start, goal, LIMITS, FREE)
    assert "can be reached with a PTP motion" in str(caught.value)
    assert caught.value.joint in {"j1", "j4"}


def test_the_other_elbow_is_offered_if_it_can_follow_the_path() -> None:
    for first in np.random.default_rng(1).uniform(-2.6, 2.6, (200, 4)):
        start = Joints(first[0], 0.2, first[2], first[3])
        goal = BARE.forward((first[0] + 1.2, 0.2, first[2], first[3]))
        try:
            linear(BARE, start, goal, LIMITS)
        except PathError as error:
            if "elbow on the other side" in str(error):
                numbers = str(error).split("start from (")[1].split(")")[0]
                other = Joints(*map(float, numbers.split(",")))
                assert other.j3 * start.j3 < 0.0
                assert linear(BARE, other, goal, LIMITS).duration > 0.0
                return
        except UnreachableError:
            pass
    pytest.fail("no start was found of which only the other elbow can do the line")


def test_a_pose_between_the_ends_that_is_out_of_reach_is_named() -> None:
    start = WIDE.inverse(Pose(0.02, -0.3, 0.25))[1]
    with pytest.raises(PathError, match=r"0\.2\d* m along .* inside the least distance"):
        linear(WIDE, start, Pose(0.02, 0.3, 0.25), WITHOUT_STOPS, FREE)


def test_a_position_limit_exceeded_between_two_points_is_found() -> None:
    """Where the line passes the column the elbow reverses, slightly beyond its limit."""
    l1, l2, _ = BARE.geometry
    limit = LIMITS[2].upper
    nearest = math.sqrt(l1 * l1 + l2 * l2 + 2.0 * l1 * l2 * math.cos(limit))
    for inward, refused in ((-1e-6, False), (1e-7, True), (1e-5, True)):
        x = nearest - inward
        # No point of the trajectory is where the elbow turns back: the ends are uneven.
        start = BARE.inverse(Pose(x, -0.3, 0.25))[1]
        for y in (0.21, 0.25, 0.2937):
            if refused:
                with pytest.raises(PathError, match=r"j3 at -2\.6\d* rad, \S+ rad beyond"):
                    linear(BARE, start, Pose(x, y, 0.25), LIMITS, FREE)
            else:
                check(linear(BARE, start, Pose(x, y, 0.25), LIMITS, FREE), LIMITS)


GOOD = BARE.inverse(FROM)[0]


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        (Pose(350.0, 300.0, 280.0), "millimetres"),
        (Pose(0.7, 0.3, 0.28), "beyond the reach"),
        (Pose(0.35, 0.30, 0.6), r"j2 at 0\.4"),
        (Pose(0.35, 0.30, 0.28, 90.0), "degrees"),
        ((0.35, 0.30, 0.28, 0.0), r"the goal is \(0\.35, .*give Pose\("),
        (Pose(0.35, math.nan, 0.28), "y of the goal is nan"),
        (Pose(0.35, 0.3, math.inf), "z of the goal is inf"),
        (FROM, "same pose"),
    ],
)
def test_bad_goals_are_refused(goal: Pose, message: str) -> None:
    with pytest.raises(InvalidArgumentError, match=message):
        linear(BARE, GOOD, goal, LIMITS)


@pytest.mark.parametrize(
    ("via", "goal", "message"),
    [
        (Pose(0.40, 0.05, 0.265), TO, "one line"),
        (TO, TO, "one line"),
        (Pose(0.5, 0.0, 0.25), FROM, "full circle"),
        (Pose(0.5, math.nan, 0.25), TO, "y of the via is nan"),
        (Pose(0.62, 0.0, 0.25), TO, "beyond the reach"),
        (Pose(600.0, 100.0, 200.0), TO, "x of the via is 600 m; are these millimetres"),
        (Pose(0.5, 0.0, 0.25, 90.0), TO, "yaw of the via is 90 rad; are these degrees"),
        ((0.5, 0.0, 0.25), TO, r"the via is \(.*give Pose\("),
    ],
)
def test_bad_arcs_are_refused(via: Pose, goal: Pose, message: str) -> None:
    with pytest.raises(InvalidArgumentError, match=message):
        circular(BARE, GOOD, via, goal, LIMITS)


def test_bad_starts_are_refused() -> None:
    with pytest.raises(UnreachableError, match=r"starts outside its limits: j2 at 0\.5"):
        linear(BARE, GOOD._replace(j2=0.5), TO, LIMITS)
    with pytest.raises(InvalidArgumentError, match="nan"):
        linear(BARE, GOOD._replace(j2=math.nan), TO, LIMITS)
    with pytest.raises(TrajectoryError, match=r"begins 0\.\d+ m .* from where the tool is"):
        parameterise(BARE, Line(TO, FROM), GOOD, LIMITS)


@pytest.mark.parametrize("speed", [0.0, 1e-200, 1e-120, 9e-4, 10.0, -1.0, math.nan])
def test_bad_shares_of_the_speed_are_refused(speed: float) -> None:
    with pytest.raises(InvalidArgumentError, match=r"scaling .* outside 0\.001 \.\. 1|nan"):
        linear(BARE, GOOD, TO, LIMITS, velocity_scaling=speed)


@pytest.mark.parametrize("value", [0.0, 1e-310, 9e-7, -1.0, math.nan])
@pytest.mark.parametrize("name", ["speed", "acceleration", "yaw_speed", "yaw_acceleration"])
def test_bad_tool_limits_are_refused(name: str, value: float) -> None:
    with pytest.raises(InvalidArgumentError, match=name.replace("_", " ")):
        ToolLimits(**{name: value})
