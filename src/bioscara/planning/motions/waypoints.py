"""Waypoints of a sequence of motions, and their validation."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum

from bioscara.arguments import items, number, shown
from bioscara.errors import InvalidArgumentError, PathError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.kinematics.pose import require_near_place, require_pose, wrapped
from bioscara.planning.limits import check_share
from bioscara.planning.paths.segments import LEVER, SHORTEST

LEAST_BLEND = 1e-4
"""Smallest blend [m]: at a smaller one the tool almost stops; 0 stops there."""
MOST_BLEND = 1.0
"""Largest blend accepted [m]: a larger one is taken for millimetres."""


class Motion(Enum):
    """Kind of motion to a waypoint."""

    PTP = "ptp"
    """Straight in joint space; the tool's path is a curve."""
    LIN = "lin"
    """Straight line of the tool."""
    CIRC = "circ"
    """Circular arc of the tool through another point."""


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A pose that the tool moves to.

    Attributes:
        pose: Of the tool in the base, or in the world frame given to the arm's kinematics.
        motion: Kind of motion to it.
        blend: Distance from the pose at which the tool may leave the path to it towards the next
            waypoint [m]; 0 rests at the pose.
        via: Point that an arc passes; its yaw does not matter. Required for CIRC, only for it.
        velocity_scaling: Share of the possible speed of the motion to it, 0.001 to 1. A blend has
            the lower one of the two motions that it joins.
    """

    pose: Pose
    motion: Motion = Motion.LIN
    blend: float = 0.0
    via: Pose | None = None
    velocity_scaling: float = 1.0


def approach(
    target: Pose, away: Pose, *, motion: Motion = Motion.PTP, velocity_scaling: float = 1.0
) -> tuple[Waypoint, Waypoint]:
    """Return the waypoints of an approach: to a pose away from the target, then straight to it.

    Args:
        target: Goal pose of the tool.
        away: Start of the straight line, in the frame of the target; (0, 0, 0.05) is above.
        motion: Kind of motion to the start of the straight line.
        velocity_scaling: Share of the possible speed on the straight line.
    """
    target = require_pose("the target", target)
    return Waypoint(target.compose(away), motion), Waypoint(
        target, velocity_scaling=velocity_scaling
    )


def retract(target: Pose, away: Pose, *, velocity_scaling: float = 1.0) -> Waypoint:
    """Return the waypoint of a straight retreat from a target.

    Args:
        target: Present pose of the tool.
        away: Goal pose, in the frame of the target.
        velocity_scaling: Share of the possible speed.
    """
    return Waypoint(
        require_pose("the target", target).compose(away), velocity_scaling=velocity_scaling
    )


def check_waypoints(
    kinematics: Scara, start: Joints, waypoints: Sequence[Waypoint]
) -> tuple[Waypoint, ...]:
    """Check that a sequence is consistent and each of its poses reachable, and return it.

    Args:
        kinematics: The arm with its tool.
        start: Joint positions at rest [rad, m, rad, rad].
        waypoints: Poses of the tool.

    Raises:
        InvalidArgumentError: The start, or a waypoint, is not usable.
    """
    beyond = kinematics.beyond(start)
    if beyond:
        raise InvalidArgumentError(f"start of the sequence: {', '.join(beyond)}")
    checked = require_waypoints(waypoints)
    if not checked:
        raise InvalidArgumentError("a sequence needs at least one waypoint; this one has none")
    here = kinematics.forward(start)
    for index, waypoint in enumerate(checked):
        following = checked[index + 1] if index + 1 < len(checked) else None
        with about(index):
            _check_blend(waypoint, following)
            _check_distance(here, waypoint)
            kinematics.solve(waypoint.pose, start)
        here = waypoint.pose
    return checked


def require_waypoints(waypoints: object) -> tuple[Waypoint, ...]:
    """Return waypoints with values that were checked one by one.

    Raises:
        InvalidArgumentError: They are no waypoints, or a value cannot be used.
    """
    given = items("the waypoints", waypoints, "give a list of Waypoint(pose)")
    for index, waypoint in enumerate(given):
        if not isinstance(waypoint, Waypoint):
            raise InvalidArgumentError(
                f"waypoint {index} is {shown(waypoint)}; give Waypoint(pose)"
            )
    checked = []
    for index, waypoint in enumerate(given):
        with about(index):
            checked.append(_check_values(waypoint))
    return tuple(checked)


def _check_values(waypoint: Waypoint) -> Waypoint:
    pose = require_pose("the pose", waypoint.pose)
    via = None if waypoint.via is None else require_near_place("the via", waypoint.via)
    if not isinstance(waypoint.motion, Motion):
        kinds = ", ".join(map(str, Motion))
        raise InvalidArgumentError(f"motion is {shown(waypoint.motion)}; give one of {kinds}")
    share, blend = check_share(waypoint.velocity_scaling), number("blend", waypoint.blend)
    if blend < 0.0:
        raise InvalidArgumentError(f"blend {blend:g} m must be 0 or more; 0 rests there")
    if 0.0 < blend < LEAST_BLEND:
        raise InvalidArgumentError(
            f"blend {blend:g} m is less than {LEAST_BLEND:g} m; 0 rests there"
        )
    if blend > MOST_BLEND:
        raise InvalidArgumentError(
            f"blend {blend:g} m is more than {MOST_BLEND:g} m; are these millimetres? "
            "lengths are metres"
        )
    circular = waypoint.motion is Motion.CIRC
    if circular != (waypoint.via is not None):
        text = "an arc needs via" if circular else f"via does not belong to {waypoint.motion.name}"
        raise InvalidArgumentError(f"{text}; a point between start and pose makes a CIRC motion")
    return Waypoint(pose, waypoint.motion, blend, via, share)


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


def _check_distance(here: Pose, waypoint: Waypoint) -> None:
    if waypoint.motion is Motion.CIRC:
        return  # Arc checks its points
    distance = math.dist(here[:3], waypoint.pose[:3])
    turn = abs(wrapped(waypoint.pose.yaw - here.yaw))
    if max(distance, LEVER * turn) < SHORTEST:
        raise InvalidArgumentError(
            f"it is only {distance:.3g} m and {turn:.3g} rad from the pose before it; leave it out"
        )


@contextmanager
def about(first: int, corners: Sequence[float] = ()) -> Iterator[None]:
    """Prefix the message of an error with the waypoint that it concerns.

    Args:
        first: The waypoint, or the first of several.
        corners: Path parameters where the motions to the further ones begin [m].
    """
    try:
        yield
    except InvalidArgumentError as error:
        position = error.position if isinstance(error, PathError) else 0.0
        error.args = (f"waypoint {first + bisect_right(corners, position)}: {error}",)
        raise
