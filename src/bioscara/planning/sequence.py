"""Several motions as one: waypoints go in, one trajectory through all of them comes out.

Straight and circular motions whose corners are rounded are one path, run without a stop. The arm
rests at every other waypoint, and always before and after a point-to-point motion.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np

from bioscara.errors import InvalidArgumentError, PathError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.kinematics.pose import require_near, require_pose, wrapped
from bioscara.planning.blending import Blend, Rounded, rounded
from bioscara.planning.limits import JointLimits, check_share
from bioscara.planning.parameterisation import parameterise
from bioscara.planning.path import LEVER, SHORTEST, Arc, Line
from bioscara.planning.point_to_point import point_to_point
from bioscara.planning.tool_limits import ToolLimits
from bioscara.planning.tool_speed import reduced
from bioscara.planning.trajectory import Trajectory

_LEAST_BLEND = 1e-4
"""Smallest blend [m]; at a smaller one the tool all but stops, and 0 does that better."""
_MOST_BLEND = 1.0
"""Largest blend that is taken for one [m]: beyond it stand millimetres."""

_BETWEEN = 1e-5
"""Share by which the tool may be faster than where it was looked at."""


class Motion(Enum):
    """How the tool gets to a waypoint."""

    PTP = "ptp"
    """Each joint by the shortest way; the tool's way is a curve."""
    LIN = "lin"
    """In a straight line."""
    CIRC = "circ"
    """On the arc over another point."""


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A pose that the tool goes to.

    Attributes:
        pose: Of the tool in the base, or in the world that the arm's kinematics were given.
        motion: The way there.
        blend: How far from the pose the tool may turn off to the next waypoint [m]; 0 rests there.
        via: Point that an arc passes; its yaw does not matter. For CIRC, and only for it.
        speed: Share of the possible speed on the way there, 0.001 to 1. A blend has the
            lower speed of the two motions that it joins.
    """

    pose: Pose
    motion: Motion = Motion.LIN
    blend: float = 0.0
    via: Pose | None = None
    speed: float = 1.0


class Sequenced(NamedTuple):
    """A planned sequence.

    Attributes:
        trajectory: All of it, from rest to rest.
        warnings: Sentences about what differs from what was asked for.
    """

    trajectory: Trajectory
    warnings: tuple[str, ...]


def sequence(
    arm: Scara,
    start: Joints,
    waypoints: Sequence[Waypoint],
    limits: Sequence[JointLimits],
    tool: ToolLimits | None = None,
) -> Sequenced:
    """Return one trajectory through all waypoints.

    Args:
        arm: The arm with its tool.
        start: Where its joints rest [rad, m, rad, rad].
        waypoints: Where the tool goes; errors and warnings count them from 0.
        limits: Of the joints, j1 to j4.
        tool: Limits of the tool; the defaults of :class:`ToolLimits` unless given.

    Raises:
        InvalidArgumentError: A value is not usable, a waypoint is where the one before it is, an
            arc's points are on one line, a blend is where the arm has to rest, or the arm cannot
            go there; the message begins with the waypoint.
    """
    tool = ToolLimits() if tool is None else tool
    _check(arm, start, waypoints)
    joints = start
    trajectories: list[Trajectory] = []
    warnings: list[str] = []
    for first, run in _runs(waypoints):
        if run[0].motion is Motion.PTP:
            with _about(first):
                motion = _free(arm, joints, run[0], limits, tool)
        else:
            pieces = _pieces(arm.forward(joints), first, run)
            path = rounded(pieces, [waypoint.blend for waypoint in run[:-1]])
            warnings.extend(_shrunk(first, run, path))
            with _about(first, path.corners):
                motion = parameterise(
                    arm, path.path, joints, limits, tool, speed=_speeds(run, path)
                )
        trajectories.append(motion)
        joints = Joints(*motion.positions[-1].tolist())
    return Sequenced(_one_after_the_other(trajectories), tuple(warnings))


def approach(
    target: Pose, away: Pose, *, motion: Motion = Motion.PTP, speed: float = 1.0
) -> tuple[Waypoint, Waypoint]:
    """Return the way to a target over a pose away from it: there freely, then straight.

    Args:
        target: Where the tool shall be.
        away: Where the straight way begins, in the frame of the target; (0, 0, 0.05) is above.
        motion: The way to where the straight way begins.
        speed: Share of the possible speed on the straight way.
    """
    return Waypoint(target.compose(away), motion), Waypoint(target, speed=speed)


def retract(target: Pose, away: Pose, *, speed: float = 1.0) -> Waypoint:
    """Return the straight way back from a target.

    Args:
        target: Where the tool is.
        away: Where it goes, in the frame of the target.
        speed: Share of the possible speed.
    """
    return Waypoint(target.compose(away), speed=speed)


def _check(arm: Scara, start: Joints, waypoints: Sequence[Waypoint]) -> None:
    beyond = arm.beyond(start)
    if beyond:
        raise InvalidArgumentError(f"start of the sequence: {', '.join(beyond)}")
    if not waypoints:
        raise InvalidArgumentError("a sequence needs at least one waypoint; this one has none")
    here = arm.forward(start)
    for index, waypoint in enumerate(waypoints):
        following = waypoints[index + 1] if index + 1 < len(waypoints) else None
        with _about(index):
            _check_values(waypoint)
            _check_blend(waypoint, following)
            _check_way(here, waypoint)
            arm.solve(waypoint.pose, start)
        here = waypoint.pose


def _check_values(waypoint: Waypoint) -> None:
    require_pose("the pose", waypoint.pose)
    if waypoint.via is not None:
        require_near("the via", waypoint.via)
    check_share(waypoint.speed)
    if not 0.0 <= waypoint.blend < math.inf:
        raise InvalidArgumentError(
            f"blend {waypoint.blend} m must be a finite number, 0 or more; 0 rests there"
        )
    if 0.0 < waypoint.blend < _LEAST_BLEND:
        raise InvalidArgumentError(
            f"blend {waypoint.blend:g} m is less than {_LEAST_BLEND:g} m; 0 rests there"
        )
    if waypoint.blend > _MOST_BLEND:
        raise InvalidArgumentError(
            f"blend {waypoint.blend:g} m is more than {_MOST_BLEND:g} m; are these millimetres? "
            "lengths are metres"
        )
    circular = waypoint.motion is Motion.CIRC
    if circular != (waypoint.via is not None):
        text = "an arc needs via" if circular else f"via does not belong to {waypoint.motion.name}"
        raise InvalidArgumentError(f"{text}; a point between start and pose makes a CIRC motion")


def _check_blend(waypoint: Waypoint, following: Waypoint | None) -> None:
    if not waypoint.blend:
        return
    if following is None:
        why = "the sequence ends there"
    elif Motion.PTP in (waypoint.motion, following.motion):
        why = "the arm rests before and after a PTP motion"
    else:
        return
    raise InvalidArgumentError(f"blend {waypoint.blend:g} m, but {why}; give blend 0")


def _check_way(here: Pose, waypoint: Waypoint) -> None:
    if waypoint.motion is Motion.CIRC:
        return  # the arc complains of its points
    distance = math.dist(here[:3], waypoint.pose[:3])
    turn = abs(wrapped(waypoint.pose.yaw - here.yaw))
    if max(distance, LEVER * turn) < SHORTEST:
        raise InvalidArgumentError(
            f"it is only {distance:.3g} m and {turn:.3g} rad from the pose before it; leave it out"
        )


def _runs(waypoints: Sequence[Waypoint]) -> Iterator[tuple[int, Sequence[Waypoint]]]:
    """Return the waypoints that are passed without a stop, with the index of their first."""
    first = 0
    for index, waypoint in enumerate(waypoints):
        if not waypoint.blend:
            yield first, waypoints[first : index + 1]
            first = index + 1


def _free(
    arm: Scara,
    joints: Joints,
    waypoint: Waypoint,
    limits: Sequence[JointLimits],
    tool: ToolLimits,
) -> Trajectory:
    """Return the point-to-point motion to a waypoint, as slow as the tool has to be."""
    goal = arm.solve(waypoint.pose, joints)
    names = [limit.name for limit in limits]
    motion = point_to_point(names, joints, goal, limits, speed=waypoint.speed)
    return reduced(motion, arm, joints, (1.0 - _BETWEEN) * tool.speed * waypoint.speed)[0]


def _pieces(here: Pose, first: int, run: Sequence[Waypoint]) -> list[Line | Arc]:
    pieces: list[Line | Arc] = []
    for index, waypoint in enumerate(run, first):
        pose, via = waypoint.pose, waypoint.via
        with _about(index):
            pieces.append(Line(here, pose) if via is None else Arc.through(here, via, pose))
        # The next piece goes on from the turn of this one.
        here = pose._replace(yaw=here.yaw + wrapped(pose.yaw - here.yaw))
    return pieces


def _shrunk(first: int, run: Sequence[Waypoint], path: Rounded) -> Iterator[str]:
    for index, (waypoint, radius) in enumerate(zip(run[:-1], path.radii, strict=True), first):
        if radius < _LEAST_BLEND:
            raise InvalidArgumentError(
                f"waypoint {index}: blend {waypoint.blend:g} m, but the way to it or from it is "
                f"only {2.0 * radius:.4g} m; leave one of the two waypoints out, or give blend 0"
            )
        if radius < waypoint.blend:
            yield (
                f"waypoint {index}: blend {waypoint.blend:g} m is more than half of the way to it "
                f"or from it; {radius:.4g} m is used"
            )


def _speeds(run: Sequence[Waypoint], path: Rounded) -> list[float]:
    """Return the share of speed of each piece of the path."""
    speeds, index = [], 0
    for piece in path.path.pieces:
        if isinstance(piece, Blend):
            speeds.append(min(run[index].speed, run[index + 1].speed))
            index += 1
        else:
            speeds.append(run[index].speed)
    return speeds


def _one_after_the_other(trajectories: Sequence[Trajectory]) -> Trajectory:
    """Return cubics from rest to rest as one trajectory; the arm does not wait between them."""
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


@contextmanager
def _about(first: int, corners: Sequence[float] = ()) -> Iterator[None]:
    """Begin the message of an error with the waypoint that it is about.

    Args:
        first: The waypoint, or the first of several.
        corners: Where the ways to the further ones begin on their path [m].
    """
    try:
        yield
    except InvalidArgumentError as error:
        position = error.position if isinstance(error, PathError) else 0.0
        error.args = (f"waypoint {first + bisect_right(corners, position)}: {error}",)
        raise
