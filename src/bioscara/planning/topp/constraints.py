"""Limits of joints and tool as limits of the speed along a path, at the points of a grid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bioscara.kinematics import Joints, Scara
from bioscara.kinematics.elementary import sin_cos
from bioscara.planning.arrays import Array, Index
from bioscara.planning.limits import JointLimits, ToolLimits
from bioscara.planning.paths.inverse_kinematics import JointSamples, along
from bioscara.planning.paths.segments import Path, PathSamples
from bioscara.planning.topp.phase_plane import Rows

_SIDES = 8
"""Half the number of sides of the polygon that approximates the circle of the tool's accelerations.
It lies inside the circle and loses at most 2 % of it, none purely along or across the path."""


class GridSamples(NamedTuple):
    """A path and the joints on it, at the points of a grid.

    Attributes:
        grid: Path parameters [m], shape (n,).
        tool: The tool; second derivatives are those just after each point.
        joints: The joints likewise.
        tool_before: The tool; second derivatives are those just before each point.
        joints_before: The joints likewise.
    """

    grid: Array
    tool: PathSamples
    joints: JointSamples
    tool_before: PathSamples
    joints_before: JointSamples


def sample_grid(kinematics: Scara, path: Path, start: Joints, grid: Array) -> GridSamples:
    """Evaluate the path at the points of a grid, which contains all its breaks."""
    tool = path.sample(grid)
    if not path.breaks:
        joints = along(kinematics, tool, start)
        return GridSamples(grid, tool, joints, tool, joints)
    # Only second derivatives jump there; poses sampled next to a break would add accelerations.
    breaks = np.flatnonzero(np.isin(grid, path.breaks))
    edges, jumps = PathSamples(*(part[breaks] for part in tool)), []
    for beside in (1e-9 * path.length, -1e-9 * path.length):
        second = path.sample(grid[breaks] + beside).second
        jumps.append((second, along(kinematics, edges._replace(second=second), start).second))
    joints = along(kinematics, tool, start)
    (after, joints_after), (before, joints_before) = jumps
    return GridSamples(
        grid,
        tool._replace(second=_with(tool.second, breaks, after)),
        joints._replace(second=_with(joints.second, breaks, joints_after)),
        tool._replace(second=_with(tool.second, breaks, before)),
        joints._replace(second=_with(joints.second, breaks, joints_before)),
    )


def _with(values: Array, rows: Index, instead: Array) -> Array:
    result = values.copy()
    result[rows] = instead
    return result


def speed_limits(samples: GridSamples, limits: Sequence[JointLimits], tool: ToolLimits) -> Array:
    """Return the square of the speed along the path that each point allows, shape (n,)."""
    velocities = np.array([limit.max_velocity for limit in limits])
    first = samples.tool.first
    with np.errstate(divide="ignore", over="ignore"):
        speeds = np.minimum(
            (velocities / np.abs(samples.joints.first)).min(axis=1),
            tool.speed / np.linalg.norm(first[:, :3], axis=1),
        )
        speeds = np.minimum(speeds, tool.yaw_speed / np.abs(first[:, 3]))
    return np.asarray(speeds * speeds, dtype=np.float64)


def acceleration_limits(
    samples: GridSamples, limits: Sequence[JointLimits], tool: ToolLimits
) -> Rows:
    """Return the limits of acceleration on each piece of the grid, at both of its ends."""
    accelerations = np.array([limit.max_acceleration for limit in limits])
    straight = not (samples.tool.second[:, :3].any() or samples.tool_before.second[:, :3].any())
    begin = _at(samples.tool, samples.joints, accelerations, tool, straight)
    end = _at(samples.tool_before, samples.joints_before, accelerations, tool, straight)
    # At the end of a piece u is the same, and b has grown by 2 u times its length.
    twice = 2.0 * np.diff(samples.grid)[:, None]
    return Rows(
        np.hstack((begin.along[:-1], end.along[1:] + twice * end.across[1:])),
        np.hstack((begin.across[:-1], end.across[1:])),
    )


def _at(
    path: PathSamples, joints: JointSamples, accelerations: Array, tool: ToolLimits, straight: bool
) -> Rows:
    """Return the limits of acceleration at each point."""
    u, b = [joints.first / accelerations], [joints.second / accelerations]
    if math.isfinite(tool.yaw_acceleration):
        u.append(path.first[:, 3:] / tool.yaw_acceleration)
        b.append(path.second[:, 3:] / tool.yaw_acceleration)
    if math.isfinite(tool.acceleration):
        first, second = path.first[:, :3], path.second[:, :3]
        speed = np.linalg.norm(first, axis=1)[:, None]
        if straight:
            u.append(speed / tool.acceleration)
            b.append(np.zeros_like(speed))
        else:
            tangent = first / np.where(speed > 0.0, speed, 1.0)
            ahead = (second * tangent).sum(axis=1)[:, None]
            aside = np.linalg.norm(second - ahead * tangent, axis=1)[:, None]
            angles = (np.arange(_SIDES) + 0.5) * math.pi / _SIDES
            scale = 1.0 / (tool.acceleration * math.cos(0.5 * math.pi / _SIDES))
            sine, cosine = sin_cos(angles)
            u.append(speed * cosine * scale)
            b.append((ahead * cosine + aside * sine) * scale)
    return Rows(np.hstack(u), np.hstack(b))
