"""Unfolding an arm that homing left folded up, and the planning of that path."""

from __future__ import annotations

import numpy as np
import pytest

from bioscara.errors import ZoneError
from bioscara.kinematics import Joints
from bioscara.model import load_parameters
from bioscara.planning import point_to_point
from bioscara.planning.collision.unfolding import OPEN
from bioscara.robot.planner import Planner
from bioscara.robot.workspace.workspace import Workspace

ARM = load_parameters()
NAMES = [joint.name for joint in ARM.joints]
HOMED = Joints(-3.04568, 0.33792, 2.62565, 3.00842)


def planner(here: Joints = HOMED) -> Planner:
    return Planner(Workspace.of(ARM), lambda: here)


def test_a_refused_direct_motion_is_planned_by_an_open_elbow() -> None:
    plan, goal = planner(), Joints(-3.04568, 0.33792, 2.13498786, -1.29199182)
    with pytest.raises(ZoneError, match=r"unfold\(\)"):
        plan.check_trajectory(point_to_point(NAMES, HOMED, goal, ARM.joints), HOMED)
    found = plan.move_joints(goal)
    assert "the elbow moves alone" in found.notes[-1]
    way = found.trajectory
    rows = way.sample_many(np.linspace(0.0, way.duration, 400))[0]
    assert rows[-1] == pytest.approx(goal)
    wrist = rows[np.abs(rows[:, 2]) > OPEN][:, 3]
    assert np.minimum(np.abs(wrist - HOMED.j4), np.abs(wrist - goal.j4)).max() < 1e-9


def test_unfold_moves_the_elbow_alone_and_nothing_if_it_is_open() -> None:
    way = planner().unfold().trajectory
    rows = way.sample_many(np.linspace(0.0, way.duration, 50))[0]
    assert rows[-1, 2] == 0.0
    assert np.ptp(rows[:, [0, 1, 3]], axis=0).max() == 0.0
    assert planner(HOMED._replace(j3=0.0)).unfold().trajectory.duration == 0.0
