"""The curve between the points, the checks on it, stretching and ramps: invariants."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from bioscara.errors import TrajectoryError
from bioscara.planning import Trajectory, check, fit
from bioscara.planning.trajectory.extrema import joint_extrema
from planning.limits import LIMITS, NAMES


def _pose(share: float) -> list[float]:
    return [limit.lower + share * (limit.upper - limit.lower) for limit in LIMITS]


shares = st.floats(0.0, 1.0)
poses = st.tuples(*(st.floats(limit.lower, limit.upper) for limit in LIMITS))


@st.composite
def trajectories(draw: st.DrawFn) -> Trajectory:
    count = draw(st.integers(2, 6))
    steps = draw(st.lists(st.floats(0.05, 2.0), min_size=count, max_size=count))
    inner = [
        tuple(0.25 * limit.lower + 0.5 * limit.upper for limit in LIMITS),
        tuple(0.5 * limit.lower + 0.25 * limit.upper for limit in LIMITS),
    ]
    rows = draw(
        st.lists(
            st.tuples(*(st.floats(min(a, b), max(a, b)) for a, b in zip(*inner, strict=True))),
            min_size=count,
            max_size=count,
        )
    )
    small = st.tuples(*(st.floats(-0.02, 0.02) for _ in LIMITS))
    kind = draw(st.integers(0, 2))
    velocities = [draw(small) for _ in rows] if kind > 0 else None
    accelerations = [draw(small) for _ in rows] if kind > 1 else None
    return Trajectory(NAMES, np.cumsum(steps), rows, velocities, accelerations)


@given(trajectories())
def test_the_curve_passes_through_its_points(trajectory: Trajectory) -> None:
    for time, row in zip(trajectory.times, trajectory.positions, strict=True):
        assert trajectory.sample(float(time)).positions == pytest.approx(row, abs=1e-9)
        before = trajectory.sample(float(np.nextafter(time, 0.0)))
        assert before.positions == pytest.approx(row, abs=1e-6)


@given(trajectories(), st.permutations(NAMES), st.integers(1, 4), poses, shares)
def test_a_motion_of_some_joints_is_one_of_all_in_which_the_others_hold(
    trajectory: Trajectory, order: list[str], count: int, others: tuple[float, ...], share: float
) -> None:
    columns = [NAMES.index(name) for name in order[:count]]

    def of(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else values[:, columns]

    some = Trajectory(
        order[:count],
        trajectory.times,
        trajectory.positions[:, columns],
        of(trajectory.velocities),
        of(trajectory.accelerations),
    )
    complete = some.completed(NAMES, others)
    assert complete.joint_names == NAMES
    time = share * trajectory.duration
    for place, rest in enumerate((others, (0.0,) * 4, (0.0,) * 4)):
        expected = list(rest)
        for column, value in zip(columns, some.sample(time)[place], strict=True):
            expected[column] = value
        assert complete.sample(time)[place] == pytest.approx(expected, rel=1e-9, abs=1e-12)


@given(trajectories(), shares)
def test_velocities_and_accelerations_are_derivatives(trajectory: Trajectory, share: float) -> None:
    step = 1e-5
    segment = int(share * (len(trajectory.times) - 1 - 1e-9))
    start, end = trajectory.times[segment], trajectory.times[segment + 1]
    time = float(start + (end - start) * (0.1 + 0.8 * share))
    (p0, v0, _), (_, v1, a1), (p2, v2, _) = (
        trajectory.sample(time + offset) for offset in (-step, 0.0, step)
    )
    slope = (np.array(p2) - np.array(p0)) / (2 * step)
    curve = (np.array(v2) - np.array(v0)) / (2 * step)
    assert np.allclose(slope, v1, atol=1e-3, rtol=1e-3)
    assert np.allclose(curve, a1, atol=1e-2, rtol=1e-2)


@given(trajectories(), st.lists(st.floats(-1.0, 20.0), min_size=1, max_size=20))
def test_sampling_many_times_is_sampling_each(trajectory: Trajectory, times: list[float]) -> None:
    many = trajectory.sample_many(times)
    for index, time in enumerate(times):
        for array, single in zip(many, trajectory.sample(time), strict=True):
            assert array[index] == pytest.approx(single, abs=1e-9)


def fit_positions(trajectory: Trajectory) -> bool:
    positions = trajectory.sample_many(np.linspace(0, trajectory.duration, 5000))[0]
    return all(
        limit.lower <= column.min() and column.max() <= limit.upper
        for limit, column in zip(LIMITS, positions.T, strict=True)
    )


@given(trajectories())
def test_extrema_are_on_the_curve_and_bound_it(trajectory: Trajectory) -> None:
    grid = np.linspace(0.0, trajectory.duration, 3000)
    sampled = trajectory.sample_many(grid)
    for joint, ranges in enumerate(joint_extrema(trajectory)):
        for order, (low, high) in enumerate(ranges):
            values = sampled[order][:, joint]
            room = 1e-9 * max(1.0, float(np.abs(values).max()))
            assert low.value - room <= values.min()
            assert values.max() <= high.value + room
            for extremum in (low, high):
                near = [
                    trajectory.sample(float(time))[order][joint]
                    for time in (
                        extremum.time,
                        np.nextafter(extremum.time, -1.0),
                        np.nextafter(extremum.time, 1e9),
                    )
                ]
                assert min(abs(value - extremum.value) for value in near) <= 1e-6 + room


def test_a_time_that_is_nan_is_refused() -> None:
    motion = Trajectory(("j1",), [0.0, 1.0], [[0.0], [1.0]])
    with pytest.raises(TrajectoryError, match="nan"):
        motion.sample(float("nan"))
    with pytest.raises(TrajectoryError, match="nan"):
        motion.sample_many([0.5, float("nan")])


@given(trajectories())
def test_a_fitted_trajectory_stays_within_every_limit(trajectory: Trajectory) -> None:
    try:
        fitted, factor = fit(trajectory, LIMITS)
    except TrajectoryError:
        # Only a position beyond its limit cannot be cured by more time.
        inside = fit_positions(trajectory)
        assert not inside
        return
    assert factor >= 1.0
    grid = np.arange(0.0, fitted.duration, max(1e-3, fitted.duration / 20000))
    positions, velocities, accelerations = fitted.sample_many(grid)
    for index, limit in enumerate(LIMITS):
        span = 1e-5 * (limit.upper - limit.lower)
        assert positions[:, index].min() >= limit.lower - span
        assert positions[:, index].max() <= limit.upper + span
        assert np.abs(velocities[:, index]).max() <= limit.max_velocity * (1 + 1e-5)
        assert np.abs(accelerations[:, index]).max() <= limit.max_acceleration * (1 + 1e-5)
    if factor > 1.0 + 1e-5:
        with pytest.raises(TrajectoryError, match="exceeds the limit"):
            check(trajectory, LIMITS)


@pytest.mark.parametrize(
    ("times", "positions", "words"),
    [
        ([0, 1], [[0, 0, 0, 0]], "shape"),
        ([], [], "no"),
        ([0, 0], [[0, 0.1, 0, 0]] * 2, "does not come after"),
        ([1, 0.5], [[0, 0.1, 0, 0]] * 2, "does not come after"),
        ([-1, 0.5], [[0, 0.1, 0, 0]] * 2, "negative"),
        ([0, float("nan")], [[0, 0.1, 0, 0]] * 2, "not finite"),
        ([0, 1], [[0, 0.1, 0, 0], [0, float("inf"), 0, 0]], "point 1: position of j2 is inf"),
    ],
)
def test_a_file_without_a_trajectory_is_refused(
    times: list[float], positions: list[list[float]], words: str
) -> None:
    with pytest.raises(TrajectoryError, match=words):
        Trajectory(NAMES, times, positions)


def test_unknown_joints_are_named_with_the_nearest() -> None:
    with pytest.raises(TrajectoryError, match="did you mean"):
        check(Trajectory(("j11",), [0.0], [[0.0]]), LIMITS)
    with pytest.raises(TrajectoryError, match="named twice: j1"):
        Trajectory(("j1", "j1"), [0.0], [[0.0, 0.0]])


def test_a_position_between_the_points_is_checked_too() -> None:
    over = Trajectory(("j2",), [0.0, 10.0], [[0.337], [0.337]], [[0.02], [-0.02]], [[0.0], [0.0]])
    with pytest.raises(TrajectoryError, match=r"j2 at 5\.000 s: position"):
        check(over, LIMITS)


@pytest.mark.parametrize("step", [1e-70, 1e-110, 1e-9])
def test_points_too_close_for_a_curve_are_refused(step: float) -> None:
    rest = [[0.0]] * 2
    with pytest.raises(TrajectoryError, match="apart"):
        Trajectory(("j1",), [0.0, step], [[0.1]] * 2, rest, rest)


def test_values_too_large_for_a_curve_are_refused() -> None:
    with pytest.raises(TrajectoryError, match="too large"):
        Trajectory(("j1",), [0.0, 1e-6], [[-1e300], [1e300]], [[0.0]] * 2, [[0.0]] * 2)


def test_a_trajectory_cannot_be_changed() -> None:
    """A curve is evaluated in arrays and in plain floats, which must agree."""
    trajectory = Trajectory(("j1",), [0.0, 1.0], [[0.0], [0.1]], [[0.0]] * 2, [[0.0]] * 2)
    for array in (
        trajectory.times,
        trajectory.positions,
        trajectory.velocities,
        trajectory.accelerations,
        trajectory.coefficients,
    ):
        assert array is not None
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 99.0
