"""Services and actions beyond ros2_control: plans, motions, named poses, STOP and faults."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest

from bioscara import Robot
from bioscara.api.runtime import VARIABLE
from programs import wait_until
from ros.bringup_controllers import VELOCITY, clear, ended, energise, follow, go_home, goal, near
from ros.rig import ABORTED, CANCELED, SUCCEEDED, Rig, Ros
from served import HALF, NAME

pytestmark = pytest.mark.ros


@pytest.fixture(autouse=True)
def energised(ros: Ros) -> Iterator[None]:
    energise(ros)
    yield
    clear(ros)


def ask(ros: Ros, name: str, /, **request: Any) -> Any:
    kind = "".join(part.title() for part in name.split("_"))
    return ros.call(f"bioscara_interfaces/srv/{kind}", f"/bioscara/{name}", **request)


def move(ros: Ros, name: str, /, **values: Any) -> Any:
    kind = "".join(part.title() for part in name.split("_"))
    return ros.do(
        "goal", type=f"bioscara_interfaces/action/{kind}", name=f"/bioscara/{name}", goal=values
    )


def test_a_plan_is_a_trajectory_that_a_controller_follows(ros: Ros) -> None:
    goal_positions = [HALF[0] + 0.05, *HALF[1:]]
    answer = ask(ros, "plan_to_joints", positions=goal_positions)
    assert answer["success"], answer
    points = answer["trajectory"]["points"]
    assert points[-1]["positions"] == pytest.approx(goal_positions)
    assert len(points[0]["velocities"]) == 4
    ros.spawn(VELOCITY)
    end = ended(ros, follow(ros, VELOCITY, {"trajectory": answer["trajectory"]}))
    assert end["status"] == SUCCEEDED
    go_home(ros)


def test_a_plan_that_is_impossible_is_answered_with_number_and_sentence(ros: Ros) -> None:
    answer = ask(ros, "plan_to_pose", pose={"x": 9.0}, linear=True)
    assert not answer["success"]
    assert answer["code"] < 0
    assert answer["message"]
    assert answer["trajectory"]["points"] == []
    assert not ask(ros, "plan_to_joints", positions=[0.0])["success"]
    assert "nowhere" in ask(ros, "plan_to_named", name="nowhere")["message"]
    assert ask(ros, "plan_to_named", name="center")["success"]


def test_poses_are_saved_listed_reached_and_deleted(ros: Ros) -> None:
    assert ask(ros, "save_pose", pose={"name": "here"})["success"]
    assert not ask(ros, "save_pose", pose={"name": "here"})["success"]
    assert ask(ros, "save_pose", pose={"name": "here"}, overwrite=True)["success"]
    listed = {each["name"]: each for each in ask(ros, "list_poses")["poses"]}
    assert {"center", "here"} <= set(listed)
    assert len(listed["here"]["joints"]) == 4
    (place,) = listed["here"]["pose"]
    given = {"name": "other", "joints": [HALF[0] + 0.05, *HALF[1:]]}
    assert ask(ros, "save_pose", pose=given)["success"]
    for name in ("other", "here"):
        end = ended(ros, move(ros, "move_named", name=name))
        assert end["status"] == SUCCEEDED, end
        assert end["result"]["success"]
    place["z"] += 0.005
    end = ended(ros, move(ros, "move_to_pose", pose=place, linear=True))
    assert end["status"] == SUCCEEDED, end
    assert [each["progress"] for _, each in end["feedback"]]
    for name in ("other", "here"):
        assert ask(ros, "delete_pose", name=name)["success"]
    assert "center is built in" in ask(ros, "delete_pose", name="center")["message"]


def test_a_motion_is_cancelled_and_one_that_is_impossible_is_aborted(ros: Ros) -> None:
    assert ask(ros, "save_pose", pose={"name": "far", "joints": [1.2, *HALF[1:]]})["success"]
    number = move(ros, "move_named", name="far", velocity_scaling=0.05)
    ros.do("cancel", number=number)
    end = ended(ros, number)
    assert end["status"] == CANCELED
    assert not end["result"]["success"]
    assert end["result"]["code"] < 0
    assert end["result"]["message"]
    end = ended(ros, move(ros, "move_named", name="nowhere"))
    assert end["status"] == ABORTED
    assert end["result"]["code"] < 0
    assert ask(ros, "delete_pose", name="far")["success"]


def test_while_a_controller_commands_the_arm_other_motions_are_refused(ros: Ros) -> None:
    ros.spawn(VELOCITY)
    end = ended(ros, move(ros, "move_named", name="center"))
    assert end["status"] == ABORTED
    assert "controllers" in end["result"]["message"]
    assert ros.states() == {VELOCITY: "active"}


def test_stop_ends_the_motion_of_controllers(ros: Ros) -> None:
    ros.spawn(VELOCITY)
    number = follow(ros, VELOCITY, goal(near(0.3, at=10.0)))
    assert ask(ros, "stop")["success"]
    assert ended(ros, number)["status"] == ABORTED
    # Once the arm has come to rest.
    wait_until(lambda: ros.states() == {VELOCITY: "inactive"}, "no active controller")
    assert ros.switch([VELOCITY])["ok"]
    go_home(ros)


def test_a_motion_is_paused_and_resumed(
    ros: Ros, ros_rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(ros_rig.folder))

    def trigger(name: str) -> Any:
        return ros.call("std_srvs/srv/Trigger", f"/bioscara/{name}")

    assert trigger("pause")["success"]
    number = move(ros, "move_named", name="center", velocity_scaling=0.3)
    with Robot.connect(f"arm:{NAME}") as other:
        (author,) = other.paused_by
        ros.do("listen", type="diagnostic_msgs/DiagnosticArray", topic="/diagnostics")
        wait_until(
            lambda: (
                f"paused by {author}" in str(ros.do("heard", topic="/diagnostics", count=1)[-1])
            ),
            "the diagnostics say who paused",
        )
        ros.do("silence", topic="/diagnostics")
        other.pause()
        assert trigger("resume")["success"]
        assert not other.paused_by, "the node has the lease, and lifts all pauses"
        assert ended(ros, number)["status"] == SUCCEEDED
        other.pause()
        other.acquire_lease()
        (author,) = other.paused_by
        able = f"only the holder of the lease, '{author}', can resume"
        refused = trigger("resume")
        assert not refused["success"]
        assert refused["message"].startswith(
            f"paused by '{author}'; {able}; 'bioscara lease --end'"
        )
        other.resume()
    ros.spawn(VELOCITY)
    go_home(ros)


def test_faults_are_listed_and_there_is_nothing_to_recover_from(ros: Ros) -> None:
    found = ask(ros, "list_faults")
    assert found["state"] == "clear"
    assert found["faults"] == []
    for name in ("acknowledge_faults", "recover"):
        answer = ask(ros, name)
        assert answer["success"] or answer["message"]
    assert not math.isnan(ask(ros, "stop")["code"])
