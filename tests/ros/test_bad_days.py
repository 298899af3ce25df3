"""Faults, monstrous goals and clients that die, as clients of ROS see them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from programs import wait_until
from ros.bringup_controllers import (
    JOINTS,
    VELOCITY,
    clear,
    ended,
    energise,
    follow,
    go_home,
    goal,
    near,
    point,
)
from ros.rig import ABORTED, SUCCEEDED, Rig, Ros
from served import HALF

pytestmark = pytest.mark.ros
OBSTACLE = HALF[0] + 0.15
"""Where the first joint meets an obstacle [rad]."""


@pytest.fixture(autouse=True)
def cleared(ros: Ros, ros_rig: Rig) -> Iterator[None]:
    yield
    clear(ros)
    if faults(ros):
        # Of a test that failed: the next ones have an arm that can move.
        simulate(ros_rig, "clear")
        recover(ros)


def simulate(rig: Rig, fault: str, joint: str = "", value: float | None = None) -> None:
    """Let the arm fail, by another client."""
    with rig.observed() as robot:
        robot.simulate_fault(fault, joint, value)


def recover(ros: Ros) -> None:
    for name, kind in (("acknowledge_faults", "AcknowledgeFaults"), ("recover", "Recover")):
        answer = ros.call(f"bioscara_interfaces/srv/{kind}", f"/bioscara/{name}")
        assert answer["success"], answer


def faults(ros: Ros) -> list[str]:
    found = ros.call("bioscara_interfaces/srv/ListFaults", "/bioscara/list_faults")["faults"]
    return [str(each) for each in found]


def worst_level(ros: Ros) -> int:
    """Return the highest level of the latest diagnostics, which come once a second."""
    _, diagnostics = ros.do("heard", topic="/diagnostics")[-1]
    return max(int(each["level"]) for each in diagnostics["status"])


def broken(ros: Ros) -> list[str]:
    """Return the joints whose hardware status is an error."""
    topic, kind = "/bioscara_arm/hardware_status", "control_msgs/HardwareStatus"
    ros.do("listen", type=kind, topic=topic, qos="best_effort")
    ros.do("forget", topic=topic)
    _, message = ros.do("heard", topic=topic, count=2)[-1]
    ros.do("silence", topic=topic)
    return [
        device["device_id"]
        for device in message["hardware_device_states"]
        if device["hardware_status"][0]["health_status"] == 4
    ]


def test_a_fault_in_a_goal_aborts_it_with_the_reason(ros: Ros, ros_rig: Rig) -> None:
    ros.do("listen", type="diagnostic_msgs/DiagnosticArray", topic="/diagnostics")
    simulate(ros_rig, "obstacle", "j1", OBSTACLE)
    energise(ros)
    ros.spawn(VELOCITY)
    end = ended(ros, follow(ros, VELOCITY, goal(near(0.4, at=4.0))))
    assert end["status"] == ABORTED
    assert "j1" in end["result"]["error_string"]
    wait_until(lambda: ros.states() == {VELOCITY: "inactive"}, "no active controller")
    assert any("j1" in each for each in faults(ros))
    ros_rig.logged("j1")
    wait_until(lambda: worst_level(ros) == 2, "an error among the diagnostics")
    assert broken(ros) == ["j1"]
    assert not ros.switch([VELOCITY])["ok"]
    simulate(ros_rig, "clear_obstacles", "j1")
    recover(ros)
    assert ros.hardware("bioscara_arm", "active")["ok"]
    assert ros.switch([VELOCITY])["ok"]
    go_home(ros)


def test_a_name_of_a_megabyte_is_rejected_in_one_line(ros: Ros, ros_rig: Rig) -> None:
    energise(ros)
    ros.spawn(VELOCITY)
    before = ros_rig.log
    names = ["x" * 1_000_000, *JOINTS[1:]]
    sent = {"trajectory": {"joint_names": names, "points": [point(*HALF, at=1.0)]}}
    assert follow(ros, VELOCITY, sent) is None
    ros_rig.logged("goal rejected", before)
    assert len(ros_rig.log) - len(before) < 2000
    go_home(ros)


def test_a_goal_of_a_client_that_dies_goes_on(ros: Ros, ros_rig: Rig) -> None:
    """As in ros2_control: the goal is the controller's, and the node renews the lease."""
    energise(ros)
    ros.spawn(VELOCITY)
    go_home(ros)
    with ros_rig.observed() as robot:
        with ros_rig.clients() as other:
            assert follow(other, VELOCITY, goal(near(0.1, at=1.5))) is not None
        wait_until(
            lambda: abs(robot.state.positions[0] - HALF[0] - 0.1) < 1e-3, "the end of the goal"
        )
    go_home(ros)
    assert ended(ros, follow(ros, VELOCITY, goal(near(0.0, at=0.5))))["status"] == SUCCEEDED
