"""The curve through the points of a goal, and the path to the first of them."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple, Protocol

from bioscara.control.controllers.joint_trajectory.goal_messages import Point
from bioscara.errors import TrajectoryError
from bioscara.planning.trajectory.polynomials import Sample, cubic, evaluate, line, quintic

Coefficients = tuple[float, ...]
_new = tuple.__new__

_SHORTEST = 1e-6
"""Shortest path to the first point [s]: no cycle samples a shorter one."""


class CurveState(NamedTuple):
    """State of the curve at a time.

    Attributes:
        values: State of the joints.
        point: Index of the point that is being approached; the number of points once all are
            passed.
    """

    values: Sample
    point: int


class Course(Protocol):
    """A course of the joints."""

    @property
    def begins(self) -> float:
        """Time from which it is defined [s]."""

    @property
    def duration(self) -> float:
        """Time at which the joints arrive [s], or, of a stream, up to which it is known."""

    @property
    def end(self) -> tuple[float, ...]:
        """Where they are to rest [rad or m]."""

    @property
    def continuable(self) -> bool:
        """Whether a new trajectory may continue from it."""

    def sample(self, time: float) -> CurveState:
        """Return the state at a time on it [s]."""


class Interpolator:
    """Curve through checked points in the controller's order, and the path to the first of them.

    Between two points: a quintic where both have velocities and accelerations, a cubic where both
    have velocities, a straight line otherwise. Before the first point the curve comes from the
    state that :meth:`begin` is given; without it the curve stays at the first point. After the
    last point the joints are to rest there, even if it was passed in motion.

    Args:
        points: At least one, with positions; times increase strictly.
        interpolate: False to output each point unchanged until its time.

    Attributes:
        points: As given.
        end: Where the joints are to rest [rad or m].
        duration: Time of the last point [s].
        begins: Time from which it is defined [s].
        continuable: Whether a new trajectory may continue from it; a single point is replaced.

    Raises:
        TrajectoryError: Two points are so far apart or so close in time that the coefficients of
            the curve between them are not finite.
    """

    def __init__(self, points: Sequence[Point], *, interpolate: bool = True) -> None:
        self.points = tuple(points)
        self._interpolate = interpolate
        self._times = [point.time for point in points]
        self._segments = [_segment(before, after) for before, after in pairwise(points)]
        self._lead: tuple[Coefficients, ...] = ()
        self._lead_to = 0
        self._first, last = _as_given(points[0]), _as_given(points[-1])
        self._waiting = self._first
        self._last, self._rest = (
            CurveState(last, len(points)),
            CurveState(_at_rest(last), len(points)),
        )
        self.duration, self.begins = self._times[-1], self._times[0]
        self.end, self.continuable = last.positions, len(points) > 1

    def begin(self, state: Sample, time: float, *, bridge: bool = False) -> None:
        """Set the state from which the first point is approached.

        Args:
            state: State of the joints.
            time: Its time [s since the trajectory's start]; negative before the start.
            bridge: Whether points up to ``time`` are left out, so that the curve continues from
                ``state`` even if it begins midway. Otherwise it follows its points at once.

        Raises:
            TrajectoryError: The coefficients of the curve to the first point are not finite.
        """
        self.begins, self._waiting = time, _at_rest(state)
        self._lead_to = bisect_right(self._times, time + _SHORTEST) if bridge else 0
        if self._lead_to < len(self.points):
            first = self.points[self._lead_to]
            if first.time - time > _SHORTEST:
                # Missing start derivatives count as zero, so that it is as smooth as the rest.
                self._lead = _segment(Point(time, *state), first)

    def sample(self, time: float) -> CurveState:
        """Return the state at ``time`` [s since the trajectory's start]."""
        times = self._times
        if time >= self.duration:
            return self._rest if time > self.duration else self._last
        index, lead_to = bisect_right(times, time), self._lead_to
        if not self._interpolate:
            waits = index <= lead_to
            return CurveState(self._waiting if waits else _as_given(self.points[index]), index)
        if index > lead_to or (index and not self._lead):
            values = evaluate(self._segments[index - 1], time - times[index - 1])
            # CurveState(...) takes twice as long.
            return _new(CurveState, (values, index))
        if self._lead:
            return CurveState(evaluate(self._lead, max(time - self.begins, 0.0)), lead_to)
        return CurveState(self._first, 0)


def _as_given(point: Point) -> Sample:
    nothing = (0.0,) * len(point.positions)
    return Sample(point.positions, point.velocities or nothing, point.accelerations or nothing)


def _at_rest(values: Sample) -> Sample:
    nothing = (0.0,) * len(values.positions)
    return Sample(values.positions, nothing, nothing)


def _segment(before: Point, after: Point) -> tuple[Coefficients, ...]:
    """Return the polynomials of one segment, powers of the time since its begin."""
    t = after.time - before.time
    moving = bool(before.velocities and after.velocities)
    curved = moving and bool(before.accelerations and after.accelerations)
    segments = []
    try:
        for joint, (p0, p1) in enumerate(zip(before.positions, after.positions, strict=True)):
            if not moving:
                segments.append(line(p0, p1, t))
                continue
            speeds = before.velocities[joint], after.velocities[joint]
            if curved:
                changes = before.accelerations[joint], after.accelerations[joint]
                segments.append(quintic(p0, p1, *speeds, *changes, t))
            else:
                segments.append(cubic(p0, p1, *speeds, t))
    except (OverflowError, ZeroDivisionError):
        segments.append((math.nan,) * 6)
    if not math.isfinite(sum(map(sum, segments))):
        raise TrajectoryError(
            f"no curve can be computed between the points at {before.time:g} s and "
            f"{after.time:g} s: they are too close in time or too far apart"
        )
    return tuple(segments)
