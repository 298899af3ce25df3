"""Publishes numbers at 100 Hz, or receives them by the executor of the node.

    executor_program.py publish COUNT      publishes 0 to COUNT - 1, once there is a subscriber
    executor_program.py receive COUNT      prints the received messages, as JSON

The callback of the receiver fails at the number 3.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import qos_profile_system_default
from std_msgs.msg import Float64

from bioscara.ros.executor import NodeExecutor

TOPIC, PERIOD, FAILING = "/numbers", 0.01, 3


def publish(count: int) -> None:
    """Publish numbers, each at its time."""
    node = rclpy.create_node("numbers")
    publisher = node.create_publisher(Float64, TOPIC, qos_profile_system_default)
    while publisher.get_subscription_count() == 0:
        time.sleep(PERIOD)
    due = time.monotonic()
    for number in range(count):
        due += PERIOD
        time.sleep(max(due - time.monotonic(), 0.0))
        publisher.publish(Float64(data=float(number)))
    # The last ones are sent while the process exists.
    time.sleep(1.0)


def receive(count: int) -> None:
    """Receive numbers until the last one, at most 30 s."""
    node = rclpy.create_node("receiver")
    numbers: list[int] = []
    failures: list[str] = []

    def take(message: Any) -> None:
        numbers.append(int(message.data))
        if numbers[-1] == FAILING:
            raise ValueError("fails")
        # As the request to the owner does.
        time.sleep(0.0007)

    group = MutuallyExclusiveCallbackGroup()
    node.create_subscription(Float64, TOPIC, take, qos_profile_system_default, callback_group=group)
    executor = NodeExecutor(4, node.context, lambda error: failures.append(repr(error)))
    executor.add_node(node)
    end = time.monotonic() + 30.0
    while time.monotonic() < end and (not numbers or numbers[-1] < count - 1):
        executor.spin_once(timeout_sec=1.0)
    executor.shutdown(timeout_sec=1.0)
    sys.stdout.write(json.dumps([numbers, failures]) + "\n")


if __name__ == "__main__":
    rclpy.init()
    {"publish": publish, "receive": receive}[sys.argv[1]](int(sys.argv[2]))
    rclpy.try_shutdown()
