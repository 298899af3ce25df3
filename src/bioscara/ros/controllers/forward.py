"""A forward command controller: its topic."""

from __future__ import annotations

from typing import Any

from rclpy.qos import qos_profile_system_default
from std_msgs.msg import Float64MultiArray

from bioscara.ros.controllers.controller_node import ControllerNode


class ForwardNode(ControllerNode):
    """The node of a forward command controller."""

    def create(self) -> None:
        """Create the topic."""
        self.subscription(
            Float64MultiArray, "~/commands", self._command, qos_profile_system_default
        )

    def _command(self, message: Any) -> None:
        values, sent, limits = list(message.data), self.sent or {}, self.bridge.description.limits
        # Another number of values is for the owner to refuse.
        for joint, value in zip(sent.get("joints", ()), values, strict=False):
            if joint in limits:
                limits[joint].check(sent["interface_name"], value)
        self.bridge.owner.robot.controllers.command(self.name, values)
