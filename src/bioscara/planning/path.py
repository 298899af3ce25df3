"""Paths of the tool through space: where it goes, not when.

A path is a curve of poses over a parameter s from 0 to its length. Along a line or an arc s is
the way of the tool in metres; where the tool turns so much on so short a way that the turn takes
longer, s is the turn times :data:`LEVER`. So its derivatives are bounded: the tool moves at most
1 m and turns at most 1 / LEVER rad per metre of s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol, Self

import numpy as np
import numpy.typing as npt

from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.kinematics.pose import require_near, require_pose, wrapped

Array = npt.NDArray[np.float64]

LEVER = 0.1
"""Way that one radian of turn counts for [m/rad]."""

SHORTEST = 1e-6
"""Least length of a piece [m], and least height of an arc over its chord."""

_GAP, _KINK = 1e-9, 1e-6
"""Largest steps of pose and of first derivative between joined pieces, for rounding."""


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

        Between them every derivative is continuous; there the second may jump.
        """
        ...

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        ...


class Line:
    """A straight line, on which the tool turns evenly by the shorter way.

    Args:
        start: Where it begins.
        goal: Where it ends.

    Attributes:
        length: Largest parameter.
        breaks: None.

    Raises:
        InvalidArgumentError: A value is not finite, or the poses are the same.
    """

    def __init__(self, start: Pose, goal: Pose) -> None:
        require_pose("the start", start)
        require_pose("the goal", goal)
        way = np.subtract(goal, start)
        way[3] = wrapped(goal.yaw - start.yaw)
        distance = float(np.linalg.norm(way[:3]))
        self.length = max(distance, LEVER * abs(way[3]))
        self.breaks: tuple[float, ...] = ()
        if self.length < SHORTEST:
            raise InvalidArgumentError(
                f"start and goal are the same pose: {distance:.3g} m and {abs(way[3]):.3g} rad "
                "apart; leave one of them out"
            )
        self._start, self._slope = np.array(start), way / self.length

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        at = np.asarray(s, dtype=np.float64)[:, None]
        poses = self._start + at * self._slope
        return PathSamples(poses, np.tile(self._slope, (len(at), 1)), np.zeros_like(poses))


class Arc:
    """A part of a circle, on which the tool turns evenly by the shorter way.

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
        self.centre, self.radius, self._axes = centre, radius, axes
        self.length = max(radius * angle, LEVER * abs(turn))
        self.breaks: tuple[float, ...] = ()
        self._rate, self._yaw, self._turn = angle / self.length, yaw, turn / self.length

    @classmethod
    def through(cls, start: Pose, via: Pose, goal: Pose) -> Self:
        """Return the arc from start over a point to the goal.

        Args:
            start: Where it begins.
            via: Where it passes; its yaw does not matter.
            goal: Where it ends.

        Raises:
            InvalidArgumentError: A value is not finite, via is in other units, or the three
                points are on one line.
        """
        require_pose("the start", start)
        require_near("the via", via)
        require_pose("the goal", goal)
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
        turn = wrapped(goal.yaw - start.yaw)
        return cls(centre, np.stack((outward, along)), radius, angle, start.yaw, turn)

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        at = np.asarray(s, dtype=np.float64)
        angle = self._rate * at
        cosine_sine = np.stack((np.cos(angle), np.sin(angle)), axis=1)
        outward = self.radius * (cosine_sine @ self._axes)
        along = self.radius * (cosine_sine @ np.stack((self._axes[1], -self._axes[0])))
        turns = np.full_like(at, self._turn)
        return PathSamples(
            np.column_stack((self.centre + outward, self._yaw + self._turn * at)),
            np.column_stack((self._rate * along, turns)),
            np.column_stack((-(self._rate**2) * outward, np.zeros_like(at))),
        )


class Part:
    """What is left of a path between two of its parameters.

    Args:
        path: The whole; it has no breaks.
        begin: Parameter of the whole where the part begins.
        end: ... and where it ends.

    Attributes:
        length: Largest parameter.
        breaks: None.
    """

    def __init__(self, path: Line | Arc, begin: float, end: float) -> None:
        self._path, self._begin = path, begin
        self.length = end - begin
        self.breaks: tuple[float, ...] = ()

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        return self._path.sample(np.asarray(s, dtype=np.float64) + self._begin)


class Joined:
    """Paths one after the other, each beginning as the one before it ends.

    Args:
        pieces: The paths, at least one.

    Attributes:
        pieces: As given.
        length: Largest parameter.
        breaks: The seams between the pieces, and the breaks inside them.

    Raises:
        InvalidArgumentError: There are none, or one begins elsewhere or in another direction than
            the one before it ends.
    """

    def __init__(self, pieces: Sequence[Path]) -> None:
        if not pieces:
            raise InvalidArgumentError("a path needs at least one piece; this one has none")
        self.pieces = tuple(pieces)
        ends = np.cumsum([piece.length for piece in pieces])
        self._starts = np.concatenate(([0.0], ends[:-1]))
        self.length = float(ends[-1])
        breaks: list[float] = []
        for index, (piece, start) in enumerate(zip(pieces, self._starts.tolist(), strict=True)):
            if index:
                _check_seam(index, pieces[index - 1], piece)
                breaks.append(start)
            breaks.extend(start + inside for inside in piece.breaks)
        self.breaks = tuple(breaks)

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        at = np.asarray(s, dtype=np.float64)
        index = np.maximum(np.searchsorted(self._starts, at, side="right") - 1, 0)
        all_samples = PathSamples(*(np.empty((len(at), 4)) for _ in range(3)))
        for number in np.unique(index).tolist():
            here = index == number
            samples = self.pieces[number].sample(at[here] - self._starts[number])
            for whole, part in zip(all_samples, samples, strict=True):
                whole[here] = part
        return all_samples


def _check_seam(index: int, before: Path, after: Path) -> None:
    last, following = before.sample([before.length]), after.sample([0.0])
    gap = float(np.abs(following.poses - last.poses).max())
    kink = float(np.abs(following.first - last.first).max())
    if gap > _GAP:
        raise InvalidArgumentError(
            f"piece {index} of the path begins {gap:.3g} (m or rad) beside the end of piece "
            f"{index - 1}; begin it there"
        )
    if kink > _KINK:
        raise InvalidArgumentError(
            f"piece {index} of the path leaves the direction of piece {index - 1} by {kink:.3g}: "
            "round the corner, or stop there"
        )
