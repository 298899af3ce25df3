"""The joint state broadcaster: states of joints, and of all their interfaces."""

from __future__ import annotations

import math
from collections.abc import Sequence

from control_msgs.msg import DynamicJointState
from rclpy.qos import qos_profile_system_default
from sensor_msgs.msg import JointState

from bioscara.api import messages as m
from bioscara.ros import messages
from bioscara.ros.controllers.controller_node import ControllerNode

_FIELDS = ("position", "velocity", "effort")
"""Interfaces that ``joint_states`` has."""


class BroadcasterNode(ControllerNode):
    """The node of a joint state broadcaster."""

    def create(self) -> None:
        """Create the topics, below its own name if ``use_local_topics`` is set."""
        given = self.parameters()
        where = "~/" if given.get("use_local_topics") else ""
        self._frame = str(given.get("frame_id", "base_link"))
        described = self.bridge.description
        joints: Sequence[str] = given.get("joints") or tuple(described.joints)
        kinds: Sequence[str] = given.get("interfaces") or ()
        self._wanted = {described.owners(joint): joint for joint in joints}
        self._kinds = frozenset(kinds)
        self._extra = tuple(given.get("extra_joints") or ())
        self._states = self.publisher(
            JointState, f"{where}joint_states", qos_profile_system_default
        )
        self._dynamic = None
        if given.get("publish_dynamic_joint_states", True):
            self._dynamic = self.publisher(
                DynamicJointState, f"{where}dynamic_joint_states", qos_profile_system_default
            )

    def publish(self, sample: m.ControllersSample) -> None:
        """Publish the states of a sample."""
        values: dict[str, dict[str, float]] = {}
        for name, value in zip(sample.state_names, sample.states, strict=True):
            joint, _, kind = name.partition("/")
            if joint in self._wanted and (not self._kinds or kind in self._kinds):
                values.setdefault(self._wanted[joint], {})[kind] = value
        time = self.bridge.time.ros(sample.time)
        joints = [joint for joint, each in values.items() if not each.keys().isdisjoint(_FIELDS)]
        zeros = [0.0] * len(self._extra)
        fields = [
            [values[joint].get(kind, math.nan) for joint in joints] + zeros for kind in _FIELDS
        ]
        names = [*joints, *self._extra]
        self._states.publish(messages.joint_state(time, self._frame, names, fields))
        if self._dynamic is not None:
            for joint in self._extra:
                values[joint] = {"position": 0.0, "velocity": 0.0, "effort": 0.0}
            self._dynamic.publish(messages.dynamic_joint_state(time, self._frame, values))
