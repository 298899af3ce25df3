"""Publishes numbers at 100 Hz, or receives them by the executor of the node.

    executor_program.py publish COUNT      publishes 0 to COUNT - 1, once there is a subscriber
    executor_program.py receive COUNT      prints the received messages, as JSON
    executor_program.py destroy COUNT      destroys COUNT nodes, and prints failures, as JSON

The callback of the receiver fails at the number 3.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from typing import Any

import rclpy
from control_msgs.action import ParallelGripperCommand
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.qos import qos_profile_system_default
from std_msgs.msg import Float64

from bioscara.ros.controllers.action_goals import GoalServer
from bioscara.ros.executor import NodeExecutor

TOPIC, PERIOD, FAILING, THREADS = "/numbers", 0.01, 3, 4


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
    executor = NodeExecutor(THREADS, node.context, lambda error: failures.append(repr(error)))
    executor.add_node(node)
    end = time.monotonic() + 30.0
    while time.monotonic() < end and (not numbers or numbers[-1] < count - 1):
        executor.spin_once(timeout_sec=1.0)
    executor.shutdown(timeout_sec=1.0)
    sys.stdout.write(json.dumps([numbers, failures]) + "\n")


def destroy(count: int) -> None:
    """Destroy nodes with topics and actions while the executor spins, as controllers are unloaded.

    Callbacks still wait for a thread when the executor is shut down.
    """
    # The threads change places at every step.
    sys.setswitchinterval(1e-6)
    node, ended = rclpy.create_node("manager"), threading.Event()
    publisher = node.create_publisher(Float64, TOPIC, qos_profile_system_default)
    node.create_timer(0.001, lambda: publisher.publish(Float64()))
    failures: list[str] = []
    executor = NodeExecutor(THREADS, node.context, lambda error: failures.append(repr(error)))
    executor.add_node(node)

    def spin() -> None:
        while not ended.is_set():
            try:
                executor.spin_once(timeout_sec=0.1)
            except Exception as error:  # noqa: BLE001
                failures.append(repr(error))

    spinning = threading.Thread(target=spin)
    spinning.start()
    for number in range(count):
        controller = rclpy.create_node(f"controller{number}")
        controller.create_subscription(Float64, TOPIC, lambda _: None, qos_profile_system_default)
        action = GoalServer(controller, ParallelGripperCommand, "~/gripper_cmd", print)
        executor.add_node(controller)
        time.sleep(PERIOD)
        action.destroy()
        executor.remove_node(controller)
        controller.destroy_node()
    busy = threading.Event()

    def wait() -> None:
        busy.set()
        time.sleep(PERIOD)

    # More than it has threads: the last ones begin when it is shut down.
    for _ in range(3 * THREADS):
        node.create_timer(0.0, wait, callback_group=ReentrantCallbackGroup())
    busy.wait()
    time.sleep(PERIOD)
    ended.set()
    executor.wake()
    spinning.join()
    executor.shutdown(timeout_sec=1.0)
    sys.stdout.write(json.dumps(failures) + "\n")


if __name__ == "__main__":
    rclpy.init()
    {"publish": publish, "receive": receive, "destroy": destroy}[sys.argv[1]](int(sys.argv[2]))
    rclpy.try_shutdown()
