"""Check that an arm moving from state to state can always come to rest clear of everything.

A state is the positions and velocities of the joints. The stopping path from there is straight in
joint space: all joints brake together, so that the arm keeps its direction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bioscara.errors import InvalidArgumentError, ZoneError
from bioscara.kinematics import Scara
from bioscara.planning.arrays import Array
from bioscara.planning.collision.broad_phase import Nearby
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.scene_pairs import Layout, Pair
from bioscara.planning.collision.swept import COARSE, SLACK, look_between

_ROUNDING = 1e-9
"""Rounding error of a distance [m]."""
_AHEAD = 0.08
"""Distance added to the required one when all pairs are evaluated [m]."""
_ENOUGH = COARSE / 4.0
"""Room with which the arm continues without a new evaluation [m]."""


class StopGuard:
    """Check of the room that an arm has in a scene.

    Args:
        arm: The arm with its tool.
        scene: Scene to keep clear of.

    Attributes:
        arm: As given.
        scene: As given.
    """

    def __init__(self, arm: Scara, scene: Scene) -> None:
        self.arm, self.scene = arm, scene
        layout = scene.layout(arm)
        self._reach: Sequence[float] = layout.reach.tolist()
        self._view = _View(arm, layout, scene.margin) if layout.pairs else None

    @property
    def reach(self) -> Sequence[float]:
        """Largest displacement of a point of the arm per joint displacement [m/rad, 1, ...]."""
        return self._reach

    def check(
        self,
        corners: Sequence[Sequence[float]] | Array,
        states: Sequence[Sequence[float]] | None = None,
        *,
        together: bool = True,
    ) -> float:
        """Make sure that the arm may go on to a state.

        It may if it keeps the margin on the path there and on the stopping path from there, plus a
        reserve so that positions between samples and later measured ones keep the margin too. A
        pair that was nearer already may stay so, but must not come nearer still, except for
        :data:`~bioscara.planning.collision.swept.SLACK` in total.

        Args:
            corners: Joints along this path, which is straight from each to the next [rad, m, rad,
                rad], shape (n, 4).
            states: Joints that enclose the whole path; the corners, unless given.
            together: Whether all joints follow this path; False if one joint may be at rest
                before another, so that the joints may be anywhere between the states.

        Returns:
            How far any point of the arm may deviate from all this and still keep the margin [m].

        Raises:
            ZoneError: It may not go on.
            InvalidArgumentError: The position of a joint is not a finite number.
        """
        if self._view is None:
            return math.inf
        way = np.array(corners)
        ends = way if states is None else np.array(states)
        if not (np.isfinite(way).all() and np.isfinite(ends).all()):
            raise InvalidArgumentError("a joint is nowhere: zones need finite positions")
        if together:
            return self._view.look(way)
        return self._view.look_around(way, np.array((ends.min(axis=0), ends.max(axis=0))))


class _View:
    """The pairs of a layout and their clearances at the last evaluation.

    Args:
        arm: The arm.
        layout: The pairs.
        margin: Distance to keep [m].
    """

    def __init__(self, arm: Scara, layout: Layout, margin: float) -> None:
        self._arm, self._layout, self._margin = arm, layout, margin
        self._wanted = margin + SLACK
        self._nearby = Nearby(arm, layout, self._wanted + COARSE, _AHEAD)
        self._reach = layout.reach
        self._highest = np.full((len(layout.pairs), 1), -math.inf)
        self._spots, self._frees = np.empty((0, len(self._reach))), np.empty(0)

    def look_around(self, corners: Array, ends: Array) -> float:
        """Check all positions between two states; return the deviation allowed from them [m].

        Args:
            corners: Joints between them, from the present ones on, shape (n, 4).
            ends: The lowest and the highest joints, shape (2, 4).

        Raises:
            ZoneError: Not all of them are verified to be clear.
        """
        free = self._around(ends)
        if free < _ENOUGH:
            far = np.abs(ends - corners[0]).max(axis=0) @ self._reach
            near, pairs = self._place(corners, float(far))
            free = self._around(ends)
            if free <= 0.0:
                nearest = int(pairs[:, 0].argmin())
                raise self._refusal(near.pairs[nearest], self._wanted - float(pairs[nearest, 0]))
        return free

    def look(self, corners: Array) -> float:
        """Check the path from corner to corner; return how far points may deviate from it [m].

        Raises:
            ZoneError: The path is not clear.
        """
        steps = np.diff(corners, axis=0)
        ways = np.abs(steps) @ self._reach
        gaps = np.abs(corners[:, None] - self._spots) @ self._reach
        free = _least((self._frees - gaps).max(axis=1, initial=-math.inf), ways)
        if free >= _ENOUGH:
            return free
        counts = np.maximum(np.ceil(ways / COARSE), 1.0)
        segments = np.repeat(np.arange(len(steps)), counts.astype(np.intp))
        first = np.cumsum(counts) - counts
        starts = segments + (np.arange(len(segments)) - first[segments]) / counts[segments]

        def at(times: Array) -> Array:
            """Return the joints at times that count corners: each is 1 after the one before."""
            index = np.minimum(times.astype(np.intp), len(steps) - 1)
            joints: Array = corners[index] + (times - index)[:, None] * steps[index]
            return joints

        spots = at(np.append(starts, len(steps)))
        far = float((np.abs(corners - corners[0]) @ self._reach).max())
        near, pairs = self._place(spots, far)
        lengths, speeds = 1.0 / counts[segments], ways[segments]
        if not len(pairs):
            return _least(self._frees, speeds * lengths)
        floor = self._floor(near, pairs[:, :1])

        def room(pairs: Array) -> Array:
            rooms = pairs - floor
            free: Array = rooms.min(axis=0)
            if (free < -_ROUNDING).any():
                row, _ = np.unravel_index(int(rooms.argmin()), rooms.shape)
                raise self._refusal(near.pairs[int(row)], -float(free.min()))
            return free

        def look(times: Array) -> Array:
            return room(near.clearances(self._arm, at(times), self._wanted + COARSE))

        look_between(look, (starts, lengths, speeds), room(pairs))
        return _least(self._frees, speeds * lengths)

    def _place(self, spots: Array, far: float) -> tuple[Layout, Array]:
        """Evaluate the clearances at some joint positions and store the room there.

        Args:
            spots: Joints, the present ones first, shape (n, 4).
            far: Longest path of any point of the arm from there [m].

        Returns:
            The pairs that may come near, and their distances [m], shape (pairs, n).
        """
        near = self._nearby.on(spots[0], far)
        # All pairs that are left out are farther than this.
        self._spots, self._frees = spots, self._nearby.free(spots) + COARSE
        if near is None:
            self._highest[:] = self._wanted
            return self._layout, np.empty((0, len(spots)))
        pairs = near.clearances(self._arm, spots, self._wanted + COARSE)
        self._frees = np.minimum(self._frees, pairs.min(axis=0) - self._wanted)
        return near, pairs

    def _around(self, ends: Array) -> float:
        """Return the verified room left around all positions between two states [m]."""
        gaps = np.abs(ends[:, None] - self._spots).max(axis=0) @ self._reach
        return float((self._frees - gaps).max(initial=-math.inf))

    def _floor(self, near: Layout, pairs: Array) -> Array:
        """Return the clearance that pairs must keep [m], shape (near pairs, 1).

        Args:
            near: The pairs that are not far apart.
            pairs: Their distances at the beginning [m], shape (near pairs, 1).
        """
        if pairs.min() >= self._wanted:
            self._highest[:] = self._wanted
            return np.full(pairs.shape, self._wanted)
        all_pairs = np.full(self._highest.shape, self._wanted)
        np.minimum.at(all_pairs, near.rows, pairs)
        # Positions may be rounded where some joints move the arm away while others hold.
        kept = np.where(all_pairs < self._margin, all_pairs - SLACK, self._margin)
        floor = np.where(all_pairs < self._wanted, kept, self._wanted)
        self._highest = np.maximum(self._highest, floor)
        lowest: Array = np.minimum(self._highest, all_pairs)[near.rows]
        return lowest

    def _refusal(self, pair: Pair, depth: float) -> ZoneError:
        where = "before it can come to rest"
        margin = self._margin - pair.allowed
        return ZoneError(pair.zone, pair.link, 0.0, depth, margin, where)


def _least(rooms: Array, ways: Array) -> float:
    """Return a lower bound of the room on a path through sampled positions [m].

    Args:
        rooms: Room at these [m].
        ways: Longest path of any point of the arm from each to the next [m].
    """
    # No clearance changes by more than the path length, which bounds it between the two ends.
    return float((rooms[:-1] + rooms[1:] - ways).min()) / 2.0
