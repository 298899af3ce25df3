"""Checks of a world: every body in a place of its own, none in the arm, labware on something."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.model import load_parameters
from bioscara.planning.collision.arm_bodies import GRIPPER, arm_of, frames
from bioscara.planning.collision.scene_pairs import LINKS
from bioscara.planning.collision.shapes import Placed, Prism, ShapeTable, distances
from bioscara.planning.world.bodies import Item, Nest, Table, Wall
from bioscara.spelling import did_you_mean

TOLERANCE = 5e-4
"""How deep a body may be in another one, and how far labware may be above the body below it [m]."""
_TAKEN = (*LINKS, "base", "base_link", "table", "left jaw", "right jaw")
"""Names that the arm and the table have."""


class Conflict(NamedTuple):
    """Reason why bodies cannot be in one world.

    Attributes:
        name: Of the body to be changed.
        text: The message, which begins with that name.
    """

    name: str
    text: str


class _Support(NamedTuple):
    """Something on which labware can stand: its name, the height of its top, its outline."""

    name: str
    height: float
    outline: Prism


def conflicts(
    zones: Sequence[str],
    table: Table | None,
    walls: Sequence[Wall],
    nests: Sequence[Nest],
    items: Sequence[Item],
) -> Iterator[Conflict]:
    """Yield the reasons why these bodies cannot be one world.

    Args:
        zones: Names of the zones.
        table: The table.
        walls: The walls.
        nests: The nests.
        items: The labware.
    """
    bodies: list[Wall | Nest | Item] = [*walls, *nests, *items]
    yield from _same_names(zones, [body.name for body in bodies])
    on = {}
    for item in items:
        found = _support(item, table, walls, nests, items)
        if isinstance(found, Conflict):
            yield found
        else:
            on[item.name] = found
    yield from _overlaps(bodies, on)
    if table is not None:
        yield from _in_table(table, bodies)
    yield from _in_arm(bodies, table)


def _same_names(zones: Sequence[str], names: Sequence[str]) -> Iterator[Conflict]:
    known = {*zones}
    for name in names:
        if name in _TAKEN:
            text = f"{name}: the name is taken by the table or a part of the arm; choose another"
            yield Conflict(name, text)
        elif name in known:
            yield Conflict(name, f"{name}: the name is there twice; choose another one")
        known.add(name)


def _support(
    item: Item,
    table: Table | None,
    walls: Sequence[Wall],
    nests: Sequence[Nest],
    items: Sequence[Item],
) -> str | Conflict:
    """Return the name of the body below an item."""
    supports = [_Support(nest.name, nest.z, nest.room) for nest in nests]
    supports += [_Support(each.name, each.top, each.shape) for each in items if each is not item]
    if item.on is not None:
        known = [support.name for support in supports]
        if item.on not in known:
            hint = did_you_mean(item.on, known, f"there are {', '.join(known) or 'none'}")
            text = f"{item.name}: there is no nest or labware {item.on} to stand on; {hint}"
            return Conflict(item.name, text)
        supports = [support for support in supports if support.name == item.on]
    else:
        supports += [_Support(wall.name, wall.upper[2], wall.shape) for wall in walls]
        if table is not None:
            supports.append(_Support("table", table.height, table.shape))
    centre = np.array(((item.x, item.y),))
    below = [support for support in supports if support.outline.covers(centre)[0]]
    standing = [each for each in below if abs(item.z - each.height) <= TOLERANCE]
    if not standing:
        heights = ", ".join(f"{each.name} at z = {each.height:g} m" for each in below)
        return Conflict(
            item.name,
            f"{item.name} stands on nothing: its bottom is at z = {item.z:g} m, and below its "
            f"centre there is {heights or 'nothing'}; correct its place",
        )
    for nest in nests:
        if nest.name == standing[0].name:
            return _fitting(item, nest)
    for each in items:
        if each.name == standing[0].name and not each.labware.stackable:
            text = f"{item.name} cannot stand on {each.name}: {each.labware.name} is not stackable"
            return Conflict(item.name, f"{text}; give it another place")
    return standing[0].name


def _fitting(item: Item, nest: Nest) -> str | Conflict:
    """Return the name of the nest in which an item stands."""
    room, turn = nest.room, -nest.yaw
    cos, sin = math.cos(turn), math.sin(turn)
    for x, y in item.shape.corners():
        dx, dy = x - nest.x, y - nest.y
        across = abs(cos * dx - sin * dy) - room.half_x, abs(sin * dx + cos * dy) - room.half_y
        if max(across) > TOLERANCE:
            return Conflict(
                item.name,
                f"{item.name} does not fit into {nest.name}: a corner is {1e3 * max(across):.1f} "
                "mm outside its guides; correct its place, or take another nest",
            )
    return nest.name


def _overlaps(bodies: Sequence[Wall | Nest | Item], on: dict[str, str]) -> Iterator[Conflict]:
    if len(bodies) < 2:
        return
    shapes = _placed(body.shape for body in bodies)
    one, other = np.triu_indices(len(bodies), 1)
    depths = -distances(shapes.take(one), shapes.take(other))
    for pair in np.flatnonzero(depths > TOLERANCE).tolist():
        first, second = bodies[one[pair]].name, bodies[other[pair]].name
        if on.get(first) != second and on.get(second) != first:
            yield Conflict(
                second,
                f"{second} is in {first}: they overlap by {1e3 * depths[pair]:.1f} mm; move one of "
                "them",
            )


def _in_table(table: Table, bodies: Sequence[Wall | Nest | Item]) -> Iterator[Conflict]:
    top = _placed([table.shape])
    for body in bodies:
        # Nests may be let into the table: their guides stand on it.
        shape = body.room if isinstance(body, Nest) else body.shape
        depth = -float(distances(top, _placed([shape]))[0])
        if depth > TOLERANCE:
            yield Conflict(
                body.name,
                f"{body.name} is in the table, whose top is at z = {table.height:g} m, by "
                f"{1e3 * depth:.1f} mm; move it up, or make the table smaller",
            )


def _in_arm(bodies: Sequence[Wall | Nest | Item], table: Table | None) -> Iterator[Conflict]:
    named = [(body.name, body.shape) for body in bodies]
    if table is not None:
        named.append(("table", table.shape))
    if not named:
        return
    links, arm = _homed_arm()
    around = _placed(shape for _, shape in named)
    depths = -distances(arm, Placed(*(column[None] for column in around)))
    for number in np.flatnonzero((depths > TOLERANCE).any(axis=0)).tolist():
        part, name = int(depths[:, number].argmax()), named[number][0]
        yield Conflict(
            name,
            f"{name} is in the arm by {1e3 * depths[part, number]:.1f} mm: in its {links[part]} as "
            "it stands after homing; move it away",
        )


@lru_cache(maxsize=1)
def _homed_arm() -> tuple[list[str], Placed]:
    """Return the parts of an arm that was homed, shape (parts, 1), and the links they are of."""
    parameters = load_parameters()
    built, width = parameters.geometry, parameters.gripper.initial
    tool = Pose(built.tool_x, built.tool_y, built.tool_z)
    kinematics = Scara(
        Geometry(built.upper_arm, built.forearm, built.height), parameters.joints, tool
    )
    bodies = arm_of(kinematics.geometry, tool, GRIPPER, (width, width))
    parts = [(body, shape) for body in bodies for shape in body.shapes]
    homed = np.array([[joint.home_position for joint in parameters.joints]])
    table = ShapeTable.of([body.frame for body, _ in parts], [shape for _, shape in parts])
    return [body.link for body, _ in parts], table.everywhere(frames(kinematics, homed))


def _placed(shapes: Iterable[Prism]) -> Placed:
    """Return shapes in the base frame as arrays."""
    shapes = [*shapes]
    return ShapeTable.of([0] * len(shapes), shapes).shapes
