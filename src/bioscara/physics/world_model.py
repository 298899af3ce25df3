"""The bodies of a world in a model of the engine, beside the arm."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from bioscara.physics.arm_model import ARM, OTHERS
from bioscara.physics.bodies import COLOURS, BodyBox, BodyShape
from bioscara.physics.engine import mujoco
from bioscara.planning.world import Item, Nest, Wall, World

SLICE = 1.024e-3
"""Time step [s]: that at which the simulated arm meets its world."""
SOLREF = (4e-3, 1.0)
"""Time constant [s] and damping ratio of contacts; a shorter one is unstable with two slices of
delay between the mechanics and their image."""
SOLIMP = (0.95, 0.99, 1e-3, 0.5, 2.0)
FRICTION = (0.4, 5e-3, 1e-4)
"""Sliding, torsional and rolling friction of labware, nests and walls. Chosen: polystyrene on metal
is between 0.3 and 0.5."""
_GUIDE, _GUIDE_LENGTH, _FLOOR = 3e-3, 15e-3, 8e-3
"""Thickness and length of a nest's guides, and thickness of its floor [m]."""
_FOOTPRINT = (0.12776, 0.08548)
"""Of labware [m]: ANSI SLAS 1-2004."""
_LIP, _LIP_PLAY = 1.2e-3, 0.4e-3
"""Thickness of the raised edge of stackable labware, and its play [m]: choices of ours."""


def new_model() -> Any:
    """Return an empty ``mujoco.MjSpec`` with the settings of a world.

    The friction cone is elliptic: with the pyramidal one, the ratio of impedances that keeps a
    gripped plate from creeping lets it fall.
    """
    engine = mujoco()
    spec = engine.MjSpec()
    option = spec.option
    option.timestep = SLICE
    option.gravity = [0.0, 0.0, -9.81]
    option.cone = engine.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 100.0
    option.noslip_iterations = 3
    option.integrator = engine.mjtIntegrator.mjINT_IMPLICITFAST
    default = spec.default.geom
    default.condim = 4
    default.solref, default.solimp = list(SOLREF), list(SOLIMP)
    default.friction = list(FRICTION)
    default.contype, default.conaffinity = OTHERS, ARM | OTHERS
    return spec


def add_fixed(spec: Any, world: World) -> list[BodyShape]:
    """Add table, walls and nests to a model; return their shapes."""
    shapes = []
    if world.table is not None:
        (x0, y0), (x1, y1) = world.table.lower, world.table.upper
        box = BodyBox((x0 + x1) / 2, (y0 + y1) / 2, -0.01, (x1 - x0) / 2, (y1 - y0) / 2, 0.01)
        shapes.append(BodyShape("table", "table", False, (box,)))
        add_fixed_body(spec, shapes[-1], (0.0, 0.0, world.table.height), 0.0)
    for wall in world.walls:
        shapes.append(_wall(wall))
        add_fixed_body(spec, shapes[-1], _centre(wall), wall.yaw)
    for nest in world.nests:
        shapes.append(BodyShape(nest.name, "nest", False, tuple(_nest_boxes(nest))))
        add_fixed_body(spec, shapes[-1], (nest.x, nest.y, nest.z), nest.yaw)
    return shapes


def add_fixed_body(spec: Any, shape: BodyShape, place: Sequence[float], yaw: float) -> None:
    """Add a body that nothing moves, but a person may."""
    body = spec.worldbody.add_body(name=shape.name, pos=list(place), quat=list(turned(yaw)))
    for box in shape.boxes:
        _add_box(body, box, shape.kind, 0.0)


def add_item(spec: Any, item: Item) -> BodyShape:
    """Add a piece of labware to a model and return its shape."""
    boxes = tuple(_item_boxes(item))
    body = spec.worldbody.add_body(
        name=item.name, pos=[item.x, item.y, item.z], quat=list(turned(item.yaw))
    )
    body.add_freejoint(name=item.name)
    volumes = [box.half_x * box.half_y * box.half_z for box in boxes]
    for box, volume in zip(boxes, volumes, strict=True):
        _add_box(body, box, "labware", item.mass * volume / math.fsum(volumes))
    return BodyShape(item.name, "labware", True, boxes)


def turned(yaw: float) -> tuple[float, float, float, float]:
    """Return the unit quaternion of a rotation about the vertical [rad]."""
    return (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0))


def _add_box(body: Any, box: BodyBox, kind: str, mass: float) -> None:
    engine = mujoco()
    body.add_geom(
        type=engine.mjtGeom.mjGEOM_BOX, pos=[box.x, box.y, box.z],
        size=[box.half_x, box.half_y, box.half_z], mass=mass, rgba=list(COLOURS[kind]),
    )  # fmt: skip


def _centre(wall: Wall) -> tuple[float, float, float]:
    (x0, y0, z0), (x1, y1, _) = wall.lower, wall.upper
    return ((x0 + x1) / 2, (y0 + y1) / 2, z0)


def _wall(wall: Wall) -> BodyShape:
    (x0, y0, z0), (x1, y1, z1) = wall.lower, wall.upper
    box = BodyBox(0.0, 0.0, (z1 - z0) / 2, (x1 - x0) / 2, (y1 - y0) / 2, (z1 - z0) / 2)
    return BodyShape(wall.name, "wall", False, (box,))


def _nest_boxes(nest: Nest) -> Iterator[BodyBox]:
    """Yield the floor of a nest, and two guides at each of its corners."""
    half_x, half_y = (size / 2.0 + nest.play for size in _FOOTPRINT)
    yield BodyBox(0.0, 0.0, -_FLOOR / 2, half_x + _GUIDE, half_y + _GUIDE, _FLOOR / 2)
    up, half, length = nest.height / 2.0, _GUIDE / 2.0, _GUIDE_LENGTH / 2.0
    for side in (-1.0, 1.0):
        for end in (-1.0, 1.0):
            yield BodyBox(side * (half_x + half), end * (half_y - length), up, half, length, up)
            yield BodyBox(side * (half_x - length), end * (half_y + half), up, length, half, up)


def _item_boxes(item: Item) -> Iterator[BodyBox]:
    """Yield the boxes of a piece of labware: with a raised edge, into which the next one fits."""
    (half_x, half_y, _), rim = (size / 2.0 for size in item.labware.size), item.labware.rim
    height = item.labware.size[2]
    if not rim:
        yield BodyBox(0.0, 0.0, height / 2, half_x, half_y, height / 2)
        return
    inset, top = _LIP + _LIP_PLAY, height - rim
    yield BodyBox(0.0, 0.0, rim / 2, half_x - inset, half_y - inset, rim / 2)
    yield BodyBox(0.0, 0.0, (rim + top) / 2, half_x, half_y, (top - rim) / 2)
    middle, lip = top + rim / 2, _LIP / 2
    for side in (-1.0, 1.0):
        yield BodyBox(side * (half_x - lip), 0.0, middle, lip, half_y, rim / 2)
        yield BodyBox(0.0, side * (half_y - lip), middle, half_x - _LIP, lip, rim / 2)
