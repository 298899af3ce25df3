"""The fastest speed along a path under acceleration limits: a backward and a forward sweep.

With b the square of the speed along the path and u its acceleration, each limit reads
|A u + B b| <= 1, or |u - m b| <= c with c = 1/|A| and m = -B/A. Between two points of the grid u is
constant, so b is a straight line over the path. All limits are symmetric and satisfied at rest, so
from every speed below the largest one the arm can still stop: each sweep is a minimum over the
limits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.planning.arrays import Array

_LEAST = 1e-7
"""Smallest factor of u, as a share of the largest one on the piece: a limit with a smaller one is
independent of u in effect, and u computed from it would be the difference of two large numbers."""


class Rows(NamedTuple):
    """Limits |A u + B b| <= 1 on each piece of the grid.

    Attributes:
        along: A, shape (pieces, limits).
        across: B, shape (pieces, limits).
    """

    along: Array
    across: Array


def fastest(steps: Array, rows: Rows, caps: Array) -> tuple[Array, Array]:
    """Return the largest squares of speed for the path from rest to rest.

    Args:
        steps: Lengths of the grid's pieces [m], shape (n - 1,).
        rows: Limits of acceleration on each piece.
        caps: Limits of b at each point [m^2/s^2], shape (n,).

    Returns:
        b at each point, shape (n,), and the bound of b at the start of each piece from the limits
        there alone, independent of the pieces before and after, shape (n - 1,).
    """
    least = _LEAST * np.abs(rows.along).max(axis=1, keepdims=True)
    along = np.where(np.abs(rows.along) < least, least, rows.along)
    c, m = 1.0 / np.abs(along), -rows.across / along
    reserve = 2.0 * steps[:, None] * c
    ahead = 1.0 + 2.0 * steps[:, None] * m
    with np.errstate(divide="ignore"):
        from_rest = reserve / ahead
        gain = np.where(ahead > 0.0, 1.0 / ahead, 0.0)
    # Every two limits must leave a common u with which the speed does not fall below zero within
    # the piece.
    stopping = np.where(ahead < 0.0, -from_rest, np.inf).min(axis=1)
    bound = np.minimum(np.minimum(_common_bound(c, m), stopping), caps[:-1])
    back = np.where(ahead > 0.0, from_rest, np.inf)
    highest = _sweep(back[::-1], gain[::-1], bound[::-1])[::-1]
    return np.maximum(_sweep(reserve, ahead, highest[1:]), 0.0), bound


def _common_bound(c: Array, m: Array) -> Array:
    """Return the largest b for which every two limits of a piece share a u, shape (pieces,)."""
    c, m = np.ascontiguousarray(c.T), np.ascontiguousarray(m.T)
    least = np.full(c.shape[1], np.inf)
    with np.errstate(divide="ignore"):
        # All pairs at once would not fit the processor's cache.
        for apart in range(1, len(c)):
            common = (c[apart:] + c[:-apart]) / np.abs(m[apart:] - m[:-apart])
            np.minimum(least, common.min(axis=0), out=least)
    return least


def _sweep(start: Array, slope: Array, most: Array) -> Array:
    """Return the largest b that the limits allow at each point, from rest, shape (n,).

    Args:
        start: Limit of b after each piece if b is 0 before it, shape (pieces, limits).
        slope: Increase of that limit per unit of b before the piece.
        most: Highest b after each piece, shape (pieces,).
    """
    before = np.concatenate(([0.0], most[:-1]))
    binding = _binding(start, slope, before)
    ends = np.cumsum(binding.sum(axis=1)).tolist()
    # Plain floats are faster than arrays for a few limits.
    lines = list(zip(start[binding].tolist(), slope[binding].tolist(), strict=True))
    here, begin = 0.0, 0
    squares = [here]
    for highest, end in zip(most.tolist(), ends, strict=True):
        reachable = min([x + y * here for x, y in lines[begin:end]])
        here = reachable if reachable < highest else highest
        begin = end
        squares.append(here)
    return np.array(squares)


def _binding(start: Array, slope: Array, before: Array) -> npt.NDArray[np.bool_]:
    """Return which of the lines ``start + slope b`` can be the lowest for 0 <= b <= ``before``.

    The lowest line at b = 0 dominates the steeper ones, the lowest at the other end those that are
    above it at 0: mostly one or two are left in each row.
    """
    pieces = np.arange(len(start))
    first = start.argmin(axis=1)
    last = (start + slope * before[:, None]).argmin(axis=1)
    lines: npt.NDArray[np.bool_] = (slope < slope[pieces, first][:, None]) & (
        start < start[pieces, last][:, None]
    )
    lines[pieces, first] = lines[pieces, last] = True
    return lines
