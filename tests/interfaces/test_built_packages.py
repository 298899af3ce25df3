"""The interface packages as clients use them, built with the ROS wheels by ``make ros2``."""

from __future__ import annotations

import json
import subprocess
from typing import Any

import pytest

from ros_environment import ros_environment, ros_python
from ros_type_hashes import DEFINITIONS, type_hash

MESSAGES = sorted(
    f"{path.parent.parent.name}/msg/{path.stem}" for path in DEFINITIONS.glob("*/msg/*")
)

HASHES = """
import importlib, json, sys, time
import rclpy

rclpy.init()
node = rclpy.create_node("hashes")
topics = {}
for number, name in enumerate(json.loads(sys.argv[1])):
    package, _, short = name.split("/")
    type_ = getattr(importlib.import_module(f"{package}.msg"), short)
    node.create_publisher(type_, f"topic_{number}", 1)
    topics[name] = f"/topic_{number}"
found = {}
while len(found) < len(topics):
    for name, topic in topics.items():
        for info in node.get_publishers_info_by_topic(topic):
            found[name] = str(info.topic_type_hash)
    time.sleep(0.05)
print(json.dumps(found))
"""

CALLS = """
import json, sys
import rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.executors import MultiThreadedExecutor
from control_msgs.action import FollowJointTrajectory
from controller_manager_msgs.srv import SwitchController
from bioscara_interfaces.action import MoveToPose
from bioscara_interfaces.srv import SavePose

rclpy.init()
node = rclpy.create_node("calls")

def switch(request, response):
    response.ok = request.strictness == SwitchController.Request.STRICT
    response.message = ", ".join(request.activate_controllers)
    return response

def save(request, response):
    response.success, response.message = True, request.pose.name
    response.code = len(request.pose.pose)
    return response

def follow(goal):
    feedback = FollowJointTrajectory.Feedback(joint_names=["j1"], index=3)
    goal.publish_feedback(feedback)
    goal.succeed()
    return FollowJointTrajectory.Result(error_string=goal.request.trajectory.joint_names[0])

node.create_service(SwitchController, "switch", switch)
node.create_service(SavePose, "save", save)
server = ActionServer(node, FollowJointTrajectory, "follow", follow)
client = ActionClient(node, FollowJointTrajectory, "follow")
executor = MultiThreadedExecutor()
executor.add_node(node)

def done(future):
    executor.spin_until_future_complete(future, 30)
    return future.result()

def call(type_, name, request):
    asked = node.create_client(type_, name)
    assert asked.wait_for_service(30)
    return done(asked.call_async(request))

switched = call(SwitchController, "switch", SwitchController.Request(
    activate_controllers=["a", "b"], strictness=2))
saved = SavePose.Request()
saved.pose.name = "tray"
saved = call(SavePose, "save", saved)
assert client.wait_for_server(30)
goal = FollowJointTrajectory.Goal()
goal.trajectory.joint_names = ["j1"]
seen = []
handle = done(client.send_goal_async(goal, lambda m: seen.append(m.feedback.index)))
result = done(handle.get_result_async()).result
print(json.dumps([switched.ok, switched.message, saved.success, saved.code, saved.message,
                  result.error_string, MoveToPose.Goal().velocity_scaling]))
"""


@pytest.fixture(scope="module")
def client() -> object:
    python = ros_python()

    def run(script: str, *arguments: str) -> object:
        done = subprocess.run(
            [python, "-c", script, *arguments],
            check=False, capture_output=True, text=True, timeout=100,
            env=ros_environment(),
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert not done.stderr
        return json.loads(done.stdout)

    return run


def test_the_types_that_are_advertised_have_the_hashes_of_their_definitions(client: Any) -> None:
    expected = {name: f"RIHS01_{type_hash(name)}" for name in MESSAGES}
    assert client(HASHES, json.dumps(MESSAGES)) == expected


@pytest.mark.timeout(400)
def test_services_and_actions_are_served_and_called(client: Any) -> None:
    assert client(CALLS) == [True, "a, b", True, 0, "tray", "j1", 1.0]
