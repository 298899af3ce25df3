"""Only valid plans are executed: outdated plans, arms that lag or are outside their limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.errors import GoalAbortedError, TrajectoryError, ZoneError
from bioscara.kinematics import Pose
from bioscara.model import load_parameters
from bioscara.planning import point_to_point
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.planning.trajectory.retiming import stretched
from bioscara.report import CycleRecord
from bioscara.robot.planner import Plan
from bioscara.robot.workspace.tools import Tool
from bioscara.sim import SimulatedArm
from simulated import SimulatedRobot, homed_robot

ARM = load_parameters()
NAMES = tuple(joint.name for joint in ARM.joints)
START = (-2.0, 0.30, 2.0, 2.0)


@pytest.fixture
def homed(tmp_path: Path) -> Iterator[SimulatedRobot]:
    with homed_robot(tmp_path, START) as made:
        yield made


@pytest.fixture
def arm(homed: SimulatedRobot) -> SimulatedArm:
    return homed.arm


@pytest.fixture
def robot(homed: SimulatedRobot) -> Robot:
    return homed.robot


def fastest(arm: SimulatedArm) -> float:
    """Return the highest speed once the belts have swung out."""
    arm.run(0.5)
    return max(abs(arm.velocity(name)) for name in NAMES)


def test_a_plan_made_at_full_speed_is_slowed_down_and_keeps_its_goal(
    robot: Robot, arm: SimulatedArm
) -> None:
    robot.reduced_speed = False
    plan = robot.plan.move_joints((-0.5, 0.30, 0.5, 0.5))
    robot.reduced_speed = True
    records: list[CycleRecord] = []
    motion = robot.execute(plan, on_cycle=records.append)
    assert robot.state.positions == pytest.approx((-0.5, 0.30, 0.5, 0.5), abs=2e-3)
    assert fastest(arm) < 1e-3
    for record in records:
        for joint in record.joints:
            assert joint.reference == pytest.approx(joint.position, abs=0.02)
    assert any("to keep the tool at 250 mm/s" in note for note in motion.notes)
    assert robot.warnings == ()


def test_a_plan_is_slowed_down_for_a_longer_tool(robot: Robot) -> None:
    plan = robot.plan.move_joints((-0.5, 0.30, 2.0, 2.0))
    robot.table = robot.table.with_tool(Tool("rod", Pose(0.9, 0.0, -0.2), 0.5))
    robot.tool = "rod"
    begin = robot.clock.now()
    robot.execute(plan)
    assert robot.clock.now() - begin > 1.2 * plan.trajectory.duration
    assert robot.state.positions[0] == pytest.approx(-0.5, abs=2e-3)


def test_a_plan_is_checked_against_the_current_scene(robot: Robot) -> None:
    plan = robot.plan.move_joints((-1.0, 0.30, 2.0, 2.0))
    robot.scene = Scene((Box("crate", (-2.0, -2.0, -2.0), (2.0, 2.0, 2.0)),))
    with pytest.raises(ZoneError, match="crate"):
        robot.execute(plan)
    robot.scene = Scene()
    far = point_to_point(NAMES, START, (-1.0, 0.30, 2.0, 2.0), ARM.joints)
    with pytest.raises(TrajectoryError, match=r"j1.*exceeds the limit"):
        robot.execute(Plan(stretched(far, 0.5)))
    assert robot.state.positions == pytest.approx(START, abs=2e-3)


@pytest.mark.parametrize(
    ("left", "speed", "complaint"),
    [(0.9, 0.15, "path tolerance"), (0.04, 1e-6, "goal_time_tolerance")],
)
def test_a_motion_that_misses_its_goal_is_aborted(
    robot: Robot, arm: SimulatedArm, left: float, speed: float, complaint: str
) -> None:
    def observe(record: CycleRecord) -> None:
        if record.joints[0].position > -1.0 - left:
            robot.runner.arm.stack.tool_speed.limit = speed

    with pytest.raises(GoalAbortedError, match=complaint):
        robot.move_joints((-1.0, 0.30, 2.0, 2.0), on_cycle=observe)
    assert fastest(arm) < 1e-3
    assert robot.faults == ()
    robot.move_joints(START)
    assert robot.state.positions == pytest.approx(START, abs=2e-3)


@pytest.fixture
def turned(robot: Robot, arm: SimulatedArm) -> Robot:
    """The wrist was turned by hand to 0.27 rad beyond its limit while the arm was released."""
    robot.disable()
    arm.remove_stops("j4")
    arm.push("j4", 0.2)
    while arm.position("j4") < 3.24:
        arm.run(0.005)
    arm.push("j4", 0.0)
    arm.run(0.5)
    return robot


def test_an_arm_beyond_a_limit_does_not_follow_a_path(turned: Robot, arm: SimulatedArm) -> None:
    assert turned.state.positions[3] > ARM.joints[3].upper + 0.2
    before = arm.position("j4")
    up = turned.pose._replace(z=0.2)
    asks: list[Callable[[], object]] = [
        lambda: turned.move_linear(up),
        lambda: turned.move_circular(up._replace(z=0.25), up),
        lambda: turned.move_sequence([Waypoint(up)]),
        lambda: turned.jog(lambda: None),
    ]
    for ask in asks:
        with pytest.raises(TrajectoryError, match=r"j4 at 3.* rad beyond its range .*move_joints"):
            ask()
    assert arm.position("j4") == pytest.approx(before, abs=0.01)


def test_an_arm_beyond_a_limit_is_moved_back_by_its_joints(turned: Robot) -> None:
    with pytest.raises(TrajectoryError, match=r"j4: goal 3\.1 rad is outside"):
        turned.move_joints((*START[:3], 3.1))
    found, records = turned.state.positions[3], list[CycleRecord]()
    turned.execute(turned.plan.move_joints(START), on_cycle=records.append)
    assert turned.state.positions == pytest.approx(START, abs=2e-3)
    references = [record.joints[3].reference for record in records]
    assert references[0] == pytest.approx(found, abs=0.01)
    assert max(abs(a - b) for a, b in pairwise(references)) < 0.1
    turned.move_linear(turned.pose._replace(z=turned.pose.z - 0.05))
