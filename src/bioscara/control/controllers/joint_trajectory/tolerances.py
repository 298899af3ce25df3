"""Tolerances of joints on the path and at the end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from bioscara.control.controllers.joint_trajectory.messages import Goal, Tolerance
from bioscara.control.controllers.joint_trajectory.parameters import Constraints
from bioscara.planning import Sample

ERASE = -1.0


class Tolerances(NamedTuple):
    """Limits of each joint in the controller's order; 0 is unchecked.

    Attributes:
        path: On the path: position, velocity, acceleration.
        goal: At the end, likewise.
        goal_time: Permitted delay after the planned arrival [s]; 0 for no limit.
    """

    path: tuple[tuple[float, float, float], ...]
    goal: tuple[tuple[float, float, float], ...]
    goal_time: float


class Violation(NamedTuple):
    """A joint whose error exceeds a tolerance.

    Attributes:
        joint: Its index.
        quantity: ``"position"`` or ``"velocity"``.
        error: Desired minus measured [rad or m, or per s].
        limit: The tolerance, likewise.
    """

    joint: int
    quantity: str
    error: float
    limit: float


def defaults(joints: Sequence[str], constraints: Constraints) -> Tolerances:
    """Return the tolerances of the parameters."""
    of = [constraints.of(joint) for joint in joints]
    stopped = constraints.stopped_velocity_tolerance
    return Tolerances(
        tuple((each.trajectory, 0.0, 0.0) for each in of),
        tuple((each.goal, stopped, 0.0) for each in of),
        constraints.goal_time,
    )


def choose(goal: Goal, joints: Sequence[str], default: Tolerances) -> tuple[Tolerances, str]:
    """Return the tolerances of a goal, and why the defaults were kept; empty if they were not.

    One invalid value discards the whole set, as in ROS; the goal still runs.
    """
    wrong = _nonsense((*goal.path_tolerance, *goal.goal_tolerance), joints)
    if not wrong and goal.goal_time_tolerance < 0.0 and goal.goal_time_tolerance != ERASE:
        wrong = f"goal_time_tolerance {goal.goal_time_tolerance:g} s"
    if wrong:
        return default, f"{wrong} makes no sense: the default tolerances are used"
    return (
        Tolerances(
            _replaced(default.path, goal.path_tolerance, joints),
            _replaced(default.goal, goal.goal_tolerance, joints),
            _value(default.goal_time, goal.goal_time_tolerance),
        ),
        "",
    )


def violated(
    tolerances: Sequence[tuple[float, float, float]],
    error: Sample,
    *,
    velocity: bool,
) -> Violation | None:
    """Return the first violation, or None.

    Args:
        tolerances: One triple for each joint.
        error: Desired minus measured.
        velocity: Whether the velocity error is meaningful.
    """
    for joint, (position_limit, velocity_limit, _) in enumerate(tolerances):
        off = error.positions[joint]
        if position_limit > 0.0 and not abs(off) <= position_limit:
            return Violation(joint, "position", off, position_limit)
        if velocity and velocity_limit > 0.0:
            off = error.velocities[joint]
            if not abs(off) <= velocity_limit:
                return Violation(joint, "velocity", off, velocity_limit)
    return None


def _nonsense(given: Sequence[Tolerance], joints: Sequence[str]) -> str:
    for tolerance in given:
        if tolerance.joint not in joints:
            return f"a tolerance of {tolerance.joint!r}, which is no joint of this controller,"
        for value in tolerance[1:]:
            if not value >= 0.0 and value != ERASE:
                return f"a tolerance of {value:g} for {tolerance.joint}"
    return ""


def _replaced(
    default: Sequence[tuple[float, float, float]],
    given: Sequence[Tolerance],
    joints: Sequence[str],
) -> tuple[tuple[float, float, float], ...]:
    result = list(default)
    for tolerance in given:
        index = joints.index(tolerance.joint)
        position, velocity, acceleration = result[index]
        result[index] = (
            _value(position, tolerance.position),
            _value(velocity, tolerance.velocity),
            _value(acceleration, tolerance.acceleration),
        )
    return tuple(result)


def _value(default: float, given: float) -> float:
    if given > 0.0:
        return given
    return 0.0 if given == ERASE else default
