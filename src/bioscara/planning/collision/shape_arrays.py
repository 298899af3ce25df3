"""Shapes of an arm as arrays, and their positions at given joint positions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bioscara.planning.arrays import Array, Index
from bioscara.planning.collision.shapes import Placed, Prism

Frames = tuple[Array, Array, Array, Array, Array]
"""The result of :func:`~bioscara.planning.collision.arm_bodies.frames`."""


class Table(NamedTuple):
    """Shapes with the numbers of their frames, each column of shape (shapes,).

    Attributes:
        frames: Numbers of the frames.
        shapes: The shapes in these frames.
    """

    frames: Index
    shapes: Placed

    @classmethod
    def of(cls, frames: Sequence[int], shapes: Sequence[Prism]) -> Table:
        """Return shapes as a table."""
        rows = [(s.x, s.y, s.yaw, s.half_x, s.half_y, s.radius, s.low, s.high) for s in shapes]
        x, y, yaw, *rest = np.array(rows).reshape(-1, 8).T.copy()
        return cls(np.array(frames, dtype=np.intp), Placed(x, y, np.cos(yaw), np.sin(yaw), *rest))

    def take(self, rows: Index) -> Table:
        """Return some of the shapes."""
        return Table(self.frames[rows], self.shapes.take(rows))

    def joined(self, other: Table) -> Table:
        """Return the shapes of two tables as one."""
        columns = zip(self.shapes, other.shapes, strict=True)
        return Table(
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
