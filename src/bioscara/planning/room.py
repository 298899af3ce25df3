"""Whether an arm that moves from state to state can always still come to rest clear of everything.

A state is where the joints are and how they move. The way to rest from there is straight in the
space of the joints: all brake together, so that the arm goes on in its direction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bioscara.errors import InvalidArgumentError, ZoneError
from bioscara.kinematics import Scara
from bioscara.planning.layout import Layout, Pair
from bioscara.planning.shapes import Array
from bioscara.planning.sweep import COARSE, look_between
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
        self._layouts = scene.layouts(arm)
        self._reach: tuple[float, ...] = tuple(self._layouts[0].reach.tolist())
        self._place: Sequence[float] = (math.nan,) * len(self._reach)
        self._free = 0.0
        self._nearest = Pair("", "")

    def check(
        self,
        before: Sequence[float],
        here: Sequence[float],
        rest: Sequence[float],
        *,
        together: bool = True,
    ) -> None:
        """Make sure that the arm may go on to a state.

        It may where it keeps the margin on the straight way there and on the way to rest from
        there. A pair that was nearer already may stay so, but not come nearer still.

        How far everything was when it was looked at last is remembered: until the arm can have
        covered that distance, this costs next to nothing.

        Args:
            before: Joints in the state before [rad, m, rad, rad].
            here: Joints in this state.
            rest: Joints where the arm comes to rest from there.
            together: Whether the way to rest is straight; False where one joint may be at rest
                before another, so that the joints may be anywhere between.

        Raises:
            ZoneError: It may not.
            InvalidArgumentError: A joint is not at a finite number.
        """
        if self._reaches(here, rest) < self._free:
            return
        for joint in (*before, *here, *rest):
            if not math.isfinite(joint):
                raise InvalidArgumentError(f"a joint is at {joint}: zones need finite positions")
        floors = self._look(before)
        if self._reaches(here, rest) < self._free:
            return
        if not together:
            raise self._refusal(self._nearest, -self._free)
        corners = np.array((before, here, rest))
        for layout, floor in zip(self._layouts, floors, strict=True):
            if layout.pairs:
                self._sweep(layout, floor, corners)

    def _reaches(self, here: Sequence[float], rest: Sequence[float]) -> float:
        """Return how far any point can be from where it was looked at, until rest [m]."""
        way = 0.0
        for reach, place, one, other in zip(self._reach, self._place, here, rest, strict=True):
            way += reach * max(abs(one - place), abs(other - place))
        return way

    def _look(self, joints: Sequence[float]) -> list[Array]:
        """Look at all pairs, and return the distance that each must keep, (pairs, 1) [m]."""
        margin, row = self.scene.margin, np.array((joints,))
        floors, self._place, self._free = [], joints, math.inf
        for layout in self._layouts:
            pairs = layout.clearances(self.arm, row, margin)
            floors.append(np.minimum(pairs, margin))
            if len(pairs) and float(pairs.min()) - margin < self._free:
                self._free = float(pairs.min()) - margin
                self._nearest = layout.pairs[int(pairs.argmin())]
        return floors

    def _sweep(self, layout: Layout, floor: Array, corners: Array) -> None:
        """Look at a way from corner to corner; its time is 1 from each to the next."""
        ways = np.abs(np.diff(corners, axis=0)) @ layout.reach
        counts = np.maximum(np.ceil(ways / COARSE), 1.0).astype(np.intp)
        starts = np.concatenate([i + np.arange(n) / n for i, n in enumerate(counts)])
        lengths, speeds = np.repeat(1.0 / counts, counts), np.repeat(ways, counts)
        times = np.arange(len(corners))

        def look(at: Array) -> Array:
            rows = np.stack([np.interp(at, times, column) for column in corners.T], axis=1)
            rooms = layout.clearances(self.arm, rows, self.scene.margin) - floor
            free: Array = rooms.min(axis=0)
            if (free < -_ROUNDING).any():
                row, _ = np.unravel_index(int(rooms.argmin()), rooms.shape)
                raise self._refusal(layout.pairs[int(row)], -float(free.min()))
            return free

        nodes = look(np.append(starts, times[-1]))
        look_between(look, (starts, lengths, speeds), nodes, 0.0)

    def _refusal(self, pair: Pair, depth: float) -> ZoneError:
        where = "before it can come to rest"
        return ZoneError(pair.zone, pair.link, 0.0, depth, self.scene.margin, where)
