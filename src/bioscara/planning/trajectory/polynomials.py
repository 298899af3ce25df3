"""Polynomials between two points of a trajectory: from the states at both ends, and their values.

The interpolation of ros2_control's joint trajectory controller: a quintic where both ends have
velocities and accelerations, a cubic where both have velocities, a straight line otherwise. A
polynomial is its six coefficients, powers of the time since its begin.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from bioscara.planning.arrays import Array

_Values = TypeVar("_Values", float, Array)
_new = tuple.__new__


class Sample(NamedTuple):
    """State of some joints at one instant, in the order of their names.

    Attributes:
        positions: [rad or m].
        velocities: [rad/s or m/s].
        accelerations: [rad/s^2 or m/s^2].
    """

    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    accelerations: tuple[float, ...]


def line(p0: _Values, p1: _Values, duration: _Values) -> tuple[_Values | float, ...]:
    """Return the straight line between two positions; arguments as in :func:`quintic`."""
    return p0, (p1 - p0) / duration, 0.0, 0.0, 0.0, 0.0


def cubic(
    p0: _Values, p1: _Values, v0: _Values, v1: _Values, duration: _Values
) -> tuple[_Values | float, ...]:
    """Return the cubic between two positions and velocities; arguments as in :func:`quintic`."""
    d, t = p1 - p0, duration
    return p0, v0, (3 * d / t - 2 * v0 - v1) / t, (v0 + v1 - 2 * d / t) / t**2, 0.0, 0.0


def quintic(
    p0: _Values,
    p1: _Values,
    v0: _Values,
    v1: _Values,
    a0: _Values,
    a1: _Values,
    duration: _Values,
) -> tuple[_Values | float, ...]:
    """Return the quintic between two positions, velocities and accelerations.

    Args:
        p0: Position at its begin [rad or m].
        p1: Position at its end.
        v0: Velocity at its begin [rad/s or m/s].
        v1: Velocity at its end.
        a0: Acceleration at its begin [rad/s^2 or m/s^2].
        a1: Acceleration at its end.
        duration: [s], above 0.
    """
    d, t = p1 - p0, duration
    t2 = t * t
    return (
        p0,
        v0,
        a0 / 2,
        (20 * d - (8 * v1 + 12 * v0) * t - (3 * a0 - a1) * t2) / (2 * t2 * t),
        (-30 * d + (14 * v1 + 16 * v0) * t + (3 * a0 - 2 * a1) * t2) / (2 * t2 * t2),
        (12 * d - 6 * (v1 + v0) * t + (a1 - a0) * t2) / (2 * t2 * t2 * t),
    )


def evaluate(polynomials: Iterable[Sequence[float]], t: float) -> Sample:
    """Return the state of some joints on the polynomials between two points.

    Args:
        polynomials: Six coefficients for each joint.
        t: Time since the first of the two points [s].
    """
    positions, velocities, accelerations = [], [], []
    # Plain floats are several times faster than arrays for four joints; all factors are floats,
    # as the product of a whole number and a float takes twice as long.
    for c0, c1, c2, c3, c4, c5 in polynomials:
        bend = 2.0 * c2
        if c4 or c5:
            positions.append(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))))
            velocities.append(c1 + t * (bend + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))))
            accelerations.append(bend + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)))
        else:  # The cubics of planned motions take two thirds of the time.
            positions.append(c0 + t * (c1 + t * (c2 + t * c3)))
            velocities.append(c1 + t * (bend + t * (3.0 * c3)))
            accelerations.append(bend + t * (6.0 * c3))
    # Sample(...) takes twice as long.
    return _new(Sample, (tuple(positions), tuple(velocities), tuple(accelerations)))


def evaluate_many(coefficients: Array, t: Array) -> tuple[Array, Array, Array]:
    """Return positions, velocities and accelerations, each of shape (m, joints).

    Args:
        coefficients: Shape (m, joints, 6).
        t: Times since the begin of their polynomials [s], shape (m,).
    """
    c, t = np.moveaxis(coefficients, -1, 0), t[:, None]
    return (
        c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5])))),
        c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5]))),
        2 * c[2] + t * (6 * c[3] + t * (12 * c[4] + t * 20 * c[5])),
    )
