"""The goals of clients' controllers, by numbers."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from bioscara.api import messages as m
from bioscara.api.values import gripper_value
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.gripper_messages import GripperGoalHandle
from bioscara.control.controllers.homing_controller import HomingGoal
from bioscara.control.controllers.joint_trajectory import GoalHandle
from bioscara.control.faults.supervisor import FaultState, Supervisor
from bioscara.errors import InvalidArgumentError

ENDED = 16
"""Number of ended goals in a sample."""

AnyHandle = GoalHandle | GripperGoalHandle | HomingGoal


class _Running(NamedTuple):
    number: int
    controller: str
    handle: AnyHandle


class ControllerGoals:
    """The goals that run, and the last ones that ended. All methods are called between cycles.

    Attributes:
        ended: The last goals that ended, oldest first.
    """

    def __init__(self) -> None:
        self._last = 0
        self._running: list[_Running] = []
        self._ended: deque[m.EndedGoal] = deque(maxlen=ENDED)
        self.ended: tuple[m.EndedGoal, ...] = ()

    def add(self, controller: str, handle: AnyHandle) -> int:
        """Return the number of a new goal."""
        self._last += 1
        self._running.append(_Running(self._last, controller, handle))
        return self._last

    def number(self, handle: object) -> int | None:
        """Return the number of a goal that runs; None for another one."""
        return next((each.number for each in self._running if each.handle is handle), None)

    def running(self, controller: str, number: int) -> AnyHandle | None:
        """Return a goal of a controller; None if it has ended.

        Raises:
            InvalidArgumentError: The controller has no such goal.
        """
        found = next((each for each in self._running if each.number == number), None)
        if not 0 < number <= self._last or (found is not None and found.controller != controller):
            raise InvalidArgumentError(
                f"{controller} has no goal {number}; the last goal of all is {self._last}"
            )
        return None if found is None else found.handle

    def observe(self, supervisor: Supervisor) -> None:
        """Note the goals that ended in the cycle before."""
        over = [each for each in self._running if each.handle.done]
        if not over:
            return
        self._running = [each for each in self._running if not each.handle.done]
        self._ended.extend(_value(each, supervisor) for each in over)
        self.ended = tuple(self._ended)


def _value(ended: _Running, supervisor: Supervisor) -> m.EndedGoal:
    handle, text = ended.handle, ended.handle.text
    if handle.status is GoalStatus.ABORTED and supervisor.state is not FaultState.CLEAR:
        # The deactivation of its controller ended it, which is no reason for people.
        text = f"{text} {supervisor.faults[0]}".lstrip()
    result = handle.result if isinstance(handle, GripperGoalHandle) else None
    return m.EndedGoal(
        goal=ended.number,
        controller=ended.controller,
        status=handle.status,
        error_code=int(handle.error_code) if isinstance(handle, GoalHandle) else 0,
        text=text,
        gripper=None if result is None else gripper_value(result),
    )
