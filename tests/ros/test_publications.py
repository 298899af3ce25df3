"""Publications of the node: joint states, frames, activity, diagnostics, statistics."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

from bioscara.model.urdf import URDF
from ros.bringup_controllers import BROADCASTER, VELOCITY, clear, energise
from ros.rig import MANAGER, Ros
from served import HALF

pytestmark = pytest.mark.ros
PANEL = "best_effort latched depth=10"
ACTIVITY = f"{MANAGER}/activity"


@pytest.fixture(autouse=True)
def cleared(ros: Ros) -> Iterator[None]:
    yield
    clear(ros)


def one(ros: Ros, kind: str, topic: str, qos: str = "reliable", count: int = 1) -> Any:
    """Return the latest of some messages on a topic."""
    ros.do("listen", type=kind, topic=topic, qos=qos)
    message = ros.do("heard", topic=topic, count=count)[-1][1]
    ros.do("silence", topic=topic)
    return message


def interfaces(message: Any) -> dict[str, dict[str, float]]:
    values = zip(message["joint_names"], message["interface_values"], strict=True)
    return {
        joint: dict(zip(each["interface_names"], each["values"], strict=True))
        for joint, each in values
    }


def test_rule_70_the_broadcaster_publishes_all_joints_in_full_length(ros: Ros) -> None:
    ros.hardware("bioscara_gripper_128", "unconfigured")
    ros.spawn(BROADCASTER)
    state = one(ros, "sensor_msgs/JointState", "/joint_states", "best_effort")
    assert state["header"]["frame_id"] == "base_link"
    assert state["name"] == ["j1", "j2", "j3", "j4", "gripper"]
    assert state["position"][:4] == pytest.approx(list(HALF), abs=0.3)
    assert [len(state[field]) for field in ("position", "velocity", "effort")] == [5, 5, 5]
    assert all(map(math.isnan, state["effort"]))
    for topic in ("/joint_states", "/dynamic_joint_states"):
        assert ros.do("publishers_of", topic=topic) == [
            {"reliability": "RELIABLE", "durability": "TRANSIENT_LOCAL"}
        ]


def test_rule_70_the_panel_gets_the_interface_home_of_each_joint(ros: Ros) -> None:
    """It subscribes best effort and transient local."""
    ros.spawn(BROADCASTER)
    kind = "control_msgs/DynamicJointState"
    values = interfaces(one(ros, kind, "/dynamic_joint_states", PANEL))
    assert all(values[joint]["home"] > 0.0 for joint in ("j1", "j2", "j3", "j4"))
    assert set(values["j1"]) == {"position", "velocity", "home"}
    assert set(values["gripper"]) == {"position", "velocity"}


def test_rule_70_the_broadcaster_is_silent_while_it_is_inactive(ros: Ros) -> None:
    ros.spawn(BROADCASTER)
    ros.do("listen", type="sensor_msgs/JointState", topic="/joint_states", qos="best_effort")
    ros.do("heard", topic="/joint_states", count=5)
    assert ros.switch((), [BROADCASTER])["ok"]
    # Frames go on, in the same cycles.
    ros.do("listen", type="tf2_msgs/TFMessage", topic="/tf")
    ros.do("heard", topic="/tf", count=2)
    ros.do("forget", topic="/joint_states")
    ros.do("forget", topic="/tf")
    ros.do("heard", topic="/tf", count=25)
    assert ros.do("heard", topic="/joint_states", count=0) == []
    for topic in ("/tf", "/joint_states"):
        ros.do("silence", topic=topic)


def test_rule_70_its_parameters_choose_joints_topics_and_frame(ros: Ros) -> None:
    assert ros.manager("load_controller", name=BROADCASTER)["ok"]
    ros.set_parameters(
        f"/{BROADCASTER}",
        use_local_topics=True,
        frame_id="world",
        joints=["j2", "gripper"],
        extra_joints=["wheel"],
    )
    ros.spawn(BROADCASTER)
    state = one(ros, "sensor_msgs/JointState", f"/{BROADCASTER}/joint_states", "best_effort")
    assert state["name"] == ["j2", "gripper", "wheel"]
    assert state["header"]["frame_id"] == "world"
    assert (state["position"][2], state["velocity"][2]) == (0.0, 0.0)


def test_description_and_frames_are_those_of_robot_state_publisher(ros: Ros) -> None:
    text = one(ros, "std_msgs/String", "/robot_description", "reliable latched depth=1")
    assert text["data"] == URDF.read_text()
    fixed = one(ros, "tf2_msgs/TFMessage", "/tf_static", "reliable latched depth=1")
    moving = one(ros, "tf2_msgs/TFMessage", "/tf")
    frames = {each["child_frame_id"] for each in fixed["transforms"]}
    moved = {each["child_frame_id"]: each for each in moving["transforms"]}
    assert {"base_link", "tool"} <= frames
    assert {"link_1", "link_4"} <= set(moved)
    turn = moved["link_1"]["transform"]["rotation"]
    assert math.hypot(*turn.values()) == pytest.approx(1.0)


def test_rule_66_each_change_is_published_as_activity_to_late_subscribers_too(ros: Ros) -> None:
    kind, qos = "controller_manager_msgs/ControllerManagerActivity", "reliable latched depth=1"
    ros.do("listen", type=kind, topic=ACTIVITY, qos=qos)

    def states() -> tuple[dict[str, str], dict[str, str]]:
        message = ros.do("heard", topic=ACTIVITY)[-1][1]
        controllers, hardware = (
            {each["name"]: each["state"]["label"] for each in message[field]}
            for field in ("controllers", "hardware_components")
        )
        return controllers, hardware

    def is_published(name: str, wanted: str) -> None:
        """Require that the answer came after the activity."""
        controllers, hardware = states()
        assert (controllers | hardware).get(name) == wanted

    assert states()[1].keys() == {"bioscara_arm", "bioscara_gripper_128"}
    for step, wanted in (("load", "unconfigured"), ("configure", "inactive")):
        assert ros.manager(f"{step}_controller", name=BROADCASTER)["ok"]
        is_published(BROADCASTER, wanted)
    assert ros.switch([BROADCASTER])["ok"]
    is_published(BROADCASTER, "active")
    for state in ("active", "inactive") * 5:
        assert ros.hardware("bioscara_gripper_128", state)["ok"]
        is_published("bioscara_gripper_128", state)
    ros.do("silence", topic=ACTIVITY)
    late = one(ros, kind, ACTIVITY, qos)
    assert [each["name"] for each in late["controllers"]] == [BROADCASTER]
    assert ros.do("publishers_of", topic=ACTIVITY) == [
        {"reliability": "RELIABLE", "durability": "TRANSIENT_LOCAL"}
    ]


def test_rule_67_diagnostics_have_three_statuses_of_the_manager_once_a_second(ros: Ros) -> None:
    energise(ros, "bioscara_arm", "bioscara_gripper_128")
    ros.spawn(BROADCASTER)
    ros.do("listen", type="diagnostic_msgs/DiagnosticArray", topic="/diagnostics")
    ros.do("heard", topic="/diagnostics", count=1)
    ros.do("forget", topic="/diagnostics")
    heard = ros.do("heard", topic="/diagnostics", count=3)
    ros.do("silence", topic="/diagnostics")
    assert heard[2][0] - heard[0][0] == pytest.approx(2.0, abs=0.5)
    statuses = {each["name"]: each for each in heard[-1][1]["status"]}
    assert set(statuses) == {
        "controller_manager: Controllers Activity",
        "controller_manager: Hardware Components Activity",
        "controller_manager: Controller Manager Activity",
    }
    assert {each["hardware_id"] for each in statuses.values()} == {"ros2_control"}
    values = {pair["key"]: pair["value"] for each in statuses.values() for pair in each["values"]}
    assert values[f"{BROADCASTER}.state"] == "active"
    assert values["update_rate"] == "50"
    assert "Avg: " in values[f"{BROADCASTER}.execution_time"]
    assert not any(key.startswith("arm.") for key in values)
    assert values["bioscara_gripper_128.state"] == "active"
    name = "diagnostics.threshold.hardware_components.execution_time.mean_error.error"
    (found,) = ros.call(
        "rcl_interfaces/srv/GetParameters", f"{MANAGER}/get_parameters", names=[name]
    )["values"]
    assert found["double_value"] == pytest.approx(18_000.0)
    assert ros.set_parameters(MANAGER, **{name.replace(".", "__"): 1e-3})[0]["successful"]
    hardware = "controller_manager: Hardware Components Activity"
    ros.do("listen", type="diagnostic_msgs/DiagnosticArray", topic="/diagnostics")
    ros.do("forget", topic="/diagnostics")
    _, message = ros.do("heard", topic="/diagnostics", count=2)[-1]
    ros.do("silence", topic="/diagnostics")
    (status,) = (each for each in message["status"] if each["name"] == hardware)
    assert (status["level"], "bioscara_gripper_128.read_cycle" in status["message"]) == (2, True)
    assert ros.set_parameters(MANAGER, **{name.replace(".", "__"): 18_000.0})[0]["successful"]


def test_rule_68_each_component_has_a_hardware_status_with_its_joints(ros: Ros) -> None:
    energise(ros)
    ros.hardware("bioscara_gripper_128", "unconfigured")
    found = {}
    for name in ("bioscara_arm", "bioscara_gripper_128"):
        topic, kind = f"/{name}/hardware_status", "control_msgs/HardwareStatus"
        ros.do("listen", type=kind, topic=topic, qos="best_effort")
        ros.do("forget", topic=topic)
        _, status = ros.do("heard", topic=topic, count=2)[-1]
        ros.do("silence", topic=topic)
        assert status["hardware_id"] == name
        found[name] = status["hardware_device_states"]
    assert [each["device_id"] for each in found["bioscara_arm"]] == ["j1", "j2", "j3", "j4"]
    for device in found["bioscara_arm"]:
        (state,) = device["hardware_status"]
        # OK, no error, on, up.
        assert (state["health_status"], state["error_domain"]) == (1, [0])
        assert (state["power_state"], state["connectivity_status"]) == (3, 1)
        assert "firmware" in state["firmware_version"]
    ((state,),) = ([*each["hardware_status"]] for each in found["bioscara_gripper_128"])
    assert (state["health_status"], state["power_state"], state["connectivity_status"]) == (0, 0, 0)


def test_rule_68_interfaces_and_statistics_are_published_by_their_names(ros: Ros) -> None:
    energise(ros)
    ros.spawn(VELOCITY)
    topic = f"{MANAGER}/introspection_data"
    names = one(ros, "pal_statistics_msgs/StatisticsNames", f"{topic}/names", "latched depth=1")
    full = one(ros, "pal_statistics_msgs/Statistics", f"{topic}/full", count=2)
    found = {each["name"]: each["value"] for each in full["statistics"]}
    assert found["state_interface.j1/position"] == pytest.approx(HALF[0], abs=0.3)
    assert "command_interface.j4/velocity" in found
    assert found["controller_manager.total_time"] > 0.0
    assert f"{VELOCITY}.stats/execution_time/average" in found
    assert names["names_version"] >= 1
    values = one(ros, "pal_statistics_msgs/StatisticsValues", f"{topic}/values")
    latest = one(ros, "pal_statistics_msgs/StatisticsNames", f"{topic}/names", "latched depth=1")
    assert len(values["values"]) == len(latest["names"])
    times = one(ros, "pal_statistics_msgs/Statistics", f"{MANAGER}/statistics/full")
    listed = {each["name"] for each in times["statistics"]}
    assert "controller_manager.periodicity/average" in listed
    assert "state_interface.j1/position" not in listed
