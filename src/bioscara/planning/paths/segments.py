"""Paths of the tool through space and their segments: geometry without times.

A path is a curve of poses over a parameter s from 0 to its length. Along a line or an arc s is
the distance travelled by the tool in metres; where the rotation over a short distance is so large
that it takes longer, s is the angle times :data:`LEVER`. So its derivatives are bounded: the tool
moves at most 1 m and rotates at most 1 / LEVER rad per metre of s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol, Self

import numpy as np
import numpy.typing as npt

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.kinematics.elementary import dot, sin_cos
from bioscara.kinematics.pose import require_near_place, require_pose, wrapped
from bioscara.planning.arrays import Array, Index
from bioscara.planning.trajectory.polynomials import evaluate_many

LEVER = 0.1
"""Path length equivalent to one radian of rotation [m/rad]."""

SHORTEST = 1e-6
"""Least length of a segment [m], and least height of an arc over its chord."""

_HALF = 1e-6
"""Tolerance within which an angle is treated as half a turn [rad]."""

_GAP, _KINK = 1e-9, 1e-6
"""Largest steps of pose and of first derivative between joined segments, for rounding."""

_POWERS = 6
"""Number of powers of the polynomial, 0 to 5."""


class PathSamples(NamedTuple):
    """A path at n parameters, each array (n, 4): x, y, z [m] and yaw [rad], not wrapped.

    Attributes:
        poses: The poses.
        first: Their first derivative by s.
        second: Their second derivative by s.
    """

    poses: Array
    first: Array
    second: Array


class Path(Protocol):
    """A curve of poses, continuous together with its first derivative."""

    @property
    def length(self) -> float:
        """Largest parameter; the smallest is 0."""
        ...

    @property
    def breaks(self) -> tuple[float, ...]:
        """Parameters inside the path where one formula ends and the next begins, increasing.

        Between breaks every derivative is continuous; at a break the second may jump.
        """
        ...

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        ...


class Formulas(NamedTuple):
    """The formulas of m segments, each a polynomial plus a circular motion.

    pose(t) = sum of p_k t^k + a cos(r t) + b sin(r t), t = s + begin. Because all segments share
    the formula, many are evaluated at once: a path of hundreds costs little more than one line.

    Attributes:
        powers: p_0 to p_5, shape (m, 6, 4).
        circle: a and b, shape (m, 2, 4).
        rate: r [rad/m], shape (m,); 0 where there is no circle.
        begin: Parameter of each formula at the start of its segment [m], shape (m,).
    """

    powers: Array
    circle: Array
    rate: Array
    begin: Array

    @classmethod
    def of(cls, segments: Sequence[Segment]) -> Self:
        """Return the formulas of some segments, in their order."""
        formulas = (segment.formula for segment in segments)
        return cls(*map(np.concatenate, zip(*formulas, strict=True)))

    def sample(self, segments: Index, s: Array) -> PathSamples:
        """Return poses and derivatives at n parameters, each of its own segment.

        Args:
            segments: Index of the segment of each parameter, shape (n,).
            s: The parameters, from 0 at the segment's start [m], shape (n,).
        """
        t = s + self.begin[segments]
        poses, first, second = evaluate_many(self.powers[segments].swapaxes(1, 2), t)
        if self.rate.any():
            rate = self.rate[segments, None]
            turned = rate * t[:, None]
            sine, cosine = sin_cos(turned)
            a, b = self.circle[segments, 0], self.circle[segments, 1]
            outward = cosine * a + sine * b
            poses += outward
            first += rate * (cosine * b - sine * a)
            second -= rate * rate * outward
        return PathSamples(poses, first, second)


class Segment:
    """A segment of a path that one formula describes.

    Args:
        length: Its largest parameter.
        powers: Coefficients of its polynomial, from power 0 on: at most 6, each a row of 4.
        circle: Point on the circle at 0 and after a quarter turn, relative to the centre.
        rate: Angular rate on the circle [rad/m].
        begin: Parameter of the formula where the segment begins.

    Attributes:
        length: As given.
        breaks: None.
        formula: The formula.
    """

    breaks: tuple[float, ...] = ()

    def __init__(
        self,
        length: float,
        powers: npt.ArrayLike,
        circle: npt.ArrayLike = ((0.0,) * 4,) * 2,
        rate: float = 0.0,
        begin: float = 0.0,
    ) -> None:
        self.length = length
        all_powers = np.zeros((1, _POWERS, 4))
        given = np.asarray(powers, dtype=np.float64)
        all_powers[0, : len(given)] = given
        self.formula = Formulas(
            all_powers, np.array([circle], dtype=np.float64), np.array([rate]), np.array([begin])
        )

    def part(self, begin: float, end: float) -> Segment:
        """Return the part of it between two of its parameters [m]."""
        powers, circle, rate, before = (column[0] for column in self.formula)
        return Segment(end - begin, powers, circle, rate, before + begin)

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        at = np.asarray(s, dtype=np.float64)
        return self.formula.sample(np.zeros(len(at), dtype=np.intp), at)


def shorter_turn(begin: float, end: float) -> float:
    """Return the shorter rotation of the tool from one yaw to another [rad].

    Half a turn is equally short in both directions: the sign of ``end - begin`` decides, not
    rounding.
    """
    displacement = end - begin
    turn = wrapped(displacement)
    if math.pi - abs(turn) < _HALF and turn * displacement < 0.0:
        turn += math.copysign(2.0 * math.pi, displacement)
    return turn


class Line(Segment):
    """A straight line, on which the tool turns uniformly by the shorter rotation.

    Args:
        start: Its first pose.
        goal: Its last pose.

    Attributes:
        length: Largest parameter.
        breaks: None.

    Raises:
        InvalidArgumentError: A value is not finite, or the poses are the same.
    """

    def __init__(self, start: Pose, goal: Pose) -> None:
        start, goal = require_pose("the start", start), require_pose("the goal", goal)
        displacement = np.subtract(goal, start)
        displacement[3] = shorter_turn(start.yaw, goal.yaw)
        distance = math.sqrt(dot(displacement[:3], displacement[:3]))
        length = max(distance, LEVER * abs(displacement[3]))
        if length < SHORTEST:
            raise InvalidArgumentError(
                f"start and goal are the same pose: {distance:.3g} m and "
                f"{abs(displacement[3]):.3g} rad apart; leave one of them out"
            )
        super().__init__(length, (start, displacement / length))


class Arc(Segment):
    """A part of a circle, on which the tool turns uniformly by the shorter rotation.

    Made by :meth:`through`.

    Attributes:
        length: Largest parameter.
        breaks: None.
        radius: Of the circle [m].
        centre: Of the circle, x, y, z [m].
    """

    def __init__(
        self, centre: Array, axes: Array, radius: float, angle: float, yaw: float, turn: float
    ) -> None:
        self.centre, self.radius = centre, radius
        length = max(radius * angle, LEVER * abs(turn))
        powers, circle = np.zeros((2, 4)), np.zeros((2, 4))
        powers[0], powers[1, 3] = (*centre, yaw), turn / length
        circle[:, :3] = radius * axes
        super().__init__(length, powers, circle, angle / length)

    @classmethod
    def through(cls, start: Pose, via: Pose, goal: Pose) -> Self:
        """Return the arc from the start through a point to the goal.

        Args:
            start: Its first pose.
            via: A point on it; its yaw does not matter.
            goal: Its last pose.

        Raises:
            InvalidArgumentError: A value is not finite, via is in other units, or the three
                points are on one line.
        """
        start, via = require_pose("the start", start), require_near_place("the via", via)
        goal = require_pose("the goal", goal)
        a, b = np.subtract(via, start)[:3], np.subtract(goal, start)[:3]
        chord = math.sqrt(dot(b, b))
        if chord < SHORTEST:
            raise InvalidArgumentError(
                f"start and goal of the arc are {chord:.3g} m apart; make a full circle of two arcs"
            )
        normal = np.cross(a, b)
        height = math.sqrt(dot(normal, normal)) / chord
        if height < SHORTEST:
            raise InvalidArgumentError(
                f"the points of the arc are on one line: via is {height:.3g} m beside the line "
                f"from start to goal, it takes {SHORTEST:g} m; move it, or go straight"
            )
        to_centre = (dot(b, b) * np.cross(normal, a) + dot(a, a) * np.cross(b, normal)) / (
            2.0 * dot(normal, normal)
        )
        radius = math.sqrt(dot(to_centre, to_centre))
        outward = -to_centre / radius
        along = np.cross(normal, outward) / math.sqrt(dot(normal, normal))
        to_goal = b - to_centre
        angle = math.atan2(dot(to_goal, along), dot(to_goal, outward)) % (2.0 * math.pi)
        centre = np.array(start[:3]) + to_centre
        turn = shorter_turn(start.yaw, goal.yaw)
        return cls(centre, np.stack((outward, along)), radius, angle, start.yaw, turn)


class Joined:
    """A sequence of segments as one path, each beginning as the one before it ends.

    Attributes:
        segments: The segments, at least one.
        length: Largest parameter.
        breaks: The seams between the segments.

    Raises:
        InvalidArgumentError: There are none, or one begins at another pose or in another direction
            than the one before it ends.
    """

    def __init__(self, segments: Sequence[Segment]) -> None:
        if not segments:
            raise InvalidArgumentError("a path needs at least one segment; this one has none")
        self.segments = tuple(segments)
        self._formulas = Formulas.of(segments)
        lengths = np.array([segment.length for segment in segments])
        ends = np.cumsum(lengths)
        self._starts = np.concatenate(([0.0], ends[:-1]))
        self.length = float(ends[-1])
        self.breaks: tuple[float, ...] = tuple(ends[:-1].tolist())
        number = np.arange(len(segments))
        _check_seams(
            self._formulas.sample(number[:-1], lengths[:-1]),
            self._formulas.sample(number[1:], np.zeros(len(segments) - 1)),
        )

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        at = np.asarray(s, dtype=np.float64)
        segment = np.maximum(np.searchsorted(self._starts, at, side="right") - 1, 0)
        return self._formulas.sample(segment, at - self._starts[segment])


def _check_seams(before: PathSamples, after: PathSamples) -> None:
    """Make sure that each segment begins at the pose and in the direction of the last one's end."""
    gaps = np.abs(after.poses - before.poses).max(axis=1)
    kinks = np.abs(after.first - before.first).max(axis=1)
    for index in np.flatnonzero((gaps > _GAP) | (kinks > _KINK)).tolist():
        if gaps[index] > _GAP:
            raise InvalidArgumentError(
                f"segment {index + 1} of the path begins {gaps[index]:.3g} (m or rad) beside the "
                f"end of segment {index}; begin it there"
            )
        raise InvalidArgumentError(
            f"segment {index + 1} of the path leaves the direction of segment {index} by "
            f"{kinks[index]:.3g}: round the corner, or stop there"
        )
