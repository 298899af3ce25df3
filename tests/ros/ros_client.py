"""Clients of ROS 2 in one process, which does what lines on standard input say.

Run with the Python of the ROS wheels. Each line is a JSON object with ``op`` and arguments, and is
answered by one line; messages are objects with the names of their fields.
"""

from __future__ import annotations

import array
import importlib
import json
import sys
import threading
import time
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_system_default,
)

DISCOVERY = 20.0
"""Time in which a server, a publisher or a subscriber must be found [s]."""
SETTLING = 0.5
"""Time in which one that was found has found this one [s]."""


def type_of(name: str) -> Any:
    """Return a type, from ``package/kind/Name`` or ``package/Name``."""
    package, *kind, short = name.split("/")
    return getattr(importlib.import_module(f"{package}.{kind[0] if kind else 'msg'}"), short)


def filled(message: Any, values: dict[str, Any]) -> Any:
    """Fill a message from an object; ``{"now": s}`` is a time from now on."""
    types = message.get_fields_and_field_types()
    for name, value in values.items():
        kind, field = types[name], getattr(message, name)
        if isinstance(value, dict) and set(value) == {"now"}:
            nanoseconds = time.time_ns() + round(1e9 * value["now"])
            field.sec, field.nanosec = divmod(nanoseconds, 10**9)
        elif hasattr(field, "get_fields_and_field_types"):
            filled(field, value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            made = type_of(kind.partition("<")[2].partition(">")[0].partition(",")[0])
            setattr(message, name, [filled(made(), each) for each in value])
        else:
            setattr(message, name, value)
    return message


def plain(value: Any) -> Any:
    """Return a value of a message as JSON has it."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return value[0]
    if isinstance(value, list | tuple | array.array) or hasattr(value, "tolist"):
        return [plain(each) for each in value]
    return value


def quality(words: str) -> QoSProfile:
    """Return a quality of service: of words such as ``reliable latched depth=1``."""
    if words == "system_default":
        return qos_profile_system_default
    given = words.split()
    depth = [int(word.removeprefix("depth=")) for word in given if word.startswith("depth=")]
    return QoSProfile(
        depth=depth[0] if depth else 10,
        reliability=ReliabilityPolicy.BEST_EFFORT
        if "best_effort" in given
        else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL
        if "latched" in given
        else DurabilityPolicy.VOLATILE,
    )


def wait(condition: Any, timeout: float, what: str) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError(f"not within {timeout:g} s: {what}")
        time.sleep(0.002)


class Clients:
    """The clients."""

    def __init__(self) -> None:
        rclpy.init()
        self.node = Node("test_clients")
        self.executor = MultiThreadedExecutor(4)
        self.executor.add_node(self.node)
        self.services: dict[str, Any] = {}
        self.publishers: dict[str, Any] = {}
        self.actions: dict[str, Any] = {}
        self.heard_by: dict[str, list[tuple[float, Any]]] = {}
        self.subscriptions: dict[str, Any] = {}
        self.streams: dict[str, Any] = {}
        self.goals: list[dict[str, Any]] = []
        self.spinning = threading.Thread(target=self.executor.spin)
        self.spinning.start()

    def close(self) -> None:
        """End so that ROS informs the others; else they find each other late for some seconds."""
        self.executor.shutdown()
        self.spinning.join()
        self.node.destroy_node()
        rclpy.shutdown()

    def _begin(self, type: str, name: str, request: dict[str, Any]) -> Any:  # noqa: A002
        if name not in self.services:
            self.services[name] = self.node.create_client(
                type_of(type), name, qos_profile=QoSProfile(history=HistoryPolicy.KEEP_ALL)
            )
        client = self.services[name]
        wait(client.service_is_ready, DISCOVERY, name)
        return client.call_async(filled(type_of(type).Request(), request))

    def calls(self, calls: list[dict[str, Any]], timeout: float = 20.0) -> Any:
        """Call services, all at once; return their answers and the durations."""
        begin = time.monotonic()
        futures = [self._begin(**call) for call in calls]
        answers = []
        for call, future in zip(calls, futures, strict=True):
            wait(future.done, timeout, call["name"])
            answers.append(plain(future.result()))
        return {"answers": answers, "took": time.monotonic() - begin}

    def publish(
        self,
        type: str,  # noqa: A002
        topic: str,
        message: dict[str, Any],
        qos: str = "reliable depth=1",
        times: int = 1,
        period: float = 0.0,
    ) -> Any:
        """Publish a message, once there is a subscriber."""
        is_new = topic not in self.publishers
        if is_new:
            made = self.node.create_publisher(type_of(type), topic, quality(qos))
            self.publishers[topic] = made
        publisher = self.publishers[topic]
        wait(lambda: publisher.get_subscription_count() > 0, DISCOVERY, f"subscriber of {topic}")
        if is_new:
            # A subscriber that asks for best effort gets nothing before it has found the publisher,
            # too, which cannot be seen from here.
            time.sleep(SETTLING)
        filled_in = filled(type_of(type)(), message)
        for _ in range(times):
            publisher.publish(filled_in)
            time.sleep(period)

    def play(
        self,
        type: str,  # noqa: A002
        topic: str,
        messages: list[dict[str, Any]],
        period: float,
    ) -> Any:
        """Publish messages, one each period."""
        self.publish(type, topic, messages[0])
        begin, made = time.monotonic(), [filled(type_of(type)(), each) for each in messages[1:]]
        for number, message in enumerate(made, 1):
            time.sleep(max(begin + number * period - time.monotonic(), 0.0))
            self.publishers[topic].publish(message)

    def stream(self, topic: str, values: list[float], step: float, period: float) -> Any:
        """Begin to publish numbers, of which the first grows by a step each time."""
        message: dict[str, Any] = {"data": values}
        self.publish("std_msgs/Float64MultiArray", topic, message)
        sent = [values]
        ended = threading.Event()

        def run() -> None:
            while not ended.wait(period):
                sent.append([sent[-1][0] + step, *values[1:]])
                self.publishers[topic].publish(type_of("std_msgs/Float64MultiArray")(data=sent[-1]))

        thread = threading.Thread(target=run, daemon=True)
        self.streams[topic] = (ended, thread, sent)
        thread.start()

    def streamed(self, topic: str) -> Any:
        """Return the commands of a stream so far."""
        return self.streams[topic][2][-1]

    def end_stream(self, topic: str) -> Any:
        """End a stream; return its last command."""
        ended, thread, sent = self.streams.pop(topic)
        ended.set()
        thread.join()
        return sent[-1]

    def listen(self, type: str, topic: str, qos: str = "reliable") -> Any:  # noqa: A002
        """Begin to listen to a topic."""
        heard = self.heard_by.setdefault(topic, [])
        if topic not in self.subscriptions:
            self.subscriptions[topic] = self.node.create_subscription(
                type_of(type),
                topic,
                lambda message: heard.append((time.monotonic(), message)),
                quality(qos),
            )

    def forget(self, topic: str) -> Any:
        """Forget the messages so far."""
        self.heard_by[topic].clear()

    def silence(self, topic: str) -> Any:
        """End listening to a topic."""
        self.node.destroy_subscription(self.subscriptions.pop(topic))
        del self.heard_by[topic]

    def heard(self, topic: str, count: int = 1, timeout: float = DISCOVERY) -> Any:
        """Return the messages so far, at least so many, with the times."""
        messages = self.heard_by[topic]
        wait(lambda: len(messages) >= count, timeout, f"{count} messages on {topic}")
        return [[when, plain(message)] for when, message in list(messages)]

    def goal(self, type: str, name: str, goal: dict[str, Any]) -> Any:  # noqa: A002
        """Send a goal; return its number, or none if it was rejected."""
        if name not in self.actions:
            self.actions[name] = ActionClient(self.node, type_of(type), name)
        client = self.actions[name]
        wait(client.server_is_ready, DISCOVERY, name)
        feedback: list[tuple[float, Any]] = []
        future = client.send_goal_async(
            filled(type_of(type).Goal(), goal),
            feedback_callback=lambda each: feedback.append((time.monotonic(), each.feedback)),
        )
        wait(future.done, DISCOVERY, f"answer of {name}")
        handle = future.result()
        if not handle.accepted:
            return None
        known = {"handle": handle, "feedback": feedback, "at": None}
        result = handle.get_result_async()
        result.add_done_callback(lambda _: known.update(at=time.monotonic()))
        known["result"] = result
        self.goals.append(known)
        return len(self.goals) - 1

    def result(self, number: int, timeout: float = 60.0) -> Any:
        """Return how a goal ended."""
        known = self.goals[number]
        wait(lambda: known["at"] is not None, timeout, f"the end of goal {number}")
        answer = known["result"].result()
        return {
            "status": answer.status,
            "result": plain(answer.result),
            "at": known["at"],
            "feedback": [[when, plain(each)] for when, each in known["feedback"]],
        }

    def cancel(self, number: int) -> Any:
        """Cancel a goal; return the number of goals that are cancelled."""
        future = self.goals[number]["handle"].cancel_goal_async()
        wait(future.done, DISCOVERY, "the answer to a cancel")
        return {"cancelling": len(future.result().goals_canceling), "at": time.monotonic()}

    def graph(self) -> Any:
        """Return the names of nodes, services and topics."""
        return {
            "nodes": sorted(
                f"{space.rstrip('/')}/{name}"
                for name, space in self.node.get_node_names_and_namespaces()
            ),
            "services": dict(self.node.get_service_names_and_types()),
            "topics": dict(self.node.get_topic_names_and_types()),
        }

    def publishers_of(self, topic: str) -> Any:
        """Return reliability and durability of the publishers of a topic."""
        wait(lambda: self.node.count_publishers(topic) > 0, DISCOVERY, f"publisher of {topic}")
        return [
            {
                "reliability": info.qos_profile.reliability.name,
                "durability": info.qos_profile.durability.name,
            }
            for info in self.node.get_publishers_info_by_topic(topic)
        ]


def main() -> None:
    """Carry out the requests in the lines."""
    clients = Clients()
    for line in sys.stdin:
        words = json.loads(line)
        try:
            answer = {"answer": getattr(clients, words.pop("op"))(**words)}
        except Exception as error:  # noqa: BLE001  raised by the test
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), flush=True)  # noqa: T201  for the test
    clients.close()


if __name__ == "__main__":
    main()
