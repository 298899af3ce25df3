"""Point-to-point joint motions: all joints start and arrive together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from bioscara.arguments import items, number
from bioscara.errors import TrajectoryError
from bioscara.kinematics.pose import unit_hint
from bioscara.planning.limits import JointLimits, check_share
from bioscara.planning.motions.double_s import Bounds, Knot, least_duration, rest_to_rest
from bioscara.planning.trajectory.trajectory import Trajectory

_ROOM = 1e-6
"""Share of a limit by which rounding may exceed it, as in the check of a trajectory."""

_SHORTEST = 1e-9
"""Pieces shorter than this [s] are left out: over them no acceleration changes measurably."""


def point_to_point(
    joint_names: Sequence[str],
    start: Sequence[float],
    goal: Sequence[float],
    limits: Sequence[JointLimits],
    *,
    velocity_scaling: float = 1.0,
) -> Trajectory:
    """Return the fastest motion from rest to rest in which all joints start and end together.

    The slowest joint determines the duration; the others stay below their limits. At speed s
    the motion is the same with 1/s times the duration.

    Args:
        joint_names: The joints.
        start: Their start positions [rad or m]; from beyond a limit they move back.
        goal: Their goal positions [rad or m].
        limits: Of these joints, in the same order; with an infinite jerk the acceleration jumps.
        velocity_scaling: Share of the speed limits to use, 0.001 to 1.

    Returns:
        The motion; a single point if the goal is the start.

    Raises:
        InvalidArgumentError: The share is outside its range, or a value is not a number.
        TrajectoryError: The goal is outside the position limits, or start or goal is not finite.
    """
    share = check_share(velocity_scaling)
    start, goal = _plain("start", start, limits), _plain("goal", goal, limits)
    _require_sizes(joint_names, start, goal, limits)
    for limit, there in zip(limits, goal, strict=True):
        _require_inside(limit, "goal", there)
    bounds = [_bounds(limit, share) for limit in limits]
    ways = [there - here for here, there in zip(start, goal, strict=True)]
    duration = max(least_duration(way, bound) for way, bound in zip(ways, bounds, strict=True))
    pieces = [
        rest_to_rest(here, way, duration, bound)
        for here, way, bound in zip(start, ways, bounds, strict=True)
    ]
    return _assembled(joint_names, start, goal, pieces)


def _plain(what: str, values: Sequence[float], limits: Sequence[JointLimits]) -> tuple[float, ...]:
    given = items(f"the positions at the {what}", values, "give one for each joint")
    if len(given) != len(limits):
        raise TrajectoryError(f"{what}: {len(given)} values for {len(limits)} joints")
    return tuple(
        number(f"{limit.name}: {what}", value, error=TrajectoryError)
        for limit, value in zip(limits, given, strict=True)
    )


def _require_sizes(names: Sequence[str], *columns: Sequence[object]) -> None:
    for what, column in zip(("start", "goal", "limits"), columns, strict=True):
        if len(column) != len(names):
            raise TrajectoryError(f"{what}: {len(column)} values for {len(names)} joints")


def _require_inside(limit: JointLimits, what: str, value: float) -> None:
    number(f"{limit.name}: {what}", value, error=TrajectoryError)
    room = _ROOM * (limit.upper - limit.lower)
    if not limit.lower - room <= value <= limit.upper + room:
        hint = unit_hint(value, limit.unit)
        raise TrajectoryError(
            f"{limit.name}: {what} {value:.6g} {limit.unit} is outside {limit.lower:g} .. "
            f"{limit.upper:g} {limit.unit}{hint and f'; {hint}'}"
        )


def _bounds(limit: JointLimits, share: float = 1.0) -> Bounds:
    return Bounds(
        share * limit.max_velocity, share**2 * limit.max_acceleration, share**3 * limit.max_jerk
    )


def _assembled(
    names: Sequence[str],
    start: Sequence[float],
    goal: Sequence[float],
    pieces: Sequence[tuple[Knot, ...]],
) -> Trajectory:
    """Combine the motions of all joints, which have equal durations, into one trajectory."""
    times = _apart(knot.time for knots in pieces for knot in knots)
    columns = np.array([_cubics(knots, times) for knots in pieces]).reshape(len(names), -1, 4)
    positions, velocities, *cubics = columns.transpose(2, 1, 0)
    positions = np.vstack((positions, goal))
    velocities = np.vstack((velocities, np.zeros(len(names))))
    if len(times) > 1:
        positions[0] = start
    return Trajectory(names, times, positions, velocities, cubics=np.stack(cubics, axis=-1))


def _apart(times: Iterable[float]) -> list[float]:
    """Return the times in order, including the first and last, without those too close together."""
    ordered = sorted(times)
    last = ordered[-1]
    kept = [0.0]
    for time in ordered:
        if time - kept[-1] > _SHORTEST and last - time > _SHORTEST:
            kept.append(time)
    if last > _SHORTEST:
        kept.append(last)
    return kept


def _cubics(knots: Sequence[Knot], times: Sequence[float]) -> list[tuple[float, ...]]:
    """Return the polynomials of one joint, one from each time to the next."""
    rows: list[tuple[float, ...]] = []
    index = 0
    for begin, end in pairwise(times):
        middle = (begin + end) / 2.0
        while index + 1 < len(knots) and knots[index + 1].time <= middle:
            index += 1
        since, p, v, a, jerk = knots[index]
        t = begin - since
        rows.append(
            (
                p + t * (v + t * (a / 2.0 + t * jerk / 6.0)),
                v + t * (a + t * jerk / 2.0),
                (a + t * jerk) / 2.0,
                jerk / 6.0,
            )
        )
    return rows
