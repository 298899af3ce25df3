"""Whether an arm that moves from state to state can always still come to rest clear of everything.

A state is where the joints are and how they move. The way to rest from there is straight in the
space of the joints: all brake together, so that the arm goes on in its direction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from bioscara.errors import InvalidArgumentError, ZoneError
from bioscara.kinematics import Scara
from bioscara.planning.layout import Layout, Pair
from bioscara.planning.nearby import Nearby
from bioscara.planning.shapes import Array
from bioscara.planning.sweep import COARSE, SLACK, look_between
from bioscara.planning.zones import Scene

_ROUNDING = 1e-9
"""What rounding makes of a distance [m]."""


class Room:
    """The room that an arm has in a scene.

    Args:
        arm: The arm with its tool.
        scene: What to keep clear of.

    Attributes:
        arm: As given.
        scene: As given.
    """

    def __init__(self, arm: Scara, scene: Scene) -> None:
        self.arm, self.scene = arm, scene
        layout = scene.layout(arm)
        self._view = _View(arm, layout, scene.margin) if layout.pairs else None

    def check(
        self,
        before: Sequence[float],
        here: Sequence[float],
        rest: Sequence[float],
        *,
        together: bool = True,
        way: Callable[[], Array | None] = lambda: None,
    ) -> bool:
        """Make sure that the arm may go on to a state.

        It may where it keeps the margin on the straight way there and on the way to rest from
        there, and a little more, so that what is missed between samples and what is measured
        there later keep it too. A pair that was nearer already may stay so, but not come nearer
        still, but for :data:`~bioscara.planning.sweep.SLACK` in all.

        How far everything was when it was looked at last is remembered: until the arm can have
        covered that distance, this costs next to nothing.

        Args:
            before: Joints in the state before [rad, m, rad, rad].
            here: Joints in this state.
            rest: Joints where the arm comes to rest from there.
            together: Whether the way to rest is straight; False where one joint may be at rest
                before another, so that the joints may be anywhere between.
            way: Returns the way that the joints go in place of that over ``here`` to ``rest``,
                shape (n, 4); all of it is between these two.

        Returns:
            Whether anything was so near that it had to be looked at closely.

        Raises:
            ZoneError: It may not.
            InvalidArgumentError: A joint is not at a finite number.
        """
        view = self._view
        if view is None or view.reaches(here, rest) < view.free:
            return False
        for joint in (*before, *here, *rest):
            if not math.isfinite(joint):
                raise InvalidArgumentError(f"a joint is at {joint}: zones need finite positions")
        view.look(np.array((before, here, rest)))
        if view.reaches(here, rest) < view.free:
            return False
        corners = way()
        if corners is None:
            corners = np.array((before, here, rest))
        view.sweep(corners, together=together)
        return True


class _View:
    """Some pairs, and how far apart they were when they were looked at last.

    Args:
        arm: The arm.
        layout: The pairs.
        margin: Distance to keep [m].

    Attributes:
        free: How much nearer any of the pairs might come [m].
    """

    def __init__(self, arm: Scara, layout: Layout, margin: float) -> None:
        self._arm, self._near, self._margin = arm, layout, margin
        self._wanted = margin + SLACK
        self._nearby = Nearby(arm, layout, self._wanted + COARSE)
        self._reach: tuple[float, ...] = tuple(layout.reach.tolist())
        self._place: Sequence[float] = (math.nan,) * len(self._reach)
        self._highest = np.full((len(layout.pairs), 1), -math.inf)
        self._floor = self._highest
        self._nearest = layout.pairs[0]
        self.free = 0.0

    def reaches(self, here: Sequence[float], rest: Sequence[float]) -> float:
        """Return how far any point goes at most, from where it was looked at until rest [m]."""
        way = 0.0
        for reach, place, one, other in zip(self._reach, self._place, here, rest, strict=True):
            way += reach * max(abs(one - place), abs(other - place))
        return way

    def look(self, corners: Array) -> None:
        """Look anew, from the first corner, at what may come near on the way along all."""
        here = corners[0]
        way = np.abs(np.diff(corners, axis=0)).sum(axis=0) @ self._nearby.reach
        near = self._nearby.on(here, float(way))
        # All that is left out is farther than the arm goes.
        self._place, self.free = here.tolist(), self._nearby.free(here) + COARSE
        if near is None:
            return
        self._near = near
        parts = near.clearances(self._arm, here[None], self._wanted + COARSE)
        nearest = int(parts.argmin())
        self._nearest = near.pairs[nearest]
        self.free = min(self.free, float(parts[nearest, 0]) - self._wanted)
        pairs = np.full(self._highest.shape, self._wanted)
        np.minimum.at(pairs, near.rows, parts)
        # Where other joints are held while some lead the arm away, digits may be rounded.
        kept = np.where(pairs < self._margin, pairs - SLACK, self._margin)
        floor = np.where(pairs < self._wanted, kept, self._wanted)
        self._highest = np.maximum(self._highest, floor)
        self._floor = np.minimum(self._highest, pairs)[near.rows]

    def sweep(self, corners: Array, *, together: bool) -> None:
        """Look at the way from corner to corner; its time is 1 from each to the next."""
        if not together:
            raise self._refusal(self._nearest, -self.free)
        ways = np.abs(np.diff(corners, axis=0)) @ self._nearby.reach
        counts = np.maximum(np.ceil(ways / COARSE), 1.0).astype(np.intp)
        starts = np.concatenate([i + np.arange(n) / n for i, n in enumerate(counts)])
        lengths, speeds = np.repeat(1.0 / counts, counts), np.repeat(ways, counts)
        times = np.arange(len(corners))

        def look(at: Array) -> Array:
            rows = np.stack([np.interp(at, times, column) for column in corners.T], axis=1)
            clearances = self._near.clearances(self._arm, rows, self._wanted + COARSE)
            rooms = clearances - self._floor
            free: Array = rooms.min(axis=0)
            if (free < -_ROUNDING).any():
                row, _ = np.unravel_index(int(rooms.argmin()), rooms.shape)
                raise self._refusal(self._near.pairs[int(row)], -float(free.min()))
            return free

        nodes = look(np.append(starts, times[-1]))
        look_between(look, (starts, lengths, speeds), nodes)

    def _refusal(self, pair: Pair, depth: float) -> ZoneError:
        where = "before it can come to rest"
        margin = self._margin - pair.allowed
        return ZoneError(pair.zone, pair.link, 0.0, depth, margin, where)
