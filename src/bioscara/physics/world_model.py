"""The bodies of a world in a model of the engine."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

from bioscara.physics.arm_model import ARM, OTHERS
from bioscara.physics.bodies import COLOURS, BodyBox, BodyShape
from bioscara.physics.engine import mujoco
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.world import Item, Nest, World
from bioscara.planning.world.bodies import FLOOR, GUIDE

SLICE = 1.024e-3
"""Time step [s]: that at which the simulated arm meets its world."""
SOLREF = (4e-3, 1.0)
"""Time constant [s] and damping ratio of contacts; a shorter one is unstable with two slices of
delay between the mechanics and their image."""
SOLIMP = (0.95, 0.99, 1e-3, 0.5, 2.0)
FRICTION = (0.4, 5e-3, 1e-4)
"""Sliding, torsional and rolling friction of labware, nests and walls. Chosen: polystyrene on metal
is between 0.3 and 0.5."""
_ABOVE, _BELOW, _SKY = (0.97, 0.98, 1.0), (0.72, 0.76, 0.8), 64
"""Red, green and blue of the background of images, high up and below, and its width [pixels]."""
_LAMP, _DOWN = 0.28, (-0.3, 0.4, -1.0)
"""Brightness and direction of a lamp above the arm; there is a light at each camera, too."""
_GUIDE_LENGTH = 15e-3
"""Length of a nest's guides from each corner [m]."""
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
    spec.add_texture(
        name="background", type=engine.mjtTexture.mjTEXTURE_SKYBOX, width=_SKY, height=6 * _SKY,
        builtin=engine.mjtBuiltin.mjBUILTIN_GRADIENT, rgb1=list(_ABOVE), rgb2=list(_BELOW),
    )  # fmt: skip
    spec.worldbody.add_light(
        name="lamp", type=engine.mjtLightType.mjLIGHT_DIRECTIONAL, castshadow=False,
        pos=[0.0, 0.0, 3.0], dir=list(_DOWN), ambient=[0.0] * 3, diffuse=[_LAMP] * 3,
        specular=[0.0] * 3,
    )  # fmt: skip
    return spec


def add_fixed(spec: Any, world: World) -> list[BodyShape]:
    """Add table, walls and nests to a model; return their shapes."""
    shapes = []
    if world.table is not None:
        shapes.append(_add_block(spec, "table", "table", world.table.shape))
    shapes += [_add_block(spec, wall.name, "wall", wall.shape) for wall in world.walls]
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


def _add_block(spec: Any, name: str, kind: str, block: Prism) -> BodyShape:
    """Add an upright box to a model and return its shape."""
    half = (block.high - block.low) / 2.0
    box = BodyBox(0.0, 0.0, half, block.half_x, block.half_y, half)
    shape = BodyShape(name, kind, False, (box,))
    add_fixed_body(spec, shape, (block.x, block.y, block.low), block.yaw)
    return shape


def _nest_boxes(nest: Nest) -> Iterator[BodyBox]:
    """Yield the floor of a nest, and two guides at each of its corners."""
    half_x, half_y = nest.room.half_x, nest.room.half_y
    yield BodyBox(0.0, 0.0, -FLOOR / 2, nest.shape.half_x, nest.shape.half_y, FLOOR / 2)
    up, half, length = nest.height / 2.0, GUIDE / 2.0, _GUIDE_LENGTH / 2.0
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
