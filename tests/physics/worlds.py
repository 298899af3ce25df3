"""Worlds for tests, and measurements in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from bioscara import Load, Pose, Robot
from bioscara.model.labware import Labware, labware_table
from bioscara.physics.coupling import Coupling
from bioscara.physics.world import PhysicsWorld
from bioscara.planning.world import Item, Nest, Table, World

TABLE = Table(height=0.0, lower=(-0.9, -0.9), upper=(0.9, 0.9))
PLATE: Labware = labware_table()["microplate_96"]
MASS = 0.05
FLOOR = 0.02
"""Height of the nests' floors [m]."""
A, B = (Nest(name=name, x=0.35, y=y, z=FLOOR) for name, y in (("a", 0.25), ("b", -0.25)))


def stack(*names: str, nest: Nest = A, mass: float = MASS) -> tuple[Item, ...]:
    """Return plates on top of each other in a nest, the lowest first."""
    return tuple(
        Item(
            name=name, labware=PLATE, x=nest.x, y=nest.y, z=nest.z + i * PLATE.stack_height,
            yaw=nest.yaw, mass=mass, on=names[i - 1] if i else nest.name,
        )
        for i, name in enumerate(names)
    )  # fmt: skip


def transfer_world(*items: Item) -> World:
    """Return a table with two nests half a metre apart, and these items."""
    return World(table=TABLE, nests=(A, B), items=items)


def simulated(world: World, **options: Any) -> Robot:
    """Return a robot in a world, which plans with the table alone."""
    robot = Robot.simulated(world=world, seed=1, homed=True, **options)
    robot.scene = replace(type(robot.scene)(), table_height=0.0)
    return robot


LOAD = Load("plate", stack("plate")[0].shape_in_tool, MASS, ("table",))
"""A plate as the arm carries it."""


def pick(robot: Robot, nest: Nest, below: int = 0, up: float = 0.08) -> None:
    """Take a plate out of a nest."""
    place = held_at(nest, below)
    robot.move_to(place.up(up))
    robot.move_linear(place)
    robot.gripper.grasp(LOAD)
    robot.move_linear(place.up(up))


def put(robot: Robot, nest: Nest, below: int = 0, up: float = 0.08) -> None:
    """Put the plate that is held into a nest."""
    place = held_at(nest, below)
    robot.move_to(place.up(up))
    robot.move_linear(place.up(3e-4))
    robot.gripper.release()
    robot.move_linear(place.up(up))


def held_at(nest: Nest, below: int = 0) -> Pose:
    """Return the pose of the tool that grips a plate in a nest, on top of this number of others."""
    return Pose(nest.x, nest.y, nest.z + below * PLATE.stack_height + PLATE.grip_height, nest.yaw)


def offset(robot: Robot, name: str, nest: Nest, below: int = 0) -> tuple[float, float]:
    """Return how far a plate is from its place in a nest [m], and its rotation against it [rad]."""
    pose = robot.simulation.pose(name)
    place = np.array([nest.x, nest.y, nest.z + below * PLATE.stack_height])
    half = nest.yaw / 2.0
    turn = 2.0 * np.arccos(min(abs(pose.qw * np.cos(half) + pose.qz * np.sin(half)), 1.0))
    return float(np.linalg.norm(np.array(pose[1:4]) - place)), float(turn)


class Watched:
    """Calls a function after each step of a world.

    Args:
        world: The world.
        look: Gets the world.
    """

    def __init__(self, world: PhysicsWorld, look: Callable[[PhysicsWorld], object]) -> None:
        self._world, self._look = world, look
        coupling: Coupling = world._coupling
        self._step = coupling.step
        coupling.step = self.step  # type: ignore[method-assign]
        world._couple()

    def step(self) -> None:
        self._step()
        self._look(self._world)
