"""A trajectory controller as clients of ROS use it: its action, topics, service and parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import pytest

from programs import wait_until
from ros.bringup_controllers import (
    JOINTS,
    POSITION,
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
from ros.rig import ABORTED, CANCELED, SUCCEEDED, Rig, Ros
from served import HALF

pytestmark = pytest.mark.ros
TRAJECTORY = "trajectory_msgs/JointTrajectory"
STATE = "control_msgs/JointTrajectoryControllerState"


@pytest.fixture(scope="module")
def following(ros: Ros) -> Iterator[Ros]:
    """Return clients of an arm whose velocity controller is active."""
    energise(ros)
    ros.spawn(VELOCITY)
    ros.do("listen", type=STATE, topic=f"/{VELOCITY}/controller_state", qos="best_effort")
    yield ros
    ros.do("silence", topic=f"/{VELOCITY}/controller_state")
    clear(ros)


def state_now(ros: Ros) -> dict[str, object]:
    topic = f"/{VELOCITY}/controller_state"
    ros.do("forget", topic=topic)
    state: dict[str, object] = ros.do("heard", topic=topic, count=2)[-1][1]
    return state


@pytest.mark.parametrize(
    ("controller", "fields"),
    [(VELOCITY, ("velocities",)), (POSITION, ("velocities", "accelerations"))],
)
def test_a_stream_is_followed(ros: Ros, controller: str, fields: tuple[str, ...]) -> None:
    """As tests/server/controllers/test_stream_tracking.py for each form, in virtual time.

    It comes first in this file: it leaves no controllers.
    """
    rate, way = 2.0 * math.pi * 0.3, 0.05
    messages = []
    for number in range(300):
        phase = rate * (0.02 * number + 0.02)
        values = {
            "velocities": [way * rate * math.sin(phase), 0.0, 0.0, 0.0],
            "accelerations": [way * rate**2 * math.cos(phase), 0.0, 0.0, 0.0],
        }
        each = near(way * (1.0 - math.cos(phase)), at=0.02)
        each.update({field: values[field] for field in fields})
        messages.append({"joint_names": JOINTS, "points": [each]})
    clear(ros)
    energise(ros)
    ros.spawn(controller)
    go_home(ros, controller)
    topic = f"/{controller}/controller_state"
    ros.do("listen", type=STATE, topic=topic, qos="best_effort")
    sent = {"type": TRAJECTORY, "topic": f"/{controller}/joint_trajectory"}
    ros.do("play", messages=messages, period=0.02, **sent)
    known = len(ros.do("heard", topic=topic))
    heard = ros.do("heard", topic=topic, count=known + 30)
    measured = [state["feedback"]["positions"][0] for _, state in heard]
    assert max(measured) - min(measured) == pytest.approx(2.0 * way, rel=0.03)
    assert measured[-1] == pytest.approx(messages[-1]["points"][0]["positions"][0], abs=1e-3)
    ros.do("silence", topic=topic)
    clear(ros)


@pytest.mark.path
def test_rule_32_and_35_a_goal_succeeds_with_feedback_and_within_50_ms(following: Ros) -> None:
    ros = following
    go_home(ros)
    end = ended(ros, follow(ros, VELOCITY, goal(near(0.05, at=1.0), near(0.1, at=2.0))))
    assert end["status"] == SUCCEEDED
    assert end["result"] == {"error_code": 0, "error_string": "Goal successfully reached!"}
    feedback = [each for _, each in end["feedback"]]
    times = [each["desired"]["time_from_start"] for each in feedback]
    seconds = [each["sec"] + 1e-9 * each["nanosec"] for each in times]
    # At 20 Hz, for the 2 s of the goal and the time to come to rest.
    assert 30 <= len(feedback) <= 1.3 * 20.0 * seconds[-1] + 2
    assert seconds == sorted(seconds)
    assert {each["index"] for each in feedback} >= {0, 1}
    for each in feedback:
        error = each["desired"]["positions"][0] - each["actual"]["positions"][0]
        assert each["error"]["positions"][0] == pytest.approx(error, abs=1e-9)
        assert each["joint_names"] == JOINTS
    # The state topic reports the end in the cycle of the result, which may arrive first.
    topic = f"/{VELOCITY}/controller_state"
    known = len(ros.do("heard", topic=topic))
    heard = ros.do("heard", topic=topic, count=known + 3)
    held = [
        when
        for when, state in heard
        if when > end["at"] - 0.5 and state["reference"]["time_from_start"]["sec"] == 0
    ]
    assert min(held) > end["at"] - 0.05


def test_rule_01_goals_and_trajectories_are_refused_while_it_is_inactive(
    following: Ros, ros_rig: Rig
) -> None:
    ros = following
    assert ros.switch((), [VELOCITY])["ok"]
    assert follow(ros, VELOCITY, goal(near(0.0, at=1.0))) is None
    ros_rig.logged(f"goal rejected: {VELOCITY} is inactive")
    assert ros.switch([VELOCITY])["ok"]


@pytest.mark.parametrize(
    ("sent", "reason"),
    [
        (goal(), "point"),
        (goal(point(0.3, 0.2, 0.8, at=1.0), joints=JOINTS[:3]), "joint"),
        (goal(near(0.0, at=1.0), near(0.0, at=1.0)), "does not come after"),
        (goal(point(math.nan, *HALF[1:], at=1.0)), "finite"),
        (goal(point(*HALF, at=1.0, effort=[1.0] * 4)), "effort"),
        (goal(point(9.0, *HALF[1:], at=30.0)), "outside"),
    ],
)
def test_rule_02_03_06_08_and_09_a_goal_that_cannot_be_followed_is_rejected(
    sent: dict[str, object], reason: str, following: Ros, ros_rig: Rig
) -> None:
    before = ros_rig.log
    assert follow(following, VELOCITY, sent) is None
    ros_rig.logged(reason, before)


def test_rule_05_a_stamp_in_the_future_delays_the_start(following: Ros) -> None:
    ros = following
    go_home(ros)
    sent = goal(near(0.0, at=1.0), near(0.05, at=2.0))
    sent["trajectory"]["header"] = {"stamp": {"now": 1.0}}
    number = follow(ros, VELOCITY, sent)
    begin = ros.do("cancel", number=follow(ros, VELOCITY, goal(near(0.0, at=9.0))))["at"]
    assert ended(ros, number)["status"] == ABORTED
    again = goal(near(0.05, at=1.0))
    again["trajectory"]["header"] = {"stamp": {"now": 1.0}}
    end = ended(ros, follow(ros, VELOCITY, again))
    assert end["status"] == SUCCEEDED
    assert end["at"] - begin >= 1.9
    late = goal(near(0.0, at=1.0))
    late["trajectory"]["header"] = {"stamp": {"now": -5.0}}
    assert follow(ros, VELOCITY, late) is None


def test_rule_21_a_new_goal_aborts_the_running_one(following: Ros) -> None:
    ros = following
    first = follow(ros, VELOCITY, goal(near(0.1, at=8.0)))
    second = follow(ros, VELOCITY, goal(near(0.0, at=1.5)))
    end = ended(ros, first)
    assert end["status"] == ABORTED
    assert end["result"] == {
        "error_code": -1,
        "error_string": "Current goal preempted by new incoming action.",
    }
    assert ended(ros, second)["status"] == SUCCEEDED


def test_rule_22_a_trajectory_on_the_topic_replaces_that_of_the_goal(following: Ros) -> None:
    ros = following
    number = follow(ros, VELOCITY, goal(near(0.1, at=8.0)))
    message = {"joint_names": JOINTS, "points": [near(0.02, at=1.0)]}
    ros.do("publish", type=TRAJECTORY, topic=f"/{VELOCITY}/joint_trajectory", message=message)
    assert ended(ros, number, timeout=6.0)["status"] == SUCCEEDED
    positions = state_now(ros)["reference"]["positions"]  # type: ignore[index]
    assert positions[0] == pytest.approx(HALF[0] + 0.02, abs=1e-3)


def test_rule_23_a_cancelled_goal_holds_the_arm_where_it_is(following: Ros) -> None:
    ros = following
    go_home(ros)
    number = follow(ros, VELOCITY, goal(near(0.2, at=10.0)))
    assert number is not None
    assert ros.do("cancel", number=number)["cancelling"] == 1
    end = ended(ros, number)
    assert end["status"] == CANCELED
    assert end["result"]["error_code"] == 0
    assert ros.states() == {VELOCITY: "active"}
    assert state_now(ros)["reference"]["positions"][0] < HALF[0] + 0.1  # type: ignore[index]


def test_rule_30_and_31_tolerances_of_a_goal_are_those_of_the_message(following: Ros) -> None:
    ros = following
    go_home(ros)
    sent = goal(near(0.1, at=1.0), path_tolerance=[{"name": "j1", "position": 1e-6}])
    end = ended(ros, follow(ros, VELOCITY, sent))
    assert end["status"] == ABORTED
    assert end["result"]["error_code"] == -4
    assert "j1" in end["result"]["error_string"]
    go_home(ros)


def test_rule_18_scaling_stretches_the_time_of_a_trajectory(ros: Ros) -> None:
    """That of a controller of positions; a message before the activation is kept by its sender."""
    energise(ros)
    ros.do("listen", type=STATE, topic=f"/{POSITION}/controller_state", qos="best_effort")
    states = ros.states()
    active = [name for name in states if states[name] == "active"]
    ros.spawn(POSITION, active=False)
    assert ros.switch([POSITION], active)["ok"]
    topic, kind = f"/{POSITION}/speed_scaling_input", "control_msgs/SpeedScalingFactor"

    def scale(factor: float) -> None:
        ros.do("publish", type=kind, topic=topic, message={"factor": factor}, qos="latched depth=1")

    def factor() -> float:
        heard = ros.do("heard", topic=f"/{POSITION}/controller_state")
        return float(heard[-1][1]["speed_scaling_factor"]) if heard else math.nan

    try:
        go_home(ros, POSITION)
        scale(0.25)
        # Topics and actions have no common order.
        wait_until(lambda: factor() == pytest.approx(0.25), "the time is stretched")
        begin = ros.do("heard", topic=f"/{POSITION}/controller_state")[-1][0]
        end = ended(ros, follow(ros, POSITION, goal(near(0.1, at=1.0))))
        assert end["status"] == SUCCEEDED
        assert end["at"] - begin > 3.5
    finally:
        scale(1.0)
        wait_until(lambda: factor() == pytest.approx(1.0), "it is not stretched any more")
        go_home(ros, POSITION)
        ros.do("silence", topic=f"/{POSITION}/controller_state")
        assert ros.switch(active, [POSITION])["ok"]


def test_rule_38_some_parameters_change_while_it_runs_and_others_do_not(following: Ros) -> None:
    ros, node = following, f"/{VELOCITY}"

    def change(**value: object) -> str:
        (answer,) = ros.set_parameters(node, **value)
        assert answer["successful"] == (not answer["reason"])
        return str(answer["reason"])

    assert change(gains__j1__p=0.8) == ""
    assert change(gains__j1__p=0.5) == ""
    assert change(allow_partial_joints_goal=True) == ""
    assert change(allow_partial_joints_goal=False) == ""
    assert change(constraints__j1__trajectory=1e-9) == ""
    goal_id = follow(ros, VELOCITY, goal(near(0.1, at=1.0)))
    assert ended(ros, goal_id)["result"]["error_code"] == -4
    assert change(constraints__j1__trajectory=0.0) == ""
    assert "no such parameter" in change(gains__j1__q=0.8)
    assert "no such parameter" in change(constraints__goal_tim=1.0)
    assert "joints cannot be changed" in change(joints=["j1"])
    assert "range" in change(constraints__goal_time=-1.0)
    names = ["constraints.goal_time", "constraints.j4.goal", "cmd_timeout", "gains.j1.p"]
    described = ros.call("rcl_interfaces/srv/DescribeParameters", f"{node}/describe_parameters",
                         names=names)["descriptors"]  # fmt: skip
    assert [each["type"] for each in described] == [3] * 4
    assert all(each["description"] for each in described)
    assert described[0]["floating_point_range"][0]["from_value"] == 0.0


def test_rule_41_the_state_is_published_each_cycle_and_the_future_can_be_asked(
    following: Ros,
) -> None:
    ros = following
    topic = f"/{VELOCITY}/controller_state"
    ros.do("forget", topic=topic)
    heard = ros.do("heard", topic=topic, count=60)
    stamps = [
        state["header"]["stamp"]["sec"] + 1e-9 * state["header"]["stamp"]["nanosec"]
        for _, state in heard
    ]
    periods = sorted(later - first for first, later in pairwise(stamps))
    assert periods[len(periods) // 2] == pytest.approx(0.02, abs=2e-3)
    state = heard[-1][1]
    assert state["joint_names"] == JOINTS
    assert len(state["output"]["velocities"]) == 4
    assert state["output"]["positions"] == []
    assert state["speed_scaling_factor"] == 1.0
    qualities = ros.do("publishers_of", topic=topic)
    assert qualities == [{"reliability": "RELIABLE", "durability": "TRANSIENT_LOCAL"}]
    ask, service = "control_msgs/srv/QueryTrajectoryState", f"/{VELOCITY}/query_state"
    assert not ros.call(ask, service, time={"now": 0.5})["success"]
    go_home(ros)
    number = follow(ros, VELOCITY, goal(near(0.1, at=2.0)))
    answer: dict[str, object] = {}

    def begun() -> object:
        answer.update(ros.call(ask, service, time={"now": 0.5}))
        return answer["success"]

    wait_until(begun, "the begin of the goal")
    assert answer["name"] == JOINTS
    (first, *_) = answer["position"]
    assert HALF[0] - 0.01 < first < HALF[0] + 0.1
    assert ended(ros, number)["status"] == SUCCEEDED


def test_a_long_trajectory_arrives_whole(following: Ros) -> None:
    ros = following
    go_home(ros)
    points = [near(0.05 * math.sin(0.01 * step) ** 2, at=0.004 * (step + 1)) for step in range(628)]
    assert ended(ros, follow(ros, VELOCITY, goal(*points)))["status"] == SUCCEEDED
