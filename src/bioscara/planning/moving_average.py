"""Moving averages of streamed values and of whole motions, which do not excite belt oscillations.

A load behind a belt has a natural period. An average over that period has no component at its
frequency: without damping the velocity of the load is itself an average of the input, hence
nowhere higher. Averages of averages achieve this for several periods.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from bioscara.planning.arrays import Array
from bioscara.planning.trajectory.trajectory import Trajectory

Values = tuple[float, float, float, float]
"""One value for each joint, or for each velocity of the tool."""


class Average:
    """Moving average of four values over a window.

    It is the difference of two integrals, each of which is the sum of the same numbers in the same
    order: its rounding does not grow. The four values are unrolled because streamed commands are
    averaged in every cycle.

    Args:
        window: Duration of the window [s]; above 0.
        values: The values until now.
    """

    def __init__(self, window: float, values: Sequence[float]) -> None:
        self._window = window
        self.fill(values)

    def fill(self, values: Sequence[float]) -> None:
        """Fill the whole window with constant values."""
        a, b, c, d = values
        window, zero = self._window, (0.0, 0.0, 0.0, 0.0)
        # Each part: its duration, its values, and their integrals up to its beginning.
        self._parts: deque[tuple[float, Values, Values]] = deque([(window, (a, b, c, d), zero)])
        self._integrals = (window * a, window * b, window * c, window * d)
        self._gone = 0.0

    def refill(self, values: Sequence[float], which: Sequence[int]) -> None:
        """Fill the whole window of some of the four with constant values; the others go on.

        Args:
            values: The values of all.
            which: Numbers of those to fill.
        """
        parts, passed = self._parts, 0.0
        self._parts = deque()
        for lasted, old, integrals in parts:
            each, sums = list(old), list(integrals)
            for index in which:
                each[index], sums[index] = values[index], passed * values[index]
            self._parts.append((lasted, _four(each), _four(sums)))
            passed += lasted
        ends = list(self._integrals)
        for index in which:
            ends[index] = passed * values[index]
        self._integrals = _four(ends)

    def ahead(self, values: Array, period: float) -> Array:
        """Return the averages after each of further values, one per period [s], shape (n, 4)."""
        counts = [round(lasted / period) for lasted, _, _ in self._parts]
        counts[0] = round((self._parts[0][0] - self._gone) / period)
        counts[-1] = max(counts[-1], 1)
        past = np.repeat(np.array([each for _, each, _ in self._parts]), counts, axis=0)
        sums = np.concatenate((past, values)).cumsum(axis=0)
        averages: Array = (sums[len(past) :] - sums[: len(values)]) / len(past)
        return averages

    @property
    def oldest(self) -> Values:
        """The values that leave the average next."""
        return self._parts[0][1]

    def step(self, values: Values, duration: float) -> Values:
        """Advance by constant values over a duration [s]; return the new average."""
        parts, window, before = self._parts, self._window, self._integrals
        parts.append((duration, values, before))
        p, q, r, s = values
        a, b, c, d = before
        a, b, c, d = a + duration * p, b + duration * q, c + duration * r, d + duration * s
        self._integrals = a, b, c, d
        gone = self._gone + duration
        while gone >= parts[0][0]:
            gone -= parts.popleft()[0]
        self._gone = gone
        _, (p, q, r, s), (w, x, y, z) = parts[0]
        return (
            (a - w - gone * p) / window,
            (b - x - gone * q) / window,
            (c - y - gone * r) / window,
            (d - z - gone * s) / window,
        )


def _four(values: Sequence[float]) -> Values:
    a, b, c, d = values
    return a, b, c, d


class Smoothed:
    """Moving averages in series, each the average of the one before.

    Args:
        windows: Duration of each window [s].
        values: The values until now.
    """

    def __init__(self, windows: Sequence[float], values: Sequence[float]) -> None:
        self._averages = [Average(window, values) for window in windows]

    @property
    def oldest(self) -> Sequence[float]:
        """The values that leave the first average next; empty if there is no average."""
        return self._averages[0].oldest if self._averages else ()

    def fill(self, values: Sequence[float]) -> None:
        """Fill all windows with constant values."""
        for average in self._averages:
            average.fill(values)

    def refill(self, values: Sequence[float], which: Sequence[int]) -> None:
        """Fill all windows of some of the four with constant values; the others go on."""
        for average in self._averages:
            average.refill(values, which)

    def step(self, values: Values, duration: float) -> Values:
        """Advance by constant values over a duration [s]; return the new average."""
        for average in self._averages:
            values = average.step(values, duration)
        return values

    def ahead(self, values: Array, period: float) -> Array:
        """Return the averages after each of further values, one per period [s], shape (n, 4)."""
        for average in self._averages:
            values = average.ahead(values, period)
        return values


_STEP, _APART = 0.01, 1e-4
"""Time between two points, and the shortest [s]."""
_SMOOTH = 1e-3
"""Jump of the velocity that counts as none [unit/s]."""
_COMPARED = 0.005
"""Time between two velocities that are compared [s]."""


def averaged(trajectory: Trajectory, window: float) -> Trajectory:
    """Return the moving average of a motion from rest to rest; it takes one window longer.

    Args:
        trajectory: The motion.
        window: Window over which it is averaged [s], above 0.
    """
    if len(trajectory.times) == 1:
        return trajectory
    motion = _MotionIntegral(trajectory)
    end = trajectory.duration + window
    corners = np.concatenate((trajectory.times, trajectory.times + window))
    even = np.linspace(0.0, end, int(np.ceil(end / _STEP)) + 1)
    times = np.sort(np.concatenate((corners, even)))
    times = times[np.concatenate(([True], np.diff(times) > _APART))]
    times[-1] = end
    (here, area), (before, less) = motion.at(times), motion.at(times - window)
    positions, velocities = (area - less) / window, (here - before) / window
    positions[0], positions[-1] = trajectory.positions[0], trajectory.positions[-1]
    velocities[[0, -1]] = 0.0
    return Trajectory(trajectory.joint_names, times, positions, velocities)


def most_jerk(trajectory: Trajectory) -> Array:
    """Return the highest jerk of each joint [unit/s^3].

    It is the second difference of velocities 5 ms apart: a jump of the acceleration is taken to
    last so long, and one of the velocity to be two of these.
    """
    count = int(np.ceil(trajectory.duration / _COMPARED)) + 4
    times = trajectory.times[0] + _COMPARED * (np.arange(count) - 2.0)
    velocities = trajectory.sample_many(times)[1]
    return np.asarray(np.abs(np.diff(velocities, n=2, axis=0)).max(axis=0) / _COMPARED**2)


def velocity_jumps(trajectory: Trajectory) -> bool:
    """Return whether a joint's velocity jumps at a point, or is not zero at the start or end."""
    if len(trajectory.times) == 1:
        return False
    powers = np.arange(1.0, 6.0)
    slopes = trajectory.coefficients[..., 1:] * powers
    ends = (slopes * np.diff(trajectory.times)[:, None, None] ** (powers - 1.0)).sum(axis=-1)
    rest = np.zeros((1, ends.shape[1]))
    jumps = np.concatenate((slopes[..., 0], rest)) - np.concatenate((rest, ends))
    return bool(np.abs(jumps).max() > _SMOOTH)


class _MotionIntegral:
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
