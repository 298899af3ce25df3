"""Rounds the corners of a motion through points without velocities, each as far as it is one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bioscara.planning.arrays import Array
from bioscara.planning.trajectory.trajectory import Trajectory

_APART = 1e-6
"""Times nearer to each other than this are one [s]."""
_REFINED = 4
"""How often the durations of the corners are computed again, as they change with the speed."""


def rounded(trajectory: Trajectory, jerks: Sequence[float]) -> Trajectory | None:
    """Return a motion from rest to rest through points without velocities, with rounded corners.

    Each jump of the velocity is spread over the time in which the joint may make it. Where the jump
    is J and the highest jerk j, the acceleration rises over h = sqrt(J / j) and falls over h, and
    the motion leaves the straight lines by at most J h / 6, beside the corner. The lines are
    followed so much faster that the whole takes as long as before.

    Args:
        trajectory: The motion; lines between its points.
        jerks: Highest jerk of each joint [unit/s^3], above 0.

    Returns:
        The motion; None where the time is too short for its corners.
    """
    times, positions = trajectory.times - trajectory.times[0], trajectory.positions
    duration = float(times[-1])
    if not duration:
        return trajectory
    inner, begin = duration, 0.0
    for _ in range(_REFINED):
        ahead = times * (inner / duration)
        slopes = np.diff(positions, axis=0) / np.diff(ahead)[:, None]
        rest = np.zeros((1, positions.shape[1]))
        jumps = np.diff(np.vstack((rest, slopes, rest)), axis=0)
        halves = np.sqrt((np.abs(jumps) / np.asarray(jerks)).max(axis=1))
        begin, end = float(halves[0]), float(halves[-1])
        inner = duration - begin - end
        if inner <= 0.0:
            return None
    corners = begin + times * (inner / duration)
    return _curve(trajectory, corners, jumps * (ahead[-1] / inner), halves)


def _curve(trajectory: Trajectory, corners: Array, jumps: Array, halves: Array) -> Trajectory:
    """Return the sum of the rounded jumps, from where the motion begins."""
    known = np.sort(np.concatenate((corners - halves, corners, corners + halves)))
    known = known[np.concatenate(([True], np.diff(known) > _APART))]
    share = (known[:, None] - corners) / np.where(halves > 0.0, halves, 1.0)
    share = np.where(halves > 0.0, share, np.copysign(np.inf, known[:, None] - corners))
    before, after = np.clip(1.0 + share, 0.0, 1.0), np.clip(1.0 - share, 0.0, 1.0)
    late = share > 0.0
    speeds = np.where(late, 1.0 - after**2 / 2.0, before**2 / 2.0)
    ways = np.where(late, np.maximum(known[:, None] - corners, 0.0), 0.0)
    ways += halves * np.where(late, after**3, before**3) / 6.0
    velocities, positions = speeds @ jumps, trajectory.positions[0] + ways @ jumps
    velocities[[0, -1]] = 0.0
    positions[-1] = trajectory.positions[-1]
    return Trajectory(trajectory.joint_names, known - known[0], positions, velocities)
