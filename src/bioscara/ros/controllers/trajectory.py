"""A trajectory controller: its action, its topics and its service."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTrajectoryControllerState, SpeedScalingFactor
from control_msgs.srv import QueryTrajectoryState
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_system_default
from trajectory_msgs.msg import JointTrajectory

from bioscara.api import messages as m
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    CHANGEABLE,
    JointTrajectoryParameters,
)
from bioscara.errors import BioscaraError
from bioscara.ros import messages, requests
from bioscara.ros.controllers import parameters
from bioscara.ros.controllers.action_goals import ActionGoals
from bioscara.ros.controllers.controller_node import ControllerNode
from bioscara.ros.controllers.parameter_names import described

_SCALING = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class TrajectoryNode(ControllerNode):
    """The node of a joint trajectory controller."""

    def create(self) -> None:
        """Create what ros2_controllers has."""
        joints = self.parameters().get("joints", ())
        every = described(JointTrajectoryParameters, tuple(joints))
        self.declare(each for each in every if _changeable(each.name))
        self._state = self.publisher(
            JointTrajectoryControllerState, "~/controller_state", qos_profile_system_default
        )
        self.subscription(
            JointTrajectory, "~/joint_trajectory", self._follow, qos_profile_system_default
        )
        # A factor holds until the next one, however late it comes.
        self.subscription(
            SpeedScalingFactor,
            "~/speed_scaling_input",
            self._scale,
            _SCALING,
            patience=math.inf,
        )
        self.service(QueryTrajectoryState, "~/query_state", self._query)
        self._actions = ActionGoals(
            self,
            FollowJointTrajectory,
            "~/follow_joint_trajectory",
            self._send,
            messages.trajectory_result,
        )
        self._period = 1.0 / float((self.sent or {}).get("action_monitor_rate", 20.0))
        self._due = 0.0

    def publish(self, sample: m.ControllersSample) -> None:
        """Publish the controller's state, and feedback at the rate of the parameters."""
        bridge = self.bridge
        for status in sample.controllers:
            if isinstance(status, m.TrajectoryStatus) and status.name == self.name:
                time = bridge.time.ros(status.time)
                self._state.publish(messages.trajectory_state(time, status, bridge.description))
                handle = self._actions.running.get(status.goal or 0)
                if handle is not None and sample.time >= self._due:
                    # Half a cycle early rather than a whole one late.
                    self._due = max(self._due + self._period, sample.time + 0.5 * self._period)
                    feedback = messages.trajectory_feedback(time, status, bridge.description)
                    handle.publish_feedback(feedback)

    def changed(self, parameters_set: Mapping[str, Any]) -> str:
        """Apply parameters that may change at any time."""
        others = {name: each for name, each in parameters_set.items() if not _changeable(name)}
        if others and (reason := super().changed(others)):
            return reason
        groups = {_group(name) for name in parameters_set.keys() - others.keys()}
        every = {**self.parameters(), **parameters_set}
        flat = {name: value for name, value in every.items() if _group(name) in groups}
        if flat:
            values = self.bridge.description.owners_value(parameters.nested(flat))
            self.bridge.owner.command(
                lambda robot: robot.controllers.set_parameters(self.name, values)
            )
        return ""

    def _send(self, request: Any) -> int:
        bridge = self.bridge
        goal = requests.trajectory_goal(request, bridge.description, bridge.time)
        return bridge.owner.robot.controllers.follow(self.name, goal)

    def _follow(self, message: Any) -> None:
        bridge = self.bridge
        trajectory = requests.joint_trajectory(message, bridge.description, bridge.time)
        bridge.owner.robot.controllers.stream(self.name, trajectory)

    def _scale(self, message: Any) -> None:
        self.bridge.owner.robot.controllers.set_scaling(self.name, message.factor)

    def _query(self, request: Any, response: Any) -> Any:
        bridge = self.bridge
        try:
            time = bridge.time.arms(requests.seconds(request.time))
            state = bridge.owner.robot.controllers.query(self.name, time)
        except BioscaraError as error:
            response.success, response.message = False, str(error)
            return response
        response.success = True
        response.name = list(self.parameters().get("joints", ()))
        response.position = list(state.positions)
        response.velocity = list(state.velocities)
        response.acceleration = list(state.accelerations)
        return response


def _group(name: str) -> str:
    return name.partition(".")[0]


def _changeable(name: str) -> bool:
    return _group(name) in CHANGEABLE
