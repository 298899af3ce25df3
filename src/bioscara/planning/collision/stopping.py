"""Check that a moving arm can still come to rest without touching anything."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.kinematics import Scara, batch
from bioscara.planning.arrays import Array
from bioscara.planning.collision.broad_phase import BroadPhase
from bioscara.planning.collision.margins import goal_slack
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.scene_pairs import Layout, Pair
from bioscara.planning.collision.swept import SLACK, refusal
from bioscara.planning.limits import JointLimits

VelocityBounds = tuple[tuple[float, ...], tuple[float, ...]]
"""Lowest and highest velocity of each joint [rad/s or m/s]."""
PositionBounds = tuple[Array, Array]
"""Lowest and highest position of each joint [rad or m], each of shape (4,)."""
_SAMPLES = (6, 48)
"""Fewest and most samples of a step, and of the stopping path after it."""
_ROUNDING = 1e-9
_SPEED_ROUNDING = 1.0 + 1e-3
"""Factor by which the tool may be faster while it turns: speeds are bounded one step ahead."""


class Hindrance(NamedTuple):
    """Why a step is not possible: a joint's range, two bodies, or else the speed of the tool.

    Attributes:
        joint: Number of the joint that would leave its range, from 0.
        upper: Whether at its upper end.
        pair: The bodies that would come too near to each other.
    """

    joint: int | None = None
    upper: bool = False
    pair: Pair | None = None


class StoppingCheck:
    """Check of the stopping paths of one arm in one scene."""

    def __init__(
        self, kinematics: Scara, limits: Sequence[JointLimits], scene: Scene | None
    ) -> None:
        self._kinematics = kinematics
        self._fastest = tuple(limit.max_velocity for limit in limits)
        self._braking = np.array([limit.max_acceleration for limit in limits])
        self._margin = math.inf if scene is None else scene.margin
        self._slack = 0.0 if scene is None else goal_slack(scene.margin)
        self._layout: Layout | None = None
        if scene is not None and (layout := scene.layout(kinematics)).pairs:
            self._layout, self._broad_phase = layout, BroadPhase(kinematics, layout, scene.margin)

    def check_start(self, positions: Sequence[float]) -> None:
        """Make sure that the arm keeps the margin at its present position.

        Raises:
            ZoneError: It does not.
        """
        if self._layout is None:
            return
        clearances = self._layout.clearances(self._kinematics, np.array([positions]), self._margin)
        floor = np.full((len(self._layout.pairs), 1), self._margin)
        floor[self._layout.own] = -math.inf
        # The next motion begins where the last one ended, which may be off its goal by the slack.
        if (clearances < floor - self._slack).any():
            raise refusal(self._layout, np.zeros(1), clearances, self._margin, floor)

    def approach(self, moving: Array, targets: Array, period: float, straight: bool) -> Array:
        """Return the velocities after a period, as near to ``targets`` as accelerations allow.

        Args:
            moving: Present velocities, shape (4,).
            targets: Target velocities, shape (k, 4).
            period: [s].
            straight: Whether all joints make the same share of their change, so that the tool
                keeps its direction; else each changes as fast as it can.
        """
        most = self._braking * period
        change = targets - moving
        if straight:
            excess = np.abs(change) / most
            change = change / np.maximum(excess.max(axis=1, keepdims=True), 1.0)
        bounded: Array = moving + np.clip(change, -most, most)
        return bounded

    def brake(self, here: Array, moving: Array, period: float) -> tuple[Array, Array]:
        """Return positions and velocities after a period of braking each joint independently."""
        there, slower = self._braked(here[None], moving[None], np.full((1, 1), period))
        return there[0, 0], slower[0, 0]

    def speeds(
        self,
        positions: Sequence[float],
        velocities: Sequence[float],
        ranges: PositionBounds,
        period: float,
        share: float = 1.0,
    ) -> VelocityBounds:
        """Return the velocities after a period from which each joint can stop within a range.

        Args:
            positions: Of the joints.
            velocities: Of the joints.
            ranges: Allowed positions of the joints.
            period: [s].
            share: Share of its deceleration that each uses.
        """
        low, high = [], []
        lower, upper = ranges
        for joint, (here, moving) in enumerate(zip(positions, velocities, strict=True)):
            up, down = float(upper[joint]) - here, here - float(lower[joint])
            high.append(self._speed_within(joint, up, moving, period, share))
            low.append(-self._speed_within(joint, down, -moving, period, share))
        return tuple(low), tuple(high)

    def _speed_within(
        self, joint: int, room: float, moving: float, period: float, share: float
    ) -> float:
        """Return the highest speed of a joint after a period from which it can still stop.

        Args:
            joint: Number of the joint, from 0.
            room: How far it may still move [rad or m].
            moving: Present velocity in that direction [rad/s or m/s].
            period: [s].
            share: Share of its deceleration that it uses.
        """
        # (moving + v) / 2 period + v^2 / (2 a) = room, for v.
        a = share * float(self._braking[joint])
        square = period * period / 4.0 + (2.0 * room - moving * period) / a
        if square <= 0.0:
            return 0.0
        # Nor may it be so fast that it cannot rest at the end of the next period.
        next_ = min(a * (math.sqrt(square) - period / 2.0), room / period - moving / 2.0)
        return min(max(next_, 0.0), self._fastest[joint])

    def allowed(
        self,
        here: Array,
        moving: Array,
        there: Array,
        next_: Array,
        period: float,
        fastest: float,
        ranges: PositionBounds,
    ) -> tuple[int | None, Hindrance | None]:
        """Return the first step after which the arm can still come to rest, or None.

        Also return the reason why the first step is not possible, None if it is.

        Args:
            here: Joints before the step, shape (4,).
            moving: Their velocities, shape (4,).
            there: Joints after each of the steps, shape (k, 4).
            next_: Their velocities then, shape (k, 4).
            period: Of the step [s].
            fastest: Highest speed of the tool [m/s].
            ranges: Allowed positions of the joints.
        """
        lower, upper = ranges
        seconds = (np.abs(next_) / self._braking).max(axis=1)
        samples = self._samples(np.abs(next_).max(axis=0) * seconds.max() / 2.0)
        times = np.outer(seconds, np.linspace(0.0, 1.0, samples))
        # The tool's speed has a corner where one joint comes to rest before the others.
        corners = np.abs(next_) / self._braking
        stop, speeds = self._braked(there, next_, np.hstack((times, corners)))
        speed = batch.tool_speeds(self._kinematics, stop, speeds)
        stop = stop[:, :samples]
        # The maximum, not the sum: a joint beyond its limit must not move further at each step.
        room = np.maximum(np.maximum(lower - here, here - upper), _ROUNDING)
        # A joint that reverses is farther out at the end of the step than at rest.
        ends = np.stack((there, stop[:, -1]))
        beyond: npt.NDArray[np.bool_] = np.any(
            (ends < lower - room) | (ends > upper + room), axis=0
        )
        inside = np.asarray(~beyond.any(axis=1))
        # Bound of the height of a parabola through three neighbours above the middle one.
        speed[:, 1 : samples - 1] += np.abs(np.diff(speed[:, :samples], 2, axis=1)) / 8.0
        slow = np.asarray(speed.max(axis=1) <= fastest * _SPEED_ROUNDING)
        good: npt.NDArray[np.bool_] = np.logical_and(inside, slow)
        hindrance = None if slow[0] else Hindrance()
        if not inside[0]:
            joint = int(beyond[0].argmax())
            upper = (ends[:, 0, joint] > upper[joint] + room[joint]).any()
            hindrance = Hindrance(joint, bool(upper))
        candidates = np.flatnonzero(good)
        if self._layout is None:
            return (int(candidates[0]) if len(candidates) else None), hindrance
        step, passed = self._step(here, moving, next_, period)
        displacements = np.concatenate((passed, np.abs(np.diff(stop, axis=1))), axis=1)
        path, zone = np.concatenate((step, stop), axis=1), None
        # Checking zones takes longest. If the first step violates another limit, the first one
        # that violates none is usually clear of zones.
        parts = [candidates] if good[0] else [np.append(0, candidates[:1]), candidates[1:]]
        for rows in filter(len, parts):
            clear, touched = self._clear(path[rows], displacements[rows])
            if rows[0] == 0:
                zone = touched
            found = rows[clear & good[rows]]
            if len(found):
                return int(found[0]), zone or hindrance
        return None, zone or hindrance

    def _step(self, here: Array, moving: Array, next_: Array, period: float) -> tuple[Array, Array]:
        """Return joints during a step without its end, and displacements between, (k, m, 4)."""
        passed = np.maximum(np.abs(moving), np.abs(next_)) * period
        times = np.linspace(0.0, period, self._samples(passed.max(axis=0)))[:-1, None]
        change = (next_ - moving)[:, None] / period
        step = here + (moving + change * times / 2.0) * times
        return step, np.repeat(passed[:, None] / len(times), len(times), axis=1)

    def _samples(self, displacement: Array) -> int:
        """Return the number of samples for joint displacements [rad or m], shape (4,)."""
        if self._layout is None:
            return _SAMPLES[1]
        count = math.ceil(float(displacement @ self._layout.reach) / (2.0 * SLACK)) + 1
        return min(max(count, _SAMPLES[0]), _SAMPLES[1])

    def _braked(self, there: Array, moving: Array, times: Array) -> tuple[Array, Array]:
        """Return positions and velocities (k, m, 4) at ``times`` (k, m) since braking began."""
        speed, a = np.abs(moving)[:, None], self._braking
        time = np.minimum(times[..., None], speed / a)
        sign = np.sign(moving)[:, None]
        return there[:, None] + sign * (speed - a * time / 2.0) * time, sign * (speed - a * time)

    def _clear(
        self, path: Array, displacements: Array
    ) -> tuple[npt.NDArray[np.bool_], Hindrance | None]:
        """Return which paths keep the margin, and the body that the first path comes too near to.

        Args:
            path: Joints, shape (k, m, 4); all paths begin at the arm's present position.
            displacements: Displacements of the joints between them, shape (k, m - 1, 4).
        """
        lengths = displacements @ self._broad_phase.reach
        layout = self._broad_phase.candidates(path[0, 0], float(lengths.sum(axis=1).max()))
        if layout is None:
            return np.ones(len(path), dtype=np.bool_), None
        exact = self._margin + float(lengths.max())
        pairs = layout.clearances(self._kinematics, path.reshape(-1, 4), exact)
        # Pairs nearer than the margin at the present position may stay so, but not come nearer.
        rooms = pairs - np.minimum(self._margin, pairs[:, :1])
        room = rooms.min(axis=0).reshape(path.shape[:2])
        between = (room[:, :-1] + room[:, 1:] - lengths) / 2.0
        kept = (room >= 0.0).all(axis=1) & (between >= -SLACK).all(axis=1)
        if kept[0]:
            return kept, None
        nearest = int(rooms[:, : path.shape[1]].min(axis=1).argmin())
        return kept, Hindrance(pair=layout.pairs[nearest])
