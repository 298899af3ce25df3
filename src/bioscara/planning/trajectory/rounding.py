"""Rounds the corners of a motion through points without velocities, each as far as it is one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bioscara.planning.arrays import Array
from bioscara.planning.trajectory.trajectory import Trajectory

_REFINED = 4
"""How often the durations of the corners are computed again, as they change with the speed."""


def rounded(trajectory: Trajectory, jerks: Sequence[float]) -> Trajectory | None:
    """Return a motion from rest to rest through points without velocities, with rounded corners.

    Each jump of the velocity is spread over the time in which the joint may make it. Where the jump
    is J and the highest jerk j, the acceleration rises over h = sqrt(J / j) and falls over h, and
    the motion leaves the straight lines by at most J h / 6, near the corner. The lines are
    followed so much faster that the whole takes as long as before.

    Args:
        trajectory: The motion; lines between its points.
        jerks: Highest jerk of each joint [unit/s^3], above 0.

    Returns:
        The motion; None where the time is too short for its corners.
    """
    times, positions = trajectory.times - trajectory.times[0], trajectory.positions
    duration = float(times[-1])
    if not np.diff(positions, axis=0).any():
        return trajectory
    inner = duration
    for _ in range(_REFINED):
        ahead = times * (inner / duration)
        slopes = np.diff(positions, axis=0) / np.diff(ahead)[:, None]
        rest = np.zeros((1, positions.shape[1]))
        jumps = np.diff(np.vstack((rest, slopes, rest)), axis=0)
        halves = np.sqrt((np.abs(jumps) / np.asarray(jerks)).max(axis=1))
        begin, end = float((halves - ahead).max()), float((halves + ahead - ahead[-1]).max())
        inner = duration - begin - end
        if inner <= 0.0:
            return None
    corners = begin + times * (inner / duration)
    return _curve(trajectory, corners, jumps * (ahead[-1] / inner), halves, duration)


def _curve(
    trajectory: Trajectory, corners: Array, jumps: Array, halves: Array, duration: float
) -> Trajectory:
    """Return the motion whose jerk is that of the rounded corners, one after the other.

    Args:
        trajectory: The motion that is rounded.
        corners: When its lines meet, from where the motion begins [s].
        jumps: Jump of each velocity there.
        halves: Time over which the acceleration rises, and that over which it falls [s].
        duration: Of the motion [s].
    """
    real = halves > 0.0
    corners, jumps, halves = corners[real], jumps[real], halves[real]
    jerks = jumps / (halves**2)[:, None]
    # It may rest for a time at first, and at last.
    ends, rest = np.array((0.0, duration)), np.zeros((1, jumps.shape[1]))
    times = np.concatenate((ends, corners - halves, corners, corners + halves)).clip(0.0, duration)
    changes = np.concatenate((rest, rest, jerks, -2.0 * jerks, jerks))
    order = np.argsort(times, kind="stable")
    times, jerk = times[order], changes[order].cumsum(axis=0)
    last = np.concatenate((np.diff(times) > 0.0, [True]))
    times, jerk = times[last], jerk[last][:-1]
    lasts = np.diff(times)[:, None]
    acceleration = np.concatenate((rest, (jerk * lasts).cumsum(axis=0)))[:-1]
    speeds = (acceleration + jerk * lasts / 2.0) * lasts
    velocity = np.concatenate((rest, speeds.cumsum(axis=0)))
    ways = (velocity[:-1] + (acceleration / 2.0 + jerk * lasts / 6.0) * lasts) * lasts
    positions = trajectory.positions[0] + np.concatenate((rest, ways.cumsum(axis=0)))
    velocity[-1], positions[-1] = 0.0, trajectory.positions[-1]
    cubics = np.stack((acceleration / 2.0, jerk / 6.0), axis=-1)
    names = trajectory.joint_names
    return Trajectory(names, times, positions, velocity, cubics=cubics)
