"""Bringing the joints to rest after a cancel or a violation, and for a pause."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.control.controllers.joint_trajectory.goal_messages import Point
from bioscara.control.controllers.joint_trajectory.interpolation import (
    Course,
    CurveState,
    Interpolator,
)
from bioscara.planning import Sample

_SLOWEST = 0.2
"""Least rate at which the pace falls [1/s], even where the course itself uses all deceleration."""
_ROUND = 0.16
"""Share of a stop over which its deceleration builds up, and again over which it ends."""
_STEEPEST = 1e3
"""Highest rate at which the pace falls [1/s]: at the ends of a course nothing moves."""


def deceleration(state: Sample, limits: Sequence[float]) -> Interpolator:
    """Return a course of constant decelerations to rest, each joint on its own, from time 0 on.

    A joint at speed v covers v^2 / (2 a).

    Args:
        state: Desired positions and velocities of the joints at time 0.
        limits: Deceleration of each [rad/s^2 or m/s^2], above zero.
    """
    joints = [
        (start, speed, abs(speed) / limit)
        for start, speed, limit in zip(state.positions, state.velocities, limits, strict=True)
    ]
    points = []
    for time in sorted({0.0, *(end for _, _, end in joints)}):
        positions, velocities = [], []
        for start, speed, end in joints:
            left = max(1.0 - time / end, 0.0) if end else 0.0
            positions.append(start + speed * end / 2.0 * (1.0 - left * left))
            velocities.append(speed * left)
        points.append(Point(time, tuple(positions), tuple(velocities)))
    return Interpolator(points)


class Braked:
    """A course at a pace that falls to zero, as fast as the joints can decelerate.

    The joints thus come to rest on their path, not next to it.

    Args:
        course: The followed course.
        time: Time on it from which on the pace falls [s].
        pace: Time on the course per time there.
        limits: Deceleration of each joint [rad/s^2 or m/s^2], above zero.
        period: Time from cycle to cycle [s].
        least: Shortest duration of the stop, at a constant rate except for a rounded begin and end
            [s]; 0 for as fast as the joints can.

    Attributes:
        end: Where the joints come to rest [rad or m].
        duration: When [s since the pace began to fall].
        begins: Time from which it is defined [s].
        continuable: Whether a new trajectory may continue from it.
    """

    continuable = True

    def __init__(
        self,
        course: Course,
        time: float,
        pace: float,
        limits: Sequence[float],
        period: float,
        least: float = 0.0,
    ) -> None:
        self._course, self._period, self.begins = course, period, 0.0
        self._steepest, self._bend = _STEEPEST, math.inf
        if least:
            self._bend = pace / (_ROUND * (1.0 - _ROUND) * least**2)
            self._steepest = self._bend * _ROUND * least
        self._last = 0.0
        self._limits = tuple(limits)
        self._steps = [(time, pace)]
        before = course.sample(time).values
        slowest = _SLOWEST * max(pace, 1.0)
        while pace > 0.0:
            after = course.sample(time + pace * period).values
            left = self._left(before, after, pace, slowest)
            time, pace, before = time + (pace + left) / 2.0 * period, left, after
            self._steps.append((time, pace))
        self.duration = (len(self._steps) - 1) * period
        self.end = course.sample(time).values.positions

    def sample(self, time: float) -> CurveState:
        """Return the state at ``time`` [s since the pace began to fall]."""
        return self._at(*self.along(time))

    def along(self, time: float) -> tuple[float, float, float]:
        """Return the time on the course [s], the pace, and the rate of the pace [1/s].

        Args:
            time: Time since the pace began to fall [s].
        """
        index = min(max(int(time / self._period), 0), len(self._steps) - 2)
        if index < 0 or time >= self.duration:
            return self._steps[-1][0], 0.0, 0.0
        (begin, pace), (_, left) = self._steps[index : index + 2]
        rate, into = (left - pace) / self._period, time - index * self._period
        return begin + (pace + rate * into / 2.0) * into, pace + rate * into, rate

    def _at(self, time: float, pace: float, rate: float) -> CurveState:
        (positions, velocities, accelerations), point = self._course.sample(time)
        pairs = tuple(zip(velocities, accelerations, strict=True))
        values = Sample(
            positions,
            tuple([v * pace for v, _ in pairs]),
            tuple([a * pace * pace + v * rate for v, a in pairs]),
        )
        return CurveState(values, point)

    def _left(self, before: Sample, after: Sample, pace: float, slowest: float) -> float:
        """Return the pace at the end of a period, for the course where it begins and ends."""
        left, rate, falling = pace, -_STEEPEST, 0.0
        for _ in range(2):
            # A joint that accelerates on the course does so less when the pace has fallen.
            rate = max(rate, self._rate(before, left), self._rate(after, left))
            falling = min(max(rate, self._even(pace)), -slowest)
            left = max(pace + falling * self._period, 0.0)
        self._last = falling
        return left

    def _even(self, pace: float) -> float:
        """Return the rate of the pace where it changes gradually [1/s], below zero."""
        if math.isinf(self._bend):
            return -_STEEPEST
        step = self._bend * self._period
        # From the pace left at the end of the period, so that the last period makes no step.
        ending = step - math.sqrt(step * step + 2.0 * self._bend * pace)
        return max(self._last - step, -self._steepest, ending)

    def _rate(self, values: Sample, pace: float) -> float:
        """Return the steepest possible rate of the pace [1/s], below zero."""
        rate = -_STEEPEST
        for v, a, limit in zip(values.velocities, values.accelerations, self._limits, strict=True):
            if v:
                gain = (a if v > 0.0 else -a) * pace * pace
                rate = max(rate, -(limit + gain) / abs(v))
        return rate


def standstill(positions: Sequence[float]) -> Interpolator:
    """Return the course that stays at ``positions`` [rad or m]."""
    return Interpolator([Point(0.0, tuple(positions))])
