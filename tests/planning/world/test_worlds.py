"""Worlds in a program: the planner keeps the arm out of bodies, and lets it pick and place them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bioscara import Load, Robot
from bioscara.errors import ConfigurationError, InvalidArgumentError, ZoneError
from bioscara.kinematics import Pose
from bioscara.model.labware import labware_table
from bioscara.planning.collision.margins import goal_slack
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.world import Item, Nest, Table, Wall, World, read_world
from entries import entry
from planning.scenes import ARM

KINDS = labware_table()
TABLE = Table(height=0.0, lower=(-0.8, -0.8), upper=(0.8, 0.8))
A, B = (Nest(name=name, x=0.35, y=y, z=0.02, yaw=0.2) for name, y in (("a", 0.25), ("b", -0.25)))


def on(support: Nest | Item, kind: str = "microplate_96", name: str = "plate") -> Item:
    """Return labware on a nest or on other labware."""
    x, y, yaw = support.x, support.y, support.yaw
    return Item(name=name, labware=KINDS[kind], x=x, y=y, z=support.top, yaw=yaw, on=support.name)


def at_width(scene: Scene, width: float, pose: Pose) -> tuple[float, str]:
    """Return by how much the arm misses the margin at a pose, and what is nearest."""
    scene = replace(scene, widths=(width, width))
    joints = ARM.solve(pose, (0.0, 0.1, 1.0, 0.0))
    pair = scene.nearest_pair(ARM, joints)
    assert pair is not None
    return pair.margin - pair.distance, f"{pair.link} {pair.other}"


@pytest.mark.parametrize("kind", KINDS)
def test_jaws_take_labware_between_them_and_touch_it_nowhere_else(kind: str) -> None:
    # A lid is lower than the fingers' margin from a nest, and taken from a plate.
    below = (on(A, name="below"),) if "lid" in kind else ()
    plate = on(below[0] if below else A, kind)
    scene = World(table=TABLE, nests=(A,), items=(*below, plate)).planned
    grip = plate.grip
    slack = goal_slack(scene.margin)
    for width in (0.112, grip.width, grip.width - 3e-3):
        with entry(width):
            assert at_width(scene, width, grip.pose)[0] <= slack
    # Jaws that are closed already would be pushed into it.
    missed, pair = at_width(scene, 0.05, grip.pose)
    assert missed > scene.margin
    assert pair == "jaws plate/core"
    across = grip.pose._replace(yaw=grip.pose.yaw + 1.0)
    assert at_width(scene, 0.112, across) > (0.0, "")


def test_a_load_touches_only_what_it_may() -> None:
    below = on(A)
    upper = on(below, name="upper")
    world = World(table=TABLE, nests=(A, B), items=(below, upper))
    arm = replace(world.without("upper").planned, widths=(0.0825, 0.0825))
    joints = ARM.solve(upper.grip.pose, (0.0, 0.1, 1.0, 0.0))
    load = Load("upper", upper.shape_in_tool).shape_in_wrist(ARM.tool)
    arm.carrying(load, ["plate"]).check_load(ARM, joints)
    with pytest.raises(ZoneError, match=r"load .* plate"):
        arm.carrying(load).check_load(ARM, joints)
    with pytest.raises(ZoneError, match=r"load .* upper"):
        world.planned.carrying(load, ["plate"]).check_load(ARM, joints)


def test_every_part_of_the_arm_keeps_out_of_a_wall_and_of_a_nest() -> None:
    world = World(
        table=TABLE, walls=(Wall(name="w", lower=(0.3, 0.2, 0.0), upper=(0.4, 0.3, 0.4)),)
    )
    assert at_width(world.planned, 0.08, Pose(0.35, 0.25, 0.3, 0.0))[1].endswith(" w")
    world = World(table=TABLE, nests=(A,))
    assert at_width(world.planned, 0.08, Pose(0.35, 0.25, 0.025, 0.2))[1] == "jaws a/guides"


def test_labware_is_taken_away_and_placed() -> None:
    plate = on(A)
    world = World(table=TABLE, nests=(A, B), items=(plate, on(plate, "corning_96_lid", "lid")))
    moved = world.placed("lid", "b")
    assert moved.item("lid").z == B.z
    assert moved.item("lid").on == "b"
    assert moved.placed("lid", "plate").items == world.items
    assert [item.name for item in world.without("lid").items] == ["plate"]
    for wrong, message in (
        (
            lambda: world.without("plate"),
            "plate cannot be taken away: lid: there is no nest or lab",
        ),
        (lambda: world.without("plat"), "no labware 'plat' in the world; did you mean plate?"),
        (lambda: world.placed("lid", "c"), "there is no nest or labware 'c'"),
        (lambda: moved.placed("plate", "b"), "plate cannot be placed on b: plate is in lid"),
    ):
        with entry(message), pytest.raises(InvalidArgumentError) as caught:
            wrong()
        assert message in str(caught.value)


def test_what_is_no_world_is_refused() -> None:
    for wrong, message in (
        (lambda: World(Scene(), TABLE, [Nest]), "is none of the walls of a world; give Wall"),
        (lambda: World(scene="scene.yaml"), "the scene of a world is 'scene.yaml'"),
        (lambda: World(table=0.0), "the table of a world is 0.0"),
        (lambda: World(nests=A), "the nests of a world are"),
        (
            lambda: World(Scene((Box("a", (0, 0, 1), (1, 1, 2)),)), nests=(A,)),
            "a: the name is there",
        ),
        (
            lambda: World(nests=tuple(A for _ in range(201))),
            "201 walls, nests and pieces of labware",
        ),
        (
            lambda: Item(name="p", labware="microplate_96", x=0, y=0, z=0),
            "labware must be a mapping",
        ),
        (lambda: Nest(name="n", x=float("nan"), y=0.0, z=0.0), "Nest: x: nan is outside"),
    ):
        with entry(message), pytest.raises(ConfigurationError) as caught:
            wrong()
        assert message in str(caught.value)


def test_a_large_world_is_checked_and_planned_at_once() -> None:
    nests = tuple(
        Nest(name=f"n{row}/{column}", x=0.2 * row + 1.0, y=0.2 * column - 1.0, z=0.02)
        for row in range(10) for column in range(10)
    )  # fmt: skip
    items = tuple(on(nest, name=f"p{number}") for number, nest in enumerate(nests))
    world = World(nests=nests, items=items)
    assert len(world.planned.zones) == 400
    assert np.isfinite(world.planned.clearance(ARM, [(0.0, 0.1, 0.0, 0.0)])).all()


def test_the_plate_of_the_example_is_moved_to_the_other_nest() -> None:
    world = read_world(Path(__file__).parents[3] / "examples" / "world.yaml")
    plate, moved = world.item("plate"), world.placed("plate", "b")
    goal = moved.item("plate").grip.pose
    load = Load("plate", plate.shape_in_tool, plate.mass, touches=("a", "b"))
    with Robot.simulated(homed=True) as robot:
        robot.enable()
        robot.unfold()
        robot.scene = world.planned
        robot.gripper.open()
        robot.move_to(plate.grip.pose.up(0.08))
        robot.move_linear(plate.grip.pose)
        robot.scene = world.without("plate").planned
        robot.gripper.grasp(load, plate.grip.width)
        robot.move_linear(plate.grip.pose.up(0.08))
        robot.move_to(goal.up(0.08))
        robot.move_linear(goal)
        robot.gripper.release()
        robot.scene = moved.planned
        robot.move_linear(goal.up(0.08))
        # It may also be held without a word about a load, as from the dashboard.
        robot.gripper.open()
        robot.move_linear(goal)
        robot.gripper.move(plate.grip.width - 3e-3)
        robot.gripper.open()
        robot.move_linear(goal.up(0.08))
        robot.gripper.close()
        with pytest.raises(ZoneError, match="jaws comes too near to plate/core"):
            robot.move_linear(goal)
