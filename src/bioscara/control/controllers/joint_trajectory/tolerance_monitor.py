"""The outcome of a trajectory from the deviations of the joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from bioscara.control.controllers.goals import Status
from bioscara.control.controllers.joint_trajectory.messages import ErrorCode
from bioscara.control.controllers.joint_trajectory.tolerances import Tolerances, Violation, violated
from bioscara.planning import Sample


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


class ToleranceMonitor:
    """Evaluates in each cycle whether the followed trajectory has ended.

    Args:
        joints: Names of the joints.
        tolerances: Of the followed trajectory; those of a goal replace them.
        timeout: Time after the last point after which it is given up in any case [s]; 0 for never.
        velocity: Whether the velocity error is meaningful.

    Attributes:
        tolerances: Of the followed trajectory.
    """

    __slots__ = ("_joints", "_timeout", "_velocity", "tolerances")

    def __init__(
        self, joints: Sequence[str], tolerances: Tolerances, timeout: float, *, velocity: bool
    ) -> None:
        self._joints, self._timeout, self._velocity = tuple(joints), timeout, velocity
        self.tolerances = tolerances

    def on_the_way(self, error: Sample, time: float) -> Verdict | None:
        """Return how a trajectory ended before its last point, or None while it continues.

        Args:
            error: Desired minus measured.
            time: Time since the trajectory's start [s], for the message.
        """
        violation = violated(self.tolerances.path, error, velocity=self._velocity)
        if violation is None:
            return None
        return Verdict(
            Status.ABORTED,
            ErrorCode.PATH_TOLERANCE_VIOLATED,
            f"Aborted due to path tolerance violation: {self._words(violation)}, "
            f"{time:.3f} s into the trajectory",
        )

    def at_the_end(self, error: Sample, overtime: float) -> Verdict | None:
        """Return how a trajectory ended after its last point, or None while its end is awaited.

        Args:
            error: Desired minus measured.
            overtime: Time since the last point's [s], not negative.
        """
        goal_time = self.tolerances.goal_time
        violation = violated(self.tolerances.goal, error, velocity=self._velocity)
        if violation is None:
            return Verdict(Status.SUCCEEDED, ErrorCode.SUCCESSFUL, "Goal successfully reached!")
        if 0.0 < goal_time < overtime:
            why = f"Aborted due to goal_time_tolerance exceeding by {overtime - goal_time:.3f} s"
        elif 0.0 < self._timeout < overtime:
            why = f"Aborted due to command timeout, {self._timeout:g} s after the last point"
        else:
            return None
        return Verdict(
            Status.ABORTED,
            ErrorCode.GOAL_TOLERANCE_VIOLATED,
            f"{why}: {self._words(violation)}",
        )

    def _words(self, violation: Violation) -> str:
        return (
            f"{violation.quantity} of {self._joints[violation.joint]} is {violation.error:.4g} "
            f"off, {violation.limit:.4g} is allowed"
        )
