"""Tolerances of joints on the path and at the end, and the outcome that follows from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.joint_trajectory.goal_messages import ErrorCode, Goal, Tolerance
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import Constraints
from bioscara.planning import Sample

ERASE = -1.0


class TrajectoryTolerances(NamedTuple):
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


class TrajectoryResult(NamedTuple):
    """How a trajectory ended.

    Attributes:
        status: SUCCEEDED or ABORTED.
        code: Result code.
        text: The result in words.
    """

    status: GoalStatus
    code: ErrorCode
    text: str


class ToleranceMonitor:
    """Evaluates in each cycle whether the followed trajectory has ended.

    Args:
        joints: Names of the joints.
        velocity: Whether the velocity error is meaningful.

    Attributes:
        tolerances: Of the followed trajectory.
        timeout: Time after the last point after which it is given up in any case [s]; 0 for never.
        stopped_time: Time for which the joints have to stand within their tolerances [s].
    """

    __slots__ = ("_arrived", "_joints", "_velocity", "stopped_time", "timeout", "tolerances")

    def __init__(self, joints: Sequence[str], *, velocity: bool) -> None:
        self._joints, self._velocity = tuple(joints), velocity
        self.timeout = self.stopped_time = 0.0
        self._arrived = math.inf
        self.tolerances: TrajectoryTolerances

    def before_the_end(self, error: Sample, time: float) -> TrajectoryResult | None:
        """Return how a trajectory ended before its last point, or None while it continues.

        Args:
            error: Desired minus measured.
            time: Time since the trajectory's start [s], for the message.
        """
        self._arrived = math.inf
        violation = violated(self.tolerances.path, error, velocity=self._velocity)
        if violation is None:
            return None
        return TrajectoryResult(
            GoalStatus.ABORTED,
            ErrorCode.PATH_TOLERANCE_VIOLATED,
            f"Aborted due to path tolerance violation: {self._describe(violation)}, "
            f"{time:.3f} s into the trajectory",
        )

    def after_the_end(
        self, error: Sample, overtime: float, *, stopped: bool
    ) -> TrajectoryResult | None:
        """Return how a trajectory ended after its last point, or None while its end is awaited.

        Args:
            error: Desired minus measured.
            overtime: Time since the last point's [s], not negative.
            stopped: Whether the joints stand, and are sent nothing but the end.
        """
        goal_time = self.tolerances.goal_time
        violation = violated(self.tolerances.goal, error, velocity=self._velocity)
        if violation is not None or not stopped:
            self._arrived = math.inf
        self._arrived = min(self._arrived, overtime)
        if violation is None and overtime - self._arrived >= self.stopped_time:
            return TrajectoryResult(
                GoalStatus.SUCCEEDED, ErrorCode.SUCCESSFUL, "Goal successfully reached!"
            )
        if 0.0 < goal_time < overtime:
            why = f"Aborted due to goal_time_tolerance exceeding by {overtime - goal_time:.3f} s"
        elif 0.0 < self.timeout < overtime:
            why = f"Aborted due to command timeout, {self.timeout:g} s after the last point"
        else:
            return None
        return TrajectoryResult(
            GoalStatus.ABORTED,
            ErrorCode.GOAL_TOLERANCE_VIOLATED,
            f"{why}: {self._describe(violation) if violation else 'the joints do not stand'}",
        )

    def _describe(self, violation: Violation) -> str:
        return (
            f"{violation.quantity} of {self._joints[violation.joint]} is {violation.error:.4g} "
            f"off, {violation.limit:.4g} is allowed"
        )


def defaults(joints: Sequence[str], constraints: Constraints) -> TrajectoryTolerances:
    """Return the tolerances of the parameters."""
    of = [constraints.of(joint) for joint in joints]
    stopped = constraints.stopped_velocity_tolerance
    return TrajectoryTolerances(
        tuple((each.trajectory, 0.0, 0.0) for each in of),
        tuple((each.goal, stopped, 0.0) for each in of),
        constraints.goal_time,
    )


def choose(
    goal: Goal, joints: Sequence[str], default: TrajectoryTolerances
) -> tuple[TrajectoryTolerances, str]:
    """Return the tolerances of a goal, and why the defaults were kept; empty if they were not.

    One invalid value discards the whole set, as in ROS; the goal still runs.
    """
    wrong = _nonsense((*goal.path_tolerance, *goal.goal_tolerance), joints)
    if not wrong and goal.goal_time_tolerance < 0.0 and goal.goal_time_tolerance != ERASE:
        wrong = f"goal_time_tolerance {goal.goal_time_tolerance:g} s"
    if wrong:
        return default, f"{wrong} makes no sense: the default tolerances are used"
    return (
        TrajectoryTolerances(
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
    positions, velocities, _ = error
    for joint, (position_limit, velocity_limit, _) in enumerate(tolerances):
        off = positions[joint]
        if position_limit > 0.0 and not abs(off) <= position_limit:
            return Violation(joint, "position", off, position_limit)
        if velocity and velocity_limit > 0.0:
            off = velocities[joint]
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
