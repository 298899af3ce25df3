"""What becomes of a trajectory, from how far the joints are off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from bioscara.control.joint_trajectory.messages import ErrorCode, JointValues, Status
from bioscara.control.joint_trajectory.tolerances import Tolerances, Violation, violated


class Verdict(NamedTuple):
    """How a trajectory ended.

    Attributes:
        status: SUCCEEDED or ABORTED.
        code: Result code.
        text: The result in words.
    """

    status: Status
    code: ErrorCode
    text: str


def judge_path(
    tolerances: Tolerances,
    error: JointValues,
    joints: Sequence[str],
    time: float,
    *,
    velocity: bool,
) -> Verdict | None:
    """Return how a trajectory ended on its way, or None while it goes on.

    Args:
        tolerances: Of the trajectory.
        error: Desired minus measured.
        joints: Names of the joints.
        time: Time since the trajectory's start [s], for the message.
        velocity: Whether the velocity error means anything.
    """
    violation = violated(tolerances.path, error, velocity=velocity)
    if violation is None:
        return None
    return Verdict(
        Status.ABORTED,
        ErrorCode.PATH_TOLERANCE_VIOLATED,
        f"Aborted due to path tolerance violation: {_words(violation, joints)}, "
        f"{time:.3f} s into the trajectory",
    )


def judge_end(
    tolerances: Tolerances,
    error: JointValues,
    joints: Sequence[str],
    overtime: float,
    timeout: float,
    *,
    velocity: bool,
) -> Verdict | None:
    """Return how a trajectory ended after its last point, or None while it is waited for.

    Args:
        tolerances: Of the trajectory.
        error: Desired minus measured.
        joints: Names of the joints.
        overtime: Time since the last point's [s], not negative.
        timeout: Overtime after which it is given up in any case [s]; 0 for never.
        velocity: Whether the velocity error means anything.
    """
    violation = violated(tolerances.goal, error, velocity=velocity)
    if violation is None:
        return Verdict(Status.SUCCEEDED, ErrorCode.SUCCESSFUL, "Goal successfully reached!")
    if 0.0 < tolerances.goal_time < overtime:
        why = (
            f"Aborted due to goal_time_tolerance exceeding by "
            f"{overtime - tolerances.goal_time:.3f} s"
        )
    elif 0.0 < timeout < overtime:
        why = f"Aborted due to command timeout, {timeout:g} s after the last point"
    else:
        return None
    return Verdict(
        Status.ABORTED,
        ErrorCode.GOAL_TOLERANCE_VIOLATED,
        f"{why}: {_words(violation, joints)}",
    )


def _words(violation: Violation, joints: Sequence[str]) -> str:
    return (
        f"{violation.quantity} of {joints[violation.joint]} is {violation.error:.4g} off, "
        f"{violation.limit:.4g} is allowed"
    )
