"""The properties that a plan reports."""

from __future__ import annotations

import contextlib
import math

import numpy as np
import pytest

from bioscara.errors import BioscaraError, InvalidArgumentError, ZoneError
from bioscara.kinematics import Joints
from bioscara.model import load_parameters
from bioscara.planning import check
from bioscara.planning.limits import FULL, SLOWEST, MotionLimits, ToolLimits
from bioscara.planning.motions.tool_speed import COMMANDED_SPEED
from bioscara.planning.trajectory.trajectory import Trajectory
from bioscara.robot.planner import Planner
from bioscara.robot.workspace.workspace import Workspace

ARM = load_parameters()
ROOM = Workspace.of(ARM)
NAMES = tuple(limit.name for limit in ARM.joints)
HERE = Joints(0.0, 0.2, 1.0, 0.0)


def test_a_line_that_keeps_to_its_speed_has_no_note_of_stretching() -> None:
    rng = np.random.default_rng(3)
    planned = 0
    for _ in range(60):
        here = Joints(*(rng.uniform(0.8 * limit.lower, 0.8 * limit.upper) for limit in ARM.joints))
        planner = Planner(ROOM, lambda here=here: here)
        tool = planner.kinematics.forward(here)
        goal = tool._replace(x=tool.x + rng.normal() * 0.1, y=tool.y + rng.normal() * 0.1)
        try:
            plan = planner.move_linear(goal)
        except BioscaraError:
            continue
        planned += 1
        assert not plan.notes
    assert planned > 20


@pytest.mark.parametrize("reduced_speed", [True, False])
def test_plans_keep_every_limit(reduced_speed: bool) -> None:
    space = Workspace.of(ARM, reduced_speed=reduced_speed)
    rng = np.random.default_rng(11)
    planned = 0
    for number in range(120):
        here, goal = (
            Joints(*(rng.uniform(limit.lower, limit.upper) for limit in ARM.joints)) for _ in "hg"
        )
        if number % 2:
            # The lift's speed is the limit, not that of the tool.
            goal = here._replace(j2=goal.j2, j4=0.9 * here.j4)
        planner = Planner(space, lambda here=here: here)
        for plan in (lambda planner=planner, goal=goal: planner.move_joints(goal), planner.unfold):
            with contextlib.suppress(ZoneError):
                trajectory = plan().trajectory
                check(trajectory, ARM.joints)
                planned += 1
    assert planned > 120


@pytest.mark.parametrize("share", [SLOWEST, 0.005, 0.3])
def test_plans_keep_to_any_share_of_the_acceleration(share: float) -> None:
    planner = Planner(ROOM, lambda: HERE)
    goal = HERE._replace(j1=0.2, j4=0.3)
    plan = planner.move_joints(goal, acceleration_scaling=share)
    assert plan.trajectory.positions[-1] == pytest.approx(goal)
    slowed = [MotionLimits.of(limit, share) for limit in ARM.joints]
    check(plan.trajectory, slowed)


@pytest.mark.parametrize(
    ("velocities", "unusual"),
    [(None, "jumps at each point"), ([[0.0] * 4, [0.1, 0.0, 0.0, 0.0]], "end is not at rest")],
    ids=["no velocities", "no rest"],
)
def test_a_plan_has_notes_on_an_unusual_trajectory(
    velocities: list[list[float]] | None, unusual: str
) -> None:
    steps = Trajectory(NAMES, [0.0, 5.0], [HERE, HERE._replace(j1=0.3)], velocities)
    (note,) = Planner(ROOM, lambda: HERE).check_trajectory(steps, HERE).notes
    assert unusual in note


def test_a_plan_has_the_tool_limits_it_was_kept_to() -> None:
    """Only lines and arcs keep to an acceleration of the tool; nothing does at full speed."""
    planner = Planner(ROOM, lambda: HERE)
    goal = planner.kinematics.forward(HERE)
    goal = goal._replace(x=goal.x + 0.05)
    assert planner.move_linear(goal).tool == ToolLimits(speed=COMMANDED_SPEED)
    assert planner.move_to(goal).tool == ToolLimits(COMMANDED_SPEED, math.inf, math.inf, math.inf)
    planner = Planner(ROOM.with_reduced_speed(False), lambda: HERE)
    assert planner.move_linear(goal).tool == planner.move_to(goal).tool == FULL


@pytest.mark.parametrize("word", ["no", "False", 1, None])
def test_reduced_speed_accepts_only_booleans(word: object) -> None:
    with pytest.raises(InvalidArgumentError, match=r"reduced_speed is .*; give True or False"):
        ROOM.with_reduced_speed(word)  # type: ignore[arg-type]
