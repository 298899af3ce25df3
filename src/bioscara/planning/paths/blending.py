"""Blends: corners of a path, rounded so that the tool need not stop at them.

A blend leaves the segment before a corner one radius ahead of it and joins the segment after it one
radius behind it, each measured in the path's parameter. In between it is the unique quintic with
the pose, direction and curvature of the segments at its ends and twice the radius as its length.
Between lines its derivative changes from one direction to the other by a smooth step, so that the
tool is nowhere faster along it than on the lines.

Invariant: the whole blend is within the radius of the corner, because the control points of the
quintic are (evident for lines, by calculation for arcs up to a full half circle). The yaw of the
tool is within radius / LEVER of that at the corner.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bioscara.planning.arrays import Array
from bioscara.planning.paths.segments import Formulas, Joined, Segment

_LEAST = 1e-10
"""Length below which the rest of a segment between two blends is left out [m]: the resulting step
is well within the one allowed between joined segments."""

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
"""Converts given ends to coefficients of the powers 0 to 5 of the quintic over 0 .. 1."""


class Blend(Segment):
    """The quintic from one point of a path to another, with pose, direction and curvature of both.

    Args:
        ends: Pose, first and second derivative at the start, and at the goal, shape (6, 4).
        length: Its largest parameter.
    """

    def __init__(self, ends: Array, length: float) -> None:
        scales = np.array((1.0, length, length**2, 1.0, length, length**2))
        # Relative to the start, so that rounding of large coordinates does not affect derivatives.
        origin = ends[0]
        scaled = ends * scales[:, None]
        scaled[[0, 3]] -= origin
        lengths = np.cumprod([1.0, *[length] * 5])
        powers = (_HERMITE[:, :, None] * scaled).sum(axis=1) / lengths[:, None]
        powers[0] = origin
        super().__init__(length, powers)


class Rounded(NamedTuple):
    """Segments with the corners between them rounded.

    Attributes:
        path: The whole path, its curvature continuous within each segment and at each blend.
        radii: Radius of each blend [m], at most the requested one.
        corners: Parameter of the path at the middle of each blend.
    """

    path: Joined
    radii: tuple[float, ...]
    corners: tuple[float, ...]


def rounded(segments: Sequence[Segment], radii: Sequence[float]) -> Rounded:
    """Join segments into one path, with blends where they meet.

    Args:
        segments: Each begins where the one before it ends; the transitions need not be smooth.
        radii: Of the blend between each segment and the next [m], all above 0. A radius longer than
            half of an adjacent segment is reduced to that.
    """
    fitted = tuple(
        min(radius, before.length / 2.0, after.length / 2.0)
        for radius, (before, after) in zip(radii, pairwise(segments), strict=True)
    )
    ends = [segment.length - left for segment, left in zip(segments, (*fitted, 0.0), strict=True)]
    blends = _blends(segments, ends[:-1], fitted)
    parts: list[Segment] = []
    corners: list[float] = []
    length = 0.0
    for index, (segment, begin, end) in enumerate(zip(segments, (0.0, *fitted), ends, strict=True)):
        if end - begin > _LEAST:
            parts.append(segment.part(begin, end))
        length += end - begin
        if index < len(blends):
            parts.append(blends[index])
            length += fitted[index]
            corners.append(length)
            length += fitted[index]
    return Rounded(Joined(parts), fitted, tuple(corners))


def _blends(
    segments: Sequence[Segment], ends: Sequence[float], radii: Sequence[float]
) -> list[Blend]:
    """Return the blends from ``ends`` of each segment to ``radii`` of the next one."""
    formulas, number = Formulas.of(segments), np.arange(len(segments))
    before = formulas.sample(number[:-1], np.array(ends))
    after = formulas.sample(number[1:], np.array(radii))
    corners = np.stack((*before, *after), axis=1)
    return [Blend(corner, 2.0 * radius) for corner, radius in zip(corners, radii, strict=True)]
