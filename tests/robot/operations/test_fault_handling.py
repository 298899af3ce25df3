"""The evidence of a fault is written between cycles, and a slow disk does no harm."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from bioscara.control.faults.kinds import FaultKind
from bioscara.errors import FollowingError
from bioscara.robot.operations.fault_handling import Acknowledge
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory
from simulated import SimulatedRobot, homed_robot

SLOW_DISK = 0.3
"""Duration of an fsync [s]: longer than joints that move wait for a setpoint."""
GOAL = (0.6, 0.2, 0.0, 0.0)


def slow_disk(made: SimulatedRobot, patch: pytest.MonkeyPatch) -> list[float]:
    """Let the arm's time pass while the disk takes a file; return when it did."""
    moments: list[float] = []

    def fsync(_: int) -> None:
        moments.append(made.arm.now())
        made.arm.run(SLOW_DISK)

    patch.setattr(os, "fsync", fsync)
    return moments


def test_a_slow_disk_adds_no_fault_to_that_of_a_motion_in_a_loop_that_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with homed_robot(tmp_path, (0.0, 0.2, 0.0, 0.0)) as made:
        arm, runner, robot = made.robot.runner.arm, made.robot.runner, made.robot
        moments = slow_disk(made, monkeypatch)
        motion = FollowTrajectory("move", lambda planner: planner.move_joints(GOAL))
        runner.begin(motion)
        for cycle in range(2000):
            if cycle == 50:
                error = FollowingError("it is off", "j1", 1.0, 0.5)
                arm.stack.supervisor.fault(error, "j1", made.arm.now())
            runner.step(idle=True)
            if motion.done and cycle > 200:
                break
        assert motion.done
        assert len(moments) == 1, "the evidence is written once"
        for _ in range(20):
            runner.step(idle=True)
        assert [fault.kind for fault in robot.faults] == [FaultKind.FOLLOWING_ERROR]
        assert len(list(tmp_path.glob("*.mcap"))) == 1


def test_a_slow_disk_adds_no_fault_to_one_that_is_acknowledged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with homed_robot(tmp_path, (0.0, 0.2, 0.0, 0.0)) as made:
        arm, runner, robot = made.robot.runner.arm, made.robot.runner, made.robot
        moments = slow_disk(made, monkeypatch)
        error = FollowingError("it is off", "j1", 1.0, 0.5)
        arm.stack.supervisor.fault(error, "j1", made.arm.now())
        acknowledge = Acknowledge("acknowledge()")
        runner.begin(acknowledge)
        while not acknowledge.done:
            runner.step(idle=True)
        assert len(moments) == 1
        for _ in range(20):
            runner.step(idle=True)
        assert [fault.kind for fault in robot.faults] == [FaultKind.FOLLOWING_ERROR]
        robot.recover()
        robot.enable()
