"""A scene prepared for one arm: the pairs of bodies to check, as arrays.

Every pair is checked in two steps: the hulls of the two bodies give a lower bound of their
distance, and only where that is too small, their parts are evaluated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.planning.arrays import Array, Index
from bioscara.planning.collision.arm_bodies import BASE, Body, arm_of, frames, hull, reaches
from bioscara.planning.collision.arm_pairs import Span, colliding_pairs
from bioscara.planning.collision.margins import GOAL_SLACK, OWN_MARGIN
from bioscara.planning.collision.shapes import (
    Frames,
    Placed,
    Prism,
    ShapeTable,
    distance_bounds,
    distances,
    room_within,
)

LINKS = ("link_1", "link_2", "link_3", "link_4", "gripper", "jaws", "tool", "load")
"""Links that move; ``tool`` is the tool's point, ``load`` the load of a tool."""
_ON_TABLE = ("base_link", "link_1")
"""Links that are mounted on the table."""
_AT_ONCE, _PARTS_AT_ONCE = 512, 16384
"""Instants, and parts at instants, processed at once: they fit the processor's cache."""
_FEW = 1000
"""Up to this number of distances, all are computed exactly instead of only the small ones."""
_FEW_PARTS = 3
"""Up to this ratio of parts to pairs, parts are evaluated directly, without the step of hulls."""
ZoneShape = tuple[str, Prism, bool, tuple[str, ...]]
"""Name, shape, whether it is a keep-in zone, and the links that it applies to."""


class Pair(NamedTuple):
    """Two bodies that are checked against each other.

    Attributes:
        link: Name of the link.
        zone: Name of its counterpart: a zone, the table or a link.
        keep_in: Whether the counterpart is a keep-in zone.
        allowed: How much smaller than the margin their distance may be [m].
        own: Whether both are parts of the arm.
    """

    link: str
    zone: str
    keep_in: bool = False
    allowed: float = 0.0
    own: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """All pairs that are checked; made by :func:`layout_of`.

    Attributes:
        pairs: In the order of the rows of :meth:`clearances`: pairs kept apart, bodies in keep-in
            zones, and bodies above the table.
        rows: Their numbers among all pairs of the scene, shape (pairs,).
        own: Which of them are pairs of the arm's own parts, shape (pairs,).
        reach: Largest displacement of any point of the arm per displacement of each joint [m/rad,
            1, m/rad, m/rad], shape (4,).
    """

    pairs: tuple[Pair, ...]
    rows: Index
    own: npt.NDArray[np.bool_]
    reach: Array
    _hulls: ShapeTable
    """Hulls around bodies."""
    _shapes: ShapeTable
    """Parts of the bodies."""
    _whole: tuple[Index, Index]
    """Hulls of each row except those above the table."""
    _parts: tuple[Index, Index]
    """Parts of all these rows, concatenated."""
    _ends: Index
    """End index of each row's parts."""
    _rough: npt.NDArray[np.bool_]
    """Whether a row has more than one pair of parts, so that its hulls are only bounds."""
    _apart: int
    """Number of the first row of a keep-in zone."""
    _above: Index
    _table: float
    _allowed: Array

    def clearances(self, kinematics: Scara, joints: Array, exact: float = np.inf) -> Array:
        """Return the sum of each pair's distance and allowance [m], shape (pairs, n).

        Args:
            kinematics: The arm that the layout is for.
            joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).
            exact: Values below this are exact [m], others are lower bounds.
        """
        result = np.empty((len(self.pairs), len(joints)))
        for start in range(0, len(joints), _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            self._fill(frames(kinematics, joints[part]), result[:, part], exact)
        return result

    def nearest(self, kinematics: Scara, joints: Array) -> Array:
        """Return the least sum of a pair's distance and allowance [m], shape (n,).

        Args:
            kinematics: The arm that the layout is for.
            joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).
        """
        result = np.full(len(joints), np.inf)
        if not self.pairs:
            return result
        for start in range(0, len(joints), _AT_ONCE):
            part = result[start : start + _AT_ONCE]
            at, count = frames(kinematics, joints[start : start + _AT_ONCE]), len(self._ends)
            bounds = np.empty((len(self.pairs), len(part)))
            hulls = self._bound(at, bounds)
            part[:] = bounds[count:].min(axis=0, initial=np.inf)
            if count:
                # The pair with the least bound first, then all that may be nearer than it.
                first = self._exact(at, bounds[:count].argmin(axis=0), np.arange(len(part)))
                np.minimum(part, first, out=part)
                self._refine(at, hulls, bounds, part)
                np.minimum(part, bounds.min(axis=0), out=part)
        return result

    def nearest_parts(
        self, kinematics: Scara, joints: Array, row: int
    ) -> tuple[Prism, Prism | None]:
        """Return the parts of a pair that are nearest to each other, in the base frame.

        Args:
            kinematics: The arm that the layout is for.
            joints: j1 to j4 [rad, m, rad, rad], shape (4,).
            row: Number of the pair.

        Returns:
            The part of the link, and that of its counterpart; None for the table.
        """
        at, count = frames(kinematics, joints[None]), len(self._ends)
        none = np.zeros(1, dtype=np.intp)
        if row >= count:
            return self._hulls.at(at, self._above[[row - count]], none).prism(0), None
        _, parts = self._parts_of(np.array([row]))
        values = self._of_parts(at, np.full(len(parts), row), parts, 0 * parts)
        nearest = parts[[int(values.argmin())]]
        one, other = (self._shapes.at(at, column[nearest], none) for column in self._parts)
        return one.prism(0), other.prism(0)

    def near(self, kinematics: Scara, joints: Array, far: float) -> tuple[Layout | None, float]:
        """Return the pairs nearer than a distance, and a lower bound of the least clearance [m].

        Args:
            kinematics: The arm that the layout is for.
            joints: j1 to j4 [rad, m, rad, rad], shape (4,).
            far: The distance [m].

        Returns:
            The pairs, each without its parts that are farther; a pair of which few parts are
            left may be split into several, one for each of them. None if no pair is so near.
        """
        at, count = frames(kinematics, joints[None]), len(self._ends)
        clearances = np.empty((len(self.pairs), 1))
        self._bound(at, clearances)
        rows = np.flatnonzero(clearances[:, 0] < far)
        looked, low = rows[rows < count], rows[rows >= count]
        owners, parts = self._parts_of(looked)
        values = self._of_parts(at, looked[owners], parts, 0 * owners)
        clearances[looked] = np.inf
        nearest = float(min(clearances.min(), values.min(initial=np.inf)))
        some = values < far
        kept, owners = np.unique(owners[some], return_inverse=True)
        looked, parts = looked[kept], parts[some]
        if not len(looked) + len(low):
            return None, nearest
        alone = len(parts) <= _FEW_PARTS * len(looked)
        if alone:
            looked, owners = looked[owners], np.arange(len(parts))
        ends = np.cumsum(np.bincount(owners, minlength=len(looked)))
        source = self._shapes if alone else self._hulls
        whole = (
            (column[parts] for column in self._parts)
            if alone
            else (column[looked] for column in self._whole)
        )
        used, numbers = np.unique(np.concatenate(tuple(whole)), return_inverse=True)
        one, other = np.split(numbers, 2)
        above = self._above[low - count]
        rows = np.concatenate((looked, low))
        near = replace(
            self,
            pairs=tuple(self.pairs[row] for row in rows.tolist()),
            rows=rows,
            own=self.own[rows],
            _hulls=source.take(used).joined(self._hulls.take(above)),
            _whole=(one, other),
            _rough=np.full(len(looked), not alone),
            _parts=(self._parts[0][parts], self._parts[1][parts]),
            _ends=ends,
            _apart=int(np.searchsorted(looked, self._apart)),
            _above=len(used) + np.arange(len(above)),
            _allowed=self._allowed[rows],
        )
        return near, nearest

    def _fill(self, at: Frames, result: Array, exact: float) -> None:
        """Write distances plus allowances; above ``exact`` lower bounds of them."""
        self._refine(at, self._bound(at, result), result, exact)

    def _bound(self, at: Frames, result: Array) -> Placed:
        """Write lower bounds of distances plus allowances; return the hulls."""
        hulls, count = self._hulls.everywhere(at), len(self._ends)
        if len(self._above):
            result[count:] = hulls.low[self._above] - self._table
        one, other = self._whole
        if self._apart < count:
            within = slice(self._apart, count)
            result[within] = room_within(hulls.take(one[within]), hulls.take(other[within]))
            one, other = one[: self._apart], other[: self._apart]
        apart = result[: self._apart]
        if apart.size <= _FEW:
            apart[:] = distances(hulls.take(one), hulls.take(other))
        else:
            apart[:] = distance_bounds(hulls, one, other)
        result += self._allowed
        return hulls

    def _refine(self, at: Frames, hulls: Placed, result: Array, exact: float | Array) -> None:
        """Replace bounds below ``exact``, one for all instants or one each, by exact values."""
        apart = result[: self._apart]
        if apart.size > _FEW:
            row, instant = np.nonzero(apart < exact)
            one, other = (column[row] for column in self._whole)
            apart[row, instant] = distances(hulls.at(one, instant), hulls.at(other, instant))
            apart[row, instant] += self._allowed[row, 0]
        if self._rough.any():
            row, instant = np.nonzero((result[: len(self._ends)] < exact) & self._rough[:, None])
            result[row, instant] = self._exact(at, row, instant)

    def _exact(self, at: Frames, row: Index, instant: Index) -> Array:
        """Return the exact distances plus allowances of pairs at instants, from all their parts."""
        result = np.empty(len(row))
        counts = np.diff(self._ends, prepend=0)[row]
        cuts = np.searchsorted(np.cumsum(counts), np.arange(0, counts.sum(), _PARTS_AT_ONCE)[1:])
        for start, end in _between(cuts, len(row)):
            rows, instants = row[start:end], instant[start:end]
            owners, parts = self._parts_of(rows)
            values = self._of_parts(at, rows[owners], parts, instants[owners])
            first = np.cumsum(counts[start:end]) - counts[start:end]
            result[start:end] = np.minimum.reduceat(values, first)
        return result

    def _parts_of(self, rows: Index) -> tuple[Index, Index]:
        """Return for each part the index of its row in ``rows``, and the parts, row after row."""
        counts = np.diff(self._ends, prepend=0)[rows]
        owners = np.repeat(np.arange(len(rows)), counts)
        within = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
        return owners, (self._ends[rows] - counts)[owners] + within

    def _of_parts(self, at: Frames, row: Index, part: Index, instant: Index) -> Array:
        """Return the distances plus allowances of pairs of parts at instants."""
        one, other = (self._shapes.at(at, column[part], instant) for column in self._parts)
        inside = row >= self._apart
        if not inside.any():
            values = distances(one, other)
        else:
            values = np.where(inside, room_within(one, other), distances(one, other))
        values += self._allowed[row, 0]
        return values


def _between(cuts: Index, end: int) -> Iterator[tuple[int, int]]:
    """Yield start and end of the intervals between cuts."""
    edges = [0, *sorted({cut for cut in cuts.tolist() if 0 < cut < end}), end]
    return pairwise(edges)


class _Rows:
    """Collects pairs of bodies and their parts."""

    def __init__(self, bodies: tuple[Body, ...]) -> None:
        self.bodies = bodies
        self.shapes = [shape for body in bodies for shape in body.shapes]
        counts = [len(body.shapes) for body in bodies]
        self.frames = [body.frame for body in bodies for _ in body.shapes]
        ends = np.cumsum(counts)
        self.numbers = [np.arange(end - n, end) for end, n in zip(ends, counts, strict=True)]
        self.hulls: dict[tuple[int, ...], int] = {}
        self.around: list[Prism] = []
        self.around_frames: list[int] = []
        self.whole: list[tuple[int, int]] = []
        self.parts: list[tuple[Index, Index]] = []

    def hull(self, parts: Index) -> int:
        """Return the number of the hull around some parts of a body."""
        key = tuple(sorted({*parts.tolist()}))
        if key not in self.hulls:
            self.hulls[key] = len(self.around)
            self.around.append(hull(tuple(self.shapes[part] for part in key)))
            self.around_frames.append(self.frames[key[0]])
        return self.hulls[key]

    def add(self, one: Index, other: Index) -> None:
        """Add a row of pairs of parts."""
        self.whole.append((self.hull(one), self.hull(other)))
        self.parts.append((one, other))


@lru_cache(maxsize=16)
def layout_of(
    zones: tuple[ZoneShape, ...],
    table: float | None,
    mounted: tuple[Body, ...],
    widths: tuple[float, float],
    geometry: Geometry,
    tool: Pose,
    ranges: tuple[Span, Span],
    margin: float,
) -> Layout:
    """Return the layout of a scene for one arm.

    Args:
        zones: Of the scene.
        table: Height of its table [m], or None.
        mounted: Bodies that the wrist carries.
        widths: Smallest and largest width of the gripper [m].
        geometry: Of the arm.
        tool: Pose of the tool in the flange.
        ranges: Lowest and highest position of the lift [m] and of the elbow [rad].
        margin: Distance to keep [m].
    """
    arm = arm_of(geometry, tool, mounted, widths)
    # The base's frame, which is also that of the zones, is the first.
    rows = _Rows((*arm, *(Body(name, BASE, (shape,)) for name, shape, _, _ in zones)))
    own = colliding_pairs(arm, len(arm) - len(mounted) - 1, geometry, ranges)
    zoned = [
        (i, len(arm) + number, keep_in)
        for number, (_, _, keep_in, links) in enumerate(zones)
        for i, body in enumerate(arm)
        if (body.link in links if links else body.link in LINKS)
    ]
    pairs = []
    for i, k, (one, other) in own:
        rows.add(rows.numbers[k][other], rows.numbers[i][one])
        pairs.append(Pair(arm[k].link, arm[i].link, False, max(margin - OWN_MARGIN, 0.0), True))
    for keeping_in in (False, True):
        for i, number, keep_in in zoned:
            if keep_in is keeping_in:
                part = rows.numbers[i]
                rows.add(part, np.repeat(rows.numbers[number], len(part)))
                zone = rows.bodies[number].link
                pairs.append(Pair(arm[i].link, zone, keep_in, _allowed(arm[i], zone, margin)))
    apart = len(own) + sum(not keep_in for _, _, keep_in in zoned)
    above = []
    for i, body in enumerate(arm):
        if table is not None and body.link not in _ON_TABLE:
            above.append(rows.hull(rows.numbers[i]))
            pairs.append(Pair(body.link, "table", False, _allowed(body, "table", margin)))
    empty = np.empty(0, dtype=np.intp)
    one, other = ([np.concatenate(column) for column in zip(*rows.parts, strict=True)]) or (
        empty,
        empty,
    )
    counts = np.array([len(column) for column, _ in rows.parts], dtype=np.intp)
    whole = np.array(rows.whole, dtype=np.intp).reshape(-1, 2)
    return Layout(
        tuple(pairs),
        np.arange(len(pairs)),
        np.array([pair.own for pair in pairs], dtype=np.bool_),
        reaches(geometry, arm),
        ShapeTable.of(rows.around_frames, rows.around),
        ShapeTable.of(rows.frames, rows.shapes),
        (whole[:, 0], whole[:, 1]),
        (one, other),
        np.cumsum(counts),
        counts > 1,
        apart,
        np.array(above, dtype=np.intp),
        0.0 if table is None else table,
        np.array([pair.allowed for pair in pairs]).reshape(-1, 1),
    )


def _allowed(body: Body, zone: str, margin: float) -> float:
    return margin + GOAL_SLACK if zone in body.touches else 0.0
