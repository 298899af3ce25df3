"""Motions of the tool on the simulated arm: to the commanded goal, along the commanded path."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from bioscara import Robot
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.errors import (
    InvalidArgumentError,
    LifecycleError,
    MotionCancelledError,
    UnreachableError,
    ZoneError,
)
from bioscara.kinematics import Pose, batch
from bioscara.model import load_parameters
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.planning.motions.jog_limitation import JogLimit, JogLimitation
from bioscara.planning.motions.waypoints import Motion, Waypoint
from bioscara.report import CycleRecord, Phase
from bioscara.robot.operations.operation import Operation
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.poses import NamedPose
from bioscara.robot.workspace.tools import Tool
from simulated import homed_robot

ARM = load_parameters()
HERE = Pose(0.45, -0.20, 0.25)


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    with homed_robot(tmp_path_factory.mktemp("evidence"), (0.0, 0.2, 0.0, 0.0), seed=4) as made:
        yield made.robot


def tool_path(robot: Robot, records: list[CycleRecord]) -> np.ndarray:
    rows = [
        [joint.position for joint in record.joints]
        for record in records
        if record.phase is Phase.TRAJECTORY
    ]
    return batch.forward(robot.kinematics, np.array(rows))


def follow(robot: Robot, plan: object) -> np.ndarray:
    records: list[CycleRecord] = []
    robot.execute(plan, on_cycle=records.append)  # type: ignore[arg-type]
    return tool_path(robot, records)


def near(pose: Pose, expected: Pose) -> bool:
    return math.dist(pose[:3], expected[:3]) < 2e-3 and abs(pose.yaw - expected.yaw) < 5e-3


def test_a_line_is_a_line(robot: Robot) -> None:
    robot.move_to(HERE)
    goal = Pose(0.35, 0.30, 0.28)
    way = follow(robot, robot.plan.move_linear(goal))
    assert near(robot.pose, goal)
    start, end = np.array(HERE[:3]), np.array(goal[:3])
    along = (end - start) / np.linalg.norm(end - start)
    off = way[:, :3] - start
    off -= np.outer(off @ along, along)
    assert np.linalg.norm(off, axis=1).max() < 2e-3


def test_an_arc_passes_its_point(robot: Robot) -> None:
    robot.move_to(Pose(0.40, -0.15, 0.25))
    via, goal = Pose(0.50, 0.0, 0.25), Pose(0.40, 0.15, 0.25)
    way = follow(robot, robot.plan.move_circular(via, goal))
    assert near(robot.pose, goal)
    assert np.linalg.norm(way[:, :3] - np.array(via[:3]), axis=1).min() < 5e-3


def test_a_sequence_rounds_its_corners_without_a_stop(robot: Robot) -> None:
    corners = [(0.5, -0.2), (0.5, 0.2), (0.4, 0.2), (0.4, -0.2)]
    robot.move_to(Pose(*corners[0], 0.2))
    plan = robot.plan.move_sequence(
        [Waypoint(Pose(x, y, 0.2), Motion.LIN, blend=0.01) for x, y in corners[1:-1]]
        + [Waypoint(Pose(*corners[-1], 0.2), Motion.LIN)]
    )
    way = follow(robot, plan)
    assert near(robot.pose, Pose(*corners[-1], 0.2))
    for x, y in corners[1:-1]:
        assert np.hypot(way[:, 0] - x, way[:, 1] - y).min() < 0.012
    inner = plan.trajectory.sample_many(np.linspace(0.2, plan.trajectory.duration - 0.3, 500))
    speeds = batch.tool_speeds(robot.kinematics, inner[0], inner[1])
    assert speeds.min() > 0.02
    assert speeds.max() <= 0.25 * (1 + 1e-6)


def test_a_reduced_blend_is_reported(robot: Robot) -> None:
    robot.move_to(Pose(0.5, -0.1, 0.2))
    corner, end = Pose(0.5, 0.0, 0.2), Pose(0.45, 0.0, 0.2)
    motion = robot.move_sequence([Waypoint(corner, blend=0.04), Waypoint(end)])
    assert re.match(r"waypoint 0: blend 0\.04 m .*; 0\.025 m is used$", motion.notes[-1])


@pytest.mark.parametrize(
    ("pose", "error", "complaint"),
    [
        (Pose(450.0, -200.0, 250.0), InvalidArgumentError, "millimetres"),
        (Pose(0.9, 0.0, 0.2), UnreachableError, "beyond the reach"),
        (Pose(0.45, -0.2, 0.9), UnreachableError, "j2"),
        (Pose(math.nan, 0.0, 0.2), InvalidArgumentError, "finite"),
    ],
)
def test_an_unreachable_pose_is_refused_and_nothing_moves(
    robot: Robot, pose: Pose, error: type[Exception], complaint: str
) -> None:
    before = robot.state.positions
    for move in (robot.move_to, robot.move_linear):
        with pytest.raises(error, match=complaint):
            move(pose)
    assert robot.state.positions == pytest.approx(before, abs=1e-4)


def test_a_zone_is_not_entered(robot: Robot) -> None:
    robot.move_to(HERE)
    robot.scene = Scene((Box("rack", (0.30, -0.05, 0.0), (0.6, 0.05, 0.4)),))
    try:
        with pytest.raises(ZoneError, match="rack"):
            robot.move_linear(HERE._replace(y=0.2))
        assert near(robot.pose, HERE)
        stopped = jog(robot, ToolVelocity(y=0.1), 4.0)
        assert stopped.y < -0.05
        assert robot.runner.arm.stack.jog.jog is not None
    finally:
        robot.scene = Scene()
    robot.move_to(HERE)


def jog(robot: Robot, velocity: JointVelocity | ToolVelocity, seconds: float) -> Pose:
    until = robot.clock.now() + seconds

    def velocities() -> JointVelocity | ToolVelocity | None:
        return velocity if robot.clock.now() < until else None

    robot.jog(velocities)
    return robot.pose


def commanded(robot: Robot) -> list[float]:
    return [guard.here for guard in robot.runner.arm.stack.manager.limiter.joints.values()]


@pytest.mark.parametrize("share", [0.3, 0.4, 0.5, 0.7])
def test_a_cancelled_motion_stops_on_its_checked_path(robot: Robot, share: float) -> None:
    """An arc in a ring: straight on, the arm would come to rest beyond it."""
    middle, radius = (0.42, 0.0), 0.05
    start, via, goal = (
        Pose(middle[0] + radius * math.cos(turn), radius * math.sin(turn), 0.2)
        for turn in (-2.4, 0.0, 2.4)
    )
    robot.move_joints((0.0, 0.2, 0.3, 0.0))
    robot.move_to(start)
    ring = Cylinder("ring", *middle, radius + 5.2e-3, -0.5, 0.6, keep_in=True, links=("tool",))
    robot.scene = scene = Scene((ring,))
    try:
        arc = robot.plan.move_circular(via, goal).trajectory
        rows: list[list[float]] = []
        begin = robot.clock.now()

        def observe(_: CycleRecord) -> None:
            rows.append(commanded(robot))
            if robot.clock.now() - begin > share * arc.duration:
                robot.stop()

        with pytest.raises(MotionCancelledError):
            robot.follow(arc, on_cycle=observe)
    finally:
        robot.scene = Scene()
    assert np.abs(rows[-1] - arc.positions[-1]).max() > 0.05
    assert max(map(abs, robot.state.velocities)) < 0.02
    assert scene.clearance(robot.kinematics, rows).min() > scene.margin
    limits = [joint.max_acceleration for joint in ARM.joints]
    assert (np.abs(np.diff(rows, 2, axis=0)).max(axis=0) * 1e4 <= np.array(limits) * 1.01).all()


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_aborted_jog_stops_on_its_checked_path(robot: Robot, error: type[BaseException]) -> None:
    start = (0.08, 0.2, 1.638, 0.059)
    corners = (0.2818, 0.4341, -0.5), (0.3418, 0.4941, 0.6)
    scene = Scene((Box("post", *corners, yaw=1.048, links=("tool",)),))
    least = []
    for seconds in (0.2, 0.25, 0.3, 0.4):
        robot.move_joints(start)
        robot.scene, rows = scene, []
        end = robot.clock.now() + seconds

        def velocities(end: float = end) -> ToolVelocity:
            if robot.clock.now() > end:
                raise error
            return ToolVelocity(0.2128, 0.2115, 0.0, 1.808)

        try:
            with pytest.raises(error):
                robot.jog(velocities, on_cycle=lambda _, rows=rows: rows.append(commanded(robot)))
        finally:
            robot.scene = Scene()
        assert rows[-1] == pytest.approx(rows[-3], abs=1e-9)
        least.append(scene.clearance(robot.kinematics, rows).min())
    assert scene.margin - 1e-6 <= min(least) < scene.margin + 5e-3


def test_a_jog_follows_its_velocities_and_ends_at_rest(robot: Robot) -> None:
    robot.move_to(HERE)
    there = jog(robot, ToolVelocity(y=0.05), 1.0)
    assert there.y - HERE.y == pytest.approx(0.05, abs=0.01)
    assert (there.x, there.z) == pytest.approx((HERE.x, HERE.z), abs=2e-3)
    assert max(map(abs, robot.state.velocities)) < 0.02
    turned = jog(robot, JointVelocity(j4=0.3), 1.0)
    assert turned.yaw - there.yaw == pytest.approx(0.3, abs=0.05)


@pytest.mark.parametrize("elbow", [-0.8, 0.8])
def test_a_straight_arm_is_jogged_to_the_side_from_which_it_came(
    robot: Robot, elbow: float
) -> None:
    robot.move_joints((0.1, 0.2, elbow, 0.2))
    robot.move_joints((0.1, 0.2, 0.0, 0.2))
    before = robot.pose
    after = jog(robot, ToolVelocity(0.02, 0.0, 0.02, 0.2), 1.0)
    # Outwards only z and yaw are carried out, by the lift and the wrist.
    assert after.z - before.z > 0.012
    assert after.yaw - before.yaw > 0.12
    assert robot.state.positions[:3:2] == pytest.approx((0.1, 0.0), abs=2e-3)
    rates: list[float] = []

    def observe(record: CycleRecord) -> None:
        rates.append(record.joints[2].velocity)

    until = robot.clock.now() + 1.5
    inwards = ToolVelocity(-0.05)
    robot.jog(lambda: inwards if robot.clock.now() < until else None, on_cycle=observe)
    assert after.x - robot.pose.x > 0.02
    assert robot.pose.y == pytest.approx(after.y, abs=3e-3)
    assert robot.state.positions[2] * elbow > 0.1
    # Measured, too, the velocity of the elbow does not jump.
    assert np.abs(np.diff(rates)).max() < 14.0 * robot.period


CLEAR = (0.3, 0.2, 0.8, -0.5)
HELD: dict[str, tuple[tuple[float, ...], JointVelocity | ToolVelocity, JogLimit, bool, str]] = {
    "joint limit": (
        (0.3, 0.33, 0.8, -0.5),
        JointVelocity(j2=0.02),
        JogLimit.JOINT_LIMIT,
        True,
        "held: j2 at its upper limit 0.338 m",
    ),
    "joint speed": (
        CLEAR,
        ToolVelocity(z=0.05),
        JogLimit.JOINT_SPEED,
        False,
        "slowed: j2 at its highest speed 0.02 m/s",
    ),
    "zone": (CLEAR, ToolVelocity(y=0.1), JogLimit.ZONE, True, r"held: \w+ at the margin of wall"),
    "table": (
        CLEAR,
        ToolVelocity(z=-0.03),
        JogLimit.TABLE,
        True,
        r"held: \w+ at the margin of table",
    ),
    "self": (
        (0.3, 0.2, 2.0, 1.5),
        JointVelocity(j3=0.4, j4=0.6),
        JogLimit.SELF,
        True,
        r"held: \w+ at the margin of (link_1|base_link)",
    ),
    "stretched": (
        (0.3, 0.2, 0.0, 0.0),
        ToolVelocity(x=0.05),
        JogLimit.STRETCHED,
        True,
        "x, y held: the elbow is straight; move inwards",
    ),
    "tool speed": (
        CLEAR,
        ToolVelocity(y=0.5),
        JogLimit.TOOL_SPEED,
        False,
        r"slowed: the tool at 0\.185 m/s, the limit at reduced speed or with the load",
    ),
}


@pytest.mark.parametrize("case", HELD)
def test_a_jog_that_is_slowed_or_held_says_why(robot: Robot, case: str) -> None:
    start, velocity, limit, held, text = HELD[case]
    robot.move_joints(start)
    x, y = robot.pose[:2]
    wall = Box("wall", (x - 0.3, y + 0.15, -0.5), (x + 0.3, y + 0.4, 0.9))
    robot.scene = Scene((wall,) if case == "zone" else (), 0.1 if case == "table" else None)
    until, seen = robot.clock.now() + (6.0 if held else 0.8), set()
    try:
        operation = robot.jog(
            lambda: velocity if robot.clock.now() < until else None,
            on_cycle=lambda _: seen.add(operation_of(robot).limitation),
        )
    finally:
        robot.scene = Scene()
    limitation = operation.limitation
    assert isinstance(limitation, JogLimitation)
    assert (limitation.limit, limitation.held) == (limit, held)
    assert re.fullmatch(text, str(limitation))
    assert limitation in seen
    # A velocity that the arm follows has none.
    robot.move_joints(CLEAR)
    until = robot.clock.now() + 0.5
    turn = JointVelocity(j4=0.1)
    assert robot.jog(lambda: turn if robot.clock.now() < until else None).limitation is None


def operation_of(robot: Robot) -> Operation[Any]:
    (operation,) = robot.runner.arm.operations
    return operation


def test_a_jog_goes_at_the_chosen_share_of_its_velocity(robot: Robot) -> None:
    robot.move_joints((0.0, 0.2, 0.0, 0.0))
    try:
        ways = {}
        for speed in (1.0, 0.25, 0.0):
            robot.speed_override = speed
            before = robot.state.positions[3]
            jog(robot, JointVelocity(j4=0.3), 1.0)
            ways[speed] = robot.state.positions[3] - before
        assert ways[1.0] > 0.299
        assert ways[0.25] == pytest.approx(0.25 * ways[1.0], rel=0.05)
        assert ways[0.0] == pytest.approx(0.0, abs=1e-3)
        with pytest.raises(InvalidArgumentError, match="j4 velocity: 100 rad/s"):
            jog(robot, JointVelocity(j4=100.0), 1.0)
    finally:
        robot.speed_override = 1.0


def test_a_jog_that_starts_in_a_zone_is_refused_and_changes_nothing(robot: Robot) -> None:
    robot.move_to(HERE)
    active = [each.state for each in robot.runner.arm.stack.manager.controllers]
    robot.scene = Scene((Box("crate", (-2.0, -2.0, -2.0), (2.0, 2.0, 2.0)),))
    try:
        with pytest.raises(ZoneError, match="crate"):
            jog(robot, JointVelocity(j4=0.3), 1.0)
    finally:
        robot.scene = Scene()
    assert [each.state for each in robot.runner.arm.stack.manager.controllers] == active
    assert near(robot.pose, HERE)


def test_the_speed_can_be_changed_in_motion(robot: Robot) -> None:
    def duration(speed: float) -> float:
        robot.move_joints((0.0, 0.2, 0.0, 0.0))
        begin, changed = robot.clock.now(), False

        def observe(record: CycleRecord) -> None:
            nonlocal changed
            if record.trajectory_time > 0.5 and not changed:
                changed = True
                robot.speed_override = speed

        robot.move_joints((1.0, 0.2, 0.5, 0.5), on_cycle=observe)
        robot.speed_override = 1.0
        return robot.clock.now() - begin

    assert duration(0.5) > 1.5 * duration(1.0)
    with pytest.raises(InvalidArgumentError, match="10"):
        robot.speed_override = 10.0
    with pytest.raises(InvalidArgumentError, match="outside 0"):
        robot.move_joints((0.0, 0.2, 0.0, 0.0), velocity_scaling=0.0)


def test_poses_and_tools_have_names(robot: Robot) -> None:
    table = robot.table
    probe = Tool("probe", Pose(0.05, 0.0, -0.1), 0.1)
    try:
        robot.table = table.with_tool(probe).with_pose(NamedPose("well", None, HERE, "probe", ""))
        robot.move_named("center")
        assert robot.state.positions == pytest.approx((0.0, 0.2, 0.0, 0.0), abs=2e-3)
        with pytest.raises(InvalidArgumentError, match=r"well.*probe"):
            robot.move_named("well")
        with pytest.raises(InvalidArgumentError, match="did you mean center"):
            robot.move_named("centre")
        with pytest.raises(InvalidArgumentError, match="did you mean probe"):
            robot.tool = "prob"
        robot.tool = "probe"
        robot.move_named("well")
        assert near(robot.pose, HERE)
    finally:
        robot.tool = "fingers"
        robot.table = table


def test_a_mounted_tool_is_as_the_table_has_it(robot: Robot) -> None:
    table = robot.table
    probe = Tool("probe", Pose(0.05, 0.0, -0.1), 0.1)
    longer = Tool("probe", Pose(0.05, 0.0, -0.15), 0.1)
    try:
        robot.table = table.with_tool(probe)
        robot.tool = probe
        height = robot.pose.z
        robot.table = robot.table.with_tool(longer, overwrite=True)
        assert robot.tool == longer
        assert robot.pose.z == pytest.approx(height - 0.05)
        with pytest.raises(InvalidArgumentError, match="probe is another one in the table"):
            robot.tool = probe
        with pytest.raises(InvalidArgumentError, match="no tool probe, which is mounted"):
            robot.table = table
        robot.attach(Load("vial", Prism(0.0, 0.0, 0.01, 0.01, -0.01, 0.01)))
        with pytest.raises(LifecycleError, match="carries vial"):
            robot.table = robot.table.with_tool(probe, overwrite=True)
        robot.detach()
    finally:
        robot.tool = "fingers"
        robot.table = table


def test_raw_setpoints_keep_clear_of_the_planner_scene(robot: Robot) -> None:
    robot.move_joints((0.3, 0.2, 0.8, -0.5))
    stack, scene = robot.runner.arm.stack, robot.scene
    names = tuple(joint.name for joint in ARM.joints)
    values = {"joints": names, "interface_name": "position"}
    forward = stack.manager.load("raw", ForwardCommandController.TYPE, values)
    assert isinstance(forward, ForwardCommandController)
    stack.manager.configure("raw")
    robot.scene = Scene((Box("wall", (-0.2, 0.62, 0.0), (0.6, 0.9, 0.6)),))
    try:
        stack.use("raw", robot.clock.now())
        forward.command((1.5, 0.2, 0.8, -0.5))
        stack.loop.restart()
        for _ in range(600):
            stack.loop.step()
        here = [guard.here for guard in stack.manager.limiter.joints.values()]
        assert robot.scene.clearance(robot.plan.kinematics, [here])[0] >= 5e-3
        assert "wall" in stack.manager.warnings[-1]
        # From where it was stopped a planned motion leads away.
        robot.move_joints((0.3, 0.2, 0.8, -0.5))
        assert stack.collision_guard.interventions > 10
    finally:
        robot.scene = scene
    stack.manager.cleanup("raw")
    stack.manager.unload("raw")
