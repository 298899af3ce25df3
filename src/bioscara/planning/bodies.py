"""The arm as a few upright shapes per link: what zones, table and the arm itself are kept from.

Sizes are those of the boxes around the existing arm's drawings, each link in its own frame
(origin on the joint's axis, x along the link). Link lengths follow the arm's geometry.
"""

from __future__ import annotations

import cmath
from itertools import product
from typing import NamedTuple

import numpy as np

from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.planning.shapes import Array, Prism

_BASE, _COLUMN, _UPPER_ARM, _FOREARM, WRIST = range(5)
"""Frames that bodies stand in; the lift's is that of the upper arm."""


class Body(NamedTuple):
    """One shape of a link.

    Attributes:
        link: Name of the link.
        frame: Number of the frame that it stands in.
        shape: In that frame.
        touches: Names of the zones that it may touch, or ``"table"``.
    """

    link: str
    frame: int
    shape: Prism
    touches: tuple[str, ...] = ()


GRIPPER = (
    Body("gripper", WRIST, Prism.between((-0.0371, -0.086, -0.089), (0.0277, 0.086, 0.0069))),
    # Jaws wherever they are between 40 and 120 mm: the carriers reach out most when closed, the
    # fingers when open.
    Body("jaws", WRIST, Prism.between((-0.026, -0.1309, -0.1466), (0.039, 0.1309, -0.0606))),
    Body("jaws", WRIST, Prism.between((0.039, -0.08, -0.1466), (0.1391, 0.08, -0.0606))),
)
"""The gripper, whatever its width, in the frame of the wrist."""

FIXED = (
    Body("base_link", _BASE, Prism.between((-0.205, -0.1222, 0.0), (0.0, 0.1222, 0.0623))),
    Body("base_link", _BASE, Prism(0.0, 0.0, 0.0, 0.0, 0.0, 0.0873, 0.115)),
)
"""The base: it does not move, so only the gripper is kept from it."""


def moving(geometry: Geometry, tool: Pose, mounted: tuple[Body, ...]) -> tuple[Body, ...]:
    """Return all bodies that move.

    Args:
        geometry: Lengths of the arm.
        tool: Pose of the tool in the flange; its point is a body of its own.
        mounted: What the wrist carries.
    """
    upper, fore = geometry.upper_arm, geometry.forearm
    return (
        Body("link_1", _COLUMN, Prism(0.0, 0.0, 0.0, 0.0, -0.0477, 0.5213, 0.1119)),
        Body("link_1", _COLUMN, Prism.between((-0.1513, -0.1119, -0.0477), (0.0, 0.1119, 0.142))),
        Body("link_1", _COLUMN, Prism.between((-0.0876, -0.1119, 0.142), (0.0, 0.1119, 0.332))),
        Body("link_1", _COLUMN, Prism.between((-0.1513, -0.1119, 0.332), (0.0, 0.1119, 0.5213))),
        Body("link_2", _UPPER_ARM, Prism.between((0.0, -0.0528, -0.0132), (0.156, 0.0528, 0.1279))),
        Body("link_2", _UPPER_ARM, _bar(0.156, upper, 0.0426, 0.1279, 0.0528)),
        Body("link_3", _FOREARM, _bar(0.0, fore, 0.0155, 0.1632, 0.0359)),
        Body("link_4", WRIST, Prism.between((-0.0215, -0.014, 0.0021), (0.0215, 0.014, 0.1555))),
        *mounted,
        Body("tool", WRIST, Prism(tool.x, tool.y, 0.0, 0.0, tool.z, tool.z)),
    )


def reaches(geometry: Geometry, bodies: tuple[Body, ...]) -> Array:
    """Return how far a point of the arm moves at most per movement of each joint.

    Returns:
        [m/rad, 1, m/rad, m/rad], shape (4,).
    """
    wrist = max(_extent(body.shape) for body in bodies if body.frame == WRIST)
    fore = max(geometry.forearm + wrist, *_extents(bodies, _FOREARM))
    upper = max(geometry.upper_arm + fore, *_extents(bodies, _UPPER_ARM))
    return np.array([max(upper, *_extents(bodies, _COLUMN)), 1.0, fore, wrist])


def frames(arm: Scara, joints: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return the frames that bodies stand in.

    Args:
        arm: The arm.
        joints: j1 to j4 [rad, m, rad, rad], shape (n, 4).

    Returns:
        x, y, z of the origins [m] in the frame of the arm's base, and cosines and sines of the
        turns, each (5, n).
    """
    q1, q2, q3, q4 = joints.T
    turns, x, y, z = np.zeros((4, 5, len(joints)))
    turns[1:] = q1
    turns[_FOREARM:] += q3
    turns[WRIST] += q4
    cos, sin = np.cos(turns), np.sin(turns)
    upper, fore, height = arm.geometry
    x[_FOREARM:], y[_FOREARM:] = upper * cos[1], upper * sin[1]
    x[WRIST] += fore * cos[_FOREARM]
    y[WRIST] += fore * sin[_FOREARM]
    z[_COLUMN], z[_UPPER_ARM:] = height, height + q2
    return x, y, z, cos, sin


def _bar(start: float, end: float, low: float, high: float, radius: float) -> Prism:
    return Prism((start + end) / 2, 0.0, (end - start) / 2, 0.0, low, high, radius)


def _extent(shape: Prism) -> float:
    """Return the distance of the outermost point from the frame's axis."""
    centre, turn = complex(shape.x, shape.y), cmath.rect(1.0, shape.yaw)
    corners = product((shape.half_x, -shape.half_x), (shape.half_y, -shape.half_y))
    return max(abs(centre + turn * complex(*corner)) for corner in corners) + shape.radius


def _extents(bodies: tuple[Body, ...], frame: int) -> list[float]:
    return [_extent(body.shape) for body in bodies if body.frame == frame]
