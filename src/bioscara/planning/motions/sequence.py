"""Motion sequences: one trajectory through several waypoints.

Straight and circular motions with blended corners are one path, executed without a stop. The arm
rests at every other waypoint, and always before and after a point-to-point motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.planning.limits import JointLimits, ToolLimits
from bioscara.planning.motions.point_to_point import point_to_point
from bioscara.planning.motions.tool_speed import reduced
from bioscara.planning.motions.waypoints import (
    LEAST_BLEND,
    Motion,
    Waypoint,
    about,
    check_waypoints,
)
from bioscara.planning.paths.blending import Blend, Rounded, rounded
from bioscara.planning.paths.segments import Arc, Line, shorter_turn
from bioscara.planning.topp.topp import parameterise
from bioscara.planning.trajectory.trajectory import Trajectory

_BETWEEN = 1e-5
"""Share by which the tool may be faster between the samples of its speed."""
_ROUNDING = 1e-9
"""Share by which a blend may exceed half of a segment by rounding."""


class Sequenced(NamedTuple):
    """A planned sequence.

    Attributes:
        trajectory: The whole sequence, from rest to rest.
        warnings: Sentences on differences from the request.
    """

    trajectory: Trajectory
    warnings: tuple[str, ...]


def sequence(
    kinematics: Scara,
    start: Joints,
    waypoints: Sequence[Waypoint],
    limits: Sequence[JointLimits],
    tool: ToolLimits | None = None,
    window: float = 0.0,
) -> Sequenced:
    """Return one trajectory through all waypoints.

    Args:
        kinematics: The arm with its tool.
        start: Joint positions at rest [rad, m, rad, rad].
        waypoints: Poses of the tool; errors and warnings count them from 0.
        limits: Of the joints, j1 to j4.
        tool: Limits of the tool; the defaults of :class:`ToolLimits` unless given.
        window: Window over which speeds are averaged, so that accelerations do not jump [s].

    Raises:
        InvalidArgumentError: A value is not usable, a waypoint equals the one before it, an arc's
            points are on one line, a blend is at a point where the arm has to rest, or the arm
            cannot go there; the message begins with the waypoint.
    """
    tool = ToolLimits() if tool is None else tool
    waypoints = check_waypoints(kinematics, start, waypoints)
    joints = start
    trajectories: list[Trajectory] = []
    warnings: list[str] = []
    for first, run in _runs(waypoints):
        if run[0].motion is Motion.PTP:
            with about(first):
                motion = _free(kinematics, joints, run[0], limits, tool)
        else:
            segments = _segments(kinematics.forward(joints), first, run)
            path = rounded(segments, [waypoint.blend for waypoint in run[:-1]])
            warnings.extend(_shrunk(first, run, path))
            with about(first, path.corners):
                speeds = _speeds(run, path)
                motion = parameterise(
                    kinematics,
                    path.path,
                    joints,
                    limits,
                    tool,
                    velocity_scaling=speeds,
                    window=window,
                )
        trajectories.append(motion)
        joints = Joints(*motion.positions[-1].tolist())
    return Sequenced(_one_after_the_other(trajectories), tuple(warnings))


def _runs(waypoints: Sequence[Waypoint]) -> Iterator[tuple[int, Sequence[Waypoint]]]:
    """Yield runs of waypoints that are passed without a stop, each with its first index."""
    first = 0
    for index, waypoint in enumerate(waypoints):
        if not waypoint.blend:
            yield first, waypoints[first : index + 1]
            first = index + 1


def _free(
    kinematics: Scara,
    joints: Joints,
    waypoint: Waypoint,
    limits: Sequence[JointLimits],
    tool: ToolLimits,
) -> Trajectory:
    """Return the point-to-point motion to a waypoint, slowed down to the tool's speed limit."""
    goal = kinematics.solve(waypoint.pose, joints)
    names = [limit.name for limit in limits]
    motion = point_to_point(names, joints, goal, limits, velocity_scaling=waypoint.velocity_scaling)
    return reduced(
        motion, kinematics, joints, (1.0 - _BETWEEN) * tool.speed * waypoint.velocity_scaling
    )[0]


def _segments(here: Pose, first: int, run: Sequence[Waypoint]) -> list[Line | Arc]:
    segments: list[Line | Arc] = []
    for index, waypoint in enumerate(run, first):
        pose, via = waypoint.pose, waypoint.via
        with about(index):
            segments.append(Line(here, pose) if via is None else Arc.through(here, via, pose))
        # The next segment continues from the unwrapped yaw of this one.
        here = pose._replace(yaw=here.yaw + shorter_turn(here.yaw, pose.yaw))
    return segments


def _shrunk(first: int, run: Sequence[Waypoint], path: Rounded) -> Iterator[str]:
    for index, (waypoint, radius) in enumerate(zip(run[:-1], path.radii, strict=True), first):
        if radius < LEAST_BLEND:
            raise InvalidArgumentError(
                f"waypoint {index}: blend {waypoint.blend:g} m, but the path to it or from it is "
                f"only {2.0 * radius:.4g} m; leave one of the two waypoints out, or give blend 0"
            )
        if radius < (1.0 - _ROUNDING) * waypoint.blend:
            yield (
                f"waypoint {index}: blend {waypoint.blend:g} m is more than half of the path to it "
                f"or from it; {radius:.4g} m is used"
            )


def _speeds(run: Sequence[Waypoint], path: Rounded) -> list[float]:
    """Return the speed share of each segment of the path."""
    speeds, index = [], 0
    for segment in path.path.segments:
        if isinstance(segment, Blend):
            speeds.append(min(run[index].velocity_scaling, run[index + 1].velocity_scaling))
            index += 1
        else:
            speeds.append(run[index].velocity_scaling)
    return speeds


def _one_after_the_other(trajectories: Sequence[Trajectory]) -> Trajectory:
    """Concatenate cubics from rest to rest into one trajectory, without waiting between them."""
    begins = np.cumsum([0.0, *(trajectory.duration for trajectory in trajectories)])
    times = [begin + part.times[:-1] for begin, part in zip(begins, trajectories, strict=False)]
    curves = np.concatenate([trajectory.coefficients for trajectory in trajectories])
    last = trajectories[-1].positions[-1]
    return Trajectory(
        trajectories[0].joint_names,
        np.concatenate((*times, begins[-1:])),
        np.vstack((curves[..., 0], last)),
        np.vstack((curves[..., 1], np.zeros_like(last))),
        cubics=curves[..., 2:4],
    )
