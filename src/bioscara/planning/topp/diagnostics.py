"""Reasons why an arm cannot follow a path of its tool: position, joint and alternatives."""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from bioscara.errors import InvalidArgumentError, PathError, TrajectoryError, UnreachableError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.planning.arrays import Array
from bioscara.planning.paths.inverse_kinematics import along
from bioscara.planning.paths.segments import Path
from bioscara.planning.topp.constraints import GridSamples
from bioscara.planning.topp.singular_ends import STRETCHED
from bioscara.planning.trajectory.trajectory import Trajectory

_NEAR = 1e-6
"""Rounding tolerance between the start of a path and the tool [m or rad]."""
SLOWEST = 1e-3
"""Least speed of the tool [m/s]: a path that requires a lower one is refused."""
_NEAR_END = 1e-3
"""Distance from the ends of a path within which the tool is slow in any case [m]."""
_TURNING = (0, 2, 3)
"""The rotary joints."""


def check_start(kinematics: Scara, path: Path, start: Joints) -> None:
    """Make sure that a path begins at the arm's present pose, within its limits.

    Raises:
        InvalidArgumentError: A value is not finite.
        UnreachableError: A joint is outside its limits.
        TrajectoryError: The path begins elsewhere.
    """
    for limit, value in zip(kinematics.limits, start, strict=True):
        if not math.isfinite(value):
            raise InvalidArgumentError(f"start of {limit.name} is {value}; give a finite number")
    beyond = kinematics.beyond(start)
    if beyond:
        raise UnreachableError(
            f"the arm starts outside its limits: {', '.join(beyond)}; move these joints back first"
        )
    begin, here = Pose(*path.sample(np.zeros(1)).poses[0].tolist()), kinematics.forward(start)
    gap = math.dist(begin[:3], here[:3])
    turn = abs(math.remainder(begin.yaw - here.yaw, 2.0 * math.pi))
    if not (gap <= _NEAR and turn <= _NEAR):
        raise TrajectoryError(
            f"the path begins {gap:.4g} m and {turn:.4g} rad from where the tool is; begin it there"
        )


def check_places(kinematics: Scara, path: Path, start: Joints, samples: GridSamples) -> None:
    """Make sure that every pose on the path is within reach and limits, on the elbow's side.

    Raises:
        PathError: A pose is not; the message names the first such one.
    """
    joints = samples.joints.joints
    missing = np.isnan(joints[:, 2])
    if missing.any():
        index = int(np.argmax(missing))
        pose = Pose(*samples.tool.poses[index].tolist())
        try:
            kinematics.inverse(pose)
        except UnreachableError as error:
            raise _refusal(kinematics, path, start, samples, index, 2, str(error)) from None
    _check_ranges(kinematics, path, start, samples, joints)
    flat = np.abs(np.sin(joints[:, 2])) < STRETCHED
    if flat.any():
        index = int(np.argmax(flat))
        why = (
            f"the arm is stretched or folded there (j3 at {joints[index, 2]:.6f} rad), where the "
            "joints cannot lead the tool along the path; stay a millimetre away"
        )
        raise _refusal(kinematics, path, start, samples, index, 2, why)


def check_turns(
    kinematics: Scara, path: Path, start: Joints, samples: GridSamples, trajectory: Trajectory
) -> None:
    """Make sure that no joint leaves its range between two points of the trajectory.

    Args:
        kinematics: The arm.
        path: The path.
        start: Joints at its beginning.
        samples: The path at the points of the trajectory.
        trajectory: Of cubics.

    Raises:
        PathError: A joint leaves its range where it reverses.
    """
    c, t = trajectory.coefficients, np.diff(trajectory.times)[:, None]
    v0, a0 = c[..., 1], 2.0 * c[..., 2]
    v1 = v0 + t * (a0 + 3.0 * t * c[..., 3])
    turning = v0 * v1 < 0.0
    # Where a joint reverses there is a root; rounding may put its square slightly below zero.
    root = np.sqrt(np.maximum(np.where(turning, a0 * a0 - 12.0 * c[..., 3] * v0, 1.0), 0.0))
    at = np.where(turning, -2.0 * v0 / np.where(turning, a0 + np.sign(v1) * root, 1.0), 0.0)
    turns = c[..., 0] + at * (v0 + at * (c[..., 2] + at * c[..., 3]))
    _check_ranges(kinematics, path, start, samples, turns)


def check_speeds(
    kinematics: Scara, path: Path, start: Joints, samples: GridSamples, bound: Array
) -> None:
    """Make sure that the tool can pass every point of the path at :data:`SLOWEST` or faster.

    Args:
        kinematics: The arm.
        path: The path.
        start: Joints at its beginning.
        samples: The path at the points of a grid.
        bound: Square of the highest speed that each piece of the grid allows, shape (n - 1,).

    Raises:
        PathError: It cannot; the message states the largest speed at the slowest point.
    """
    grid = samples.grid[:-1]
    inside = (grid > _NEAR_END) & (grid < path.length - _NEAR_END)
    bound = np.where(inside, bound, np.inf)
    index = int(np.argmin(bound))
    if bound[index] >= SLOWEST**2:
        return
    joint = _TURNING[int(np.argmax(np.abs(samples.joints.second[index, _TURNING])))]
    largest = math.sqrt(float(bound[index]))
    why = (
        f"{kinematics.limits[joint].name} would have to turn so suddenly that the tool can pass at "
        f"{largest:.2g} m/s at most (j3 at {samples.joints.joints[index, 2]:.4f} rad: nearly "
        "stretched or folded); lead the path further away from there"
    )
    raise _refusal(kinematics, path, start, samples, index, joint, why, largest)


def _check_ranges(
    kinematics: Scara, path: Path, start: Joints, samples: GridSamples, joints: Array
) -> None:
    lower = np.array([limit.lower for limit in kinematics.limits]) - 1e-9
    upper = np.array([limit.upper for limit in kinematics.limits]) + 1e-9
    outside = (joints < lower) | (joints > upper)
    if outside.any():
        index, joint = (int(part) for part in np.argwhere(outside)[0])
        why = f"it would take {', '.join(kinematics.beyond(joints[index].tolist()))}"
        raise _refusal(kinematics, path, start, samples, index, joint, why)


def _refusal(
    kinematics: Scara,
    path: Path,
    start: Joints,
    samples: GridSamples,
    index: int,
    joint: int,
    why: str,
    largest_speed: float = 0.0,
) -> PathError:
    s = float(samples.grid[index])
    segment = bisect_right(path.breaks, s)
    where = f"segment {segment}, " if path.breaks else ""
    text = f"{where}{s:.4f} m along the path of {path.length:.4f} m: {why}"
    name = kinematics.limits[joint].name
    instead = _alternative(kinematics, start, samples, elbow=largest_speed == 0.0)
    return PathError(f"{text}; {instead}", segment, name, s, largest_speed)


def _alternative(kinematics: Scara, start: Joints, samples: GridSamples, *, elbow: bool) -> str:
    """Return the alternatives to the path, those with the other elbow only if requested."""
    offers = []
    for other in kinematics.inverse(kinematics.forward(start)):
        if elbow and math.sin(other.j3) * math.sin(start.j3) < 0.0 and not kinematics.beyond(other):
            joints = along(kinematics, samples.tool, other).joints
            # The other elbow mirrors this one: it is stretched at the same points.
            stretched = (np.abs(np.sin(joints[:, 2])) < STRETCHED).any()
            if not stretched and not any(kinematics.beyond(row) for row in joints.tolist()):
                offers.append(
                    "with the elbow on the other side the whole path is within limits: start from "
                    f"({', '.join(f'{value:.4f}' for value in other)})"
                )
    goal = Pose(*samples.tool.poses[-1].tolist())
    try:
        kinematics.solve(goal, start)
    except UnreachableError:
        offers.append("the goal itself is out of limits too: choose another yaw or place")
    else:
        offers.append("the goal itself can be reached with a PTP motion")
    return "; ".join(offers)
