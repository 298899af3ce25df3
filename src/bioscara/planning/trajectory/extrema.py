"""Extrema of position, velocity and acceleration on the curve of a trajectory."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bioscara.planning.arrays import Array
from bioscara.planning.trajectory.trajectory import Trajectory

_HALVINGS = 42
"""Bisection steps: finds a turning point to 2e-13 of its segment; the value's error is the square
of that."""


class Extremum(NamedTuple):
    """Largest or smallest value of a quantity of one joint, and its time.

    Attributes:
        time: Time [s].
        value: The value then.
    """

    time: float
    value: float


class Extrema(NamedTuple):
    """Extrema of a quantity of one joint.

    Attributes:
        low: The smallest value.
        high: The largest value.
    """

    low: Extremum
    high: Extremum

    @property
    def largest(self) -> Extremum:
        """The extremum of largest magnitude."""
        return max(self, key=lambda extremum: abs(extremum.value))


class JointExtrema(NamedTuple):
    """Extrema of one joint.

    Attributes:
        position: [rad or m].
        velocity: [rad/s or m/s].
        acceleration: [rad/s^2 or m/s^2].
    """

    position: Extrema
    velocity: Extrema
    acceleration: Extrema


def joint_extrema(trajectory: Trajectory) -> list[JointExtrema]:
    """Return the extrema of each joint, in the order of ``joint_names``.

    They hold for every instant, including the rest before and after the motion. Values too large
    to be computed are infinite or NaN.
    """
    rest = np.zeros((2, len(trajectory.joint_names)))
    with np.errstate(all="ignore"):
        cubic = not trajectory.coefficients[..., 4:].any()
        candidates = _of_cubics(trajectory) if cubic else _candidates(trajectory)
    columns = [
        _ranges(trajectory, at, values, edges)
        for (at, values), edges in zip(
            candidates, (trajectory.positions[[0, -1]], rest, rest), strict=True
        )
    ]
    return [JointExtrema(*joint) for joint in zip(*columns, strict=True)]


def _of_cubics(trajectory: Trajectory) -> list[tuple[Array, Array]]:
    """As :func:`_candidates` for polynomials up to degree 3, with turning points in closed form.

    If a segment has none, its start or end is used instead.
    """
    c0, c1, c2, c3 = np.moveaxis(trajectory.coefficients[..., :4], -1, 0)
    lengths = np.broadcast_to(np.diff(trajectory.times)[:, None], c0.shape)
    still = -(c2 + np.copysign(np.sqrt(np.maximum(c2 * c2 - 3.0 * c1 * c3, 0.0)), c2))
    free, first, second = (
        np.clip(np.where(np.isfinite(at), at, 0.0), 0.0, lengths)
        for at in (-c2 / (3.0 * c3), still / (3.0 * c3), c1 / still)
    )
    ends = np.zeros_like(c0), lengths
    slopes = np.stack([c1, 2.0 * c2, 3.0 * c3])
    result = []
    for curve, turns in (
        (np.stack([c0, c1, c2, c3]), (*ends, first, second)),
        (slopes, (*ends, free)),
        (np.stack([2.0 * c2, 6.0 * c3]), ends),
    ):
        at = np.stack(turns)
        result.append((at, _value(curve, at)))
    return result


def _candidates(trajectory: Trajectory) -> list[tuple[Array, Array]]:
    """Return for each derivative the candidate times of its extrema in each segment, and values.

    Between two neighbouring zeros of its derivative a polynomial is monotonic, so it has at most
    one zero of its own there, which bisection finds. Starting at the fourth derivative, a straight
    line, this gives the turning points of all lower ones.
    """
    curves = [np.moveaxis(trajectory.coefficients, -1, 0)]
    for _ in range(4):
        powers = np.arange(1, len(curves[-1]))[:, None, None]
        curves.append(curves[-1][1:] * powers)
    lengths = np.broadcast_to(np.diff(trajectory.times)[:, None], curves[0].shape[1:])
    turns = np.stack([np.zeros_like(lengths), lengths])
    found = []
    for order in (3, 2, 1, 0):
        turns = _with_zeros(curves[order + 1], turns)
        found.append((turns, _value(curves[order], turns)))
    return found[:0:-1]


def _with_zeros(curve: Array, turns: Array) -> Array:
    """Return the zeros of a curve that is monotonic between ``turns``, and the outer two turns.

    If an interval has no zero, one of its ends is used instead.
    """
    low, high = turns[:-1], turns[1:]
    negative = _value(curve, low) < 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        before = (_value(curve, middle) < 0.0) == negative
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.concatenate([turns[:1], low, turns[-1:]])


def _value(curve: Array, at: Array) -> Array:
    result = np.broadcast_to(curve[-1], at.shape)
    for coefficient in curve[-2::-1]:
        result = result * at + coefficient
    return result


def _ranges(trajectory: Trajectory, at: Array, values: Array, edges: Array) -> list[Extrema]:
    """Return the extrema of each joint; ``edges`` are the values before and after the motion."""
    joints = len(trajectory.joint_names)
    times = np.concatenate(
        [
            (at + trajectory.times[:-1, None]).reshape(-1, joints),
            np.broadcast_to(trajectory.times[[0, -1], None], edges.shape),
        ]
    )
    values = np.concatenate([values.reshape(-1, joints), edges])
    lows, highs = values.argmin(axis=0), values.argmax(axis=0)
    return [
        Extrema(
            Extremum(float(times[low, joint]), float(values[low, joint])),
            Extremum(float(times[high, joint]), float(values[high, joint])),
        )
        for joint, (low, high) in enumerate(zip(lows, highs, strict=True))
    ]
