"""The node and the owner of the arm: its loss and return, its lease, its other clients."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from bioscara.api.runtime import VARIABLE, owners
from bioscara.errors import LeaseError
from bioscara.model.urdf import URDF
from bioscara.remote.lease_keeper import TIME_TO_LIVE
from bioscara.remote.remote_robot import RemoteRobot
from programs import LIMIT, wait_until
from ros.bringup_controllers import (
    BROADCASTER,
    VELOCITY,
    ended,
    energise,
    follow,
    go_home,
    goal,
    near,
)
from ros.rig import ABORTED, CANCELED, MANAGER, Rig, Ros, rig
from served import HALF, NAME
from unread import unread

pytestmark = pytest.mark.ros
SLOWLY = goal(near(0.2, at=60.0))
"""A goal that outlasts a test."""
WITH_GPIO = URDF.read_text().replace("</hardware>", '</hardware><gpio name="home"/>', 1)
GPIO_COMPLAINT = "robot_description, line 476: bioscara_arm: <gpio> is not read"
"""The reason why it is refused: the original's manual has an interface of this kind."""


@pytest.fixture(scope="module")
def empty() -> Iterator[Rig]:
    """Return a rig without an owner."""
    with rig(2) as made:
        yield made


@pytest.fixture(scope="module")
def site() -> Iterator[Rig]:
    """Return a rig with an owner, whose nodes come and go."""
    with rig(3) as made, made.owner(*HALF):
        yield made


@pytest.fixture(scope="module")
def ros(site: Rig) -> Iterator[Ros]:
    """Return clients of that."""
    with site.clients() as clients:
        yield clients


def running(site: Rig) -> dict[str, int]:
    """Return the processes of the owners of a rig, by their names."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, str(site.folder))
        return {each.name: each.pid for each in owners()}


def aborted_in_time(ros: Ros, number: int | None, text: str) -> None:
    """Require that a goal is aborted within the time of the lease, for a reason."""
    begin = time.monotonic()
    end = ended(ros, number)
    assert time.monotonic() - begin < TIME_TO_LIVE + 0.5
    assert end["status"] == ABORTED
    assert text in end["result"]["error_string"]


def lease_is_free(robot: RemoteRobot) -> bool:
    """Return whether another client gets the lease."""
    try:
        robot.acquire_lease()
    except Exception:  # noqa: BLE001
        return False
    robot.release_lease()
    return True


def test_a_description_of_another_arm_or_with_unread_tags_ends_the_node(site: Rig) -> None:
    other = URDF.read_text().replace('"reduction">35.0', '"reduction">34.0')
    for text, complaint in (
        (other, "j1: <param> reduction is 34.0, and 35 in the parameters"),
        (WITH_GPIO, GPIO_COMPLAINT),
    ):
        with site.node(description=text) as node:
            wait_until(lambda: node.poll() is not None, "the end of the node")
        site.logged(complaint)


def test_rule_42_services_appear_with_the_description_and_a_second_one_is_ignored(
    site: Rig, ros: Ros
) -> None:
    kind, topic, qos = "std_msgs/String", "/robot_description", "reliable latched depth=1"
    with site.node(description=""):
        site.logged("waiting for robot_description")
        assert f"{MANAGER}/list_controllers" not in ros.do("graph")["services"]
        ros.do("publish", type=kind, topic=topic, message={"data": WITH_GPIO}, qos=qos)
        site.logged(f"the description on the topic cannot be used: {GPIO_COMPLAINT}")
        text = URDF.read_text()
        ros.do("publish", type=kind, topic=topic, message={"data": text}, qos=qos)
        assert ros.components().keys() == {"bioscara_arm", "bioscara_gripper_128"}
        ros.do("publish", type=kind, topic=topic, message={"data": text}, qos=qos)
        assert "another robot_description" not in site.log
        ros.do("publish", type=kind, topic=topic, message={"data": text + " "}, qos=qos)
        site.logged("another robot_description was published and is ignored")


def test_the_node_waits_for_an_owner_and_finds_the_next_one(empty: Rig) -> None:
    site = empty
    with site.node(), site.clients() as ros:
        site.logged("waiting: no owner of arm left runs")
        ros.do("listen", type="diagnostic_msgs/DiagnosticArray", topic="/diagnostics")
        with site.owner(*HALF) as first:
            energise(ros)
            ros.spawn(BROADCASTER)
            ros.spawn(VELOCITY)
            number = follow(ros, VELOCITY, goal(near(0.2, at=30.0)))
            assert number is not None
            active = ros.states()
            first.kill()
            seen = [ros.states()]
            while seen[-1]:
                seen.append(ros.states())
            # Never unknown, as those of a silent owner are.
            assert all(each in ({}, active) for each in seen)
            aborted_in_time(ros, number, "the owner of arm left has ended")
        assert not ros.manager("load_controller", name=VELOCITY)["ok"]
        answer = ros.switch([VELOCITY])
        assert not answer["ok"]
        assert "owner of arm left" in answer["message"]
        ros.do("forget", topic="/diagnostics")
        status = ros.do("heard", topic="/diagnostics")[-1][1]["status"]
        assert [(each["level"], "owner of arm left" in each["message"]) for each in status] == [
            (2, True)
        ]
        with site.owner(*HALF):
            wait_until(lambda: len(ros.components()) == 2, "the components of the next owner")
            assert ros.components() == {
                "bioscara_arm": "inactive",
                "bioscara_gripper_128": "unconfigured",
            }
            assert ros.states() == {}
            energise(ros)
            ros.spawn(VELOCITY)
            go_home(ros)


def test_the_lease_is_taken_for_commands_only_and_a_refusal_is_answered(
    site: Rig, ros: Ros
) -> None:
    with site.node(), site.observed() as other:
        energise(ros)
        ros.spawn(BROADCASTER)
        # A broadcaster commands nothing.
        wait_until(lambda: lease_is_free(other), "a free lease")
        other.acquire_lease()
        before = site.log
        assert not ros.manager("load_controller", name=VELOCITY)["ok"]
        site.logged(f"cannot load '{VELOCITY}': ", before)
        assert not ros.hardware("bioscara_arm", "inactive")["ok"]
        answer = ros.switch((), [BROADCASTER])
        assert not answer["ok"]
        assert "commands" in answer["message"]
        assert ros.states() == {BROADCASTER: "active"}
        other.release_lease()
        ros.spawn(VELOCITY)
        with pytest.raises(LeaseError, match=rf"^{MANAGER}\[\d+\] commands the arm"):
            other.acquire_lease()
        assert ros.switch((), [VELOCITY])["ok"]
        wait_until(lambda: lease_is_free(other), "a lease that was given back")


def test_rule_53_a_switch_that_the_owner_does_not_carry_out_in_time_is_answered(
    site: Rig, ros: Ros
) -> None:
    with site.node():
        ros.spawn(BROADCASTER, active=False)
        with site.observed():
            pid = site.owner_pid
            os.kill(pid, signal.SIGSTOP)
            try:
                begin = time.monotonic()
                answer = ros.manager("switch_controller", activate_controllers=[BROADCASTER])
                took = time.monotonic() - begin
            finally:
                os.kill(pid, signal.SIGCONT)
        assert not answer["ok"]
        assert "has not switched within 1 s" in answer["message"]
        assert 0.9 < took < 3.0
        wait_until(lambda: ros.states() == {BROADCASTER: "active"}, "the owner's answer")


def test_rule_58_nothing_is_activated_at_the_start(site: Rig, ros: Ros) -> None:
    """Neither by default, as there, nor on request of a parameter: a restart energises nothing."""
    with site.node() as node:
        energise(ros)
        assert ros.hardware("bioscara_arm", "inactive")["ok"]
        node.send_signal(signal.SIGINT)
        node.wait(LIMIT)
    with site.node():
        assert ros.components()["bioscara_arm"] == "inactive"
        assert ros.states() == {}


def test_a_stop_of_another_client_leaves_controllers_inactive_until_the_next_switch(
    site: Rig, ros: Ros
) -> None:
    with site.node(), site.observed() as other:
        energise(ros)
        ros.spawn(VELOCITY)
        number = follow(ros, VELOCITY, goal(near(0.3, at=10.0)))
        other.stop()
        end = ended(ros, number)
        assert end["status"] == ABORTED
        assert end["result"]["error_string"]
        wait_until(lambda: ros.states() == {VELOCITY: "inactive"}, "no active controller")
        assert follow(ros, VELOCITY, goal(near(0.0, at=1.0))) is None
        wait_until(lambda: not other.is_moving, "an arm at rest")
        assert ros.switch([VELOCITY])["ok"]
        go_home(ros)


def test_a_node_that_is_killed_stops_the_arm_and_the_next_one_goes_on(site: Rig, ros: Ros) -> None:
    with site.observed() as other:
        with site.node() as node:
            energise(ros)
            ros.spawn(BROADCASTER)
            ros.spawn(VELOCITY)
            assert follow(ros, VELOCITY, goal(near(0.4, at=10.0))) is not None
            wait_until(lambda: abs(other.state.velocities[0]) > 0.01, "an arm in motion")
            node.kill()
            node.wait()
            wait_until(lambda: not other.is_moving, "an arm at rest")
            assert abs(other.state.velocities[0]) < 0.01
            assert other.state.positions[0] < HALF[0] + 0.35
        with site.node():
            ros.found()
            assert ros.states() == {}
            ros.spawn(BROADCASTER)
            ros.spawn(VELOCITY)
            go_home(ros)


def test_rule_65_ctrl_c_twice_ends_the_node_once_its_controllers_are_unloaded(
    site: Rig, ros: Ros
) -> None:
    with site.observed() as other:
        with site.node() as node:
            energise(ros)
            ros.spawn(VELOCITY)
            assert follow(ros, VELOCITY, goal(near(0.3, at=10.0))) is not None
            begin = time.monotonic()
            node.send_signal(signal.SIGINT)
            time.sleep(0.05)
            node.send_signal(signal.SIGINT)
            assert node.wait(LIMIT) == 0
            # Launch sends SIGTERM after 5 s.
            assert time.monotonic() - begin < 5.0
        listed = [each.name for each in other.controllers.list().controllers]
        assert all(name.startswith("arm.") for name in listed)
        assert "Traceback" not in site.log
        wait_until(lambda: lease_is_free(other), "a free lease")


def test_a_node_whose_log_is_not_read_answers_and_ends(site: Rig, ros: Ros) -> None:
    # Much of this log is written by code in C.
    words = ("--arm", NAME, "--ros-args", "--log-level", "debug")
    with unread() as log, site.node(*words, stderr=log.written) as node, site.observed() as other:
        ros.found()
        energise(ros)
        ros.spawn(VELOCITY)
        log.block()
        assert not ros.manager("load_controller", name="unknown")["ok"]
        number = follow(ros, VELOCITY, goal(near(0.3, at=60.0)))
        for _ in range(400):
            assert ros.states() == {VELOCITY: "active"}
        begin = time.monotonic()
        ros.do("cancel", number=number)
        assert ended(ros, number)["status"] == CANCELED
        assert time.monotonic() - begin < 2.0
        follow(ros, VELOCITY, goal(near(0.3, at=60.0)))
        wait_until(lambda: other.is_moving, "an arm in motion")
        other.stop()
        wait_until(lambda: not other.is_moving, "an arm at rest", 2.0)
        log.read()
        assert "cannot load 'unknown'" in log.wait_for("left out here, as the output was not read")
        node.send_signal(signal.SIGINT)
        assert node.wait(LIMIT) == 0


def test_a_second_node_of_the_same_name_is_reported(site: Rig, ros: Ros) -> None:
    with site.node():
        ros.spawn(BROADCASTER)
        before = site.log
        with site.node():
            site.logged("another node is named /controller_manager", before)


def test_rule_69_with_a_bus_the_node_has_an_owner_of_its_own_as_long_as_it_runs(empty: Rig) -> None:
    site = empty
    with site.clients() as ros, site.node("--bus", "sim") as node:
        wait_until(lambda: running(site).keys() == {"arm"}, "an owner")
        ros.found()
        arm = ros.manager("list_hardware_components")["component"][0]
        # update_rate of the parameter files.
        assert arm["rw_rate"] == 50
        node.kill()
        node.wait()
        wait_until(lambda: not running(site), "the end of the owner")
    with site.clients() as ros, site.node("--bus", "sim") as node:
        energise(ros)
        node.send_signal(signal.SIGINT)
        assert node.wait(LIMIT) == 0
        assert not running(site)


def test_the_owner_of_a_node_is_used_by_no_other_and_its_end_aborts_goals(empty: Rig) -> None:
    site = empty
    with site.clients() as ros, site.node("--bus", "sim", "--homed") as node:
        ros.found()
        energise(ros)
        ros.spawn(VELOCITY)
        pid, before = running(site)["arm"], site.log
        with site.node("--bus", "sim") as other:
            assert other.wait(LIMIT) == 2
        site.logged(f"arm arm has an owner, process {pid} on sim; leave out --bus")
        assert "connected to the owner" not in site.log.removeprefix(before)
        number = follow(ros, VELOCITY, SLOWLY)
        os.kill(pid, signal.SIGSTOP)
        aborted_in_time(ros, number, "has been silent")
        os.kill(pid, signal.SIGCONT)
        wait_until(lambda: ros.states() == {VELOCITY: "inactive"}, "the owner")
        assert ros.switch([VELOCITY])["ok"]
        number = follow(ros, VELOCITY, SLOWLY)
        os.kill(pid, signal.SIGKILL)
        aborted_in_time(ros, number, "has ended")
        assert node.wait(LIMIT) == 1
    site.logged("the owner of the arm has ended with status -9", before)


def test_an_owner_that_cannot_begin_ends_the_node(empty: Rig) -> None:
    site = empty
    with site.node("--bus", "linux:99") as node:
        assert node.wait(LIMIT) == 1
    site.logged("the owner of the arm has ended with status")


def test_arguments_that_ros_refuses_are_one_sentence(empty: Rig) -> None:
    before = empty.log if (empty.folder / "node.log").exists() else ""
    with empty.node(configs=[Path("/nowhere/manager.yaml")]) as node:
        assert node.wait(LIMIT) == 2
    log = empty.log.removeprefix(before)
    assert "ROS refuses the arguments" in log
    assert "/nowhere/manager.yaml" in log
    assert "Traceback" not in log


def test_beside_an_owner_the_node_is_started_by_serve(empty: Rig) -> None:
    site = empty
    words = [str(site.python), "-m", "bioscara", "serve", "--bus", "sim", "--name", NAME]
    text = site.folder / "described.yaml"
    text.write_text(
        yaml.safe_dump(
            {"controller_manager": {"ros__parameters": {"robot_description": URDF.read_text()}}},
            width=10**9,
        )
    )
    with subprocess.Popen(
        [*words, "--with", f"ros --ros-args --params-file {text}"], env=site.environment
    ) as process:
        try:
            with site.clients() as ros:
                assert len(ros.components()) == 2
        finally:
            process.terminate()
            assert process.wait(LIMIT) == 0


def stamp(message: Any) -> float:
    found = message["header"]["stamp"]
    return float(found["sec"] + 1e-9 * found["nanosec"])


def test_with_simulated_time_stamps_are_those_of_the_clock(site: Rig, ros: Ros) -> None:
    clock, kind = "/clock", "rosgraph_msgs/Clock"
    with site.node():
        ros.spawn(BROADCASTER)
        ros.do("listen", type="sensor_msgs/JointState", topic="/joint_states", qos="best_effort")
        assert stamp(ros.do("heard", topic="/joint_states")[-1][1]) > 1e9
        assert ros.set_parameters(MANAGER, use_sim_time=True)[0]["successful"]
        message = {"clock": {"sec": 1234}}
        ros.do("publish", type=kind, topic=clock, message=message, times=10, period=0.05)
        ros.do("forget", topic="/joint_states")
        heard = ros.do("heard", topic="/joint_states", count=5)
        assert stamp(heard[-1][1]) == pytest.approx(1234.0, abs=0.1)
