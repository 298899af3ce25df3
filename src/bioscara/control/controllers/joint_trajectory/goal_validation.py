"""Checks whether a trajectory can be followed; every rule has its own error message.

Limits are checked at its points; where the curve between them exceeds the limits, it is bounded in
each cycle, as every command is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from operator import attrgetter, itemgetter
from typing import NamedTuple

from bioscara.arguments import flag, items, number, numbers, shown, text
from bioscara.control.controllers.joint_trajectory.goal_messages import (
    Goal,
    JointTrajectory,
    Point,
    Tolerance,
)
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.errors import GoalRejectedError
from bioscara.model import JointParameters
from bioscara.planning.trajectory.validation import TOLERANCE
from bioscara.spelling import did_you_mean

_EPSILON = 1.19e-7
"""Speed that still counts as none at the end [rad/s or m/s]: the rounding of a 32 bit float."""
_LARGEST = 1e6
"""Largest number in a trajectory, SI units: beyond any motion, and small enough for every curve
that a cycle draws to the first point."""
_ROUGHNESS = 1e-5
"""Rounding error of the accelerations of planned points [rad/s^2 or m/s^2]."""
_SETTLING = {"rad": 6e-3, "m": 5e-4}
"""Possible displacement of a joint beyond a limit since its return was planned [rad or m]: engaging
it takes the twist out of its belt. The limiter does not let it move farther out."""
_UNIT_HINTS = {"rad": "angles are in rad, not in degrees", "m": "lengths are in m, not in mm"}
_PLAIN = frozenset({float})
_FIELDS = ("positions", "velocities", "accelerations")


class Range(NamedTuple):
    """Smallest and largest value of a joint in the points that give one; NaN if none does.

    Attributes:
        positions: [rad or m].
        velocities: [rad/s or m/s].
        accelerations: [rad/s^2 or m/s^2].
    """

    positions: tuple[float, float]
    velocities: tuple[float, float]
    accelerations: tuple[float, float]


def check_form(trajectory: JointTrajectory, parameters: JointTrajectoryParameters) -> None:
    """Make the checks that do not depend on the state of the arm.

    Raises:
        GoalRejectedError: It cannot be followed; the message gives the point, the joint, the value
            and the remedy.
    """
    names = trajectory.joint_names
    _check_names(names, parameters)
    if not trajectory.points:
        raise GoalRejectedError("the trajectory has no points; send at least one, or cancel")
    before = -math.inf
    for index, point in enumerate(trajectory.points):
        _check_time(index, point.time, before)
        _check_fields(index, point, names, parameters)
        before = point.time


def arranged(
    trajectory: JointTrajectory,
    parameters: JointTrajectoryParameters,
    commanded: Sequence[float],
) -> tuple[Point, ...]:
    """Return the points of a trajectory in the order of the controller's joints.

    Args:
        trajectory: The sent trajectory, of checked form.
        parameters: The controller's.
        commanded: Position command of each of the controller's joints, for those that a partial
            goal leaves out, and for integration [rad or m].

    Raises:
        GoalRejectedError: It ends in motion, which the parameters do not permit.
    """
    names, points = trajectory.joint_names, trajectory.points
    if parameters.allow_integration_in_goal_trajectories:
        points = integrate(points, _in_order(names, parameters.joints, commanded))
    _check_end(points[-1], names, parameters)
    if names == parameters.joints:
        return points
    return tuple(_local(point, names, parameters.joints, commanded) for point in points)


def ranges(points: Sequence[Point], joints: int) -> tuple[Range, ...]:
    """Return the ranges of the joints' values."""
    # In short steps: another thread may wait for the interpreter, to run the control loop.
    given = [[values for point in points if (values := getattr(point, f))] for f in _FIELDS]

    def within(rows: list[tuple[float, ...]], joint: int) -> tuple[float, float]:
        if not rows:
            return math.nan, math.nan
        value = itemgetter(joint)
        return min(map(value, rows)), max(map(value, rows))

    return tuple(Range(*(within(rows, joint) for rows in given)) for joint in range(joints))


def check_limits(
    points: Sequence[Point],
    within: Sequence[Range],
    parameters: JointTrajectoryParameters,
    limits: Mapping[str, JointParameters],
    commanded: Sequence[float],
    measured: Sequence[float],
) -> None:
    """Check arranged points against the limits of the joints.

    Args:
        points: The points.
        within: Ranges of their values.
        parameters: The controller's.
        limits: Of the joints that have some, by name.
        commanded: Position command of each of the controller's joints [rad or m].
        measured: Their measured positions [rad or m].

    Raises:
        GoalRejectedError: A value is beyond a limit.
    """
    for place, joint in enumerate(parameters.joints):
        if joint in limits:
            here = commanded[place], measured[place]
            _check_limits(points, within[place], place, limits[joint], here)


def check_stamp(trajectory: JointTrajectory, now: float) -> None:
    """Check that a trajectory is neither over at ``now`` [s] nor far in the future.

    Raises:
        GoalRejectedError: It is.
    """
    if trajectory.stamp == 0.0:
        return
    if not math.isfinite(trajectory.stamp):
        raise GoalRejectedError(f"stamp {trajectory.stamp} is not a finite number")
    if trajectory.stamp - now > _LARGEST:
        raise GoalRejectedError(
            f"stamp {trajectory.stamp:g} s is more than {_LARGEST:g} s after now, {now:g} s; it "
            "counts by the arm's clock, and 0 starts at once"
        )
    end = trajectory.stamp + trajectory.points[-1].time
    if end < now:
        raise GoalRejectedError(
            f"the trajectory ended {now - end:.3f} s ago; send a stamp of 0 to start at once"
        )


def plain(trajectory: JointTrajectory) -> JointTrajectory:
    """Return a sent trajectory in plain floats.

    Raises:
        GoalRejectedError: A value in it is not a number, or its form is wrong.
    """
    if not isinstance(trajectory, JointTrajectory):
        raise GoalRejectedError(f"{shown(trajectory)} is not a JointTrajectory")
    names = items("the joint names", trajectory.joint_names, error=GoalRejectedError)
    for name in names:
        text("a joint name", name, error=GoalRejectedError)
    points = items("the points", trajectory.points, error=GoalRejectedError)
    return JointTrajectory(
        names,
        tuple(_plain_point(index, point) for index, point in enumerate(points)),
        number("the stamp", trajectory.stamp, error=GoalRejectedError),
    )


def plain_goal(goal: Goal) -> Goal:
    """Return a sent goal in plain floats.

    Raises:
        GoalRejectedError: A value in it is not a number, or its form is wrong.
    """
    if not isinstance(goal, Goal):
        raise GoalRejectedError(f"{shown(goal)} is not a Goal")
    return Goal(
        plain(goal.trajectory),
        _plain_tolerances("path_tolerance", goal.path_tolerance),
        _plain_tolerances("goal_tolerance", goal.goal_tolerance),
        number("goal_time_tolerance", goal.goal_time_tolerance, error=GoalRejectedError),
        flag("collision_checked", goal.collision_checked, error=GoalRejectedError),
    )


def _plain_tolerances(what: str, given: object) -> tuple[Tolerance, ...]:
    tolerances = items(what, given, error=GoalRejectedError)
    for tolerance in tolerances:
        if not isinstance(tolerance, Tolerance) or not isinstance(tolerance.joint, str):
            raise GoalRejectedError(f"{what}: {shown(tolerance)} is not a Tolerance of a joint")
    return tuple(
        Tolerance(
            each.joint, *numbers(f"{what} of {each.joint}", each[1:], error=GoalRejectedError)
        )
        for each in tolerances
    )


def _plain_point(index: int, point: Point) -> Point:
    if not isinstance(point, Point):
        raise GoalRejectedError(f"point {index} is {shown(point)}; give Point(time, positions)")
    time, *columns = point
    if type(time) is float and all(
        type(values) is tuple and set(map(type, values)) <= _PLAIN for values in columns
    ):
        return point  # finiteness is checked below; a plan has very many points
    return Point(
        number(f"point {index}: time_from_start", time, error=GoalRejectedError),
        *(
            numbers(f"point {index}: {what}", values, error=GoalRejectedError)
            for what, values in zip(Point._fields[1:], columns, strict=True)
        ),
    )


def integrate(points: Sequence[Point], start: Sequence[float]) -> tuple[Point, ...]:
    """Return points whose missing velocities and positions are integrated from the given values.

    By the trapezoid rule from the point before; the first point from rest at ``start`` [rad or m].
    """
    done: list[Point] = []
    before = Point(0.0, tuple(start), (0.0,) * len(start), (0.0,) * len(start))
    for point in points:
        step = point.time - before.time
        velocities = point.velocities
        if not velocities and point.accelerations:
            accelerations = before.accelerations or (0.0,) * len(start)
            velocities = tuple(
                v + (a0 + a1) / 2.0 * step
                for v, a0, a1 in zip(
                    before.velocities, accelerations, point.accelerations, strict=True
                )
            )
        positions = point.positions
        if not positions:
            positions = tuple(
                p + (v0 + v1) / 2.0 * step
                for p, v0, v1 in zip(before.positions, before.velocities, velocities, strict=True)
            )
        before = point._replace(positions=positions, velocities=velocities)
        done.append(before)
        if not velocities:
            before = before._replace(velocities=(0.0,) * len(start))
    return tuple(done)


def _check_names(names: Sequence[str], parameters: JointTrajectoryParameters) -> None:
    joints = parameters.joints
    if not names:
        raise GoalRejectedError(f"the trajectory names no joints; name {', '.join(joints)}")
    for name in names:
        if name not in joints:
            hint = did_you_mean(name, joints, f"it has {', '.join(joints)}")
            raise GoalRejectedError(f"{name} is not a joint of this controller; {hint}")
        if names.count(name) > 1:
            raise GoalRejectedError(f"joint {name} is named twice")
    if len(names) != len(joints) and not parameters.allow_partial_joints_goal:
        missing = [joint for joint in joints if joint not in names]
        raise GoalRejectedError(
            f"the trajectory leaves out {', '.join(missing)}; name all joints, or set "
            "allow_partial_joints_goal"
        )


def _check_time(index: int, time: float, before: float) -> None:
    prefix = f"point {index}: time_from_start {time:g} s"
    if not math.isfinite(time) or time < 0.0:
        raise GoalRejectedError(f"{prefix} must be finite and not negative")
    if time > _LARGEST:
        raise GoalRejectedError(f"{prefix} is beyond {_LARGEST:g} s; send the trajectory in parts")
    if time <= before:
        raise GoalRejectedError(f"{prefix} does not come after {before:g} s of the point before")


def _check_fields(
    index: int, point: Point, names: Sequence[str], parameters: JointTrajectoryParameters
) -> None:
    if point.effort:
        raise GoalRejectedError(f"point {index}: effort cannot be commanded; leave it empty")
    for field in _FIELDS:
        values: tuple[float, ...] = getattr(point, field)
        if not values:
            continue
        if len(values) != len(names):
            raise GoalRejectedError(f"point {index}: {len(values)} {field} for {len(names)} joints")
        for name, value in zip(names, values, strict=True):
            if not math.isfinite(value):
                raise GoalRejectedError(
                    f"point {index}: {field} of {name} is {value}; every value must be finite"
                )
            if abs(value) > _LARGEST:
                raise GoalRejectedError(
                    f"point {index}: {field} of {name} is {value:g}, beyond {_LARGEST:g}; give "
                    "rad or m, and seconds"
                )
    if parameters.allow_integration_in_goal_trajectories:
        if not (point.positions or point.velocities or point.accelerations):
            raise GoalRejectedError(f"point {index}: it has no positions nor anything to integrate")
    elif not point.positions:
        raise GoalRejectedError(f"point {index}: it has no positions; give one for each joint")


def _check_end(last: Point, names: Sequence[str], parameters: JointTrajectoryParameters) -> None:
    if parameters.allow_nonzero_velocity_at_trajectory_end:
        return
    for name, velocity in zip(names, last.velocities, strict=False):
        if abs(velocity) > _EPSILON:
            raise GoalRejectedError(
                f"{name} ends at {velocity:g} rad/s or m/s, {_EPSILON:g} is the most; end at rest, "
                "or set allow_nonzero_velocity_at_trajectory_end"
            )


def _check_limits(
    points: Sequence[Point],
    within: Range,
    place: int,
    limits: JointParameters,
    here: tuple[float, float],
) -> None:
    """Check one joint; pushed beyond a limit, or reading slightly beyond it, it may return."""
    unit, speed, change = limits.unit, limits.max_velocity, limits.max_acceleration
    low, high = min(limits.lower, *here), max(limits.upper, *here)
    low -= _SETTLING[unit] * (low < limits.lower)
    high += _SETTLING[unit] * (high > limits.upper)
    for field, lower, upper, room, per in (
        ("positions", low, high, TOLERANCE * (limits.upper - limits.lower), ""),
        ("velocities", -speed, speed, TOLERANCE * speed, "/s"),
        ("accelerations", -change, change, TOLERANCE * change + _ROUGHNESS, "/s^2"),
    ):
        least, most = lower - room, upper + room
        smallest, largest = getattr(within, field)
        if not (smallest < least or largest > most):
            continue
        for index, values in enumerate(map(attrgetter(field), points)):
            if values and not least <= values[place] <= most:
                raise GoalRejectedError(
                    f"point {index}: {field} of {limits.name} is {values[place]:.7g} {unit}{per}, "
                    f"outside {lower:g} .. {upper:g} {unit}{per}; {_UNIT_HINTS[unit]}"
                )


def _in_order(
    names: Sequence[str], joints: Sequence[str], values: Sequence[float]
) -> tuple[float, ...]:
    return tuple(values[joints.index(name)] for name in names)


def _local(
    point: Point, names: Sequence[str], joints: Sequence[str], commanded: Sequence[float]
) -> Point:
    """Return the point in the controller's order; joints that it leaves out stay."""
    place = [names.index(joint) if joint in names else None for joint in joints]

    def arrange(values: tuple[float, ...], otherwise: Sequence[float]) -> tuple[float, ...]:
        if not values:
            return ()
        return tuple(
            otherwise[index] if where is None else values[where]
            for index, where in enumerate(place)
        )

    nothing = (0.0,) * len(joints)
    return Point(
        point.time,
        arrange(point.positions, commanded),
        arrange(point.velocities, nothing),
        arrange(point.accelerations, nothing),
    )
