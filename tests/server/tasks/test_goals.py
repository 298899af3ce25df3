"""Which goals an owner keeps, and for how long."""

from __future__ import annotations

import gc
import logging
from itertools import pairwise

import pytest

from bioscara import BioscaraError, InvalidArgumentError, Robot
from bioscara.api import messages as m
from bioscara.control.controllers.joint_trajectory import PreparedGoal
from bioscara.control.faults.kinds import ArmFault
from bioscara.remote.link import OwnerLink
from bioscara.robot.operations.running import Status
from bioscara.server.clients import events
from bioscara.server.tasks import goals
from bioscara.sim import FirmwareBus
from served import HALF, NAME, arm_served, eventually
from simulated import simulated_bus


def kept(kind: type) -> int:
    """Return how many objects of a kind there are; other tests of this process leave some."""
    gc.collect()
    return sum(isinstance(each, kind) for each in gc.get_objects())


def test_old_goals_that_failed_keep_no_trajectories(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(goals, "TRAJECTORIES", 1)
    others = kept(PreparedGoal)
    # Homed by this robot, whose record of the cycles is full then.
    arm = simulated_bus(seed=2).arm
    with arm_served(at=HALF, arm=arm) as served, Robot.connect(f"arm:{NAME}") as robot:
        bus = served.robot.runner.arm.session.bus
        assert isinstance(bus, FirmwareBus)
        for _ in range(4):
            motion = robot.move_joints((0.9, 0.15, 0.2, 0.7), velocity_scaling=0.5, wait=False)
            eventually(lambda: served.owner.goals.running[0].operation.progress > 0.1)
            bus.arm.overheat("j3")
            with pytest.raises(BioscaraError):
                motion.result(20.0)
            bus.arm.overheat("j3", False)
            robot.acknowledge()
            robot.recover()
            robot.move_joints(HALF)
        failed = [goal for goal in served.owner.goals.all if goal.operation.status is Status.FAILED]
        assert len(failed) == 4
        # Of the last goal, which is kept.
        assert kept(PreparedGoal) - others <= 1


def test_the_faults_that_were_acknowledged_by_old_goals_are_dropped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(goals, "TRAJECTORIES", 1)
    others = kept(ArmFault)
    # Homed by this robot, whose record of the cycles is full then.
    arm = simulated_bus(seed=2).arm
    with arm_served(at=HALF, arm=arm) as served, Robot.connect(f"arm:{NAME}") as robot:
        bus = served.robot.runner.arm.session.bus
        assert isinstance(bus, FirmwareBus)
        for _ in range(4):
            robot.enable()
            bus.arm.overheat("j3")
            eventually(lambda: robot.faults)
            bus.arm.overheat("j3", False)
            robot.acknowledge()
            robot.recover()
        # Of the last goal, of the owner, and of its last event.
        assert kept(ArmFault) - others <= 2


def test_the_trajectories_of_the_latest_goals_are_kept_and_the_results_of_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(goals, "TRAJECTORIES", 2)
    with arm_served(at=HALF) as served, Robot.connect(f"arm:{NAME}") as robot:
        for _ in range(4):
            robot.move_relative(z=0.001)
        link = OwnerLink(NAME, lambda _: None, lambda _: None)
        link.open()
        try:
            listed = link.request(m.ListGoals())
            assert isinstance(listed, m.GoalList)
            ended = [(goal.goal, goal.status) for goal in listed.goals]
            last = served.owner.goals.last
            assert ended == [(number, "succeeded") for number in range(last - 3, last + 1)]
            durations = [goal.duration for goal in listed.goals]
            assert min(durations) > 0.0
            for number in (last - 1, last):
                answer = link.request(m.GetTrajectories(number))
                assert isinstance(answer, m.GoalTrajectories)
                assert len(answer.trajectories[0].times) > 2
            with pytest.raises(InvalidArgumentError, match=f"of goal {last - 3} are not kept"):
                link.request(m.GetTrajectories(last - 3))
        finally:
            link.close()


def test_old_goals_that_followed_a_clients_trajectory_do_not_keep_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(goals, "TRAJECTORIES", 1)
    with arm_served(at=HALF) as served, Robot.connect(f"arm:{NAME}") as robot:
        for turn in range(6):
            robot.execute(robot.plan.move_joints((HALF[0] + 0.01 * (turn % 2 + 1), *HALF[1:])))
        assert len(served.owner.goals.all) >= 6
        gc.collect()
        # Of the client's last requests and the last goal.
        assert sum(isinstance(each, m.Follow) for each in gc.get_objects()) <= 2


def test_a_fault_leaves_only_what_events_and_goals_keep_of_it(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    # pytest keeps each record of a log, and the level is what tests before this one left.
    caplog.set_level(logging.CRITICAL, "bioscara")
    # Rings that are full after some faults.
    monkeypatch.setattr(goals, "KEPT", 10)
    monkeypatch.setattr(events, "KEPT", 50)
    # Homed by this robot, whose record of the cycles is full then.
    arm = simulated_bus(seed=2).arm
    with arm_served(at=HALF, arm=arm) as served, Robot.connect(f"arm:{NAME}") as robot:
        bus = served.robot.runner.arm.session.bus
        assert isinstance(bus, FirmwareBus)

        def objects_after(faults: int) -> int:
            for _ in range(faults):
                robot.enable()
                bus.arm.overheat("j3")
                eventually(lambda: robot.faults)
                bus.arm.overheat("j3", False)
                robot.acknowledge()
                robot.recover()
            gc.collect()
            return len(gc.get_objects())

        counts = [objects_after(8) for _ in range(4)]
        # Unbounded, they were about 100 for each fault; what else the process makes comes once.
        assert min(later - before for before, later in pairwise(counts[1:])) < 8 * 20
