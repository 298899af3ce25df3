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

from bioscara.planning.trajectory import Array

_LEAST = 1e-12
"""Smallest factor of u; below it a limit does not depend on u [s^2/m]."""


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
    along = np.where(np.abs(rows.along) < _LEAST, _LEAST, rows.along)
    c, m = 1.0 / np.abs(along), -rows.across / along
    twice = 2.0 * steps[:, None]
    one, other = np.triu_indices(c.shape[1], 1)
    with np.errstate(divide="ignore"):
        # Every two limits must leave a u between them ...
        between = (c.T[one] + c.T[other]) / np.abs(m.T[one] - m.T[other])
        # ... that does not slow down below zero within the piece.
        ahead = 1.0 + twice * m
        stopping = np.where(ahead < 0.0, -twice * c / ahead, np.inf)
        gain = np.where(ahead > 0.0, 1.0 / ahead, np.inf)
    bound = np.minimum(between.min(axis=0), stopping.min(axis=1))
    bound = np.minimum(bound, caps[:-1])
    highest = _back(bound, twice * c, gain)
    return _forth(highest, twice * c, twice * m), bound


def _back(bound: Array, reserve: Array, gain: Array) -> list[float]:
    """Return the largest b at each point from which the rest of the path can be run."""
    following = 0.0
    highest = [following]
    # Plain floats: for a dozen limits they are faster than arrays.
    for most, f, g in zip(
        bound[::-1].tolist(), reserve[::-1].tolist(), gain[::-1].tolist(), strict=True
    ):
        reachable = min([(following + x) * y for x, y in zip(f, g, strict=True)])
        following = reachable if reachable < most else most
        highest.append(following)
    return highest[::-1]


def _forth(highest: list[float], reserve: Array, slope: Array) -> Array:
    """Return b when each piece is run with the largest u, never above ``highest``."""
    here = 0.0
    squares = [here]
    for most, f, g in zip(highest[1:], reserve.tolist(), slope.tolist(), strict=True):
        reachable = here + min([x + y * here for x, y in zip(f, g, strict=True)])
        here = reachable if reachable < most else most
        squares.append(here)
    return np.maximum(squares, 0.0)
