"""Shapes and poses of the bodies of a world, for display."""

from __future__ import annotations

from typing import NamedTuple


class BodyBox(NamedTuple):
    """A box, upright in the frame of its body.

    Attributes:
        x: x of its centre [m].
        y: [m].
        z: [m].
        half_x: Half its size along x [m].
        half_y: [m].
        half_z: [m].
    """

    x: float
    y: float
    z: float
    half_x: float
    half_y: float
    half_z: float


class BodyShape(NamedTuple):
    """A body of a world.

    Attributes:
        name: Its name in the world.
        kind: ``"labware"``, ``"nest"``, ``"wall"``, ``"table"``, ``"obstacle"`` or ``"jaw"``.
        movable: Whether it moves.
        boxes: Its parts.
    """

    name: str
    kind: str
    movable: bool
    boxes: tuple[BodyBox, ...]


class BodyPose(NamedTuple):
    """Where a body is, in the base frame of the arm.

    Attributes:
        name: Its name in the world.
        x: x of its origin [m]; that of labware is the centre of its bottom.
        y: [m].
        z: [m].
        qw: Rotation, as a unit quaternion.
        qx: Its x.
        qy: Its y.
        qz: Its z.
    """

    name: str
    x: float
    y: float
    z: float
    qw: float
    qx: float
    qy: float
    qz: float


COLOURS = {
    "arm": (0.75, 0.77, 0.8, 1.0),
    "jaw": (0.25, 0.25, 0.3, 1.0),
    "labware": (0.35, 0.6, 0.85, 1.0),
    "nest": (0.3, 0.33, 0.36, 1.0),
    "wall": (0.6, 0.55, 0.5, 1.0),
    "table": (0.85, 0.85, 0.82, 1.0),
    "obstacle": (0.85, 0.4, 0.25, 1.0),
}
"""Red, green, blue and opacity of the kinds of bodies, and of the arm."""
