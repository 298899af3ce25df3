"""Paths of the tool through space: geometry without times.

A path is a curve of poses over a parameter s from 0 to its length. Along a line or an arc s is
the distance travelled by the tool in metres; where the rotation over a short distance is so large
that it takes longer, s is the angle times :data:`LEVER`. So its derivatives are bounded: the tool
moves at most 1 m and rotates at most 1 / LEVER rad per metre of s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol, Self

import numpy as np
import numpy.typing as npt

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.kinematics.pose import require_near, require_pose, wrapped
from bioscara.planning.arrays import Array
from bioscara.planning.paths.curve import Curve, Formulas, PathSamples

LEVER = 0.1
"""Path length equivalent to one radian of rotation [m/rad]."""

SHORTEST = 1e-6
"""Least length of a piece [m], and least height of an arc over its chord."""

_HALF = 1e-6
"""Tolerance within which an angle is treated as half a turn [rad]."""

_GAP, _KINK = 1e-9, 1e-6
"""Largest steps of pose and of first derivative between joined pieces, for rounding."""


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


def shorter_turn(begin: float, end: float) -> float:
    """Return the shorter rotation of the tool from one yaw to another [rad].

    Half a turn is equally short in both directions: the sign of ``end - begin`` decides, not
    rounding.
    """
    way = end - begin
    turn = wrapped(way)
    if math.pi - abs(turn) < _HALF and turn * way < 0.0:
        turn += math.copysign(2.0 * math.pi, way)
    return turn


class Line(Curve):
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
        way = np.subtract(goal, start)
        way[3] = shorter_turn(start.yaw, goal.yaw)
        distance = float(np.linalg.norm(way[:3]))
        length = max(distance, LEVER * abs(way[3]))
        if length < SHORTEST:
            raise InvalidArgumentError(
                f"start and goal are the same pose: {distance:.3g} m and {abs(way[3]):.3g} rad "
                "apart; leave one of them out"
            )
        super().__init__(length, (start, way / length))


class Arc(Curve):
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
        start, via = require_pose("the start", start), require_near("the via", via)
        goal = require_pose("the goal", goal)
        a, b = np.subtract(via, start)[:3], np.subtract(goal, start)[:3]
        chord = float(np.linalg.norm(b))
        if chord < SHORTEST:
            raise InvalidArgumentError(
                f"start and goal of the arc are {chord:.3g} m apart; make a full circle of two arcs"
            )
        normal = np.cross(a, b)
        height = float(np.linalg.norm(normal)) / chord
        if height < SHORTEST:
            raise InvalidArgumentError(
                f"the points of the arc are on one line: via is {height:.3g} m beside the line "
                f"from start to goal, it takes {SHORTEST:g} m; move it, or go straight"
            )
        to_centre = ((b @ b) * np.cross(normal, a) + (a @ a) * np.cross(b, normal)) / (
            2.0 * (normal @ normal)
        )
        radius = float(np.linalg.norm(to_centre))
        outward = -to_centre / radius
        along = np.cross(normal, outward) / np.linalg.norm(normal)
        to_goal = b - to_centre
        angle = math.atan2(to_goal @ along, to_goal @ outward) % (2.0 * math.pi)
        centre = np.array(start[:3]) + to_centre
        turn = shorter_turn(start.yaw, goal.yaw)
        return cls(centre, np.stack((outward, along)), radius, angle, start.yaw, turn)


class Joined:
    """A sequence of pieces as one path, each beginning as the one before it ends.

    Args:
        pieces: The pieces, at least one.

    Attributes:
        pieces: As given.
        length: Largest parameter.
        breaks: The seams between the pieces.

    Raises:
        InvalidArgumentError: There are none, or one begins at another pose or in another direction
            than the one before it ends.
    """

    def __init__(self, pieces: Sequence[Curve]) -> None:
        if not pieces:
            raise InvalidArgumentError("a path needs at least one piece; this one has none")
        self.pieces = tuple(pieces)
        self._formulas = Formulas.of(pieces)
        lengths = np.array([piece.length for piece in pieces])
        ends = np.cumsum(lengths)
        self._starts = np.concatenate(([0.0], ends[:-1]))
        self.length = float(ends[-1])
        self.breaks: tuple[float, ...] = tuple(ends[:-1].tolist())
        number = np.arange(len(pieces))
        _check_seams(
            self._formulas.sample(number[:-1], lengths[:-1]),
            self._formulas.sample(number[1:], np.zeros(len(pieces) - 1)),
        )

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        at = np.asarray(s, dtype=np.float64)
        piece = np.maximum(np.searchsorted(self._starts, at, side="right") - 1, 0)
        return self._formulas.sample(piece, at - self._starts[piece])


def _check_seams(before: PathSamples, after: PathSamples) -> None:
    """Make sure that each piece begins at the pose and in the direction in which the last ends."""
    gaps = np.abs(after.poses - before.poses).max(axis=1)
    kinks = np.abs(after.first - before.first).max(axis=1)
    for index in np.flatnonzero((gaps > _GAP) | (kinks > _KINK)).tolist():
        if gaps[index] > _GAP:
            raise InvalidArgumentError(
                f"piece {index + 1} of the path begins {gaps[index]:.3g} (m or rad) beside the "
                f"end of piece {index}; begin it there"
            )
        raise InvalidArgumentError(
            f"piece {index + 1} of the path leaves the direction of piece {index} by "
            f"{kinks[index]:.3g}: round the corner, or stop there"
        )
