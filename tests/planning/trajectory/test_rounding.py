"""Laws of rounded corners, over random lines between points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from bioscara.planning import Trajectory
from bioscara.planning.trajectory.rounding import rounded

JERKS = (4.0, 0.4, 28.0)
NAMES = ("j1", "j2", "j3")

steps = st.lists(
    st.tuples(st.floats(0.05, 3.0), *(st.floats(-size, size) for size in (0.4, 0.03, 1.5))),
    min_size=1,
    max_size=12,
)


def lines(moves: list[tuple[float, ...]], scale: float = 1.0) -> Trajectory:
    """Return a motion through points, from steps of time and joints."""
    times, *columns = np.vstack((np.zeros(4), np.cumsum(moves, axis=0))).T
    return Trajectory(NAMES, scale * times, np.stack(columns, axis=1))


@given(steps, st.sampled_from([1.0, 3.0]))
def test_a_rounded_motion_takes_as_long_and_keeps_to_the_lines(
    moves: list[tuple[float, ...]], scale: float
) -> None:
    asked = lines(moves, scale)
    motion = rounded(asked, JERKS)
    if motion is None or motion is asked:
        # It is too short for its corners, or has none.
        return
    assert motion.duration == pytest.approx(asked.duration, abs=1e-9)
    for end in (0, -1):
        assert motion.positions[end] == pytest.approx(asked.positions[end], abs=1e-12)
        assert motion.velocities is not None
        assert not motion.velocities[end].any()
    # Continuous up to the acceleration, and no corner is steeper than it may be.
    lasts, powers = np.diff(motion.times)[:, None], motion.coefficients
    for order, factors in ((0, (1, 1, 1, 1)), (1, (0, 1, 2, 3)), (2, (0, 0, 2, 6))):
        terms = [
            factors[each] * powers[..., each] * lasts ** max(each - order, 0)
            for each in range(order, 4)
        ]
        begins = factors[order] * powers[1:, :, order]
        assert sum(terms)[:-1] == pytest.approx(begins, abs=1e-6)
    jerk = np.abs(6.0 * powers[..., 3]).max(axis=0)
    assert (jerk <= len(moves) * 2.0 * np.array(JERKS) * (1.0 + 1e-6)).all()


@given(steps)
def test_corners_that_are_apart_leave_the_lines_by_little(moves: list[tuple[float, ...]]) -> None:
    asked = lines([(3.0 + each[0], *each[1:]) for each in moves], 2.0)
    motion = rounded(asked, JERKS)
    assert motion is not None
    jerk = np.abs(6.0 * motion.coefficients[..., 3])
    assert (jerk <= np.array(JERKS) * (1.0 + 1e-6)).all()
    slopes = np.abs(np.diff(asked.positions, axis=0) / np.diff(asked.times)[:, None]).max(axis=0)
    # The lines are followed faster, here by less than a quarter; a jump is twice a slope at most.
    jumps = 2.5 * slopes
    room = jumps * np.sqrt((jumps / np.array(JERKS)).max()) / 6.0
    instants = np.linspace(0.0, motion.duration, 2000)
    course = motion.sample_many(instants)[0]
    between = 1.25 * slopes * instants[1]
    for point in asked.positions:
        nearest = np.abs(course - point)[
            (np.abs(course - point) / (room + 1e-9)).max(axis=1).argmin()
        ]
        assert (nearest <= room + between + 1e-9).all()


def test_rest_stays_rest_and_no_motion_is_none() -> None:
    still = Trajectory(NAMES, [0.0, 1.0], np.zeros((2, 3)))
    assert rounded(still, JERKS) is still
    waits = Trajectory(NAMES, [0.0, 2.0, 5.0, 9.0], [[0.0] * 3, [0.0] * 3, [0.3] * 3, [0.3] * 3])
    motion = rounded(waits, (4.0, 4.0, 4.0))
    assert motion is not None
    assert motion.duration == pytest.approx(9.0)
    assert motion.sample(1.0).positions == (0.0, 0.0, 0.0)
    assert motion.sample(8.5).positions == pytest.approx((0.3, 0.3, 0.3))
    assert rounded(Trajectory(NAMES, [0.0, 0.1], [[0.0] * 3, [0.3] * 3]), JERKS) is None
