"""Homing by the topic of the panel, the gripper's action, and streams of commands."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

from ros.bringup_controllers import (
    BROADCASTER,
    GRIP,
    GRIPPER,
    HOMING,
    VELOCITY,
    clear,
    energise,
    go_home,
)
from ros.rig import ABORTED, CANCELED, MANAGER, SUCCEEDED, Rig, Ros, rig
from simulated import ARM

pytestmark = pytest.mark.ros
JAWS = "bioscara_gripper_128"
STREAM = "stream_controller"


@pytest.fixture(autouse=True)
def cleared(ros: Ros) -> Iterator[None]:
    yield
    clear(ros)


def grip(ros: Ros, *positions: float, **fields: list[float]) -> Any:
    """Send a goal; return its number, or none if it was rejected."""
    command = {"name": ["gripper"], "position": list(positions), **fields}
    return ros.do("goal", type=GRIP, name=f"/{GRIPPER}/gripper_cmd", goal={"command": command})


def closed(ros: Ros, number: int | None) -> Any:
    """Return how a goal ended."""
    assert number is not None, "the goal was rejected"
    return ros.do("result", number=number)


def test_rule_71_a_gripper_goal_reaches_its_width(ros: Ros) -> None:
    energise(ros, JAWS)
    ros.spawn(GRIPPER)
    for width in (0.08, 0.05):
        end = closed(ros, grip(ros, width))
        assert end["status"] == SUCCEEDED
        assert end["result"]["reached_goal"]
        assert not end["result"]["stalled"]
        assert end["result"]["state"]["name"] == ["gripper"]
        assert end["result"]["state"]["position"][0] == pytest.approx(width, abs=0.011)
        assert end["feedback"] == []


def test_rule_71_gripper_goals_are_rejected_replaced_and_cancelled(ros: Ros, ros_rig: Rig) -> None:
    energise(ros, JAWS)
    assert ros.manager("load_controller", name=GRIPPER)["ok"]
    # Slow jaws: a goal runs for a second.
    assert ros.set_parameters(f"/{GRIPPER}", velocity_limit=0.05)[0]["successful"]
    ros.spawn(GRIPPER)
    assert grip(ros) is None
    ros_rig.logged("0 positions in the goal")
    assert grip(ros, 0.05, 0.06) is None
    assert grip(ros, 0.5) is None
    ros_rig.logged("position 0.5 m is outside")
    assert closed(ros, grip(ros, 0.05))["status"] == SUCCEEDED
    first = grip(ros, 0.1)
    second = grip(ros, 0.05)
    # In ROS a goal that no client cancelled cannot end as cancelled.
    assert closed(ros, first)["status"] == ABORTED
    assert closed(ros, second)["status"] == SUCCEEDED
    third = grip(ros, 0.1)
    assert ros.do("cancel", number=third)["cancelling"] == 1
    assert closed(ros, third)["status"] == CANCELED
    assert ros.switch((), [GRIPPER])["ok"]
    assert grip(ros, 0.05) is None


def test_arm_and_gripper_move_at_the_same_time(ros: Ros) -> None:
    energise(ros, "bioscara_arm", JAWS)
    ros.spawn(VELOCITY)
    ros.spawn(GRIPPER)
    number = grip(ros, 0.05)
    go_home(ros)
    assert closed(ros, number)["status"] == SUCCEEDED
    assert ros.states() == {VELOCITY: "active", GRIPPER: "active"}


def test_forwarded_velocities_move_the_joints_as_long_as_they_last(ros: Ros) -> None:
    energise(ros)
    ros.set_parameters(MANAGER, **{f"{STREAM}__type": TYPE})
    assert ros.manager("load_controller", name=STREAM)["ok"]
    ros.set_parameters(f"/{STREAM}", joints=["j1", "j4"], interface_name="velocity")
    ros.spawn(BROADCASTER)
    ros.spawn(STREAM)
    topic = f"/{STREAM}/commands"
    ros.do("listen", type="sensor_msgs/JointState", topic="/joint_states", qos="best_effort")
    before = ros.do("heard", topic="/joint_states", count=2)[-1][1]["position"]
    kind = "std_msgs/Float64MultiArray"
    ros.do("publish", type=kind, topic=topic, message={"data": [0.1, -0.1]}, times=50, period=0.01)
    still = {"data": [0.0, 0.0]}
    ros.do("publish", type=kind, topic=topic, message=still, times=5, period=0.05)
    # Of no use for two joints: it is left out.
    ros.do("publish", type=kind, topic=topic, message={"data": [0.1]})
    ros.do("forget", topic="/joint_states")
    after = ros.do("heard", topic="/joint_states", count=40)[-1][1]
    ros.do("silence", topic="/joint_states")
    assert after["position"][0] > before[0] + 0.03
    assert after["position"][3] < before[3] - 0.03
    assert abs(after["velocity"][0]) < 0.01
    ros.spawn(VELOCITY, active=False)
    assert ros.switch([VELOCITY], [STREAM])["ok"]
    go_home(ros)


TYPE = "forward_command_controller/ForwardCommandController"


def home(ros: Ros, joint: str, command: float) -> None:
    """Publish a command as the panel does."""
    message = {
        "interface_groups": [joint],
        "interface_values": [{"interface_names": ["home"], "values": [command]}],
    }
    kind = "control_msgs/DynamicInterfaceGroupValues"
    ros.do("publish", type=kind, topic=f"/{HOMING}/commands", message=message)


def reported(ros: Ros, text: str, *, there: bool = True) -> int:
    """Wait until the diagnostics of the manager have a text, or not; return their level."""
    for _ in range(5):
        ros.do("forget", topic="/diagnostics")
        (_, message), *_ = ros.do("heard", topic="/diagnostics", count=1)
        (status,) = (
            each for each in message["status"] if each["name"].endswith("Manager Activity")
        )
        if (text in status["message"]) is there:
            level: int = status["level"]
            return level
    raise AssertionError(status)


def test_what_is_refused_to_the_panel_is_in_log_and_diagnostics(ros: Ros, ros_rig: Rig) -> None:
    """It shows no answer of a service, and homing has none."""
    ros.do("listen", type="diagnostic_msgs/DiagnosticArray", topic="/diagnostics")
    ros.hardware("bioscara_arm", "inactive")
    ros.spawn(HOMING, active=False)
    assert not ros.switch([HOMING], strictness=1)["ok"]
    refused = "cannot switch: homing_controller cannot command j1/home: bioscara_arm is inactive; a"
    ros_rig.logged(refused)
    assert reported(ros, refused) >= 1
    energise(ros)
    reported(ros, refused, there=False)
    ros.spawn(HOMING)
    # Refused within the same second, each with a line in the log.
    for joint, command, text in (
        ("j3", -1.0, "j3: home command -1 leads away from its end stop; give a number above 0"),
        ("j9", 1.0, "j9 is not a joint of homing_controller; it has j1, j2, j3, j4"),
        ("j3", 1.0, "j3 cannot be homed: j2 is "),
    ):
        home(ros, joint, command)
        ros_rig.logged(text)
    assert reported(ros, "homing_controller: cannot home: j3 cannot be homed: j2 is ") >= 1
    ros.do("silence", topic="/diagnostics")


def test_the_panel_homes_the_joints_one_by_one() -> None:
    """An arm that is not homed: its position is unknown until its end stop is found."""
    with rig(1) as other, other.owner(speed=5.0), other.node(), other.clients() as ros:
        energise(ros)
        ros.spawn(BROADCASTER)
        ros.spawn(HOMING)
        topic = "/dynamic_joint_states"
        ros.do("listen", type="control_msgs/DynamicJointState", topic=topic, qos="best_effort")

        def homed() -> dict[str, float]:
            ros.do("forget", topic=topic)
            message = ros.do("heard", topic=topic, count=2)[-1][1]
            values = zip(message["joint_names"], message["interface_values"], strict=True)
            return {
                joint: dict(zip(each["interface_names"], each["values"], strict=True)).get(
                    "home", math.nan
                )
                for joint, each in values
            }

        assert not any(value > 0.0 for value in homed().values())
        directions = {joint.name: joint.homing.velocity for joint in ARM.joints}
        for joint in ARM.homing_order:
            home(ros, joint, math.copysign(1.0, directions[joint]))
            for _ in range(1500):
                if homed()[joint] > 0.0:
                    break
            else:
                raise AssertionError(f"{joint} was not homed: {other.log}")
