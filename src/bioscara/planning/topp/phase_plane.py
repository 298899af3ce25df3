"""The fastest speed along a path under limits of acceleration: one sweep back, one forth.

With b the square of the speed along the path and u its acceleration, each limit reads
|A u + B b| <= 1, or |u - m b| <= c with c = 1/|A| and m = -B/A. Between two points of the grid u is
constant, so b is a straight line over the path. All limits are symmetric and standing still keeps
them, so from every speed below the largest one the arm can still stop: each sweep is a minimum
over the limits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bioscara.planning.trajectory.trajectory import Array

_LEAST = 1e-7
"""Smallest factor of u, as a share of the largest one on the piece: a limit with a smaller one does
not depend on u, and with it u would be the difference of two large numbers."""


class Rows(NamedTuple):
    """Limits |A u + B b| <= 1 of each piece of the grid.

    Attributes:
        along: A, shape (pieces, limits).
        across: B, shape (pieces, limits).
    """

    along: Array
    across: Array


def fastest(steps: Array, rows: Rows, caps: Array) -> tuple[Array, Array]:
    """Return the largest squares of speed with which the path is run from rest to rest.

    Args:
        steps: Lengths of the grid's pieces [m], shape (n - 1,).
        rows: Limits of acceleration on each piece.
        caps: Limits of b at each point [m^2/s^2], shape (n,).

    Returns:
        b at each point, shape (n,), and the bound of b at the start of each piece from the limits
        there alone, whatever comes before and after, shape (n - 1,).
    """
    least = _LEAST * np.abs(rows.along).max(axis=1, keepdims=True)
    along = np.where(np.abs(rows.along) < least, least, rows.along)
    c, m = 1.0 / np.abs(along), -rows.across / along
    reserve = 2.0 * steps[:, None] * c
    ahead = 1.0 + 2.0 * steps[:, None] * m
    with np.errstate(divide="ignore"):
        from_rest = reserve / ahead
        gain = np.where(ahead > 0.0, 1.0 / ahead, 0.0)
    # Every two limits must leave a u between them that does not slow down below zero within the
    # piece.
    stopping = np.where(ahead < 0.0, -from_rest, np.inf).min(axis=1)
    bound = np.minimum(np.minimum(_between(c, m), stopping), caps[:-1])
    back = np.where(ahead > 0.0, from_rest, np.inf)
    highest = _run(back[::-1], gain[::-1], bound[::-1])[::-1]
    return np.maximum(_run(reserve, ahead, highest[1:]), 0.0), bound


def _between(c: Array, m: Array) -> Array:
    """Return up to which b every two limits of a piece have a u in common, shape (pieces,)."""
    c, m = np.ascontiguousarray(c.T), np.ascontiguousarray(m.T)
    least = np.full(c.shape[1], np.inf)
    with np.errstate(divide="ignore"):
        # All pairs at once would not fit the processor's cache.
        for apart in range(1, len(c)):
            common = (c[apart:] + c[:-apart]) / np.abs(m[apart:] - m[:-apart])
            np.minimum(least, common.min(axis=0), out=least)
    return least


def _run(start: Array, slope: Array, most: Array) -> Array:
    """Return b at each point, shape (n,), from rest and as large as the limits let it become.

    Args:
        start: How large b may be after each piece when it is 0 before, shape (pieces, limits).
        slope: How much larger for each unit that it has before.
        most: How large it may be after each piece, shape (pieces,).
    """
    before = np.concatenate(([0.0], most[:-1]))
    binding = _binding(start, slope, before)
    ends = np.cumsum(binding.sum(axis=1)).tolist()
    # Plain floats: for a few limits they are faster than arrays.
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

    The lowest at b = 0 hides the steeper ones, the lowest at the other end those that are above it
    at 0: mostly one or two are left of each row.
    """
    pieces = np.arange(len(start))
    first = start.argmin(axis=1)
    last = (start + slope * before[:, None]).argmin(axis=1)
    lines: npt.NDArray[np.bool_] = (slope < slope[pieces, first][:, None]) & (
        start < start[pieces, last][:, None]
    )
    lines[pieces, first] = lines[pieces, last] = True
    return lines
