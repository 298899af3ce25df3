"""The reports of joints at an owner, and when it reads their counters."""

from __future__ import annotations

import math

from bioscara import Robot
from bioscara.api import messages as m
from bioscara.protocol import ResetCause
from served import NAME, RawClient, arm_served, eventually
from simulated import simulated_bus


def asked(client: RawClient) -> m.JointList:
    result = client.request(m.GetJoints())
    assert isinstance(result, m.JointList)
    return result


def test_joints_report_their_identity_and_their_counters() -> None:
    with arm_served(), RawClient() as client:
        found = asked(client)
        assert [joint.name for joint in found.joints] == ["j1", "j2", "j3", "j4"]
        assert [joint.address for joint in found.joints] == [0x11, 0x12, 0x13, 0x14]
        assert all(joint.boot_id is not None for joint in found.joints)
        assert not math.isnan(found.counted)
        for joint in found.joints:
            assert (joint.protocol, joint.reset_cause, joint.halted) == (2, "power on", "")
            assert "bus errors" in joint.capabilities
            assert joint.counters is not None
            assert joint.hot is False
            assert joint.counters.fault == "NONE"
            assert joint.counters.bus_errors == 0


def test_a_joint_that_restarted_has_another_boot_id_and_says_why() -> None:
    with arm_served() as served, RawClient() as client, Robot.connect(f"arm:{NAME}") as robot:
        before = asked(client).joints[2]
        arm = served.robot.runner.arm.session.bus.arm  # type: ignore[attr-defined]
        arm.reset("j3", ResetCause.WATCHDOG)
        eventually(lambda: client.request(m.GetState()).fault == "latched")
        assert "restarted" in asked(client).joints[2].halted
        (fault,) = client.request(m.GetFaults()).faults
        assert "report that its firmware hung" in fault.text
        assert "supply" not in fault.text
        robot.acknowledge()
        robot.recover()
        after = asked(client).joints[2]
        assert after.reset_cause == "watchdog" != before.reset_cause
        assert after.boot_id != before.boot_id
        assert after.halted == ""


def test_the_counters_of_a_moving_arm_are_left_alone() -> None:
    with arm_served(speed=1.0) as served, RawClient() as client:
        loop = served.robot.runner.arm.stack.loop
        with Robot.connect(f"arm:{NAME}") as robot:
            motion = robot.move_joints((0.9, 0.2, 0.8, -0.5), wait=False)
            assert client.request(m.GetState()).moving
            found = asked(client)
            assert math.isnan(found.counted)
            assert found.joints[0].counters is None
            motion.wait()
            eventually(lambda: not math.isnan(asked(client).counted))
        assert served.robot.faults == ()
        # By the arm's clock: a late computer delays cycles in real time alone.
        assert loop.statistics.periods.percentile(99.0) < 1.5 * loop.period


def test_a_joint_that_overheated_is_hot() -> None:
    with arm_served() as served, RawClient() as client:
        served.robot.enable()
        served.robot.runner.arm.session.bus.arm.overheat("j2")  # type: ignore[attr-defined]
        eventually(lambda: asked(client).joints[1].hot)
        assert not asked(client).joints[0].hot


def test_the_original_firmware_counts_nothing() -> None:
    bus = simulated_bus(v1=True)
    with arm_served(arm=bus.arm, at=None), RawClient() as client:
        found = asked(client)
        assert all(joint.protocol == 1 and joint.counters is None for joint in found.joints)
        assert all(joint.boot_id is None and joint.hot is None for joint in found.joints)
