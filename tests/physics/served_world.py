"""An owner that serves an arm with two nests, a plate in the first and one on the table."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bioscara import Robot
from bioscara.planning.world import Item
from bioscara.server.serve import Served, ServeSettings, serving
from physics.worlds import MASS, PLATE, simulated, stack, transfer_world
from served import NAME, runtime_folder


def arm_in_world(**options: Any) -> Robot:
    """Return an arm that was used before."""
    spare = Item(name="spare", labware=PLATE, x=-0.5, y=-0.5, z=0.0, mass=MASS)
    return simulated(transfer_world(*stack("plate"), spare), **options)


@contextmanager
def world_served(speed: float = 5.0) -> Iterator[Served]:
    """Serve it in a runtime folder of its own."""
    with runtime_folder() as folder:
        evidence = folder / "faults"
        settings = ServeSettings(NAME, "sim", evidence=evidence, real_time_factor=speed)
        with serving(arm_in_world(evidence=evidence), settings) as served:
            yield served
