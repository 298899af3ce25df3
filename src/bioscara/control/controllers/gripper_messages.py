"""Goals and answers of a gripper, as in control_msgs/ParallelGripperCommand."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from bioscara.control.controllers.goal_handle import AcceptedGoal, GoalStatus
from bioscara.hardware.interfaces import Quality


@dataclass(frozen=True, slots=True)
class GripperGoal:
    """A goal of control_msgs/ParallelGripperCommand, unchecked.

    Attributes:
        position: The width between the jaws, one value [m].
        velocity: Highest speed, one value or none [m/s]; unused where the gripper has no
            interface for it, as is the effort.
        effort: Highest effort, one value or none [N].
    """

    position: tuple[float, ...]
    velocity: tuple[float, ...] = ()
    effort: tuple[float, ...] = ()


class GripperFeedback(NamedTuple):
    """State of the gripper.

    Attributes:
        time: Begin of the cycle [s].
        position: Width between the jaws [m], limited to what they can have reached by then.
        velocity: As measured [m/s].
        quality: Reliability of these values.
    """

    time: float
    position: float
    velocity: float
    quality: Quality


class GripperResult(NamedTuple):
    """How a goal ended.

    Attributes:
        position: Width between the jaws [m].
        velocity: As measured [m/s].
        reached_goal: Whether the width is the goal's.
        stalled: Whether the gripper was held up before.
        quality: Reliability of these values.
    """

    position: float
    velocity: float
    reached_goal: bool
    stalled: bool
    quality: Quality


@dataclass(slots=True)
class GripperGoalHandle(AcceptedGoal):
    """An accepted goal; changed by the controller until it ends.

    Attributes:
        goal: The requested goal.
        status: Its status.
        text: Why it ended early.
        feedback: State of the gripper; None before the goal's first cycle.
        result: How it ended; None before.
    """

    goal: GripperGoal
    status: GoalStatus = GoalStatus.EXECUTING
    text: str = ""
    feedback: GripperFeedback | None = field(default=None, repr=False)
    result: GripperResult | None = field(default=None, repr=False)
