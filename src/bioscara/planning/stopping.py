"""Whether a moving arm can still come to rest without touching anything."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from bioscara.kinematics import Scara, batch
from bioscara.planning.limits import JointLimits
from bioscara.planning.shapes import Array
from bioscara.planning.sweep import SLACK, refusal
from bioscara.planning.zones import Scene

Bounds = tuple[tuple[float, ...], tuple[float, ...]]
"""Lowest and highest velocity of each joint [rad/s or m/s]."""
_SAMPLES = 24
"""Instants at which the way to rest is looked at, after its start."""
_ROUNDING = 1e-9
_SPEED_ROUNDING = 1e-3
"""Share by which the tool may be faster while it turns: speeds are bounded a step ahead."""


class Stops:
    """The ways to rest of one arm in one scene.

    Args:
        arm: The arm with its tool.
        limits: Of its joints.
        scene: What to keep clear of, or None.
    """

    def __init__(self, arm: Scara, limits: Sequence[JointLimits], scene: Scene | None) -> None:
        self._arm = arm
        self._lower = np.array([limit.lower for limit in limits])
        self._upper = np.array([limit.upper for limit in limits])
        self._fastest = tuple(limit.max_velocity for limit in limits)
        self._braking = np.array([limit.max_acceleration for limit in limits])
        self._margin = math.inf if scene is None else scene.margin
        self._layout = None if scene is None else scene.layout(arm)

    def check_start(self, positions: Sequence[float]) -> None:
        """Make sure that the arm keeps the margin where it is.

        Raises:
            ZoneError: It does not.
        """
        if self._layout is None or not self._layout.pairs:
            return
        clearances = self._layout.clearances(self._arm, np.array([positions]))
        # Where a jog came to rest the next one begins, also when the digits were rounded.
        if clearances.min() < self._margin - SLACK:
            raise refusal(self._layout, np.zeros(1), clearances, self._margin)

    def approach(self, moving: Array, targets: Array, period: float, straight: bool) -> Array:
        """Return the velocities after a period, as near to ``targets`` as accelerations allow.

        Args:
            moving: Velocities now, shape (4,).
            targets: Velocities to go for, shape (k, 4).
            period: [s].
            straight: Whether all joints take the same share of their change, so that the tool
                keeps its direction; else each changes as fast as it can.
        """
        most = self._braking * period
        change = targets - moving
        if straight:
            excess = np.abs(change) / most
            return moving + change / np.maximum(excess.max(axis=1, keepdims=True), 1.0)
        bounded: Array = moving + np.clip(change, -most, most)
        return bounded

    def brake(self, here: Array, moving: Array, period: float) -> tuple[Array, Array]:
        """Return positions and velocities after a period of braking each joint by itself."""
        there, slower = self._braked(here[None], moving[None], np.full((1, 1), period))
        return there[0, 0], slower[0, 0]

    def speeds(
        self, positions: Sequence[float], velocities: Sequence[float], period: float
    ) -> Bounds:
        """Return between which velocities each joint keeps to its limits and can stop in them."""
        low, high = [], []
        for joint, (here, moving) in enumerate(zip(positions, velocities, strict=True)):
            up, down = float(self._upper[joint]) - here, here - float(self._lower[joint])
            high.append(self.speed_within(joint, up, moving, period))
            low.append(-self.speed_within(joint, down, -moving, period))
        return tuple(low), tuple(high)

    def speed_within(self, joint: int, room: float, moving: float, period: float) -> float:
        """Return how fast a joint may be after a period so that it can still stop.

        Args:
            joint: Number of the joint, from 0.
            room: How far it may go on [rad or m].
            moving: How fast it goes there now [rad/s or m/s].
            period: [s].
        """
        # (moving + v) / 2 period + v^2 / (2 a) = room, for v.
        a = float(self._braking[joint])
        square = period * period / 4.0 + (2.0 * room - moving * period) / a
        if square <= 0.0:
            return 0.0
        return min(max(a * (math.sqrt(square) - period / 2.0), 0.0), self._fastest[joint])

    def allowed(
        self, here: Array, moving: Array, there: Array, next_: Array, period: float, fastest: float
    ) -> tuple[npt.NDArray[np.bool_], str]:
        """Return after which steps the arm can still come to rest, and what hinders the first.

        Args:
            here: Joints before the step, shape (4,).
            moving: Their velocities, shape (4,).
            there: Joints after each of the steps, shape (k, 4).
            next_: Their velocities then, shape (k, 4).
            period: Of the step [s].
            fastest: Speed of the tool [m/s].
        """
        longest = (np.abs(next_) / self._braking).max(axis=1, keepdims=True)
        times = longest * np.linspace(0.0, 1.0, _SAMPLES + 1)
        way, speeds = self._braked(there, next_, times)
        room = _ROUNDING + np.maximum(np.maximum(self._lower - here, here - self._upper), 0.0)
        end = way[:, -1]
        inside = ((end >= self._lower - room) & (end <= self._upper + room)).all(axis=1)
        tool = batch.tool_speeds(self._arm, way, speeds).max(axis=1)
        slow = tool <= fastest * (1.0 + _SPEED_ROUNDING)
        good = inside & slow
        hindrance = "joint limit" if not inside[0] else "tool speed" if not slow[0] else ""
        if self._layout is None or not self._layout.pairs:
            return good, hindrance
        first = np.maximum(np.abs(moving), np.abs(next_)) * period
        clear, zone = self._clear(here, way, first)
        return good & clear, hindrance or zone

    def _braked(self, there: Array, moving: Array, times: Array) -> tuple[Array, Array]:
        """Return positions and velocities (k, m, 4) at ``times`` (k, m) since braking began."""
        speed, a = np.abs(moving)[:, None], self._braking
        time = np.minimum(times[..., None], speed / a)
        sign = np.sign(moving)[:, None]
        return there[:, None] + sign * (speed - a * time / 2.0) * time, sign * (speed - a * time)

    def _clear(self, here: Array, way: Array, first: Array) -> tuple[npt.NDArray[np.bool_], str]:
        """Return which ways keep the margin, and the zone that the first one does not."""
        layout = self._layout
        if layout is None:
            return np.ones(len(way), dtype=np.bool_), ""
        count, samples, _ = way.shape
        rows = np.concatenate((here[None], way.reshape(-1, 4)))
        pairs = layout.clearances(self._arm, rows)
        clearance = pairs.min(axis=0)
        # Rounding and a start within the slack must not shut the arm in where it is.
        floor = min(self._margin, float(clearance[0]))
        after = clearance[1:].reshape(count, samples)
        before = np.concatenate((np.full((count, 1), clearance[0]), after[:, :-1]), axis=1)
        steps = np.concatenate((first[:, None], np.abs(np.diff(way, axis=1))), axis=1)
        between = (before + after - steps @ layout.reach) / 2.0
        kept = ((after >= floor) & (between >= floor - SLACK)).all(axis=1)
        nearest = int(pairs[:, 1 : samples + 1].min(axis=1).argmin())
        return kept, "" if kept[0] else layout.pairs[nearest].zone
