"""What a gripper is asked for and answers, as in control_msgs/ParallelGripperCommand."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from bioscara.control.controllers.goals import Pursued, Status
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
    """Where the gripper is.

    Attributes:
        time: Begin of the cycle [s].
        position: Width between the jaws [m], no farther than they can have come by then.
        velocity: As measured [m/s].
        quality: How far that can be believed.
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
        quality: How far all of this can be believed.
    """

    position: float
    velocity: float
    reached_goal: bool
    stalled: bool
    quality: Quality


@dataclass(slots=True)
class GripperGoalHandle(Pursued):
    """An accepted goal; changed by the controller until it ends.

    Attributes:
        goal: What was asked.
        status: How far it got.
        text: Why it ended early.
        feedback: Where the gripper is; None before the goal's first cycle.
        result: How it ended; None before.
    """

    goal: GripperGoal
    status: Status = Status.EXECUTING
    text: str = ""
    feedback: GripperFeedback | None = field(default=None, repr=False)
    result: GripperResult | None = field(default=None, repr=False)
