"""Goals: the operations that clients have begun, and their results."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import Any

from bioscara.api.failures import failure_of
from bioscara.api.messages import GoalValue, OnLeaseLoss
from bioscara.api.values import gripper_value
from bioscara.control.controllers.gripper_messages import GripperResult
from bioscara.errors import InvalidArgumentError
from bioscara.planning import Trajectory
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory
from bioscara.robot.operations.motions.jog import Jog
from bioscara.robot.operations.operation import Operation
from bioscara.robot.operations.running import Status

_ENDED = frozenset({Status.SUCCEEDED, Status.CANCELLED, Status.FAILED})
KEPT = 1000
"""Number of goals that are kept."""
TRAJECTORIES = 20
"""Number of ended goals whose trajectories are kept: each may have some hundred kilobytes."""


@dataclass(eq=False, slots=True)
class ClientGoal:
    """An operation that a client has begun.

    Attributes:
        number: Counted from 1.
        operation: The operation.
        session: ClientSession of the client.
        client: Its name.
        epoch: Epoch of its lease.
        on_lease_loss: Whether it stops or finishes when that lapses or is released.
    """

    number: int
    operation: Operation[Any]
    session: str
    client: str
    epoch: int
    on_lease_loss: OnLeaseLoss
    _final: GoalValue | None = field(default=None, init=False)

    @property
    def needs_lease(self) -> bool:
        """Whether it is stopped when its client's lease lapses or is released; a jog always is."""
        return self.on_lease_loss == "stop" or isinstance(self.operation, Jog)

    def value(self) -> GoalValue:
        """Return the goal as it is now."""
        if self._final is not None:
            return self._final
        operation = self.operation
        # First, so that a goal that ends now is not reported as ended without its result.
        status = operation.status
        ended = status in _ENDED
        error = operation.error if ended else None
        duration = math.nan
        notes: tuple[str, ...] = ()
        if isinstance(operation, FollowTrajectory) and operation.plan is not None:
            duration = sum(path.duration for path in operation.paths)
            notes = operation.plan.notes
        result = operation.result() if ended and error is None else None
        return GoalValue(
            self.number,
            operation.name,
            self.client,
            status,
            operation.progress,
            None if error is None else failure_of(error),
            gripper_value(result) if isinstance(result, GripperResult) else None,
            duration,
            notes,
            operation.limitation,
        )

    @property
    def paths(self) -> list[Trajectory]:
        """The trajectories that it follows.

        Raises:
            InvalidArgumentError: They are not kept any more.
        """
        operation = self.operation
        if not isinstance(operation, FollowTrajectory):
            return []
        if self._final is not None:
            raise InvalidArgumentError(
                f"the trajectories of goal {self.number} are not kept any more; those of the last "
                f"{TRAJECTORIES} are"
            )
        return operation.paths

    def shorten(self) -> None:
        """Keep the value of an ended goal, and not the objects of its operation."""
        if self._final is None:
            self._final = self.value()
            self.operation.forget()


class Goals:
    """The latest goals of an owner.

    Attributes:
        last: Number of the newest; 0 before the first.
    """

    def __init__(self) -> None:
        self._kept: OrderedDict[int, ClientGoal] = OrderedDict()
        self.last = 0

    def reserve(self) -> int:
        """Return the number of the next goal, which :meth:`keep` keeps once it has begun."""
        self.last += 1
        return self.last

    def keep(self, goal: ClientGoal) -> None:
        """Keep a goal; the oldest that have ended are forgotten."""
        self._kept[goal.number] = goal
        for old in list(self._kept.values())[:-TRAJECTORIES]:
            if old.operation.done:
                old.shorten()
        for number, old in list(self._kept.items()):
            if len(self._kept) <= KEPT:
                break
            if old.operation.done:
                del self._kept[number]

    def get(self, number: int) -> ClientGoal:
        """Return a goal.

        Raises:
            InvalidArgumentError: There is none of that number, or it is not kept any more.
        """
        goal = self._kept.get(number)
        if goal is None:
            raise InvalidArgumentError(
                f"there is no goal {number}; the last is {self.last}, and {KEPT} are kept"
            )
        return goal

    @property
    def all(self) -> list[ClientGoal]:
        """All goals that are kept, oldest first."""
        return list(self._kept.values())

    @property
    def running(self) -> list[ClientGoal]:
        """The goals that have not ended."""
        return [goal for goal in self._kept.values() if not goal.operation.done]
