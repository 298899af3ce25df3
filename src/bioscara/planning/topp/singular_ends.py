"""Paths of the tool that begin or end with the arm exactly stretched or folded.

There the elbow's angle varies with the square root of the remaining distance, so the joints have no
finite derivative by the path parameter. They have one by time, because the arm rests there. The
first or last short piece of the path, over which the elbow turns by :data:`CLEAR`, is therefore a
joint motion: on it the tool deviates from the path by about the square of that angle times the
arm's length, 10 nm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bioscara.kinematics import Joints, Pose, Scara
from bioscara.planning.arrays import Array
from bioscara.planning.limits import JointLimits, ToolLimits
from bioscara.planning.paths.inverse_kinematics import along
from bioscara.planning.paths.segments import LEVER, Path

STRETCHED = 1e-6
"""Sine of the elbow's angle below which the joints have no finite speed on a path."""
CLEAR = 1e-4
"""Sine of the elbow's angle from which on the path itself is followed."""
_LENGTHS = 1e-10 * 2.0 ** np.arange(24)
"""Lengths tried for the joint motion, up to a millimetre [m]."""


class RegularPart(NamedTuple):
    """The part of a path on which the joints have finite derivatives, without stretched ends.

    Attributes:
        begin: Parameter where it begins.
        end: Parameter where it ends.
        side: Joints at the path's beginning, the elbow slightly on the side that it bends to.
    """

    begin: float
    end: float
    side: Joints


def regular_part(kinematics: Scara, path: Path, start: Joints) -> RegularPart:
    """Return the part of a path between its stretched or folded ends.

    Args:
        kinematics: The arm.
        path: Of the tool; all of it is returned if the arm stays stretched along it.
        start: Joints at its beginning [rad, m, rad, rad].
    """
    edges = (0.0, *path.breaks, path.length)
    begin = _singular_length(kinematics, path, start, 0.0, edges[1])
    end = path.length - _singular_length(
        kinematics, path, start, path.length, edges[-2] - path.length
    )
    if not begin:
        return RegularPart(begin, end, start)
    # From the stretched position the elbow can bend to either side; it takes the goal's.
    goal = kinematics.solve(Pose(*path.sample([path.length]).poses[0].tolist()), start)
    straight = start.j3 - math.remainder(start.j3, math.pi)
    side = straight + math.copysign(STRETCHED, goal.j3 - straight)
    return RegularPart(begin, end, start._replace(j3=side))


def with_ends(
    kinematics: Scara,
    path: Path,
    part: RegularPart,
    start: Joints,
    points: tuple[Array, Array, Array],
    limits: Sequence[JointLimits],
    tool: ToolLimits,
) -> tuple[Array, Array, Array]:
    """Extend the points of a motion along the part to one along the whole path.

    Args:
        kinematics: The arm.
        path: Of the tool.
        part: The part that the motion follows.
        start: Joints at the path's beginning [rad, m, rad, rad].
        points: Times, positions and velocities of the motion along the part, rest to rest.
        limits: Of the joints, j1 to j4.
        tool: Limits of the tool.
    """
    times, positions, velocities = points
    at = np.array((0.0, part.begin, part.end, path.length))
    joints = along(kinematics, path.sample(at), part.side).joints
    rest = np.zeros((1, 4))
    if part.begin:
        takes = _duration(joints[1] - start, part.begin, limits, tool)
        times = np.concatenate(([0.0], times + takes))
        positions, velocities = np.vstack((start, positions)), np.vstack((rest, velocities))
    if part.end < path.length:
        takes = _duration(joints[3] - joints[2], path.length - part.end, limits, tool)
        times = np.append(times, times[-1] + takes)
        positions, velocities = np.vstack((positions, joints[3])), np.vstack((velocities, rest))
    return times, positions, velocities


def _singular_length(
    kinematics: Scara, path: Path, start: Joints, end: float, room: float
) -> float:
    """Return the distance from an end of a path to where the elbow is bent [m].

    Args:
        kinematics: The arm.
        path: Of the tool.
        start: Joints at its beginning.
        end: Parameter of the end.
        room: Parameter of the next break relative to it; negative at the final end.
    """
    lengths = np.concatenate(([0.0], _LENGTHS[abs(room) > 2.0 * _LENGTHS]))
    samples = path.sample(end + math.copysign(1.0, room) * lengths)
    sines = np.abs(np.sin(along(kinematics, samples, start).joints[:, 2]))
    if not sines[0] < STRETCHED:
        return 0.0
    bent = sines >= CLEAR
    return float(lengths[np.argmax(bent)]) if bent.any() else 0.0


def _duration(
    displacement: Array, length: float, limits: Sequence[JointLimits], tool: ToolLimits
) -> float:
    """Return the duration of a cubic from rest to rest [s]; estimated for the tool's limits."""
    distances: list[float] = [*np.abs(displacement).tolist(), length, length / LEVER]
    fastest = [*(limit.max_velocity for limit in limits), tool.speed, tool.yaw_speed]
    hardest = [*(limit.max_acceleration for limit in limits)]
    hardest += [tool.acceleration, tool.yaw_acceleration]
    return max(
        max(1.5 * d / v, math.sqrt(6.0 * d / a))
        for d, v, a in zip(distances, fastest, hardest, strict=True)
    )
