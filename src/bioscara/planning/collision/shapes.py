"""Upright shapes and the distances between them.

Every link of the arm rotates about the vertical only, so every body and every zone is a planar
shape extruded between two heights. The planar shape is a rectangle offset outwards by a radius: a
box has radius 0, a cylinder is a rectangle without extent, a rounded bar is one without width.
All distances are exact, and none changes faster than the bodies' fastest points move.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.planning.arrays import Array, Index

_SIGNS = np.array(((1.0, 1.0, -1.0, -1.0), (1.0, -1.0, 1.0, -1.0)))
"""Signs of a rectangle's half sizes at its four corners."""


@dataclass(frozen=True, slots=True)
class Prism:
    """An upright shape in the frame of its link.

    Attributes:
        x: Of the rectangle's centre [m].
        y: [m].
        half_x: Half the rectangle's size along its own x [m].
        half_y: [m].
        low: Height of the bottom [m].
        high: Height of the top [m].
        radius: Added to the rectangle on all sides [m].
        yaw: Rotation of the rectangle about its centre [rad].
    """

    x: float
    y: float
    half_x: float
    half_y: float
    low: float
    high: float
    radius: float = 0.0
    yaw: float = 0.0

    @classmethod
    def between(cls, lower: Sequence[float], upper: Sequence[float], yaw: float = 0.0) -> Prism:
        """Return the box between two corners, rotated about its centre.

        Args:
            lower: Smallest x, y, z [m].
            upper: Largest x, y, z [m].
            yaw: Rotation [rad].
        """
        (x0, y0, z0), (x1, y1, z1) = lower, upper
        return cls((x0 + x1) / 2, (y0 + y1) / 2, (x1 - x0) / 2, (y1 - y0) / 2, z0, z1, 0.0, yaw)

    def outline(self) -> Array:
        """Return the outline in plan view, counterclockwise, for drawing.

        Returns:
            Corners x, y [m] in the frame of the link, shape (n, 2); round corners are 16 each.
        """
        turns = np.linspace(0.0, np.pi / 2.0, 16 if self.radius > 0.0 else 1)
        corners = [
            np.column_stack((x + self.radius * np.cos(turn), y + self.radius * np.sin(turn)))
            for x, y, turn in (
                (self.half_x, self.half_y, turns),
                (-self.half_x, self.half_y, turns + np.pi / 2.0),
                (-self.half_x, -self.half_y, turns + np.pi),
                (self.half_x, -self.half_y, turns + 1.5 * np.pi),
            )
        ]
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        turned = np.concatenate(corners) @ np.array(((cos, sin), (-sin, cos)))
        placed: Array = turned + np.array((self.x, self.y))
        return placed

    def corners(self) -> tuple[tuple[float, float], ...]:
        """Return the corners x, y of the rectangle in the frame of the link [m]."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return tuple(
            (self.x + cos * x - sin * y, self.y + sin * x + cos * y)
            for x in (self.half_x, -self.half_x)
            for y in (self.half_y, -self.half_y)
        )

    def reach(self, x: float, y: float) -> float:
        """Return the horizontal distance from a point to the farthest point of the shape.

        Args:
            x: Of the point, in the frame of the link [m].
            y: [m].
        """
        return self.radius + max(math.hypot(a - x, b - y) for a, b in self.corners())

    def covers(self, places: Array) -> npt.NDArray[np.bool_]:
        """Return which points are within the outline in plan view.

        Args:
            places: x, y [m] in the frame of the link, shape (n, 2).
        """
        x, y = (places - (self.x, self.y)).T
        cos, sin = np.cos(self.yaw), np.sin(self.yaw)
        beyond_x = np.maximum(np.abs(cos * x + sin * y) - self.half_x, 0.0)
        beyond_y = np.maximum(np.abs(cos * y - sin * x) - self.half_y, 0.0)
        within: npt.NDArray[np.bool_] = np.hypot(beyond_x, beyond_y) <= self.radius
        return within


class Placed(NamedTuple):
    """Shapes: in their own frames, shape (shapes,); or in the base frame at instants.

    Attributes:
        x: Of the centre [m].
        y: [m].
        cos: Cosine of the rotation.
        sin: Sine of the rotation.
        half_x: As in :class:`Prism`, like all that follow.
        half_y: [m].
        radius: [m].
        low: [m].
        high: [m].
    """

    x: Array
    y: Array
    cos: Array
    sin: Array
    half_x: Array
    half_y: Array
    radius: Array
    low: Array
    high: Array

    def take(self, index: Index) -> Placed:
        """Return some of the shapes."""
        return Placed(*(column[index] for column in self))

    def prism(self, number: int) -> Prism:
        """Return one of single shapes."""
        row = (float(column[number]) for column in self)
        x, y, cos, sin, half_x, half_y, radius, low, high = row
        return Prism(x, y, half_x, half_y, low, high, radius, math.atan2(sin, cos))

    def at(self, shape: Index, instant: Index) -> Placed:
        """Return single shapes, each at one of the instants, shape (n,)."""
        return Placed(
            *(
                column[shape, 0] if column.shape[1] == 1 else column[shape, instant]
                for column in self
            )
        )


def distance_bounds(placed: Placed, one: Index, other: Index) -> Array:
    """Return lower bounds of the distances of shapes, faster than :func:`distances`.

    Args:
        placed: Shapes, each at several instants.
        one: Indices of the first shape of each pair.
        other: Indices of the second.

    Returns:
        [m], shape (pairs, instants); minus infinity where the circles around the shapes overlap
        at the same height.
    """
    x, y, low, high = placed.x, placed.y, placed.low, placed.high
    around = placed.radius + np.hypot(placed.half_x, placed.half_y)
    flat: Array = np.hypot(x[other] - x[one], y[other] - y[one])
    flat -= around[one] + around[other]
    upright = np.maximum(low[other] - high[one], low[one] - high[other])
    result: Array = np.hypot(np.maximum(flat, 0.0, out=flat), np.maximum(upright, 0.0, out=upright))
    result[result <= 0.0] = -np.inf
    return result


def distances(one: Placed, other: Placed) -> Array:
    """Return the distances between shapes, pair by pair.

    Returns:
        [m]; where negative, the displacement that separates the two.
    """
    flat = _flat(one, other) - (one.radius + other.radius)
    upright = np.maximum(other.low - one.high, one.low - other.high)
    outside = np.hypot(np.maximum(flat, 0.0), np.maximum(upright, 0.0))
    apart = np.maximum(flat, upright)
    return np.where(apart > 0.0, outside, apart)


def room_within(body: Placed, box: Placed) -> Array:
    """Return the clearances of bodies to the borders of keep-in zones, pair by pair.

    Args:
        body: Shapes.
        box: As many; each either a rectangle without radius or a circle.

    Returns:
        [m], shape (pairs, instants); negative where the body is partly outside, by how far.
    """
    dx, dy = body.x - box.x, body.y - box.y
    cos, sin = np.abs(_turned(box, body.cos, body.sin))
    along, across = np.abs(_turned(box, dx, dy))
    far_x = along + body.half_x * cos + body.half_y * sin
    far_y = across + body.half_x * sin + body.half_y * cos
    straight = np.minimum(box.half_x - far_x, box.half_y - far_y)
    along, across = np.abs(_turned(body, dx, dy))
    circle = box.radius - np.hypot(along + body.half_x, across + body.half_y)
    flat = np.where(box.radius > 0.0, circle, straight) - body.radius
    room: Array = np.minimum(flat, np.minimum(body.low - box.low, box.high - body.high))
    return room


def _turned(frame: Placed, x: Array, y: Array) -> tuple[Array, Array]:
    """Return the components of a vector along the axes of ``frame``."""
    return frame.cos * x + frame.sin * y, frame.cos * y - frame.sin * x


def _flat(one: Placed, other: Placed) -> Array:
    """Return the distances between rectangles in the plane, below zero where they overlap."""
    dx, dy = other.x - one.x, other.y - one.y
    cos, sin = _turned(one, other.cos, other.sin)
    there = _turned(one, dx, dy)
    back = _turned(other, -dx, -dy)
    c, s = np.abs(cos), np.abs(sin)
    # The widest gap along the normals of the sides: exact where the rectangles overlap.
    gap = np.maximum(
        np.maximum(
            np.abs(there[0]) - (one.half_x + other.half_x * c + other.half_y * s),
            np.abs(there[1]) - (one.half_y + other.half_x * s + other.half_y * c),
        ),
        np.maximum(
            np.abs(back[0]) - (other.half_x + one.half_x * c + one.half_y * s),
            np.abs(back[1]) - (other.half_y + one.half_x * s + one.half_y * c),
        ),
    )
    # Where the rectangles are apart, a corner of one of them is nearest.
    square = np.minimum(
        _corners(there, cos, sin, other, one), _corners(back, cos, -sin, one, other)
    )
    result: Array = np.where(gap > 0.0, np.sqrt(square), gap)
    return result


def _corners(
    centre: tuple[Array, Array], cos: Array, sin: Array, owner: Placed, target: Placed
) -> Array:
    """Return the squared distance of the nearest corner of ``owner`` from ``target``.

    ``centre`` is the owner's in the target's frame, ``cos`` and ``sin`` its turn there.
    """
    one, two = _SIGNS.reshape(2, 4, *(1,) * cos.ndim)
    along, across = one * owner.half_x, two * owner.half_y
    x = np.abs(centre[0] + along * cos - across * sin) - target.half_x
    y = np.abs(centre[1] + along * sin + across * cos) - target.half_y
    np.maximum(x, 0.0, out=x)
    np.maximum(y, 0.0, out=y)
    nearest: Array = (x * x + y * y).min(axis=0)
    return nearest


Frames = tuple[Array, Array, Array, Array, Array]
"""The result of :func:`~bioscara.planning.collision.arm_bodies.frames`."""


class ShapeTable(NamedTuple):
    """Shapes with the numbers of their frames, each column of shape (shapes,).

    Attributes:
        frames: Numbers of the frames.
        shapes: The shapes in these frames.
    """

    frames: Index
    shapes: Placed

    @classmethod
    def of(cls, frames: Sequence[int], shapes: Sequence[Prism]) -> ShapeTable:
        """Return shapes as a table."""
        rows = [(s.x, s.y, s.yaw, s.half_x, s.half_y, s.radius, s.low, s.high) for s in shapes]
        x, y, yaw, *rest = np.array(rows).reshape(-1, 8).T.copy()
        return cls(np.array(frames, dtype=np.intp), Placed(x, y, np.cos(yaw), np.sin(yaw), *rest))

    def take(self, rows: Index) -> ShapeTable:
        """Return some of the shapes."""
        return ShapeTable(self.frames[rows], self.shapes.take(rows))

    def joined(self, other: ShapeTable) -> ShapeTable:
        """Return the shapes of two tables as one."""
        columns = zip(self.shapes, other.shapes, strict=True)
        return ShapeTable(
            np.concatenate((self.frames, other.frames)),
            Placed(*(np.concatenate(both) for both in columns)),
        )

    def everywhere(self, at: Frames) -> Placed:
        """Return all shapes in the base frame at all instants, (shapes, instants)."""
        columns = (column[self.frames] for column in at)
        return _moved(Placed(*(column[:, None] for column in self.shapes)), *columns)

    def at(self, at: Frames, rows: Index, instants: Index) -> Placed:
        """Return shapes in the base frame, each at an instant of its own, (n,)."""
        frames = self.frames[rows]
        return _moved(self.shapes.take(rows), *(column[frames, instants] for column in at))


def _moved(own: Placed, x: Array, y: Array, z: Array, cos: Array, sin: Array) -> Placed:
    """Transform shapes to the base frame from frames at x, y, z with given rotations."""
    return Placed(
        x + cos * own.x - sin * own.y,
        y + sin * own.x + cos * own.y,
        cos * own.cos - sin * own.sin,
        sin * own.cos + cos * own.sin,
        own.half_x,
        own.half_y,
        own.radius,
        z + own.low,
        z + own.high,
    )
