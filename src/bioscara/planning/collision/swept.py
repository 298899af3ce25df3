"""Continuous collision check of a trajectory: no clearance between samples is missed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bioscara.errors import TrajectoryError, ZoneError
from bioscara.kinematics import Scara
from bioscara.planning.arrays import Array
from bioscara.planning.collision.scene_pairs import Layout
from bioscara.planning.trajectory.trajectory import Trajectory

SLACK = 4e-4
"""Part of the margin that may be lost between two samples [m]: otherwise the check of an arm that
touches the margin without violating it would not terminate."""
COARSE = 0.02
"""Longest path of any point of the arm between the first samples [m]."""
_LONGEST = 1e4
"""Longest path that is checked [m]: hours at full speed."""
_BERNSTEIN = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, 1 / 4, 0.0, 0.0, 0.0],
        [1.0, 1 / 2, 1 / 6, 0.0, 0.0],
        [1.0, 3 / 4, 1 / 2, 1 / 4, 0.0],
        [1.0, 1.0, 1.0, 1.0, 1.0],
    ]
)
"""Converts powers on 0 .. 1 to control points: a polynomial is within the range of these."""


def sweep(
    layout: Layout,
    kinematics: Scara,
    trajectory: Trajectory,
    rest: Array,
    margin: float,
    floor: Array,
) -> None:
    """Make sure that every pair keeps its distance throughout a trajectory.

    Args:
        layout: The pairs to check.
        kinematics: The arm.
        trajectory: For some or all of its joints.
        rest: Positions of the other joints [rad, m, rad, rad], shape (4,).
        margin: Distance to keep [m].
        floor: Distance that each pair must keep instead [m], shape (pairs, 1).

    Raises:
        ZoneError: It is not kept.
        TrajectoryError: The path is longer than that of any motion.
    """
    names = [limit.name for limit in kinematics.limits]
    columns = [names.index(name) for name in trajectory.joint_names]
    if not layout.pairs:
        return

    def evaluate(times: Array) -> Array:
        joints = np.tile(rest, (len(times), 1))
        joints[:, columns] = trajectory.sample_many(times)[0]
        pairs = layout.clearances(kinematics, joints, margin + COARSE)
        room: Array = (pairs - floor).min(axis=0)
        if (room < 0.0).any():
            raise refusal(layout, times, pairs, margin, floor)
        return room

    starts, lengths, speeds = _steps(trajectory, layout.reach[columns])
    nodes = evaluate(np.append(starts, trajectory.times[-1]))
    subdivide(evaluate, (starts, lengths, speeds), nodes)


def subdivide(
    evaluate: Callable[[Array], Array], steps: tuple[Array, Array, Array], nodes: Array
) -> None:
    """Subdivide steps until no clearance that is too small can be missed between samples.

    Args:
        evaluate: Returns the room at some instants [m]; raises where that is below zero.
        steps: Start and length of each step [s], one after the other, and the highest speed of
            any point of the arm in it [m/s].
        nodes: Room at all starts and at the end of the last step [m].
    """
    starts, lengths, speeds = steps
    first, last = nodes[:-1], nodes[1:]
    while True:
        paths = speeds * lengths
        # No clearance changes by more than the path length, which bounds it between the two ends.
        near = (first + last - paths) / 2.0 < -SLACK
        if not near.any():
            return
        starts, lengths, speeds = starts[near], lengths[near] / 2.0, speeds[near]
        first, last = first[near], last[near]
        middle = evaluate(starts + lengths)
        starts = np.concatenate((starts, starts + lengths))
        lengths, speeds = np.tile(lengths, 2), np.tile(speeds, 2)
        first, last = np.concatenate((first, middle)), np.concatenate((middle, last))


def _steps(trajectory: Trajectory, reach: Array) -> tuple[Array, Array, Array]:
    """Return start [s], length [s] and highest speed of any point [m/s] of the first steps."""
    durations = np.diff(trajectory.times)
    speeds = highest_rates(trajectory) @ reach
    paths = speeds * durations
    if not paths.sum() < _LONGEST:
        raise TrajectoryError(
            f"a point of the arm would move up to {paths.sum():.3g} m; motions above "
            f"{_LONGEST:g} m are not checked for collisions; check the limits, or cut the "
            "motion in two"
        )
    counts = np.maximum(np.ceil(paths / COARSE), 1.0).astype(np.intp)
    segment = np.repeat(np.arange(len(counts)), counts)
    within = np.arange(len(segment)) - np.repeat(np.cumsum(counts) - counts, counts)
    lengths = (durations / counts)[segment]
    return trajectory.times[segment] + within * lengths, lengths, speeds[segment]


def highest_rates(trajectory: Trajectory) -> Array:
    """Return an upper bound of each joint's speed in each segment, shape (n - 1, joints)."""
    powers = trajectory.coefficients[..., 1:] * np.arange(1, 6)
    powers = powers * np.diff(trajectory.times)[:, None, None] ** np.arange(5)
    highest: Array = np.abs(powers @ _BERNSTEIN.T).max(axis=-1)
    return highest


def refusal(layout: Layout, times: Array, pairs: Array, margin: float, floor: Array) -> ZoneError:
    """Return the error that states which distance is not kept, and when.

    Args:
        layout: The pairs checked.
        times: Times of the samples [s], shape (n,).
        pairs: Distance of each pair [m], shape (pairs, n).
        margin: Distance to keep [m].
        floor: Distance that each pair must keep instead [m], shape (pairs, 1).
    """
    rooms = pairs - floor
    begins = float(times[rooms.min(axis=0) < 0.0].min())
    row, sample = np.unravel_index(int(rooms.argmin()), rooms.shape)
    pair = layout.pairs[int(row)]
    margin, clearance = margin - pair.allowed, float(pairs[row, sample]) - pair.allowed
    where = "at the start" if begins <= 0.0 else f"from {begins:.3f} s on"
    nearest = f"{where}, nearest at {times[sample]:.3f} s: {_described(pair.keep_in, clearance)}"
    at_goal = bool(rooms[int(row), -1] < 0.0 < begins)
    depth = margin - clearance
    return ZoneError(pair.zone, pair.link, begins, depth, margin, nearest, at_goal=at_goal)


def _described(keep_in: bool, clearance: float) -> str:
    if keep_in:
        return (
            f"{clearance * 1e3:.1f} mm from the zone's border"
            if clearance >= 0.0
            else f"{-clearance * 1e3:.1f} mm outside of the zone"
        )
    if clearance >= 0.0:
        return f"{clearance * 1e3:.1f} mm away"
    return f"{-clearance * 1e3:.1f} mm inside"
