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
from bioscara.planning.collision.broad_phase import BroadPhase
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.scene_pairs import Layout, Pair
from bioscara.planning.collision.swept import COARSE, SLACK, subdivide

_ROUNDING = 1e-9
"""Rounding error of a distance [m]."""
_AHEAD = 0.08
"""Distance added to the required one when all pairs are evaluated [m]."""
_ENOUGH = COARSE / 4.0
"""Deviation that must be left for the arm to continue without a new evaluation [m]."""


class StopGuard:
    """Check that an arm in a scene can come to rest clear of everything.

    Attributes:
        kinematics: The arm with its tool.
        scene: The scene to keep clear of.
    """

    def __init__(self, kinematics: Scara, scene: Scene) -> None:
        self.kinematics, self.scene = kinematics, scene
        layout = scene.layout(kinematics)
        self._reach: Sequence[float] = layout.reach.tolist()
        self._clearances = _Clearances(kinematics, layout, scene.margin) if layout.pairs else None

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
        """Make sure that the arm may move to a state.

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
            How far any point of the arm may deviate from these paths and still keep the margin [m].

        Raises:
            ZoneError: It may not.
            InvalidArgumentError: The position of a joint is not a finite number.
        """
        if self._clearances is None:
            return math.inf
        path = np.array(corners)
        ends = path if states is None else np.array(states)
        if not (np.isfinite(path).all() and np.isfinite(ends).all()):
            raise InvalidArgumentError(
                "a joint position is not a finite number: zones cannot be checked"
            )
        if together:
            return self._clearances.check_path(path)
        return self._clearances.check_between(path, np.array((ends.min(axis=0), ends.max(axis=0))))


class _Clearances:
    """The pairs of a layout and their clearances at the last evaluation.

    Args:
        kinematics: The arm.
        layout: The pairs.
        margin: Distance to keep [m].
    """

    def __init__(self, kinematics: Scara, layout: Layout, margin: float) -> None:
        self._kinematics, self._layout, self._margin = kinematics, layout, margin
        self._wanted = margin + SLACK
        self._broad_phase = BroadPhase(kinematics, layout, self._wanted + COARSE, _AHEAD)
        self._reach = layout.reach
        self._highest = np.full((len(layout.pairs), 1), -math.inf)
        self._samples, self._frees = np.empty((0, len(self._reach))), np.empty(0)

    def check_between(self, corners: Array, ends: Array) -> float:
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
            near, pairs = self._evaluate(corners, float(far))
            free = self._around(ends)
            if free <= 0.0:
                nearest = int(pairs[:, 0].argmin())
                raise self._refusal(near.pairs[nearest], self._wanted - float(pairs[nearest, 0]))
        return free

    def check_path(self, corners: Array) -> float:
        """Check the path from corner to corner; return how far points may deviate from it [m].

        Raises:
            ZoneError: The path is not clear.
        """
        steps = np.diff(corners, axis=0)
        paths = np.abs(steps) @ self._reach
        gaps = np.abs(corners[:, None] - self._samples) @ self._reach
        free = _least((self._frees - gaps).max(axis=1, initial=-math.inf), paths)
        if free >= _ENOUGH:
            return free
        counts = np.maximum(np.ceil(paths / COARSE), 1.0)
        segments = np.repeat(np.arange(len(steps)), counts.astype(np.intp))
        first = np.cumsum(counts) - counts
        starts = segments + (np.arange(len(segments)) - first[segments]) / counts[segments]

        def at(times: Array) -> Array:
            """Return the joints at path parameters that increase by 1 from corner to corner."""
            index = np.minimum(times.astype(np.intp), len(steps) - 1)
            joints: Array = corners[index] + (times - index)[:, None] * steps[index]
            return joints

        samples = at(np.append(starts, len(steps)))
        far = float((np.abs(corners - corners[0]) @ self._reach).max())
        near, pairs = self._evaluate(samples, far)
        lengths, speeds = 1.0 / counts[segments], paths[segments]
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

        def evaluate(times: Array) -> Array:
            return room(near.clearances(self._kinematics, at(times), self._wanted + COARSE))

        subdivide(evaluate, (starts, lengths, speeds), room(pairs))
        return _least(self._frees, speeds * lengths)

    def _evaluate(self, samples: Array, far: float) -> tuple[Layout, Array]:
        """Evaluate the clearances at some joint positions and store the free distance there.

        Args:
            samples: Joints, the present ones first, shape (n, 4).
            far: Longest path of any point of the arm from there [m].

        Returns:
            The pairs that may come near, and their distances [m], shape (pairs, n).
        """
        near = self._broad_phase.candidates(samples[0], far)
        # All pairs that the broad phase leaves out are farther apart than this.
        self._samples, self._frees = samples, self._broad_phase.free_distance(samples) + COARSE
        if near is None:
            self._highest[:] = self._wanted
            return self._layout, np.empty((0, len(samples)))
        pairs = near.clearances(self._kinematics, samples, self._wanted + COARSE)
        self._frees = np.minimum(self._frees, pairs.min(axis=0) - self._wanted)
        return near, pairs

    def _around(self, ends: Array) -> float:
        """Return the free distance left around all positions between two states [m]."""
        gaps = np.abs(ends[:, None] - self._samples).max(axis=0) @ self._reach
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
        # Where some joints hold while others move the arm away, positions may be off by rounding.
        kept = np.where(all_pairs < self._margin, all_pairs - SLACK, self._margin)
        floor = np.where(all_pairs < self._wanted, kept, self._wanted)
        self._highest = np.maximum(self._highest, floor)
        lowest: Array = np.minimum(self._highest, all_pairs)[near.rows]
        return lowest

    def _refusal(self, pair: Pair, depth: float) -> ZoneError:
        where = "before it can come to rest"
        margin = self._margin - pair.allowed
        return ZoneError(pair.zone, pair.link, 0.0, depth, margin, where)


def _least(rooms: Array, paths: Array) -> float:
    """Return a lower bound of the room on a path through sampled positions [m].

    Args:
        rooms: Room at these [m].
        paths: Longest path of any point of the arm from each to the next [m].
    """
    # No clearance changes by more than the path length, which bounds it between the two ends.
    return float((rooms[:-1] + rooms[1:] - paths).min()) / 2.0
