"""A load is carried from the grasp to the release, and only then."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.errors import (
    BioscaraError,
    BusyError,
    ConfigurationError,
    GoalRejectedError,
    InvalidArgumentError,
    LifecycleError,
    LimitError,
    MotionCancelledError,
    ZoneError,
)
from bioscara.kinematics import Pose
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.tools import Tool
from robot.bench import Bench
from simulated import ARM, NAMES, simulated_bus

JAWS = ARM.gripper
PLATE = Load(
    "plate", Prism.between((-0.064, -0.043, -0.011), (0.064, 0.043, 0.004)), 0.05, ("table",)
)
HERE = Pose(0.10, 0.35, 0.0112, math.pi / 2)
TABLE = Scene(table_height=0.0)
ABOVE = (0.0, 0.2, 0.0, 0.0)


@pytest.fixture(scope="module")
def homed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Robot]:
    arm = simulated_bus(homed=True, at=ABOVE).arm
    with Bench(arm, tmp_path_factory.mktemp("evidence")).robot as robot:
        robot.move_joints(ABOVE)
        yield robot


@pytest.fixture
def robot(homed: Robot) -> Robot:
    """The robot without a load, with its jaws around a plate on the table."""
    if homed.load is not None:
        homed.detach()
    homed.scene = TABLE
    homed.gripper.open()
    if math.dist(homed.pose[:3], HERE[:3]) > 1e-3:
        homed.move_to(HERE._replace(z=0.15))
        homed.move_to(HERE)
    homed.gripper.move(0.1)
    return homed


def test_the_jaws_open_and_close_over_their_whole_range(robot: Robot) -> None:
    robot.move_relative(z=0.1)
    robot.gripper.open()
    assert robot.gripper.width == pytest.approx(JAWS.upper)
    robot.gripper.close()
    assert robot.gripper.width == pytest.approx(JAWS.lower)


def test_a_load_is_grasped_carried_and_released(robot: Robot) -> None:
    assert robot.load is None
    robot.gripper.grasp(PLATE)
    assert robot.load is PLATE
    assert robot.gripper.widths == pytest.approx((0.083, 0.086))
    robot.move_relative(z=0.1)
    robot.move_relative(y=-0.05)
    # Only the load is too low here: the tool is 9 mm above the table.
    with pytest.raises(ZoneError, match="load comes too near to table"):
        robot.move_relative(z=-0.1021)
    robot.move_relative(z=-0.1)
    robot.gripper.release(0.012)
    assert robot.load is None
    assert robot.gripper.width == pytest.approx(0.098)
    robot.move_relative(z=0.1)
    robot.move_relative(z=-0.1021)


def test_the_width_of_the_grasp_can_be_given(robot: Robot) -> None:
    robot.gripper.grasp(PLATE, 0.08, squeeze=0.001)
    assert robot.gripper.width == pytest.approx(0.079)
    assert robot.gripper.widths == pytest.approx((0.079, 0.08))


def test_a_load_reaches_as_far_as_its_farthest_corner(robot: Robot) -> None:
    robot.attach(PLATE)
    assert robot.kinematics.overhang == pytest.approx(math.hypot(0.064, 0.043))
    robot.detach()
    assert robot.kinematics.overhang == 0.0


def test_a_load_of_a_scene_counts_too(robot: Robot) -> None:
    robot.move_relative(z=0.1)
    tool = robot.tool.pose_tool_in_flange
    robot.scene = TABLE.carrying(PLATE.shape_in_wrist(tool), ["table"])
    assert robot.kinematics.overhang == pytest.approx(math.hypot(0.064, 0.043))


def test_a_load_is_placed_at_the_point_of_a_turned_tool() -> None:
    tool = Tool("hook", Pose(0.1, 0.02, -0.15, math.pi / 2), 0.1)
    load = Load("bar", Prism.between((0.0, -0.01, -0.02), (0.2, 0.01, 0.01)))
    shape = load.shape_in_wrist(tool.pose_tool_in_flange)
    xs, ys = zip(*shape.corners(), strict=True)
    assert (min(xs), max(xs)) == pytest.approx((0.09, 0.11))
    assert (min(ys), max(ys)) == pytest.approx((0.02, 0.22))
    assert (shape.low, shape.high) == pytest.approx((-0.17, -0.14))
    assert load.width == pytest.approx(0.02)


def refused(call: Callable[[], object], error: type[BioscaraError], match: str) -> None:
    with pytest.raises(error, match=match):
        call()


def test_calls_that_a_load_forbids_are_refused(robot: Robot) -> None:
    robot.gripper.grasp(PLATE)
    width = robot.gripper.width
    for call in (robot.gripper.open, robot.gripper.close, lambda: robot.gripper.move(0.1)):
        refused(
            call, LifecycleError, r"gripper\.\w+\(\): the jaws hold plate; gripper\.release\(\)"
        )
    refused(lambda: robot.gripper.grasp(PLATE), LifecycleError, "the jaws hold plate")
    refused(lambda: robot.attach(PLATE), LifecycleError, "carries plate already; detach")
    refused(lambda: setattr(robot, "tool", "fingers"), LifecycleError, "carries plate; detach")
    refused(lambda: setattr(robot, "scene", Scene()), ConfigurationError, "load may touch 'table'")
    assert robot.load is PLATE
    assert robot.scene is TABLE
    assert robot.gripper.width == width


def test_without_a_load_there_is_nothing_to_release(robot: Robot) -> None:
    for call in (robot.gripper.release, robot.detach):
        refused(call, LifecycleError, "carries no load; attach")
    assert robot.gripper.width == 0.1


def test_a_grasp_that_is_refused_moves_nothing(robot: Robot) -> None:
    reader = Box("reader", (0.0, 0.38, 0.0), (0.2, 0.40, 0.03))
    robot.gripper.move(0.1)
    for load, match in (
        (replace(PLATE, touches=()), "load comes too near to table"),
        (replace(PLATE, touches=("rack",)), "'rack', which is not in the scene"),
        (replace(PLATE, shape=Prism.between((-0.05, -0.01, 0), (0.05, 0.01, 0.01))), "0.017"),
        ("plate", "the load is 'plate'; give Load"),
    ):
        refused(lambda load=load: robot.gripper.grasp(load), InvalidArgumentError, match)
    refused(lambda: robot.gripper.grasp(PLATE, math.nan), InvalidArgumentError, "width is nan")
    refused(lambda: robot.gripper.grasp(PLATE, squeeze=3.0), LimitError, "in metres")
    refused(lambda: robot.gripper.grasp(PLATE, 86.0), LimitError, "86 m is outside 0 .. 1 m")
    robot.scene = replace(TABLE, zones=(replace(reader, links=("load",)),))
    refused(lambda: robot.gripper.grasp(PLATE), ZoneError, "load comes too near to reader")
    refused(lambda: robot.attach(PLATE), ZoneError, "load comes too near to reader")
    assert robot.load is None
    assert robot.gripper.width == 0.1


def test_a_release_that_is_refused_keeps_the_load(robot: Robot) -> None:
    robot.gripper.grasp(PLATE)
    refused(lambda: robot.gripper.release(0.05), GoalRejectedError, "0.136")
    refused(lambda: robot.gripper.release(-0.01), LimitError, "-0.01 m is outside 0 .. 1 m")
    refused(lambda: robot.gripper.release(math.nan), InvalidArgumentError, "opening is nan")
    assert robot.load is PLATE
    assert robot.gripper.widths == pytest.approx((0.083, 0.086))


def test_a_grasp_that_is_stopped_attaches_nothing_and_a_release_keeps_the_load(
    robot: Robot,
) -> None:
    refused(
        lambda: robot.gripper.grasp(PLATE, on_cycle=lambda _: robot.stop()),
        MotionCancelledError,
        "interrupted",
    )
    assert robot.load is None
    robot.gripper.move(0.1)
    robot.gripper.grasp(PLATE)
    refused(
        lambda: robot.gripper.release(on_cycle=lambda _: robot.stop()),
        MotionCancelledError,
        "interrupted",
    )
    assert robot.load is PLATE
    robot.gripper.release()


def test_nothing_else_uses_the_arm_during_a_grasp(robot: Robot) -> None:
    errors: list[type[Exception]] = []

    def interfere(_: object) -> None:
        for call in (lambda: robot.attach(PLATE), robot.detach, lambda: robot.move_relative(z=0.1)):
            try:
                call()
            except BioscaraError as error:
                errors.append(type(error))

    robot.gripper.grasp(PLATE, on_cycle=interfere)
    assert errors
    assert set(errors) == {BusyError}
    assert robot.load is PLATE


def test_a_plan_made_without_a_load_is_slowed_down_for_it(robot: Robot) -> None:
    robot.move_relative(z=0.1)
    x, lift, elbow, wrist = robot.state.positions
    plan = robot.plan.move_joints((x, lift, elbow, wrist - 2.0))
    robot.attach(PLATE)
    begin = robot.clock.now()
    motion = robot.execute(plan)
    assert robot.clock.now() - begin > 1.5 * plan.trajectory.duration
    assert "keep the tool and plate at 250 mm/s" in motion.notes[-1]
    assert robot.warnings == ()


def test_a_load_may_be_slower_than_the_tool(robot: Robot) -> None:
    robot.move_relative(z=0.1)
    robot.attach(replace(PLATE, max_speed=0.05))
    plan = robot.plan.move_linear(robot.pose._replace(x=0.2))
    speeds = [
        robot.kinematics.tool_speed(*plan.trajectory.sample(time)[:2])
        for time in (plan.trajectory.duration * step / 200 for step in range(201))
    ]
    assert max(speeds) == pytest.approx(0.05, rel=1e-3)
    robot.reduced_speed = False
    assert robot.plan.move_linear(robot.pose._replace(x=0.2)).trajectory.duration > 2.0
    robot.reduced_speed = True


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"name": "3"}, "load name '3'"),
        ({"shape": (1, 2)}, r"the shape is \(1, 2\); give Prism"),
        ({"shape": Prism.between((-64, -43, 0), (64, 43, 14))}, "are these millimetres"),
        ({"shape": Prism.between((0, 0, 0), (0.6, 0.1, 0.1))}, r"corner is 0\.608 m from the tool"),
        ({"shape": Prism.between((0, 0, 0.1), (0.1, 0.1, 0.0))}, "is not below its top"),
        ({"shape": Prism.between((0.1, 0, 0), (0.0, 0.1, 0.1))}, "half_x: -0.05 m is below zero"),
        ({"shape": Prism(0, 0, 0.1, 0.1, 0, math.nan)}, "high is nan"),
        ({"mass": -1.0}, "mass: -1 kg is below zero"),
        ({"mass": 50.0}, "mass: 50 kg is outside"),
        ({"touches": "table"}, r'give \["table"\]'),
        ({"touches": [3]}, "give a text"),
        ({"max_speed": 0.0}, "max_speed: 0 m/s is below"),
        ({"max_speed": math.nan}, "max_speed is nan"),
    ],
)
def test_impossible_loads_are_refused(change: dict[str, object], complaint: str) -> None:
    with pytest.raises(InvalidArgumentError, match=complaint):
        replace(PLATE, **change)


def test_homing_with_a_load_is_refused_and_moves_nothing(tmp_path: Path) -> None:
    made = Bench(simulated_bus().arm, tmp_path)
    with made.robot as robot:
        # The positions of the joints are unknown: a load is not checked.
        robot.attach(replace(PLATE, touches=()))
        before = [made.arm.position(name) for name in NAMES]
        with pytest.raises(LifecycleError, match=r"home.* carries plate"):
            robot.home()
        after = [made.arm.position(name) for name in NAMES]
        assert after == pytest.approx(before, abs=2e-3)
        robot.detach()
        # The servo is not driven: the jaws may have any width.
        robot.attach(replace(PLATE, touches=()))
        robot.gripper.release()
        assert robot.gripper.width == pytest.approx(JAWS.upper)
