"""Unusable arguments are refused with a message, not by an incidental Python error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from bioscara import Robot
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Pose
from bioscara.model import load_parameters
from bioscara.planning.motions.jog import ToolVelocity
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot.workspace.tools import Tool
from entries import entry
from simulated import homed_robot

ARM = load_parameters()
GOAL = Pose(0.4, 0.2, 0.25)
HALF = (0.3, 0.2, 0.8, -0.5)
Call = Callable[[Any], object]
"""Calls a robot as a user without a type checker does."""


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with homed_robot(tmp_path_factory.mktemp("evidence"), HALF, seed=4) as made:
        yield made.robot


WRONG: list[tuple[Call, str]] = [
    (lambda r: r.move_sequence([GOAL]), r"^waypoint 0 is Pose\(.*\); give Waypoint\(pose\)$"),
    (lambda r: r.move_sequence(GOAL), r"^waypoint 0 is 0\.4; give Waypoint\(pose\)$"),
    (lambda r: r.move_sequence([(0.4, 0.2, 0.25)]), r"^waypoint 0 is \(0\.4, .*give Waypoint"),
    (
        lambda r: r.move_sequence(Waypoint(GOAL)),
        r"^the waypoints are Waypoint\(.*; give a list of Waypoint\(pose\)$",
    ),
    (lambda r: r.move_sequence(None), "^the waypoints are None; give a list"),
    (
        lambda r: r.move_sequence([Waypoint(GOAL, "ptp")]),  # type: ignore[arg-type]
        r"^waypoint 0: motion is 'ptp'; give one of Motion\.PTP, Motion\.LIN, Motion\.CIRC$",
    ),
    (
        lambda r: r.move_sequence([Waypoint(GOAL, blend="1")]),  # type: ignore[arg-type]
        "^waypoint 0: blend is '1'; give a number$",
    ),
    (
        lambda r: r.follow(r.plan.move_to(GOAL)),
        r"^follow\(\) takes a Trajectory, not a Plan; execute\(\) takes a Plan or a Trajectory$",
    ),
    (lambda r: r.follow(None), r"^follow\(\) takes a Trajectory, not a NoneType; execute"),
    (
        lambda r: r.execute(GOAL),
        r"^execute\(\) takes a Plan or a Trajectory, not Pose\(.*; robot\.plan makes plans$",
    ),
    (
        lambda r: r.move_joints(GOAL),
        r"^the positions of the joints are Pose\(.*\); give one for each joint, or a pose to "
        r"move_to\(\)$",
    ),
    (lambda r: r.move_joints(None), "^the positions of the joints are None; give one for each"),
    (lambda r: r.move_joints(0.3), r"^the positions of the joints are 0\.3; give one for each"),
    (lambda r: r.move_joints(("a", 0.2, 0.8, -0.5)), "^j1: goal is 'a'; give a number$"),
    (lambda r: r.move_to(Pose("0.4", 0.2, 0.25)), "^x of the goal is '0.4'; give a number$"),  # type: ignore[arg-type]
    (
        lambda r: r.move_to(GOAL, velocity_scaling="fast"),
        "^velocity_scaling is 'fast'; give a number$",
    ),
    (
        lambda r: r.move_linear(GOAL, acceleration_scaling=None),
        "^acceleration_scaling is None; give a number$",
    ),
    (
        lambda r: setattr(r, "speed_override", "fast"),
        "^speed_override is 'fast'; give a number$",
    ),
    (lambda r: setattr(r, "scene", None), r"^the scene is None; give Scene\(\.\.\.\)$"),
    (lambda r: setattr(r, "table", None), "^the table is None; give a TeachTable$"),
    (lambda r: r.move_named(3), "^name is 3; give a text$"),
    (lambda r: setattr(r, "tool", None), "^there is no tool None"),
    (
        lambda r: r.jog(ToolVelocity(0.1)),
        r"^jog\(\) is given ToolVelocity\(.*\); give a function that returns the velocity, or None",
    ),
    (
        lambda r: r.jog(lambda: GOAL),
        r"^jog: the velocity is Pose\(.*\); give JointVelocity or ToolVelocity$",
    ),
    (lambda r: r.jog(lambda: (0.1, 0.0, 0.0, 0.0)), r"^jog: the velocity is \(0\.1, .*; give"),
]


def test_invalid_arguments_are_refused_and_nothing_moves(robot: Robot) -> None:
    for call, complaint in WRONG:
        with entry(complaint):
            before = robot.state.positions
            with pytest.raises(InvalidArgumentError, match=complaint):
                call(robot)
            assert robot.state.positions == pytest.approx(before, abs=1e-3)


def test_the_tool_cannot_be_changed_without_the_kinematics(robot: Robot) -> None:
    fingers, table, before = robot.tool, robot.table, robot.kinematics.forward(HALF)
    with pytest.raises(AttributeError, match="tool"):
        robot.plan.workspace.tool = fingers  # type: ignore[misc]  # it is frozen
    robot.table = table.with_tool(Tool("rod", Pose(0.1, 0.0, -0.2), 0.5))
    robot.tool = "rod"
    assert robot.kinematics.forward(HALF) == robot.plan.kinematics.forward(HALF) != before
    robot.tool = fingers
    assert robot.kinematics.forward(HALF) == robot.plan.kinematics.forward(HALF) == before
    robot.table = table


def test_a_misspelt_attribute_is_refused(robot: Robot) -> None:
    with pytest.raises(
        AttributeError, match=r"no attribute 'secne' that can be set; did you mean scene"
    ):
        robot.secne = None  # type: ignore[attr-defined]  # as a user without a type checker may do


def test_joints_and_scalings_may_be_numbers_of_numpy(robot: Robot) -> None:
    robot.move_joints(np.array(HALF, dtype=np.float32), velocity_scaling=np.float32(0.5))
    assert robot.state.positions == pytest.approx(HALF, abs=2e-3)
