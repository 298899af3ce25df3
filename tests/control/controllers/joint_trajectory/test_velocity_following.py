"""A planned motion, followed by velocity alone."""

from __future__ import annotations

from pathlib import Path

from bioscara.control.controllers.joint_trajectory import Goal, GoalStatus, JointTrajectory
from bioscara.planning import read
from control.control_stack import NAMES, World
from control.controllers.joint_trajectory.follower import Follower

DATA = Path(__file__).parents[3] / "data"


def test_velocity_and_pid_follow_a_planned_motion_within_two_thousandths() -> None:
    trajectory, _ = read(DATA / "planned_pilz_ptp.yaml")
    start = dict(zip(trajectory.joint_names, trajectory.positions[0].tolist(), strict=True))
    arm = Follower(
        World(at=start),
        command_interfaces=("velocity",),
        gains={name: {"p": 0.5, "ff_velocity_scale": 1.0} for name in NAMES},
    )
    before = arm.interventions
    goal = arm.jtc.send_goal(Goal(JointTrajectory.of(trajectory)), arm.now)
    worst = 0.0
    while not goal.done:
        arm.step()
        assert goal.feedback is not None
        worst = max(worst, *map(abs, goal.feedback.error.positions))
    assert goal.status is GoalStatus.SUCCEEDED
    assert worst < 2e-3
    assert arm.interventions == before
