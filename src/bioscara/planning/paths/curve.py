"""The common formula of all pieces of a path: a polynomial plus a circular motion.

Because all pieces share it, many of them are evaluated at once: a path of hundreds costs little
more than one line.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from bioscara.planning.arrays import Array, Index

POWERS = 6
"""Number of powers of the polynomial, 0 to 5."""


class PathSamples(NamedTuple):
    """A path at n parameters, each array (n, 4): x, y, z [m] and yaw [rad], not wrapped.

    Attributes:
        poses: The poses.
        first: Their first derivative by s.
        second: Their second derivative by s.
    """

    poses: Array
    first: Array
    second: Array


class Formulas(NamedTuple):
    """The formulas of m pieces: pose(t) = sum of p_k t^k + a cos(r t) + b sin(r t), t = s + begin.

    Attributes:
        powers: p_0 to p_5, shape (m, 6, 4).
        circle: a and b, shape (m, 2, 4).
        rate: r [rad/m], shape (m,); 0 where there is no circle.
        begin: Parameter of each formula at the start of its piece [m], shape (m,).
    """

    powers: Array
    circle: Array
    rate: Array
    begin: Array

    @classmethod
    def of(cls, pieces: Sequence[Curve]) -> Self:
        """Return the formulas of some pieces, in their order."""
        return cls(*map(np.concatenate, zip(*(piece.formula for piece in pieces), strict=True)))

    def sample(self, pieces: Index, s: Array) -> PathSamples:
        """Return poses and derivatives at n parameters, each of its own piece.

        Args:
            pieces: Index of the piece of each parameter, shape (n,).
            s: The parameters, from 0 at the piece's start [m], shape (n,).
        """
        t = (s + self.begin[pieces])[:, None]
        c0, c1, c2, c3, c4, c5 = (self.powers[pieces, power] for power in range(POWERS))
        poses = c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5))))
        first = c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5)))
        second = 2 * c2 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5))
        if self.rate.any():
            rate = self.rate[pieces, None]
            cosine, sine = np.cos(rate * t), np.sin(rate * t)
            a, b = self.circle[pieces, 0], self.circle[pieces, 1]
            outward = cosine * a + sine * b
            poses += outward
            first += rate * (cosine * b - sine * a)
            second -= rate * rate * outward
        return PathSamples(poses, first, second)


class Curve:
    """A piece of a path that one formula describes.

    Args:
        length: Its largest parameter.
        powers: Coefficients of its polynomial, from power 0 on: at most 6, each a row of 4.
        circle: Point on the circle at 0 and after a quarter turn, relative to the centre.
        rate: Angular rate on the circle [rad/m].
        begin: Parameter of the formula where the piece begins.

    Attributes:
        length: As given.
        breaks: None.
        formula: The formula.
    """

    breaks: tuple[float, ...] = ()

    def __init__(
        self,
        length: float,
        powers: npt.ArrayLike,
        circle: npt.ArrayLike = ((0.0,) * 4,) * 2,
        rate: float = 0.0,
        begin: float = 0.0,
    ) -> None:
        self.length = length
        all_powers = np.zeros((1, POWERS, 4))
        given = np.asarray(powers, dtype=np.float64)
        all_powers[0, : len(given)] = given
        self.formula = Formulas(
            all_powers, np.array([circle], dtype=np.float64), np.array([rate]), np.array([begin])
        )

    def part(self, begin: float, end: float) -> Curve:
        """Return the part of it between two of its parameters [m]."""
        powers, circle, rate, before = (column[0] for column in self.formula)
        return Curve(end - begin, powers, circle, rate, before + begin)

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        at = np.asarray(s, dtype=np.float64)
        return self.formula.sample(np.zeros(len(at), dtype=np.intp), at)
