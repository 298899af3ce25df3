"""The description and the frames of the robot, as robot_state_publisher has them."""

from __future__ import annotations

from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from bioscara.api import messages as m
from bioscara.hardware.link_frames import LinkFrames
from bioscara.ros import messages
from bioscara.ros.arm.description import RobotDescription
from bioscara.ros.arm_time import ArmTime

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
DESCRIPTION = "robot_description"
"""Name of the parameter and the topic with the description."""


class RobotFrames:
    """Publishes the description once, and the poses of links whose joints have positions."""

    def __init__(self, node: Any, description: RobotDescription, time: ArmTime) -> None:
        self._description, self._time = description, time
        self._frames = LinkFrames(description.urdf)
        self._text = node.create_publisher(String, DESCRIPTION, LATCHED)
        self._static = node.create_publisher(TFMessage, "/tf_static", LATCHED)
        self._moving = node.create_publisher(TFMessage, "/tf", 100)
        self._text.publish(String(data=description.text))
        now = 1e-9 * float(node.get_clock().now().nanoseconds)
        self._static.publish(
            TFMessage(transforms=[messages.transform(now, each) for each in self._frames.fixed])
        )

    def take(self, sample: m.ControllersSample) -> None:
        """Publish the frames of a sample."""
        positions = {}
        for name, value in zip(sample.state_names, sample.states, strict=True):
            joint, _, kind = name.partition("/")
            if kind == "position":
                positions[self._description.described(joint)] = value
        time = self._time.ros(sample.time)
        transforms = [messages.transform(time, each) for each in self._frames.at(positions)]
        if transforms:
            self._moving.publish(TFMessage(transforms=transforms))
