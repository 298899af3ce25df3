"""The fastest speed along a path, against a plain sweep over all limits."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from bioscara.planning.topp.phase_plane import Rows, fastest


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_no_binding_limit_is_missed(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pieces, limits = int(rng.integers(1, 12)), int(rng.integers(2, 9))
    # Some limits are repeated, as those of a straight line are at both ends of a piece.
    columns = rng.integers(0, limits, size=limits + 2)
    along = rng.normal(size=(pieces, limits))[:, columns]
    across = (rng.normal(size=(pieces, limits)) * rng.choice((0.0, 1.0, 30.0), limits))[:, columns]
    steps = rng.uniform(1e-3, 0.3, pieces)
    caps = rng.uniform(0.01, 4.0, pieces + 1)
    squares, bound = fastest(steps, Rows(along, across), caps)
    reserve, slope = 2.0 * steps[:, None] / np.abs(along), -2.0 * steps[:, None] * across / along

    for piece in range(pieces):
        least = caps[piece]
        for f, g in zip(reserve[piece], 1.0 + slope[piece], strict=True):
            least = min(least, -f / g if g < 0.0 else np.inf)
        for a, b in combinations(range(len(columns)), 2):
            apart = abs(slope[piece, a] - slope[piece, b])
            if apart > 0.0:
                least = min(least, (reserve[piece, a] + reserve[piece, b]) / apart)
        assert bound[piece] == pytest.approx(least, rel=1e-6)

    highest = [0.0]
    for piece in reversed(range(pieces)):
        ahead = 1.0 + slope[piece]
        rising = ahead > 0.0
        reachable = (highest[-1] + reserve[piece][rising]) / ahead[rising]
        highest.append(min(bound[piece], reachable.min(initial=np.inf)))
    here, forth = 0.0, [0.0]
    for piece, most in enumerate(highest[-2::-1]):
        here = min(most, here + (reserve[piece] + slope[piece] * here).min())
        forth.append(here)
    assert squares == pytest.approx(np.maximum(forth, 0.0), rel=1e-9, abs=1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_where_a_path_turns_back_every_limit_is_kept_without_a_stop(seed: int) -> None:
    """The first derivative is zero there except for rounding: no limit depends on u."""
    rng = np.random.default_rng(seed)
    s = np.union1d(rng.uniform(-0.01, 0.01, 30), (-0.01, 0.0, 0.01))
    bend = 10.0 ** rng.uniform(5.0, 9.0, 6) * rng.choice((-1.0, 1.0), 6)
    first, steps = bend * s[:, None], np.diff(s)
    first[s == 0.0] = rng.choice((0.0, -1e-16, 1e-15), 6) * np.abs(bend)
    across = np.tile(bend, (len(steps), 1))
    end = first[1:] + 2.0 * steps[:, None] * across
    rows = Rows(np.hstack((first[:-1], end)), np.hstack((across, across)))
    squares, _ = fastest(steps, rows, np.full(len(s), np.inf))
    assert (squares[1:-1] > 0.0).all()
    u = np.diff(squares) / (2.0 * steps)
    used = np.abs(rows.along * u[:, None] + rows.across * squares[:-1, None])
    assert 0.99 < used.max() <= 1.0 + 1e-6
