"""A world with a plate in one of two nests, and an owner that serves an arm in it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from bioscara import Robot
from bioscara.planning.world import Item, Labware, Nest, Table, World
from bioscara.server.serve import Served, ServeSettings, serving
from served import NAME, runtime_folder

FLOOR = 0.02
"""Height of the nests [m]."""
PLATE = Labware((0.12776, 0.08548, 0.01435))


def world(items: int = 1) -> World:
    """Return a table with two nests, and plates in and beside the first."""
    nests = (Nest("a", 0.35, 0.3, FLOOR), Nest("b", 0.35, -0.2, FLOOR))
    plates = [Item("plate", PLATE, 0.35, 0.3, FLOOR)]
    plates += [Item(f"plate_{n}", PLATE, -0.5, -0.6 + 0.1 * n, 0.0) for n in range(1, items)]
    return World(Table(0.0, (-0.8, -0.8), (0.8, 0.8)), (), nests, tuple(plates))


@contextmanager
def world_served(speed: float = 5.0, name: str = NAME, **settings: object) -> Iterator[Served]:
    """Serve an arm that was used before, in that world, in a runtime folder of its own."""
    with runtime_folder() as folder, Robot.simulated(world=world(), seed=1, homed=True) as robot:
        given = ServeSettings(
            name, "sim", evidence=folder / "faults", real_time_factor=speed, **settings
        )
        with serving(robot, given) as served:
            yield served
