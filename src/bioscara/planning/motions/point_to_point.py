"""Point-to-point joint motions: all joints start and arrive together."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from bioscara.arguments import items, number
from bioscara.errors import TrajectoryError
from bioscara.kinematics.pose import unit_hint
from bioscara.planning.limits import JointLimits, check_share
from bioscara.planning.profiles.double_s import durations, fastest, lasting
from bioscara.planning.profiles.segments import Bounds, Knot, MotionState
from bioscara.planning.trajectory.trajectory import Trajectory
from bioscara.planning.trajectory.validation import check

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
    speed: float = 1.0,
    jerk_limited: bool = True,
) -> Trajectory:
    """Return the fastest motion from rest to rest in which all joints start and end together.

    The slowest joint determines the duration; the others stay below their limits. At speed s
    the motion is the same with 1/s times the duration.

    Args:
        joint_names: The joints.
        start: Their start positions [rad or m]; from beyond a limit they move back.
        goal: Their goal positions [rad or m].
        limits: Of these joints, in the same order.
        speed: Share of the speed limits to use, 0.001 to 1.
        jerk_limited: False allows jumps of acceleration: faster, and rougher.

    Returns:
        The motion; a single point if the goal is the start.

    Raises:
        InvalidArgumentError: The speed is outside its range, or a value is not a number.
        TrajectoryError: The goal is outside the position limits, or start or goal is not finite.
    """
    speed = check_share(speed)
    start, goal = _plain("start", start, limits), _plain("goal", goal, limits)
    _require_sizes(joint_names, start, goal, limits)
    for limit, there in zip(limits, goal, strict=True):
        _require_inside(limit, "goal", there)
    bounds = [_bounds(limit, speed) for limit in limits]
    begin, end = [MotionState(p) for p in start], [MotionState(p) for p in goal]
    if jerk_limited:
        return _assembled(joint_names, begin, end, _synchronised(begin, end, bounds))
    joints = [
        (here, there - here, bound) for here, there, bound in zip(start, goal, bounds, strict=True)
    ]
    duration = max(_quickest(displacement, bound) for _, displacement, bound in joints)
    pieces = [_trapezoid(*joint, duration) for joint in joints]
    return _assembled(joint_names, begin, end, pieces)


def state_to_state(
    joint_names: Sequence[str],
    start: Sequence[MotionState],
    goal: Sequence[MotionState],
    limits: Sequence[JointLimits],
) -> Trajectory:
    """Return the fastest jerk-limited motion between two states of motion, synchronised.

    Args:
        joint_names: The joints.
        start: Their positions, velocities and accelerations at the start.
        goal: The same at the end.
        limits: Of these joints, in the same order.

    Raises:
        TrajectoryError: A state is not finite or cannot be reached or left within the limits, or
            the motion would leave the position limits in between.
    """
    _require_sizes(joint_names, start, goal, limits)
    for limit, here, there in zip(limits, start, goal, strict=True):
        _require_possible(limit, "start", here)
        _require_possible(limit, "goal", there)
    pieces = _synchronised(start, goal, [_bounds(limit) for limit in limits])
    trajectory = _assembled(joint_names, start, goal, pieces)
    check(trajectory, limits)
    return trajectory


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


def _require_possible(limit: JointLimits, what: str, state: MotionState) -> None:
    """Make sure that a joint can reach a state, or can continue from it, within its limits."""
    _require_inside(limit, what, state.position)
    most, hardest, jerk = _bounds(limit)
    _, v, a = state
    # The jerk is limited: until the acceleration is zero, the velocity continues to change after
    # the start, and has changed before the goal.
    rest = a * abs(a) / (2.0 * jerk) * (1.0 if what == "start" else -1.0)
    for quantity, value, highest, unit in (
        ("acceleration", a, hardest, f"{limit.unit}/s^2"),
        ("velocity", v, most, f"{limit.unit}/s"),
        ("velocity where the acceleration is zero", v + rest, most, f"{limit.unit}/s"),
    ):
        if not abs(value) <= highest * (1.0 + _ROOM):
            raise TrajectoryError(
                f"{limit.name}: {quantity} of the {what}, {value:.6g} {unit}, exceeds the limit of "
                f"{highest:g} {unit}"
            )


def _bounds(limit: JointLimits, speed: float = 1.0) -> Bounds:
    return Bounds(
        speed * limit.max_velocity, speed**2 * limit.max_acceleration, speed**3 * limit.max_jerk
    )


def _synchronised(
    start: Sequence[MotionState], goal: Sequence[MotionState], bounds: Sequence[Bounds]
) -> list[tuple[Knot, ...]]:
    """Return motions of equal duration, the least that is possible for all joints."""
    problems = list(zip(start, goal, bounds, strict=True))
    profiles = [fastest(*problem) for problem in problems]
    for duration in _candidates(problems, max(profile.duration for profile in profiles)):
        together = [
            own if own.duration == duration else lasting(duration, *problem)
            for own, problem in zip(profiles, problems, strict=True)
        ]
        found = [profile.knots for profile in together if profile is not None]
        if len(found) == len(together):
            return found
    raise TrajectoryError("the joints have no duration in common: the start is beyond a limit")


def _candidates(
    problems: Sequence[tuple[MotionState, MotionState, Bounds]], least: float
) -> Iterator[float]:
    """Yield the least duration, and the longer ones from which on a joint's motion may exist."""
    yield least
    yield from sorted(t for problem in problems for t in durations(*problem) if t > least)


def _quickest(displacement: float, bounds: Bounds) -> float:
    """Return the least duration from rest to rest without a jerk limit [s]."""
    most, hardest, _ = bounds
    if abs(displacement) * hardest <= most * most:
        return 2.0 * math.sqrt(abs(displacement) / hardest)
    return abs(displacement) / most + most / hardest


def _trapezoid(
    start: float, displacement: float, bounds: Bounds, duration: float
) -> tuple[Knot, ...]:
    """Return the motion from rest to rest in a given time, without a jerk limit."""
    if duration <= 0.0:
        return (Knot(0.0, start, 0.0, 0.0, 0.0),)
    ramp = min(bounds.velocity / bounds.acceleration, duration / 2.0)
    cruise = duration - 2.0 * ramp
    velocity = displacement / (ramp + cruise)
    rise = displacement * ramp / (ramp + cruise) / 2.0
    acceleration = velocity / ramp
    knots = [
        Knot(0.0, start, 0.0, acceleration, 0.0),
        Knot(ramp, start + rise, velocity, 0.0, 0.0),
        Knot(ramp + cruise, start + displacement - rise, velocity, -acceleration, 0.0),
        Knot(duration, start + displacement, 0.0, 0.0, 0.0),
    ]
    return tuple(knots)


def _assembled(
    names: Sequence[str],
    start: Sequence[MotionState],
    goal: Sequence[MotionState],
    pieces: Sequence[tuple[Knot, ...]],
) -> Trajectory:
    """Combine the motions of all joints, which have equal durations, into one trajectory."""
    times = _apart(knot.time for knots in pieces for knot in knots)
    columns = np.array([_cubics(knots, times) for knots in pieces]).reshape(len(names), -1, 4)
    positions, velocities, *cubics = columns.transpose(2, 1, 0)
    ends = [[state.position for state in goal], [state.velocity for state in goal]]
    positions, velocities = np.vstack((positions, ends[0])), np.vstack((velocities, ends[1]))
    if len(times) > 1:
        positions[0] = [state.position for state in start]
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
