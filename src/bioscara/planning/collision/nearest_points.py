"""The points of two upright shapes that are nearest to each other, for displays."""

from __future__ import annotations

import math
from collections.abc import Iterator

from bioscara.planning.collision.shapes import Prism

Point = tuple[float, float, float]
Spot = tuple[float, float]


def nearest_points(one: Prism, other: Prism) -> tuple[Point, Point]:
    """Return the nearest points of two shapes in the same frame.

    Returns:
        A point of each, x, y, z [m]. Where the shapes overlap in plan view, their points are one
        above the other; where they overlap in height, at the same height.
    """
    first, second = _in_plan(one, other)
    bottom, top = max(one.low, other.low), min(one.high, other.high)
    if bottom <= top:
        heights = (bottom + top) / 2.0, (bottom + top) / 2.0
    else:
        heights = (one.high, other.low) if one.high < other.low else (one.low, other.high)
    return (*first, heights[0]), (*second, heights[1])


def _in_plan(one: Prism, other: Prism) -> tuple[Spot, Spot]:
    """Return the nearest points in plan view; the same one twice where the shapes overlap."""
    first, second = min(_candidates(one, other), key=lambda spots: math.dist(*spots))
    apart = math.dist(first, second)
    if apart <= one.radius + other.radius:
        total = one.radius + other.radius
        spot = _between(first, second, one.radius / total if total else 0.0)
        return spot, spot
    return (
        _between(first, second, one.radius / apart),
        _between(second, first, other.radius / apart),
    )


def _candidates(one: Prism, other: Prism) -> Iterator[tuple[Spot, Spot]]:
    """Yield pairs of points of the rectangles, among them a nearest one."""
    for corner in ((one.x, one.y), *one.corners()):
        spot = _clamped(other, corner)
        yield _clamped(one, spot), spot
    for corner in ((other.x, other.y), *other.corners()):
        spot = _clamped(one, corner)
        yield spot, _clamped(other, spot)


def _clamped(shape: Prism, spot: Spot) -> Spot:
    """Return the point of the rectangle of a shape that is nearest to a point."""
    cos, sin = math.cos(shape.yaw), math.sin(shape.yaw)
    dx, dy = spot[0] - shape.x, spot[1] - shape.y
    along = min(max(cos * dx + sin * dy, -shape.half_x), shape.half_x)
    across = min(max(cos * dy - sin * dx, -shape.half_y), shape.half_y)
    return shape.x + cos * along - sin * across, shape.y + sin * along + cos * across


def _between(begin: Spot, end: Spot, share: float) -> Spot:
    return begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1])
