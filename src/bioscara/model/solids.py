"""Convex solids, and upright shapes that contain them. Metres, in the frame of a link."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

FIT = 4.5e-3
"""Distance by which a solid's upright shapes may exceed it [m]: rounded solids are sliced."""
_SIDES = 32
"""Sides of the polygon that approximates a circle."""
AXES = {"x": (1, 2, 0), "y": (2, 0, 1), "z": (0, 1, 2)}
"""Coordinates of an outline and of the axis along which it is extruded, by that axis."""


class Upright(NamedTuple):
    """A rectangle along x and y, moved outwards by a radius, between two heights.

    Attributes:
        x: x of the rectangle's centre [m].
        y: y of its centre [m].
        half_x: Half its size along x [m].
        half_y: Half its size along y [m].
        low: Height of the bottom [m].
        high: Height of the top [m].
        radius: Added to the rectangle on all sides [m].
    """

    x: float
    y: float
    half_x: float
    half_y: float
    low: float
    high: float
    radius: float = 0.0


@dataclass(frozen=True, slots=True)
class Solid:
    """A convex polygon, extruded along an axis.

    Attributes:
        outline: Corners counter-clockwise, shape (n, 2): x, y for axis z; y, z for x; z, x for y.
        lower: Its start along the axis [m].
        upper: Its end [m].
        axis: ``"x"``, ``"y"`` or ``"z"``.
        uprights: Upright shapes that contain it together and reach at most :data:`FIT` beyond it.
    """

    outline: Array
    lower: float
    upper: float
    axis: str
    uprights: tuple[Upright, ...]


def prism(outline: npt.ArrayLike, lower: float, upper: float, axis: str = "z") -> Solid:
    """Return an extruded convex polygon; its upright shapes are box-shaped slices of it.

    Args:
        outline: Corners counter-clockwise, shape (n, 2): x, y for axis z; y, z for x; z, x for y.
        lower: Its start along the axis [m].
        upper: Its end [m].
        axis: ``"x"``, ``"y"`` or ``"z"``.
    """
    corners = np.asarray(outline, dtype=np.float64)
    return Solid(corners, lower, upper, axis, _sliced(corners, lower, upper, axis))


def _sliced(corners: Array, lower: float, upper: float, axis: str) -> tuple[Upright, ...]:
    """Return boxes around slices of a polygon, as few as keep within :data:`FIT` of it."""
    first, second, along = AXES[axis]
    for count in itertools.count(1):
        cuts = np.linspace(*_range(corners[:, 0]), count + 1)
        slices = [(low, high, *_width(corners, low, high)) for low, high in pairwise(cuts)]
        edges = ((u, v) for *us, v0, v1 in slices for u in us for v in (v0, v1))
        if all(_beyond(corners, u, v) <= FIT for u, v in edges):
            break
    boxes = []
    for low, high, narrow, wide in slices:
        lowest, highest = np.zeros((2, 3))
        lowest[[first, second, along]] = low, narrow, lower
        highest[[first, second, along]] = high, wide, upper
        boxes.append(_upright(lowest.tolist(), highest.tolist()))
    return tuple(boxes)


def _range(values: Array) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _width(corners: Array, low: float, high: float) -> tuple[float, float]:
    """Return a polygon's range of second coordinates between two first coordinates."""
    u, v = corners.T
    found = [v[(low <= u) & (u <= high)]]
    for (u0, v0), (u1, v1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        at = np.array([cut for cut in (low, high) if (cut - u0) * (cut - u1) < 0.0])
        found.append(v0 + (v1 - v0) * (at - u0) / (u1 - u0) if len(at) else at)
    return _range(np.concatenate(found))


def _beyond(corners: Array, u: float, v: float) -> float:
    """Return the distance of a point from a convex polygon; zero inside."""
    place, sides = np.array((u, v)), np.roll(corners, -1, axis=0) - corners
    off = place - corners
    if (sides[:, 0] * off[:, 1] >= sides[:, 1] * off[:, 0]).all():
        return 0.0
    share = np.clip((off * sides).sum(axis=1) / (sides * sides).sum(axis=1), 0.0, 1.0)
    return float(np.linalg.norm(off - share[:, None] * sides, axis=1).min())


def _upright(lower: Sequence[float], upper: Sequence[float]) -> Upright:
    (x0, y0, z0), (x1, y1, z1) = lower, upper
    return Upright((x0 + x1) / 2.0, (y0 + y1) / 2.0, (x1 - x0) / 2.0, (y1 - y0) / 2.0, z0, z1)


def box(lower: Sequence[float], upper: Sequence[float]) -> Solid:
    """Return a box with its edges along the axes, from corner to corner."""
    (x0, y0, z0), (x1, y1, z1) = lower, upper
    outline = np.array(((x0, y0), (x1, y0), (x1, y1), (x0, y1)), dtype=np.float64)
    return Solid(outline, z0, z1, "z", (_upright(lower, upper),))


def capsule(start: float, end: float, radius: float, lower: float, upper: float) -> Solid:
    """Return an upright bar along x with round ends.

    Args:
        start: Position of the axis of one end, along x [m].
        end: Position of the other end's axis, at a larger x [m].
        radius: Radius of both ends [m].
        lower: Height of its bottom [m].
        upper: Its end [m].
    """
    half = np.linspace(-np.pi / 2.0, np.pi / 2.0, _SIDES // 2 + 1)
    arc = radius * np.column_stack((np.cos(half), np.sin(half)))
    right, left = arc + np.array((end, 0.0)), np.array((start, 0.0)) - arc
    upright = Upright((start + end) / 2.0, 0.0, (end - start) / 2.0, 0.0, lower, upper, radius)
    return Solid(np.concatenate((right, left)), lower, upper, "z", (upright,))


def cylinder(
    centre: Sequence[float], radius: float, lower: float, upper: float, axis: str = "z"
) -> Solid:
    """Return a cylinder.

    Args:
        centre: Centre in the plane perpendicular to the axis, as the corners of :func:`prism`.
        radius: Its radius [m].
        lower: Its start along the axis [m].
        upper: Its end [m].
        axis: ``"x"``, ``"y"`` or ``"z"``.
    """
    angles = np.arange(_SIDES) * (2.0 * np.pi / _SIDES)
    outline = np.asarray(centre) + radius * np.column_stack((np.cos(angles), np.sin(angles)))
    if axis != "z":
        return prism(outline, lower, upper, axis)
    upright = Upright(centre[0], centre[1], 0.0, 0.0, lower, upper, radius)
    return Solid(outline, lower, upper, axis, (upright,))
