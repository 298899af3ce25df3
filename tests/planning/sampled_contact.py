"""Brute-force check of whether the arm touches a zone, by points of its bodies."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np
import numpy.typing as npt

from bioscara.kinematics import Scara
from bioscara.planning.collision.arm_bodies import GRIPPER, WIDTHS, arm_of
from bioscara.planning.collision.scene import Box, Cylinder
from bioscara.planning.collision.shapes import Prism

Array = npt.NDArray[np.float64]


def _outline(shape: Prism) -> Array:
    """Return points on the border of the flat shape and in it, (n, 2), in its own frame."""
    turns = np.linspace(0.0, 2.0 * math.pi, 17)
    points = [
        (
            a * shape.half_x + share * shape.radius * math.cos(turn),
            b * shape.half_y + share * shape.radius * math.sin(turn),
        )
        for a in np.linspace(-1.0, 1.0, 9)
        for b in np.linspace(-1.0, 1.0, 5)
        for share, some in ((1.0, turns), (0.5, turns[::4]))
        for turn in (some if shape.radius else (0.0,))
    ]
    return np.unique(np.round(np.array(points), 9), axis=0)


def _turned(points: Array, x: float, y: float, yaw: float) -> Array:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.stack(
        (x + c * points[:, 0] - s * points[:, 1], y + s * points[:, 0] + c * points[:, 1]), axis=1
    )


@cache
def _points(shape: Prism) -> Array:
    """Return points on the border of the shape and in it, (n, 3), in the frame of its link."""
    flat = _turned(_outline(shape), shape.x, shape.y, shape.yaw)
    heights = np.linspace(shape.low, shape.high, 7)
    return np.column_stack((np.tile(flat, (len(heights), 1)), np.repeat(heights, len(flat))))


def points_of(kinematics: Scara, joints: Sequence[float]) -> Iterator[tuple[str, Array]]:
    """Yield for each body its link and points (n, 3) in the base frame."""
    q1, q2, q3, q4 = joints
    upper, fore, height = kinematics.geometry
    elbow = (upper * math.cos(q1), upper * math.sin(q1))
    wrist = (elbow[0] + fore * math.cos(q1 + q3), elbow[1] + fore * math.sin(q1 + q3))
    lift = height + q2
    frames = {1: (0.0, 0.0, height, q1), 2: (0.0, 0.0, lift, q1), 3: (*elbow, lift, q1 + q3)}
    frames[4] = (*wrist, lift, q1 + q3 + q4)
    for body in arm_of(kinematics.geometry, kinematics.tool, GRIPPER, WIDTHS):
        if body.link == "base_link":
            continue
        x, y, z, yaw = frames[body.frame]
        own = np.concatenate([_points(shape) for shape in body.shapes])
        yield body.link, np.column_stack((_turned(own[:, :2], x, y, yaw), own[:, 2] + z))


def beyond(zone: Box | Cylinder, points: Array) -> Array:
    """Return the distance of points outside a zone [m]; below zero or zero inside."""
    if isinstance(zone, Cylinder):
        flat = np.hypot(points[:, 0] - zone.x, points[:, 1] - zone.y) - zone.radius
        up = np.maximum(zone.low - points[:, 2], points[:, 2] - zone.high)
        sides = np.column_stack((flat, up))
    else:
        centre = (np.array(zone.lower) + np.array(zone.upper)) / 2.0
        own = points - centre
        own[:, :2] = _turned(own[:, :2], 0.0, 0.0, -zone.yaw)
        sides = np.abs(own) - (np.array(zone.upper) - np.array(zone.lower)) / 2.0
    far = np.linalg.norm(np.maximum(sides, 0.0), axis=1)
    return np.where(far > 0.0, far, sides.max(axis=1))


def touched(
    kinematics: Scara, zones: Sequence[Box | Cylinder], joints: Sequence[float]
) -> list[str]:
    """Return the names of zones that are entered, or left, at these joints."""
    names = []
    for link, points in points_of(kinematics, joints):
        for zone in zones:
            if not zone.links or link in zone.links:
                inside = beyond(zone, points) < 0.0
                if not inside.all() if zone.keep_in else inside.any():
                    names.append(zone.name)
    return names
