"""Moving averages of joint motions whose accelerations jump.

An average of joint positions keeps every limit of a joint, because limits are convex. The path
between start and end changes slightly: by less than a tenth of the acceleration times the square of
the window.
"""

from __future__ import annotations

import numpy as np

from bioscara.planning.arrays import Array
from bioscara.planning.trajectory.trajectory import Trajectory

_STEP, _APART = 0.01, 1e-4
"""Time between two points, and the least one [s]."""
_LOOK = 0.005
"""Time over which accelerations are compared [s]."""


def averaged(trajectory: Trajectory, window: float) -> Trajectory:
    """Return the moving average of a motion from rest to rest; it takes one window longer.

    Args:
        trajectory: The motion.
        window: Window over which it is averaged [s], above 0.
    """
    if len(trajectory.times) == 1:
        return trajectory
    motion = _Motion(trajectory)
    end = trajectory.duration + window
    corners = np.concatenate((trajectory.times, trajectory.times + window))
    even = np.linspace(0.0, end, int(np.ceil(end / _STEP)) + 1)
    times = np.unique(np.concatenate((corners, even)))
    times = times[np.concatenate(([True], np.diff(times) > _APART))]
    times[-1] = end
    (here, area), (before, less) = motion.at(times), motion.at(times - window)
    positions, velocities = (area - less) / window, (here - before) / window
    positions[0], positions[-1] = trajectory.positions[0], trajectory.positions[-1]
    velocities[[0, -1]] = 0.0
    return Trajectory(trajectory.joint_names, times, positions, velocities)


def most_jerk(trajectory: Trajectory) -> Array:
    """Return the highest jerk of each joint [unit/s^3]; a jump is taken to last 5 ms."""
    count = int(np.ceil(trajectory.duration / _LOOK)) + 3
    times = trajectory.times[0] + _LOOK * (np.arange(count) - 1.0)
    accelerations = trajectory.sample_many(times)[2]
    return np.asarray(np.abs(np.diff(accelerations, axis=0)).max(axis=0) / _LOOK)


class _Motion:
    """Positions of a motion, which rests before and after, and their integral."""

    def __init__(self, trajectory: Trajectory) -> None:
        self._trajectory = trajectory
        powers = np.arange(1.0, 7.0)
        self._integrals = trajectory.coefficients / powers
        steps = np.diff(trajectory.times)[:, None]
        areas = np.zeros_like(steps * self._integrals[..., 0])
        for power in range(5, -1, -1):
            areas = (areas + self._integrals[..., power]) * steps
        self._areas = np.concatenate((np.zeros((1, areas.shape[1])), np.cumsum(areas, axis=0)))

    def at(self, times: Array) -> tuple[Array, Array]:
        """Return positions at some times, and their integrals since the start."""
        known = self._trajectory.times
        inside = np.clip(times, known[0], known[-1])
        piece = np.clip(np.searchsorted(known, inside, side="right") - 1, 0, len(known) - 2)
        t = (inside - known[piece])[:, None]
        coefficients, integrals = self._trajectory.coefficients[piece], self._integrals[piece]
        here, area = np.zeros_like(coefficients[..., 0]), np.zeros_like(coefficients[..., 0])
        for power in range(5, -1, -1):
            here = here * t + coefficients[..., power]
            area = (area + integrals[..., power]) * t
        outside = (times - inside)[:, None]
        return here, area + self._areas[piece] + outside * here
