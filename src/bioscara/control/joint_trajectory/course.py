"""The curve through the points of a trajectory, as ros2_control draws it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from bioscara.control.joint_trajectory.messages import JointValues, Point

Coefficients = tuple[float, float, float, float, float, float]


class Place(NamedTuple):
    """Where a course is at some time.

    Attributes:
        values: State of the joints.
        point: Index of the point that is being approached; the number of points once all are
            passed.
    """

    values: JointValues
    point: int


class Course:
    """Checked points in the controller's order, and the way to the first of them.

    Between two points: a quintic where both have velocities and accelerations, a cubic where both
    have velocities, a straight line otherwise. Before the first point the curve comes from the
    state that :meth:`begin` is given.

    Args:
        points: At least one, with positions; times increase strictly.
        interpolate: False to output each point as it is until its time has come.
    """

    def __init__(self, points: Sequence[Point], *, interpolate: bool = True) -> None:
        self.points = tuple(points)
        self._interpolate = interpolate
        self._times = [point.time for point in points]
        self._pieces: list[tuple[Coefficients, ...]] = [
            _piece(before, after) for before, after in pairwise(points)
        ]
        self._lead: tuple[Coefficients, ...] = ()
        self._lead_start = 0.0
        self._start: JointValues | None = None
        self.duration = self._times[-1]

    @property
    def begun(self) -> bool:
        """Whether the state before the first point is known."""
        return self._start is not None

    def begin(self, state: JointValues, time: float) -> None:
        """Take the state from which the first point is approached.

        Args:
            state: Where the joints are.
            time: When [s since the trajectory's start]; negative where that is still to come.
        """
        self._start, self._lead_start = state, time
        first = self.points[0]
        if first.time > time:
            # What the start state lacks counts as zero, so the lead-in is as smooth as the rest.
            before = Point(time, state.positions, state.velocities, state.accelerations)
            self._lead = _piece(before, first)

    def sample(self, time: float) -> Place:
        """Return the state at ``time`` [s since the trajectory's start]; :meth:`begin` first."""
        times = self._times
        if time >= times[-1]:
            return Place(_at_rest(self.points[-1]), len(times))
        index = bisect_right(times, time)
        if not self._interpolate:
            held = self._start if index == 0 else _at_rest(self.points[index])
            return Place(held or _at_rest(self.points[0]), index)
        if index == 0:
            return Place(_evaluate(self._lead, max(time - self._lead_start, 0.0)), 0)
        return Place(_evaluate(self._pieces[index - 1], time - times[index - 1]), index)


def _at_rest(point: Point) -> JointValues:
    nothing = (0.0,) * len(point.positions)
    return JointValues(point.positions, point.velocities or nothing, point.accelerations or nothing)


def _evaluate(piece: tuple[Coefficients, ...], t: float) -> JointValues:
    positions, velocities, accelerations = [], [], []
    for c0, c1, c2, c3, c4, c5 in piece:
        positions.append(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))))
        velocities.append(c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5))))
        accelerations.append(2 * c2 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5)))
    return JointValues(tuple(positions), tuple(velocities), tuple(accelerations))


def _piece(before: Point, after: Point) -> tuple[Coefficients, ...]:
    """Return the polynomials of one piece, powers of the time since its begin."""
    t = after.time - before.time
    pieces = []
    for joint, (p0, p1) in enumerate(zip(before.positions, after.positions, strict=True)):
        if not (before.velocities and after.velocities):
            pieces.append((p0, (p1 - p0) / t, 0.0, 0.0, 0.0, 0.0))
            continue
        v0, v1, way = before.velocities[joint], after.velocities[joint], p1 - p0
        if not (before.accelerations and after.accelerations):
            pieces.append(
                (
                    p0,
                    v0,
                    (3 * way / t - 2 * v0 - v1) / t,
                    (v0 + v1 - 2 * way / t) / t**2,
                    0.0,
                    0.0,
                )
            )
            continue
        a0, a1 = before.accelerations[joint], after.accelerations[joint]
        pieces.append(
            (
                p0,
                v0,
                a0 / 2,
                (20 * way - (8 * v1 + 12 * v0) * t - (3 * a0 - a1) * t**2) / (2 * t**3),
                (-30 * way + (14 * v1 + 16 * v0) * t + (3 * a0 - 2 * a1) * t**2) / (2 * t**4),
                (12 * way - 6 * (v1 + v0) * t + (a1 - a0) * t**2) / (2 * t**5),
            )
        )
    return tuple(pieces)
