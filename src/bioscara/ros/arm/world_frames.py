"""The bodies around a simulated arm: their frames, and markers for RViz."""

from __future__ import annotations

from typing import Any

from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from bioscara.api import messages as m
from bioscara.api.values import body_transform, placed
from bioscara.physics.bodies import BodyPose
from bioscara.remote.remote_simulation import RemoteSimulation
from bioscara.ros import messages
from bioscara.ros.arm.robot_frames import LATCHED
from bioscara.ros.arm_time import ArmTime

BODIES = "bodies"
"""Name of the topic with the markers."""
_ALL = 1.0
"""Time between two messages with the frames of all bodies [s], for programs that begin later."""


class WorldFrames:
    """Publishes the frames of bodies that moved, and markers when bodies come or go."""

    def __init__(self, node: Any, time: ArmTime) -> None:
        self._node, self._time = node, time
        self._markers: Any = None
        self._frames: Any = None
        self._shown: m.BodyList | None = None
        self._last: m.WorldSample | None = None
        self._poses: dict[str, BodyPose] = {}
        self._due = 0.0

    def take(self, simulation: RemoteSimulation) -> None:
        """Publish the newest sample; it may ask the owner for the bodies.

        Raises:
            BioscaraError: The owner does not answer.
        """
        sample = simulation.newest
        if sample is None or sample is self._last:
            return
        self._last = sample
        if self._markers is None:
            # Not for an arm without a world, which has no such samples.
            self._markers = self._node.create_publisher(MarkerArray, BODIES, LATCHED)
            self._frames = self._node.create_publisher(TFMessage, "/tf", 100)
        bodies, time = simulation.body_list(sample), self._time.ros(sample.time)
        if bodies is not self._shown:
            self._shown, self._poses = bodies, {}
            self._markers.publish(messages.markers(time, bodies))
        if bodies.version != sample.version:
            return
        if not self._due - _ALL <= sample.time < self._due:
            self._due, self._poses = sample.time + _ALL, {}
        moved = [p for p in placed(bodies, sample) if self._poses.get(p.name) != p]
        self._poses.update({pose.name: pose for pose in moved})
        if moved:
            transforms = [messages.transform(time, body_transform(pose)) for pose in moved]
            self._frames.publish(TFMessage(transforms=transforms))

    def lose(self) -> None:
        """Take the markers away, as the owner is lost."""
        if self._shown is not None:
            self._shown = self._last = None
            self._markers.publish(messages.markers(0.0, None))
