#!/usr/bin/env python3
"""Home the arm and move it, as a client of ROS 2, with the calls of the spawner and ``ros2``.

Needs ``bioscara ros`` with the usual controllers, which is that without arguments of ROS:

    make ros2
    .venv-ros2/bin/bioscara ros --bus sim
    .venv-ros2/bin/python examples/ros2/first_motion.py     # in another terminal
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import rclpy
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import DynamicInterfaceGroupValues, DynamicJointState, InterfaceValue
from controller_manager_msgs.srv import (
    ConfigureController,
    ListControllers,
    LoadController,
    SetHardwareComponentState,
    SwitchController,
)
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.qos import qos_profile_system_default
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

MANAGER = "/controller_manager"
BROADCASTER, HOMING, TRAJECTORY = (
    "joint_state_broadcaster",
    "homing_controller",
    "position_joint_trajectory_controller",
)
JOINTS = ("j1", "j2", "j3", "j4")
HOMING_ORDER = (("j2", 1.0), ("j1", -1.0), ("j4", 1.0), ("j3", 1.0))
"""Joints in the order in which they can be homed, with the direction of the end stop."""
OPEN_ELBOW = 1.2
"""Position of j3 in which the hand can meet nothing [rad]."""
GOAL = (0.3, 0.2, 0.8, -0.5)
"""Where the arm ends [rad, m, rad, rad]."""


class FirstMotion(Node):
    """Homes the arm and moves it to :data:`GOAL`."""

    def __init__(self) -> None:
        super().__init__("first_motion")
        self.homed: dict[str, bool] = {}
        self.positions: dict[str, float] = {}
        self.create_subscription(
            DynamicJointState, "/dynamic_joint_states", self._take_homed, qos_profile_system_default
        )
        self.create_subscription(JointState, "/joint_states", self._take_positions, 1)
        self._trigger = self.create_publisher(DynamicInterfaceGroupValues, f"/{HOMING}/commands", 1)
        self._follow = ActionClient(
            self, FollowJointTrajectory, f"/{TRAJECTORY}/follow_joint_trajectory"
        )

    def run(self) -> None:
        """Do it."""
        for name in (BROADCASTER, HOMING, TRAJECTORY):
            self.spawn(name)
        self.switch([BROADCASTER], [])
        self.activate("bioscara_arm")
        self.wait(lambda: len(self.homed) >= len(JOINTS), "the states of the joints")
        if not all(self.homed.values()):
            self.home()
        self.switch([TRAJECTORY], [HOMING])
        here = [self.positions[joint] for joint in JOINTS]
        here[2] = OPEN_ELBOW
        self.follow((tuple(here), 8.0), (GOAL, 16.0))

    def spawn(self, name: str) -> None:
        """Load a controller unless it is loaded, and configure it unless it is active."""
        listed = self.call(ListControllers, "list_controllers").controller
        states = {each.name: each.state for each in listed}
        if name not in states:
            self.call(LoadController, "load_controller", name=name)
        if states.get(name) != "active":
            self.call(ConfigureController, "configure_controller", name=name)

    def activate(self, component: str) -> None:
        """Energise the motors of a component; nothing moves."""
        request = SetHardwareComponentState.Request(name=component)
        request.target_state.label = "active"
        self.call(SetHardwareComponentState, "set_hardware_component_state", request)

    def switch(self, activate: list[str], deactivate: list[str]) -> None:
        """Change which controllers are active; those that are so already stay."""
        request = SwitchController.Request(
            activate_controllers=activate,
            deactivate_controllers=deactivate,
            strictness=SwitchController.Request.BEST_EFFORT,
        )
        self.call(SwitchController, "switch_controller", request)

    def home(self) -> None:
        """Home one joint after the other."""
        self.switch([HOMING], [TRAJECTORY])
        self.wait(lambda: self._trigger.get_subscription_count() > 0, "the homing controller")
        for joint, direction in HOMING_ORDER:
            if self.homed[joint]:
                continue
            self.get_logger().info(f"homing {joint}")
            value = InterfaceValue(interface_names=["home"], values=[direction])
            self._trigger.publish(
                DynamicInterfaceGroupValues(interface_groups=[joint], interface_values=[value])
            )
            self.wait(lambda joint=joint: self.homed[joint], f"{joint} to be homed", 300.0)  # type: ignore[misc]

    def follow(self, *points: tuple[tuple[float, ...], float]) -> None:
        """Follow a trajectory through points, each with its time [s]."""
        goal = FollowJointTrajectory.Goal()
        goal.trajectory.joint_names = list(JOINTS)
        for positions, at in points:
            point = JointTrajectoryPoint(positions=positions, velocities=[0.0] * len(JOINTS))
            point.time_from_start.sec = int(at)
            goal.trajectory.points.append(point)
        self.wait(self._follow.server_is_ready, "the trajectory action")
        accepted = self._follow.send_goal_async(goal)
        self.wait(accepted.done, "the answer to the goal")
        if not accepted.result().accepted:
            raise SystemExit("the goal was rejected; the log of the node says why")
        self.get_logger().info("moving")
        ended = accepted.result().get_result_async()
        try:
            self.wait(ended.done, "the end of the motion", points[-1][1] + 30.0)
        except KeyboardInterrupt:
            # Otherwise the controller would follow the goal to its end.
            cancelled = accepted.result().cancel_goal_async()
            self.wait(cancelled.done, "the answer to the cancel")
            raise
        result = ended.result().result
        if result.error_code != result.SUCCESSFUL:
            raise SystemExit(f"the motion failed: {result.error_string}")
        self.get_logger().info("there")

    def call(self, kind: Any, service: str, request: Any = None, **fields: Any) -> Any:
        """Call a service of the controller manager, and end the program if it is refused."""
        client = self.create_client(kind, f"{MANAGER}/{service}")
        self.wait(client.service_is_ready, f"{MANAGER}/{service}: is bioscara ros running?")
        future = client.call_async(kind.Request(**fields) if request is None else request)
        self.wait(future.done, f"the answer of {service}")
        self.destroy_client(client)
        answer = future.result()
        if not getattr(answer, "ok", True):
            reason = getattr(answer, "message", "") or "the log of the node says why"
            raise SystemExit(f"{service} was refused: {reason}")
        return answer

    def wait(self, condition: Callable[[], bool], what: str, limit: float = 20.0) -> None:
        """Take messages until a condition holds, and end the program if it does not in time."""
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end:
                raise SystemExit(f"waited {limit:g} s in vain for {what}")
            rclpy.spin_once(self, timeout_sec=0.1)

    def _take_homed(self, message: Any) -> None:
        for joint, values in zip(message.joint_names, message.interface_values, strict=True):
            known = dict(zip(values.interface_names, values.values, strict=True))
            if "home" in known:
                self.homed[joint] = known["home"] > 0.0

    def _take_positions(self, message: Any) -> None:
        self.positions.update(zip(message.name, message.position, strict=True))


def main() -> int:
    """Run it, and return the exit status."""
    # Without a handler of rclpy's own, so that a goal can still be cancelled after Ctrl-C.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = FirstMotion()
    try:
        node.run()
    except KeyboardInterrupt:
        return 130
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
