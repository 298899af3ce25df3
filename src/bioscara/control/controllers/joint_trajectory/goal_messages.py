"""Goals and answers of a joint trajectory controller, field by field as in ROS."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple, Self

from bioscara.control.controllers.goal_handle import AcceptedGoal, GoalStatus
from bioscara.planning import Sample, Trajectory


class Point(NamedTuple):
    """One point of a trajectory; a field that is not given is empty.

    Attributes:
        time: Time from the start of the trajectory [s].
        positions: One for each joint [rad or m].
        velocities: Likewise [rad/s or m/s].
        accelerations: Likewise [rad/s^2 or m/s^2].
        effort: Likewise [N m or N].
    """

    time: float
    positions: tuple[float, ...] = ()
    velocities: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class JointTrajectory:
    """A trajectory as sent, unchecked.

    Attributes:
        joint_names: The joints, in the order of the points' values.
        points: The points.
        stamp: Its start [s, arm clock]; 0 for the time of its first sample.
    """

    joint_names: tuple[str, ...]
    points: tuple[Point, ...]
    stamp: float = 0.0

    @classmethod
    def of(cls, trajectory: Trajectory, stamp: float = 0.0) -> Self:
        """Return a planned trajectory in the form in which it is sent."""
        rows = trajectory.positions.tolist()
        nothing: list[list[float]] = [[]] * len(rows)
        velocities = nothing if trajectory.velocities is None else trajectory.velocities.tolist()
        accelerations = (
            nothing if trajectory.accelerations is None else trajectory.accelerations.tolist()
        )
        points = zip(trajectory.times.tolist(), rows, velocities, accelerations, strict=True)
        return cls(
            trajectory.joint_names,
            tuple(Point(t, tuple(p), tuple(v), tuple(a)) for t, p, v, a in points),
            stamp,
        )


class Tolerance(NamedTuple):
    """Tolerance of one joint; above 0 replaces the default, 0 keeps it, -1 erases it.

    Attributes:
        joint: Name of the joint.
        position: [rad or m].
        velocity: [rad/s or m/s].
        acceleration: [rad/s^2 or m/s^2].
    """

    joint: str
    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


@dataclass(frozen=True, slots=True)
class Goal:
    """A goal of control_msgs/FollowJointTrajectory.

    Attributes:
        trajectory: The trajectory to follow.
        path_tolerance: Tolerances of joints on the path.
        goal_tolerance: Tolerances at the end.
        goal_time_tolerance: Permitted delay of the arrival [s]; values as in a tolerance.
        collision_checked: Whether the sender has checked that the arm keeps clear of everything
            on the whole path, from rest where it is. Other goals are checked while they run.
    """

    trajectory: JointTrajectory
    path_tolerance: tuple[Tolerance, ...] = ()
    goal_tolerance: tuple[Tolerance, ...] = ()
    goal_time_tolerance: float = 0.0
    collision_checked: bool = False


class ErrorCode(IntEnum):
    """Result codes of control_msgs/FollowJointTrajectory."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class Feedback(NamedTuple):
    """Progress of a goal.

    Attributes:
        time: Begin of the cycle [s].
        trajectory_time: Time since the trajectory started [s].
        point: Index of the point that is being approached.
        desired: Desired state of the joints.
        actual: Their measured state.
        error: ``desired`` minus ``actual``.
    """

    time: float
    trajectory_time: float
    point: int
    desired: Sample
    actual: Sample
    error: Sample


class ControllerState(NamedTuple):
    """State of a controller in its last cycle; a field without interfaces of its kind is empty.

    Attributes:
        time: Begin of the cycle [s].
        joint_names: The joints.
        trajectory_time: Time since the trajectory's start, or since it holds [s].
        reference: Desired state of the joints.
        feedback: Their measured state.
        error: ``reference`` minus ``feedback``.
        output: Value of each command interface, by name.
        speed_scaling_factor: Share of the planned speed.
    """

    time: float
    joint_names: tuple[str, ...]
    trajectory_time: float
    reference: Sample
    feedback: Sample
    error: Sample
    output: dict[str, float]
    speed_scaling_factor: float


@dataclass(slots=True)
class GoalHandle(AcceptedGoal):
    """An accepted goal; changed by the controller until it ends.

    Attributes:
        goal: The requested goal.
        status: Its status.
        error_code: Result once it ended.
        text: The result in words.
        feedback: Its progress; None before its first cycle.
    """

    goal: Goal
    status: GoalStatus = GoalStatus.EXECUTING
    error_code: ErrorCode = ErrorCode.SUCCESSFUL
    text: str = ""
    feedback: Feedback | None = field(default=None, repr=False)

    def end(
        self, status: GoalStatus, code: ErrorCode = ErrorCode.SUCCESSFUL, text: str = ""
    ) -> None:
        """End it; called by the controller."""
        self.status, self.error_code, self.text = status, code, text
