"""Goals of an action that a controller of the owner carries out."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

from bioscara.api import messages as m
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.errors import BioscaraError
from bioscara.ros.controllers.controller_node import ControllerNode

_FINISH_WAIT, _SENDING = 1.0, 0.1
"""Longest time for goals to end once they were ended, and the time for sending results [s]."""
_CANCEL_WAIT = 1.0
"""Longest time between the end of a cancelled goal and its state in ROS [s]."""


class GoalServer(ActionServer):  # type: ignore[misc]
    """An action server that may be destroyed while an executor collects what it waits for.

    rclpy leaves entities out that were destroyed meanwhile, except servers of actions.
    """

    _destroyed = False

    def destroy(self) -> None:
        """Destroy it."""
        self._destroyed = True
        super().destroy()

    def add_to_wait_set(self, wait_set: Any) -> None:
        """Add it, unless it was destroyed."""
        if not self._destroyed:
            super().add_to_wait_set(wait_set)

    def is_ready(self, wait_set: Any) -> bool:
        """Return whether there is something to do; there is nothing once it was destroyed."""
        return not self._destroyed and bool(super().is_ready(wait_set))


class _Sent(NamedTuple):
    number: int
    generation: int


class ActionGoals:
    """An action server whose goals go to a controller.

    Args:
        controller: The controller.
        kind: Type of the action.
        name: Its name.
        send: Sends a goal to the owner and returns its number; raises a BioscaraError to reject it.
        result: Returns the result for an end.

    Attributes:
        running: Handles of the goals that run, by their numbers.
        used: Whether a goal was ever accepted.
    """

    def __init__(
        self,
        controller: ControllerNode,
        kind: Any,
        name: str,
        send: Callable[[Any], int],
        result: Callable[[m.EndedGoal], Any],
    ) -> None:
        self._controller, self._send, self._result = controller, send, result
        self._log = controller.node.get_logger()
        self.running: dict[int, Any] = {}
        self.used = False
        # Of requests that were accepted, until their handles exist; then by the handles' ids.
        self._accepted: dict[int, _Sent] = {}
        self._sent: dict[bytes, _Sent] = {}
        self._cancelled: set[int] = set()
        # Goals must not overtake one another; those that run are not in the group.
        server = GoalServer(
            controller.node,
            kind,
            name,
            self._execute,
            callback_group=MutuallyExclusiveCallbackGroup(),
            goal_callback=self._accept,
            handle_accepted_callback=self._begin,
            cancel_callback=self._cancel,
        )
        controller.own(server, self.finish)

    def finish(self) -> None:
        """Wait until the goals that run have ended, and their results are sent."""
        end = time.monotonic() + _FINISH_WAIT
        while self._sent and time.monotonic() < end:
            time.sleep(0.005)
        if self.used:
            # By the executor, after the end of its callback.
            time.sleep(_SENDING)

    def _accept(self, request: Any) -> GoalResponse:
        goals = self._controller.bridge.goals
        generation = goals.generation
        try:
            number = self._send(request)
        except BioscaraError as error:
            controller = self._controller
            controller.bridge.refuse(f"{controller.name}: goal rejected: {error}")
            return GoalResponse.REJECT
        self._accepted[id(request)] = _Sent(number, generation)
        return GoalResponse.ACCEPT

    def _begin(self, handle: Any) -> None:
        self.used = True
        sent = self._accepted.pop(id(handle.request))
        self._sent[_key(handle)] = sent
        self.running[sent.number] = handle
        handle.execute()

    def _cancel(self, handle: Any) -> CancelResponse:
        sent = self._sent.get(_key(handle))
        if sent is not None:
            self._cancelled.add(sent.number)
            try:
                owner = self._controller.bridge.owner
                owner.robot.controllers.cancel(self._controller.name, sent.number)
            except BioscaraError as error:
                self._log.warning(f"goal {sent.number} cannot be cancelled: {error}")
        return CancelResponse.ACCEPT

    def _execute(self, handle: Any) -> Any:
        sent = self._sent[_key(handle)]
        try:
            ended = self._controller.bridge.goals.wait(sent.number, sent.generation)
        finally:
            self.running.pop(sent.number, None)
            del self._sent[_key(handle)]
            requested = sent.number in self._cancelled
            self._cancelled.discard(sent.number)
        if ended.text:
            self._log.info(ended.text)
        if ended.status is GoalStatus.SUCCEEDED:
            handle.succeed()
        elif ended.status is GoalStatus.CANCELED and requested and _is_cancelled(handle):
            handle.canceled()
        else:
            # ROS has no goal that is cancelled without a request for that.
            handle.abort()
        return self._result(ended)


def _key(handle: Any) -> bytes:
    return bytes(handle.goal_id.uuid)


def _is_cancelled(handle: Any) -> bool:
    """Return whether a client has cancelled the goal; its state follows the answer to that."""
    end = time.monotonic() + _CANCEL_WAIT
    while not handle.is_cancel_requested and time.monotonic() < end:
        time.sleep(0.001)
    return bool(handle.is_cancel_requested)
