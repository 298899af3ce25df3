"""A gripper controller: its action."""

from __future__ import annotations

from typing import Any

from control_msgs.action import ParallelGripperCommand

from bioscara.api import messages as m
from bioscara.ros import messages, requests
from bioscara.ros.controllers.action_goals import ActionGoals
from bioscara.ros.controllers.controller_node import ControllerNode


class GripperNode(ControllerNode):
    """The node of a gripper controller."""

    def create(self) -> None:
        """Create the action."""
        ActionGoals(self, ParallelGripperCommand, "~/gripper_cmd", self._send, self._result)

    def _send(self, request: Any) -> int:
        goal = requests.gripper_goal(request, self.bridge.description)
        return self.bridge.owner.robot.controllers.move_gripper(self.name, goal)

    def _result(self, ended: m.EndedGoal) -> ParallelGripperCommand.Result:
        return messages.gripper_result(ended, str(self.parameters().get("joint", "")))
