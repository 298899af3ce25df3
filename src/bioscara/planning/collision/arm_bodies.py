"""Collision bodies of the arm as upright shapes.

They are derived from the drawing that the arm's meshes are generated from, each link in its own
frame (origin on the joint's axis, x along the link), and extend at most 5 mm beyond the meshes.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.model.parts import Link, drawing, hand
from bioscara.planning.arrays import Array
from bioscara.planning.collision.shapes import Prism

BASE, COLUMN, UPPER_ARM, FOREARM, WRIST, LEFT_JAW, RIGHT_JAW = range(7)
"""Frames of the bodies; the lift's is that of the upper arm. Those of the jaws are rotated like the
wrist's and offset from it by half the gripper's width along y."""
ATTACHED = ({"link_1", "link_2"}, {"link_3", "link_4"})
"""Links that overlap by construction: the column's rods in the carriage, the post of the wrist in
the forearm's hub."""
WIDTHS = (0.04, 0.112)
"""Smallest and largest width of the existing gripper [m], as in the committed parameters."""
_JAWS = {LEFT_JAW: 0.5, RIGHT_JAW: -0.5}
"""Position of each jaw along the wrist's y, as a share of the gripper's width."""


class Body(NamedTuple):
    """A part of a link, or an object that the wrist carries.

    Attributes:
        link: Name of the link.
        frame: Number of its frame.
        shapes: Shapes whose union is the body, in that frame.
        touches: Names of the zones that it may touch, or ``"table"``.
    """

    link: str
    frame: int
    shapes: tuple[Prism, ...]
    touches: tuple[str, ...] = ()


def _bodies(link: Link, name: str, frame: int) -> tuple[Body, ...]:
    return tuple(
        Body(name, frame, tuple(Prism(*each) for part in parts for each in part.solid.uprights))
        for parts in link.bodies.values()
    )


def _in_wrist_axes(body: Body) -> Body:
    """Return a body of the gripper in the wrist's axes; the gripper's x is the wrist's y."""
    turned = tuple(
        Prism(-s.y, s.x, s.half_y, s.half_x, s.low, s.high, s.radius) for s in body.shapes
    )
    return body._replace(shapes=turned)


_GRIPPER, *_HAND = hand()
GRIPPER = tuple(
    _in_wrist_axes(body)
    for link, name, frame in (
        (_GRIPPER, "gripper", WRIST),
        *zip(_HAND, ("jaws", "jaws"), _JAWS, strict=True),
    )
    for body in _bodies(link, name, frame)
)
"""Bodies of the gripper; the position of its jaws depends on its width."""


@lru_cache(maxsize=4)
def links_of(geometry: Geometry) -> tuple[Body, ...]:
    """Return the links of the arm from its base to the wrist."""
    links = drawing(geometry)
    return tuple(
        body for frame, link in enumerate(links[:5]) for body in _bodies(link, link.name, frame)
    )


def arm_of(
    geometry: Geometry, tool: Pose, mounted: tuple[Body, ...], widths: tuple[float, float]
) -> tuple[Body, ...]:
    """Return all bodies of an arm, in frames up to the wrist's.

    Args:
        geometry: Lengths of the arm.
        tool: Pose of the tool in the flange; its point is a body of its own.
        mounted: Bodies that the wrist carries.
        widths: Smallest and largest width that the gripper may have [m]: its jaws occupy the
            space of all widths between.
    """
    point = Prism(tool.x, tool.y, 0.0, 0.0, tool.z, tool.z)
    return (
        *links_of(geometry),
        *(_placed(body, widths) for body in mounted),
        Body("tool", WRIST, (point,)),
    )


def _placed(body: Body, widths: tuple[float, float]) -> Body:
    """Return a body in the wrist's frame; a jaw as the space that it can occupy."""
    if body.frame not in _JAWS:
        return body
    at = [_JAWS[body.frame] * width for width in widths]
    middle, half = sum(at) / 2.0, abs(at[1] - at[0]) / 2.0
    moved = tuple(
        Prism(s.x, s.y + middle, s.half_x, s.half_y + half, s.low, s.high, s.radius)
        for s in body.shapes
    )
    return body._replace(frame=WRIST, shapes=moved)


def hull(shapes: tuple[Prism, ...]) -> Prism:
    """Return one shape that contains all: a box, a bar or a disc, whichever is smallest."""
    if len(shapes) == 1:
        return shapes[0]
    corners, radii = _corners(shapes), np.repeat([s.radius for s in shapes], 4)
    reach = np.column_stack((radii, radii))
    lower, upper = (corners - reach).min(axis=0), (corners + reach).max(axis=0)
    (x, y), (half_x, half_y) = (lower + upper) / 2.0, (upper - lower) / 2.0
    low, high = min(s.low for s in shapes), max(s.high for s in shapes)
    least = min(half_x, half_y)
    bar = np.hypot(*np.maximum(np.abs(corners - (x, y)) - (half_x - least, half_y - least), 0.0).T)
    disc = float((np.hypot(*(corners - (x, y)).T) + radii).max())
    if np.pi * disc * disc < 4.0 * half_x * half_y:
        return Prism(float(x), float(y), 0.0, 0.0, low, high, disc)
    round_ = bool((bar + radii <= least + 1e-12).all())
    inset = float(least) if round_ else 0.0
    return Prism(float(x), float(y), float(half_x) - inset, float(half_y) - inset, low, high, inset)


def reaches(geometry: Geometry, bodies: tuple[Body, ...]) -> Array:
    """Return the largest displacement of any point of the arm per displacement of each joint.

    Args:
        geometry: Lengths of the arm.
        bodies: Of :func:`arm_of`.

    Returns:
        [m/rad, 1, m/rad, m/rad], shape (4,).
    """
    wrist = max(_extents(bodies, WRIST))
    fore = max(geometry.forearm + wrist, *_extents(bodies, FOREARM))
    upper = max(geometry.upper_arm + fore, *_extents(bodies, UPPER_ARM))
    return np.array([max(upper, *_extents(bodies, COLUMN)), 1.0, fore, wrist])


def frames(kinematics: Scara, joints: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return the frames of the bodies, from the base's to the wrist's.

    Args:
        kinematics: The arm.
        joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).

    Returns:
        x, y, z of the origins [m] in the frame of the arm's base, and cosines and sines of the
        turns, each (5, n).
    """
    q1, q2, q3, q4 = joints.T
    turns, x, y, z = np.zeros((4, 5, len(joints)))
    turns[1:] = q1
    turns[FOREARM:] += q3
    turns[WRIST] += q4
    cos, sin = np.cos(turns), np.sin(turns)
    upper, fore, height = kinematics.geometry
    x[FOREARM:], y[FOREARM:] = upper * cos[1], upper * sin[1]
    x[WRIST] += fore * cos[FOREARM]
    y[WRIST] += fore * sin[FOREARM]
    z[COLUMN], z[UPPER_ARM:] = height, height + q2
    return x, y, z, cos, sin


def _corners(shapes: tuple[Prism, ...]) -> Array:
    """Return the corners of the rectangles in their frame, shape (4 shapes, 2)."""
    return np.array([corner for shape in shapes for corner in shape.corners()])


def extent(body: Body) -> float:
    """Return the distance of a body's outermost point from the axis of its frame [m]."""
    far = np.hypot(*_corners(body.shapes).T)
    return float((far + np.repeat([shape.radius for shape in body.shapes], 4)).max())


def _extents(bodies: tuple[Body, ...], frame: int) -> list[float]:
    return [extent(body) for body in bodies if body.frame == frame]
