"""The joints along a path against single inverse kinematics, and their derivatives."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bioscara.kinematics import Geometry, Joints, Pose, Scara
from bioscara.planning.paths.inverse_kinematics import along
from bioscara.planning.paths.segments import Arc, Joined, Line, Path
from bioscara.planning.topp.constraints import sample_grid
from planning.limits import LIMITS

ARM = Scara(
    Geometry(0.33, 0.285, 0.135), LIMITS, tool=Pose(0.1, 0.03, -0.1, 0.4), base=Pose(1, 2, 3, 0.7)
)
HERE = ARM.forward((0.3, 0.1, 1.2, -0.5))
THERE = ARM.forward((0.9, 0.2, 0.8, 0.6))
BETWEEN = Pose((HERE.x + THERE.x) / 2 + 0.05, (HERE.y + THERE.y) / 2, 3.2)
PATHS = [Line(HERE, THERE), Arc.through(HERE, BETWEEN, THERE)]


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("elbow", [0, 1])
def test_the_joints_reach_the_poses_on_the_elbows_side(path: Path, elbow: int) -> None:
    start = ARM.inverse(HERE)[elbow]
    samples = path.sample(np.linspace(0.0, path.length, 50))
    joints = along(ARM, samples, start).joints
    assert np.allclose(joints[0], start, atol=1e-9)
    assert np.abs(np.diff(joints, axis=0)).max() < 0.3
    assert (np.sign(joints[:, 2]) == (1.0, -1.0)[elbow]).all()
    reached = np.array([ARM.forward(row) for row in joints.tolist()])
    turns = (reached - samples.poses)[:, 3] / (2.0 * math.pi)
    assert np.allclose(reached[:, :3], samples.poses[:, :3], atol=1e-9)
    assert np.allclose(turns, np.round(turns), atol=1e-9)


@pytest.mark.parametrize("turn", [-3.5, -2.9, 2.9, 3.5, 7.0])
def test_an_elbow_past_half_a_turn_continues_from_its_position(turn: float) -> None:
    start = Joints(0.3, 0.1, turn, -0.5)
    here = ARM.forward(start)
    line = Line(here, here._replace(z=here.z + 0.1, yaw=here.yaw + 0.2))
    samples = line.sample(np.linspace(0.0, line.length, 50))
    joints = along(ARM, samples, start).joints
    assert np.allclose(joints[0], start, atol=1e-9)
    assert np.abs(np.diff(joints, axis=0)).max() < 0.3
    reached = np.array([ARM.forward(row) for row in joints.tolist()])
    assert np.allclose(reached, samples.poses, atol=1e-9)


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("elbow", [0, 1])
def test_derivatives_are_the_limits_of_differences(path: Path, elbow: int) -> None:
    start, h = ARM.inverse(HERE)[elbow], 1e-4
    at = np.linspace(0.1, 0.9, 40) * path.length
    # The same first sample for all three, so that none of them is another turn.
    grids = [np.append(0.0, at + shift) for shift in (-h, 0.0, h)]
    before, here, after = (along(ARM, path.sample(grid), start) for grid in grids)
    first = (after.joints - before.joints)[1:] / (2.0 * h)
    second = (after.joints - 2.0 * here.joints + before.joints)[1:] / h**2
    assert np.allclose(here.first[1:], first, atol=2e-6, rtol=1e-5)
    assert np.allclose(here.second[1:], second, atol=1e-4, rtol=1e-4)


def test_at_a_break_both_second_derivatives_are_seen() -> None:
    arm = Scara(ARM.geometry, LIMITS)
    line = Line(Pose(0.45, -0.2, 0.2), Pose(0.45, 0.0, 0.2))
    via = Pose(0.35 + 0.1 * math.cos(0.5), 0.1 * math.sin(0.5), 0.2)
    path = Joined((line, Arc.through(Pose(0.45, 0.0, 0.2), via, Pose(0.35, 0.1, 0.2))))
    start: Joints = arm.inverse(Pose(0.45, -0.2, 0.2))[0]
    seen = sample_grid(arm, path, start, np.array([0.0, 0.1, line.length, path.length]))
    assert np.allclose(seen.tool_before.second[2], 0.0)
    assert np.allclose(seen.tool.second[2], (-10.0, 0.0, 0.0, 0.0), atol=1e-6)
    jump = seen.joints.second[2] - seen.joints_before.second[2]
    rates = arm.rates(seen.joints.joints[2].tolist(), (-10.0, 0.0, 0.0, 0.0))
    assert np.allclose(jump, rates, atol=1e-5)
