"""Programs of ROS 2 that measure the node; run with the Python of the ROS wheels.

    ros_program.py publisher     publishes joint states at 100 Hz, as a bare program does
    ros_program.py client        listens, sends goals and streams commands

Each line of the input is a JSON list of a word and its arguments, and is answered by one line.
Times are those of the machine's monotonic clock [s], stamps are in seconds since 1970.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path
from typing import Any

import rclpy
from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_system_default
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectoryPoint

PERIOD = 0.01
"""Time between two messages [s]."""
JOINTS = ["j1", "j2", "j3", "j4"]


class Publisher:
    """Publishes joint states while it is on; the methods are the words."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(JointState, "/bare", qos_profile_system_default)
        self._node, self._timer = node, node.create_timer(PERIOD, self._publish)
        self._timer.cancel()

    def _publish(self) -> None:
        message = JointState(name=JOINTS, position=[0.0] * 4, velocity=[0.0] * 4, effort=[0.0] * 4)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)

    def on(self) -> None:
        """Begin."""
        self._timer.reset()

    def off(self) -> None:
        """Pause."""
        self._timer.cancel()


class Client:
    """Listens and commands; the methods are the words."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[str, Any] = {}
        self._actions: dict[str, Any] = {}

    def listen(self, topic: str, count: int, process: int) -> Any:
        """Listen to joint states.

        Returns:
            A stamp and the time of the callback for each of ``count`` messages, and the share of a
            core that a process uses in this time.
        """
        heard: list[tuple[float, float]] = []
        used: list[tuple[float, float]] = []
        done = threading.Event()
        # The first ones come late where the subscription is new.
        skipped = 50

        def receive(message: Any) -> None:
            moment = time.monotonic()
            stamp = message.header.stamp
            heard.append((stamp.sec + 1e-9 * stamp.nanosec, moment))
            if len(heard) == skipped:
                used.append((moment, _processor_time(process)))
            elif len(heard) == skipped + count:
                used.append((moment, _processor_time(process)))
                done.set()

        entity = self._node.create_subscription(
            JointState, topic, receive, qos_profile_system_default
        )
        if not done.wait(20.0 + 10.0 * PERIOD * count):
            raise TimeoutError(f"{len(heard)} messages on {topic}")
        self._node.destroy_subscription(entity)
        (begin, before), (end, after) = used
        share = (after - before) / (end - begin)
        return {"heard": heard[skipped : skipped + count], "share": share}

    def count(self, topic: str, seconds: float, process: int) -> Any:
        """Count messages; return a number and the memory of a process [byte] for each second."""
        number = 0

        def receive(_: bytes) -> None:
            nonlocal number
            number += 1

        entity = self._node.create_subscription(
            JointState, topic, receive, qos_profile_system_default, raw=True
        )
        rows = []
        for _ in range(round(seconds)):
            time.sleep(1.0)
            rows.append((number, _memory(process)))
        self._node.destroy_subscription(entity)
        return rows

    def goal(self, controller: str, positions: list[float], duration: float) -> Any:
        """Let a trajectory controller go to positions; return when this was sent."""
        if controller not in self._actions:
            name = f"/{controller}/follow_joint_trajectory"
            self._actions[controller] = ActionClient(self._node, FollowJointTrajectory, name)
            self._actions[controller].wait_for_server(20.0)
        goal = FollowJointTrajectory.Goal()
        point = JointTrajectoryPoint(positions=positions)
        point.time_from_start.nanosec = round(1e9 * duration)
        goal.trajectory.joint_names, goal.trajectory.points = JOINTS, [point]
        sent = time.monotonic()
        handle = _waited(self._actions[controller].send_goal_async(goal))
        if not handle.accepted:
            raise RuntimeError("the goal was rejected")
        _waited(handle.get_result_async())
        return sent

    def stream(self, controller: str, positions: list[float], step: float, count: int) -> Any:
        """Stream positions at 100 Hz, the first one growing; return times and first positions."""
        topic = f"/{controller}/commands"
        if topic not in self._publishers:
            made = self._node.create_publisher(Float64MultiArray, topic, qos_profile_system_default)
            self._publishers[topic] = made
        publisher = self._publishers[topic]
        while publisher.get_subscription_count() == 0:
            time.sleep(0.01)
        sent, first = [], positions[0]
        due = time.monotonic()
        for _ in range(count):
            due += PERIOD
            time.sleep(max(due - time.monotonic(), 0.0))
            first += step
            message = Float64MultiArray(data=[first, *positions[1:]])
            sent.append((time.monotonic(), first))
            publisher.publish(message)
        return sent


def _waited(future: Any) -> Any:
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    if not done.wait(20.0):
        raise TimeoutError("no answer of an action server")
    return future.result()


def _processor_time(process: int) -> float:
    """Return the time that the threads of a process have computed [s]."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _memory(process: int) -> int:
    text = Path(f"/proc/{process}/status").read_text()
    return 1024 * int(text.split("VmRSS:")[1].split()[0])


def main(what: str) -> None:
    """Carry out the lines."""
    rclpy.init()
    node = Node(f"benchmark_{what}")
    program: Any = {"publisher": Publisher, "client": Client}[what](node)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spinning = threading.Thread(target=executor.spin)
    spinning.start()
    for line in sys.stdin:
        word, *arguments = json.loads(line)
        print(json.dumps(getattr(program, word)(*arguments)), flush=True)
    # A program that only exits delays for seconds that others find each other.
    executor.shutdown()
    spinning.join()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main(sys.argv[1])
