"""A homing controller: its topic."""

from __future__ import annotations

from typing import Any

from control_msgs.msg import DynamicInterfaceGroupValues
from rclpy.qos import qos_profile_system_default

from bioscara.api import messages as m
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.ros import requests
from bioscara.ros.controllers.controller_node import ControllerNode

_WAITING = 10
"""Messages that wait: each may be for another joint."""


class HomingNode(ControllerNode):
    """The node of a single trigger controller."""

    def create(self) -> None:
        """Create the topic."""
        self.subscription(
            DynamicInterfaceGroupValues,
            "~/commands",
            self._trigger,
            qos_profile_system_default,
            waiting=_WAITING,
        )

    def report(self, ended: m.EndedGoal) -> None:
        """Report how a homing ended, as the topic has no answer."""
        if ended.status is GoalStatus.ABORTED:
            self.bridge.refuse(f"homing aborted: {ended.text}")
        else:
            self.node.get_logger().info(f"homing {ended.status.value} {ended.text}".rstrip())

    def _trigger(self, message: Any) -> None:
        def trigger() -> None:
            controllers = self.bridge.owner.robot.controllers
            for joint, command in requests.homing_commands(message, self.bridge.description):
                controllers.trigger(self.name, joint, command)

        self.bridge.attempt(f"{self.name}: cannot home", trigger)
