"""A scene made ready for one arm: which bodies are looked at against what, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.planning.bodies import FIXED, Body, frames, moving, reaches
from bioscara.planning.shapes import Array, Index, Placed, Prism, bounds, distances, room_within

LINKS = ("link_1", "link_2", "link_3", "link_4", "gripper", "jaws", "tool", "load")
"""Links that move; ``tool`` is the tool's point, ``load`` what a tool carries."""
_ON_TABLE = ("link_1",)
"""Links that stand on the table."""
_AT_ONCE = 512
"""Instants that are worked on together: their arrays fit the processor's cache."""
_FEW = 1000
"""So many distances are worked out as soon as it is said which of them matter."""
ZoneShape = tuple[str, Prism, bool, tuple[str, ...]]
"""Name, shape, whether it is kept in, and the links that it is for."""


class Pair(NamedTuple):
    """Two things that are kept apart.

    Attributes:
        link: Name of the link.
        zone: Name of what it is kept from: a zone, the table or a link.
        keep_in: Whether the zone is one that must not be left.
        allowed: How much nearer than the margin they may come to each other [m].
    """

    link: str
    zone: str
    keep_in: bool = False
    allowed: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """All pairs that are looked at; made by :func:`layout_of`.

    Attributes:
        pairs: In the order of the rows of :meth:`clearances`.
        reach: How far a point of the arm moves at most per movement of each joint [m/rad, 1,
            m/rad, m/rad], shape (4,).
    """

    pairs: tuple[Pair, ...]
    reach: Array
    _frames: Index
    _shapes: Placed
    _apart: tuple[Index, Index]
    _within: tuple[Index, Index]
    _above: Index
    _table: float
    _allowed: Array

    def clearances(self, arm: Scara, joints: Array, exact: float = -np.inf) -> Array:
        """Return the distance of each pair, and what it is allowed, as one [m], shape (pairs, n).

        At each instant the nearest pair is exact; others may be farther than what stands here.

        Args:
            arm: The arm that the layout is for.
            joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).
            exact: Every pair that is nearer than this is exact too [m].
        """
        result = np.empty((len(self.pairs), len(joints)))
        for start in range(0, len(joints), _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            self._fill(arm, joints[part], result[:, part], exact)
        return result

    def only(self, rows: Index) -> Layout:
        """Return some of the pairs, by the numbers of their rows in ascending order."""
        apart, within = len(self._apart[0]), len(self._within[0])
        of_apart, of_within, of_above = np.split(
            rows, np.searchsorted(rows, (apart, apart + within))
        )
        columns = (
            *(column[of_apart] for column in self._apart),
            *(column[of_within - apart] for column in self._within),
            self._above[of_above - apart - within],
        )
        used, numbers = np.unique(np.concatenate(columns), return_inverse=True)
        ends = np.cumsum([len(column) for column in columns])
        one, other, body, zone, above = np.split(numbers, ends[:-1])
        return replace(
            self,
            pairs=tuple(self.pairs[row] for row in rows.tolist()),
            _frames=self._frames[used],
            _shapes=self._shapes.take(used),
            _apart=(one, other),
            _within=(body, zone),
            _above=above,
            _allowed=self._allowed[rows],
        )

    def _fill(self, arm: Scara, joints: Array, result: Array, exact: float) -> None:
        placed = self._placed(arm, joints)
        apart, within = len(self._apart[0]), len(self._within[0])
        if within:
            body, zone = (placed.take(index) for index in self._within)
            result[apart : apart + within] = room_within(body, zone)
        result[apart + within :] = placed.low[self._above] - self._table
        result[apart:] += self._allowed[apart:]
        one, other = self._apart
        allowed = self._allowed[:apart]
        if result[:apart].size <= _FEW:
            result[:apart] = distances(placed.take(one), placed.take(other)) + allowed
            return
        least, most = (bound + allowed for bound in bounds(placed, one, other))
        nearest = np.minimum(
            most.min(axis=0, initial=np.inf), result[apart:].min(axis=0, initial=np.inf)
        )
        # Only what may be the nearest of all is worth the exact distance.
        pair, instant = np.nonzero(least <= np.maximum(nearest, exact))
        least[pair, instant] = distances(
            placed.at(one[pair], instant), placed.at(other[pair], instant)
        )
        least[pair, instant] += allowed[pair, 0]
        result[:apart] = least

    def _placed(self, arm: Scara, joints: Array) -> Placed:
        x, y, z, cos, sin = (column[self._frames] for column in frames(arm, joints))
        own = self._shapes
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


@lru_cache(maxsize=16)
def layout_of(
    zones: tuple[ZoneShape, ...],
    table: float | None,
    mounted: tuple[Body, ...],
    geometry: Geometry,
    tool: Pose,
    allowed: float,
    *,
    own: bool = False,
) -> Layout:
    """Return what is looked at in a scene.

    Args:
        own: Whether to look at the arm's own links against each other, and at nothing else;
            False for all the rest.
        zones: Of the scene.
        table: Height of its table [m], or None.
        mounted: What the wrist carries.
        geometry: Of the arm.
        tool: Pose of the tool in the flange.
        allowed: How much nearer than the margin bodies may come to what they may touch [m].
    """
    arm = moving(geometry, tool, mounted)
    # The base's frame, in which zones stand too, is the first.
    obstacles = (*FIXED, *(Body(name, 0, shape) for name, shape, _, _ in zones))
    bodies = (*arm, *obstacles)
    first = len(arm) + len(FIXED)
    near: list[tuple[int, int]] = []
    inside: list[tuple[int, int]] = []
    for number, (_, _, keep_in, links) in enumerate(zones, first):
        concerned = [i for i, body in enumerate(arm) if not links or body.link in links]
        (inside if keep_in else near).extend((i, number) for i in concerned)
    if own:
        held = [i for i, body in enumerate(arm) if body in mounted]
        stood = [i for i, body in enumerate(bodies) if body.link in ("base_link", "link_1")]
        near, inside = [(i, k) for i in held for k in stood], []
    above = (
        []
        if table is None or own
        else [i for i, body in enumerate(arm) if body.link not in _ON_TABLE]
    )

    def pair(body: Body, zone: str, *, keep_in: bool = False) -> Pair:
        return Pair(body.link, zone, keep_in, allowed if zone in body.touches else 0.0)

    pairs = (
        *(pair(bodies[i], bodies[k].link) for i, k in near),
        *(pair(bodies[i], bodies[k].link, keep_in=True) for i, k in inside),
        *(pair(bodies[i], "table") for i in above),
    )
    return Layout(
        pairs,
        reaches(geometry, arm),
        np.array([body.frame for body in bodies], dtype=np.intp),
        _columns(bodies),
        _indices(near),
        _indices(inside),
        np.array(above, dtype=np.intp),
        0.0 if table is None else table,
        np.array([pair.allowed for pair in pairs]).reshape(-1, 1),
    )


def _indices(pairs: list[tuple[int, int]]) -> tuple[Index, Index]:
    table = np.array(pairs, dtype=np.intp).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _columns(bodies: tuple[Body, ...]) -> Placed:
    shapes = [body.shape for body in bodies]

    def column(values: list[float]) -> Array:
        return np.array(values, dtype=np.float64)[:, None]

    return Placed(
        column([shape.x for shape in shapes]),
        column([shape.y for shape in shapes]),
        np.cos(column([shape.yaw for shape in shapes])),
        np.sin(column([shape.yaw for shape in shapes])),
        column([shape.half_x for shape in shapes]),
        column([shape.half_y for shape in shapes]),
        column([shape.radius for shape in shapes]),
        column([shape.low for shape in shapes]),
        column([shape.high for shape in shapes]),
    )
