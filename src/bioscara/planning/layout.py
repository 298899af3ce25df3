"""A scene made ready for one arm: which bodies are looked at against what, as arrays.

Every pair is looked at in two steps. One shape around each of the two says how far apart they are
at least; only where that is not enough to know, their parts are looked at.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.planning.bodies import (
    ATTACHED,
    BASE,
    COLUMN,
    FOREARM,
    UPPER_ARM,
    WRIST,
    Body,
    arm_of,
    extent,
    frames,
    hull,
    reaches,
)
from bioscara.planning.shapes import Array, Index, Placed, Prism, distances, least, room_within
from bioscara.planning.standing import STAND

LINKS = ("link_1", "link_2", "link_3", "link_4", "gripper", "jaws", "tool", "load")
"""Links that move; ``tool`` is the tool's point, ``load`` what a tool carries."""
OWN_MARGIN = 5e-3
"""What the arm's own parts keep from each other where the margin of the scene is larger [m]: they
are known, and folded up as homing leaves the arm they are 15 mm apart."""
_ON_TABLE = ("base_link", "link_1")
"""Links that stand on the table."""
_AT_ONCE, _PARTS_AT_ONCE = 512, 16384
"""Instants, and parts at instants, that are worked on together: they fit the processor's cache."""
_FEW = 1000
"""So many distances are worked out as soon as it is said which of them matter."""
_BEYOND_END = 5e-3
"""How far the lift may be beyond its limits [m]: pressed on by hand."""
_FEW_PARTS = 3
"""Up to so many times as many parts as pairs are looked at at once, without a step before."""
_TURNS = 201
"""At so many angles of the elbow its range is looked at."""
_ROUNDING = 1e-9
Range = tuple[float, float]
"""Lowest and highest."""
ZoneShape = tuple[str, Prism, bool, tuple[str, ...]]
"""Name, shape, whether it is kept in, and the links that it is for."""
_Frames = tuple[Array, Array, Array, Array, Array]
_Meeting = tuple[int, int, tuple[Index, Index]]


class Pair(NamedTuple):
    """Two things that are kept apart.

    Attributes:
        link: Name of the link.
        zone: Name of what it is kept from: a zone, the table or a link.
        keep_in: Whether the zone is one that must not be left.
        allowed: How much nearer than the margin they may come to each other [m].
        own: Whether both are of the arm.
    """

    link: str
    zone: str
    keep_in: bool = False
    allowed: float = 0.0
    own: bool = False


class _Table(NamedTuple):
    """Shapes in the frames that they stand in, each column of shape (shapes,).

    Attributes:
        frames: Numbers of the frames.
        shapes: In these.
    """

    frames: Index
    shapes: Placed

    @classmethod
    def of(cls, frames: Sequence[int], shapes: Sequence[Prism]) -> _Table:
        """Return shapes as a table."""
        rows = [(s.x, s.y, s.yaw, s.half_x, s.half_y, s.radius, s.low, s.high) for s in shapes]
        x, y, yaw, *rest = np.array(rows).reshape(-1, 8).T.copy()
        return cls(np.array(frames, dtype=np.intp), Placed(x, y, np.cos(yaw), np.sin(yaw), *rest))

    def take(self, rows: Index) -> _Table:
        """Return some of the shapes."""
        return _Table(self.frames[rows], self.shapes.take(rows))

    def joined(self, other: _Table) -> _Table:
        """Return the shapes of two tables as one."""
        columns = zip(self.shapes, other.shapes, strict=True)
        return _Table(
            np.concatenate((self.frames, other.frames)),
            Placed(*(np.concatenate(both) for both in columns)),
        )

    def everywhere(self, at: _Frames) -> Placed:
        """Return all shapes in the base frame at all instants, (shapes, instants)."""
        columns = (column[self.frames] for column in at)
        return _moved(Placed(*(column[:, None] for column in self.shapes)), *columns)

    def at(self, at: _Frames, rows: Index, instants: Index) -> Placed:
        """Return shapes in the base frame, each at an instant of its own, (n,)."""
        frames = self.frames[rows]
        return _moved(self.shapes.take(rows), *(column[frames, instants] for column in at))


def _moved(own: Placed, x: Array, y: Array, z: Array, cos: Array, sin: Array) -> Placed:
    """Return shapes from frames at x, y, z, which are turned, in the base frame."""
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


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """All pairs that are looked at; made by :func:`layout_of`.

    Attributes:
        pairs: In the order of the rows of :meth:`clearances`: what is kept apart, what is kept
            in, and what is kept above the table.
        own: Which of them are of the arm itself, shape (pairs,).
        reach: How far a point of the arm moves at most per movement of each joint [m/rad, 1,
            m/rad, m/rad], shape (4,).
    """

    pairs: tuple[Pair, ...]
    own: npt.NDArray[np.bool_]
    reach: Array
    _hulls: _Table
    """Shapes around bodies."""
    _shapes: _Table
    """Their parts."""
    _whole: tuple[Index, Index]
    """Hulls of each row but those above the table."""
    _parts: tuple[Index, Index]
    """Parts of all these rows, one after the other."""
    _ends: Index
    """Where each row's parts end."""
    _rough: npt.NDArray[np.bool_]
    """Whether a hull is more than the only part, of each of these rows."""
    _apart: int
    """Number of the first row that is kept in."""
    _above: Index
    _table: float
    _allowed: Array

    def clearances(self, arm: Scara, joints: Array, exact: float = np.inf) -> Array:
        """Return the distance of each pair, and what it is allowed, as one [m], shape (pairs, n).

        Args:
            arm: The arm that the layout is for.
            joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).
            exact: What is nearer than this is exact [m]; what is not may be still farther.
        """
        result = np.empty((len(self.pairs), len(joints)))
        for start in range(0, len(joints), _AT_ONCE):
            part = slice(start, start + _AT_ONCE)
            self._fill(frames(arm, joints[part]), result[:, part], exact)
        return result

    def nearest(self, arm: Scara, joints: Array) -> Array:
        """Return the distance of the nearest pair, and what it is allowed, as one [m], shape (n,).

        Args:
            arm: The arm that the layout is for.
            joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).
        """
        result = np.full(len(joints), np.inf)
        if not self.pairs:
            return result
        for start in range(0, len(joints), _AT_ONCE):
            part = result[start : start + _AT_ONCE]
            at, count = frames(arm, joints[start : start + _AT_ONCE]), len(self._ends)
            bounds = np.empty((len(self.pairs), len(part)))
            hulls = self._bound(at, bounds)
            part[:] = bounds[count:].min(axis=0, initial=np.inf)
            if count:
                # The one that may be the nearest of all, then what may be nearer still.
                first = self._exact(at, bounds[:count].argmin(axis=0), np.arange(len(part)))
                np.minimum(part, first, out=part)
                self._refine(at, hulls, bounds, part)
                np.minimum(part, bounds.min(axis=0), out=part)
        return result

    def near(self, arm: Scara, joints: Array, far: float) -> tuple[Layout | None, float]:
        """Return what is nearer than a distance, and how far the nearest pair is at least [m].

        Args:
            arm: The arm that the layout is for.
            joints: j1 to j4 [rad, m, rad, rad], shape (4,).
            far: The distance [m].

        Returns:
            The pairs, each without its parts that are farther; a pair of which few parts are
            left may be several, one for each of them. None where nothing is so near.
        """
        at, count = frames(arm, joints[None]), len(self._ends)
        clearances = np.empty((len(self.pairs), 1))
        self._fill(at, clearances, far)
        rows, nearest = np.flatnonzero(clearances[:, 0] < far), float(clearances.min())
        if not len(rows):
            return None, nearest
        looked, low = rows[rows < count], rows[rows >= count]
        owners, parts = self._parts_of(looked)
        some = self._of_parts(at, looked[owners], parts, 0 * owners) < far
        owners, parts = owners[some], parts[some]
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

    def _fill(self, at: _Frames, result: Array, exact: float) -> None:
        """Write distances and what is allowed; above ``exact`` what they are at least."""
        self._refine(at, self._bound(at, result), result, exact)

    def _bound(self, at: _Frames, result: Array) -> Placed:
        """Write how far pairs are apart at least, and what is allowed; return the hulls."""
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
            apart[:] = least(hulls, one, other)
        result += self._allowed
        return hulls

    def _refine(self, at: _Frames, hulls: Placed, result: Array, exact: float | Array) -> None:
        """Make what is nearer than ``exact``, at all instants or at each, exact."""
        apart = result[: self._apart]
        if apart.size > _FEW:
            row, instant = np.nonzero(apart < exact)
            one, other = (column[row] for column in self._whole)
            apart[row, instant] = distances(hulls.at(one, instant), hulls.at(other, instant))
            apart[row, instant] += self._allowed[row, 0]
        if self._rough.any():
            row, instant = np.nonzero((result[: len(self._ends)] < exact) & self._rough[:, None])
            result[row, instant] = self._exact(at, row, instant)

    def _exact(self, at: _Frames, row: Index, instant: Index) -> Array:
        """Return the distances of pairs at instants from all of their parts."""
        result = np.empty(len(row))
        counts = np.diff(self._ends, prepend=0)[row]
        cuts = np.searchsorted(np.cumsum(counts), np.arange(0, counts.sum(), _PARTS_AT_ONCE)[1:])
        for start, end in _between(np.unique(cuts), len(row)):
            rows, instants = row[start:end], instant[start:end]
            owners, parts = self._parts_of(rows)
            values = self._of_parts(at, rows[owners], parts, instants[owners])
            first = np.cumsum(counts[start:end]) - counts[start:end]
            result[start:end] = np.minimum.reduceat(values, first)
        return result

    def _parts_of(self, rows: Index) -> tuple[Index, Index]:
        """Return the place of each part's row among some, and the parts, row after row."""
        counts = np.diff(self._ends, prepend=0)[rows]
        owners = np.repeat(np.arange(len(rows)), counts)
        within = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
        return owners, (self._ends[rows] - counts)[owners] + within

    def _of_parts(self, at: _Frames, row: Index, part: Index, instant: Index) -> Array:
        """Return the distances of pairs of parts at instants, and what they are allowed."""
        one, other = (self._shapes.at(at, column[part], instant) for column in self._parts)
        inside = row >= self._apart
        if not inside.any():
            values = distances(one, other)
        else:
            values = np.where(inside, room_within(one, other), distances(one, other))
        values += self._allowed[row, 0]
        return values


def _between(cuts: Index, end: int) -> Iterator[tuple[int, int]]:
    """Yield start and end of the pieces between cuts."""
    edges = [0, *(cut for cut in cuts.tolist() if 0 < cut < end), end]
    return pairwise(edges)


class _Rows:
    """Collects pairs of bodies and their parts.

    Args:
        bodies: What is looked at; zones too.
    """

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
        """Return the number of the shape around some parts of a body."""
        key = tuple(parts.tolist())
        if key not in self.hulls:
            self.hulls[key] = len(self.around)
            self.around.append(hull(tuple(self.shapes[part] for part in key)))
            self.around_frames.append(self.frames[key[0]])
        return self.hulls[key]

    def add(self, one: Index, other: Index) -> None:
        """Add a row of pairs of parts."""
        self.whole.append((self.hull(np.unique(one)), self.hull(np.unique(other))))
        self.parts.append((one, other))


@lru_cache(maxsize=16)
def layout_of(
    zones: tuple[ZoneShape, ...],
    table: float | None,
    mounted: tuple[Body, ...],
    widths: tuple[float, float],
    geometry: Geometry,
    tool: Pose,
    ranges: tuple[Range, Range],
    margin: float,
) -> Layout:
    """Return what is looked at in a scene.

    Args:
        zones: Of the scene.
        table: Height of its table [m], or None.
        mounted: What the wrist carries.
        widths: Smallest and largest width of the gripper [m].
        geometry: Of the arm.
        tool: Pose of the tool in the flange.
        ranges: Lowest and highest position of the lift [m] and of the elbow [rad].
        margin: Distance to keep [m].
    """
    arm = arm_of(geometry, tool, mounted, widths)
    # The base's frame, in which zones stand too, is the first.
    rows = _Rows((*arm, *(Body(name, BASE, (shape,)) for name, shape, _, _ in zones)))
    own = _meetings(arm, len(arm) - len(mounted) - 1, geometry, ranges)
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
        np.array([pair.own for pair in pairs], dtype=np.bool_),
        reaches(geometry, arm),
        _Table.of(rows.around_frames, rows.around),
        _Table.of(rows.frames, rows.shapes),
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
    return margin + STAND if zone in body.touches else 0.0


def _meetings(
    arm: tuple[Body, ...], links: int, geometry: Geometry, ranges: tuple[Range, Range]
) -> list[_Meeting]:
    """Return which bodies of an arm may meet, by their numbers, and which parts of them.

    Args:
        arm: All of its bodies; the last is the tool's point, which nothing is kept from.
        links: So many of them are links; the rest is carried by the wrist.
        geometry: Of the arm.
        ranges: Of lift and elbow.
    """
    found = list(_links_meeting(arm[:links], geometry, ranges))
    for k in range(links, len(arm) - 1):
        for i in range(k):
            parts = _meeting(arm[i], arm[k], geometry.height, ranges[0])
            if parts is not None:
                found.append((i, k, parts))
    return found


@lru_cache(maxsize=4)
def _links_meeting(
    links: tuple[Body, ...], geometry: Geometry, ranges: tuple[Range, Range]
) -> tuple[_Meeting, ...]:
    """Return which links may meet; those of the existing arm do not, within its elbow's range."""
    found = []
    for k, other in enumerate(links):
        for i, one in enumerate(links[:k]):
            parts = _meeting(one, other, geometry.height, ranges[0])
            if parts is not None and _near(one, other, parts, geometry, ranges[1]):
                found.append((i, k, parts))
    return tuple(found)


def _meeting(one: Body, other: Body, height: float, lift: Range) -> tuple[Index, Index] | None:
    """Return which parts of two bodies of the arm may meet, if any; by their heights.

    What turns together, or is in one another by construction, does not meet.
    """
    if one.frame == other.frame or {one.link, other.link} in ATTACHED:
        return None
    lifted = [body.frame >= UPPER_ARM for body in (one, other)]
    ranges = []
    for body, up in zip((one, other), lifted, strict=True):
        stands = 0.0 if body.frame == BASE else height
        down, raised = lift if up and not all(lifted) else (0.0, 0.0)
        beyond = 0.0 if all(lifted) or not any(lifted) else _BEYOND_END
        ranges.append(
            (
                np.array([shape.low for shape in body.shapes]) + (stands + down - beyond),
                np.array([shape.high for shape in body.shapes]) + (stands + raised + beyond),
            )
        )
    (low_one, high_one), (low_other, high_other) = ranges
    first, second = np.nonzero(
        (low_one[:, None] < high_other - _ROUNDING) & (low_other < high_one[:, None] - _ROUNDING)
    )
    return (first, second) if len(first) else None


def _near(
    one: Body, other: Body, parts: tuple[Index, Index], geometry: Geometry, elbow: Range
) -> bool:
    """Return whether a link before the elbow and one after it come near to each other.

    Looked at from above, and as if the wrist turned all the way round.
    """
    if one.frame not in (COLUMN, UPPER_ARM) or other.frame not in (FOREARM, WRIST):
        return True
    turns = np.linspace(*elbow, _TURNS)
    x, y = geometry.upper_arm, 0.0
    if other.frame == WRIST:
        shapes = [Prism(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, extent(other))]
        parts = parts[0], 0 * parts[1]
    else:
        shapes = [replace(shape, low=0.0, high=0.0) for shape in other.shapes]
    before = [replace(shape, low=0.0, high=0.0) for shape in one.shapes]
    zero = np.zeros(len(turns))
    cos, sin = np.cos(turns), np.sin(turns)
    ahead = geometry.forearm if other.frame == WRIST else 0.0
    here, there = _Table.of([0] * len(before), before), _Table.of([0] * len(shapes), shapes)
    still = (zero[None], zero[None], zero[None], zero[None] + 1.0, zero[None])
    turned = (x + ahead * cos[None], y + ahead * sin[None], zero[None], cos[None], sin[None])
    gaps = distances(here.everywhere(still).take(parts[0]), there.everywhere(turned).take(parts[1]))
    missed = (geometry.forearm + extent(other)) * (elbow[1] - elbow[0]) / (2.0 * (_TURNS - 1))
    return float(gaps.min()) - missed < OWN_MARGIN
