"""Corners of a path, rounded so that the tool need not stop at them.

A blend leaves the piece before a corner a radius ahead of it and joins the piece after it the
same way behind it, each measured in the path's parameter. In between it is the one quintic that
has pose, direction and curvature of the pieces at its ends and twice the radius as its length.
Between lines its derivative goes from one direction to the other by a smooth step, so that the
tool is nowhere faster along it than on the lines.

Law: all of the blend is within the radius of the corner, for the control points of the quintic
are (for lines plainly, for arcs by calculation up to a full half circle). The turn of the tool
is within radius / LEVER of that at the corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.planning.path import Arc, Joined, Line, Part, Path, PathSamples

_LEAST = 1e-10
"""What is left of a piece between two blends is left out below this length [m]: a step that is
well within the one that joined pieces may have."""

_HERMITE = np.array(
    [
        # start pose, first, second derivative; goal pose, first, second derivative
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
        [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
        [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
        [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
    ]
)
"""Coefficients of the powers 0 to 5 of the quintic over 0 .. 1 with given ends."""


class Blend:
    """The quintic from one point of a path to another, with pose, direction and curvature of both.

    Args:
        start: Sample where it begins, arrays (1, 4).
        goal: Sample where it ends, arrays (1, 4).
        length: Its largest parameter.

    Attributes:
        length: As given.
        breaks: None.
    """

    def __init__(self, start: PathSamples, goal: PathSamples, length: float) -> None:
        self.length = length
        self.breaks: tuple[float, ...] = ()
        scales = np.array((1.0, length, length**2, 1.0, length, length**2))
        ends = np.concatenate((*start, *goal)) * scales[:, None]
        # From the start on, lest rounding of large coordinates shows in the derivatives.
        self._origin = start.poses[0]
        ends[[0, 3]] -= self._origin
        self._powers = _HERMITE @ ends / length ** np.arange(6.0)[:, None]

    def sample(self, s: npt.ArrayLike) -> PathSamples:
        """Return poses and derivatives at the parameters ``s``, shape (n,)."""
        t = np.asarray(s, dtype=np.float64)[:, None]
        c0, c1, c2, c3, c4, c5 = self._powers
        return PathSamples(
            self._origin + c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))),
            c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5))),
            2 * c2 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5)),
        )


class Rounded(NamedTuple):
    """Pieces with the corners between them rounded.

    Attributes:
        path: All of it, its curvature continuous within each piece and at each blend.
        radii: Radius of each blend [m], at most as asked for.
        corners: Parameter of the path at the middle of each blend.
    """

    path: Joined
    radii: tuple[float, ...]
    corners: tuple[float, ...]


def rounded(pieces: Sequence[Line | Arc], radii: Sequence[float]) -> Rounded:
    """Return one path along pieces that need not be smooth where they meet.

    Args:
        pieces: Each begins where the one before it ends.
        radii: Of the blend between each piece and the next [m], all above 0. One that is longer
            than half of a piece beside it is shrunk to that.
    """
    fitted = tuple(
        min(radius, before.length / 2.0, after.length / 2.0)
        for radius, (before, after) in zip(radii, pairwise(pieces), strict=True)
    )
    parts: list[Path] = []
    corners: list[float] = []
    length = 0.0
    for index, (piece, begin, left) in enumerate(
        zip(pieces, (0.0, *fitted), (*fitted, 0.0), strict=True)
    ):
        end = piece.length - left
        if end - begin > _LEAST:
            parts.append(Part(piece, begin, end))
        if left:
            start, goal = piece.sample([end]), pieces[index + 1].sample([left])
            parts.append(Blend(start, goal, 2.0 * left))
        length += end - begin + left
        corners.append(length)
        length += left
    return Rounded(Joined(parts), fitted, tuple(corners[:-1]))
