"""Poses of the links of a robot description in their parents, for RViz and MoveIt."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from bioscara.hardware.urdf import Urdf
from bioscara.hardware.urdf_joints import Triple, UrdfJoint, joints_of

Quaternion = tuple[float, float, float, float]
"""Rotation: x, y, z, w."""


class Transform(NamedTuple):
    """Pose of a link in its parent.

    Attributes:
        parent: Name of the parent link.
        child: Name of the link.
        translation: [m].
        rotation: Rotation.
    """

    parent: str
    child: str
    translation: Triple
    rotation: Quaternion


class _LinkFrame:
    """The pose of a joint's child, by the position of the joint that moves it.

    Attributes:
        source: Name of that joint: itself, or the one that it follows.
        still: The pose at position zero.
    """

    def __init__(self, joint: UrdfJoint) -> None:
        mimic, (*place, roll, pitch, yaw) = joint.mimic, joint.origin
        self.source = joint.name if mimic is None else mimic.joint
        self._factor = 1.0 if mimic is None else mimic.multiplier
        self._offset = 0.0 if mimic is None else mimic.offset
        self._turns = joint.type != "prismatic"
        x, y, z = joint.axis
        length = math.hypot(x, y, z) or 1.0
        axis = (x / length, y / length, z / length)
        turn = _product(_about((0.0, 1.0, 0.0), pitch), _about((1.0, 0.0, 0.0), roll))
        turn = _product(_about((0.0, 0.0, 1.0), yaw), turn)
        # Rotation at position pi; and the axis in the parent.
        self._turned = _product(turn, (*axis, 0.0))
        *self._along, _ = _product(self._turned, (-turn[0], -turn[1], -turn[2], turn[3]))
        self.still = Transform(joint.parent, joint.child, (place[0], place[1], place[2]), turn)

    def at(self, position: float) -> Transform:
        """Return the pose for a position of the source [rad or m]."""
        parent, child, place, turn = self.still
        value = self._factor * position + self._offset
        if not self._turns:
            x, y, z = (here + value * along for here, along in zip(place, self._along, strict=True))
            return Transform(parent, child, (x, y, z), turn)
        cosine, sine = math.cos(0.5 * value), math.sin(0.5 * value)
        (qx, qy, qz, qw), (tx, ty, tz, tw) = turn, self._turned
        rotation = (
            qx * cosine + tx * sine,
            qy * cosine + ty * sine,
            qz * cosine + tz * sine,
            qw * cosine + tw * sine,
        )
        return Transform(parent, child, place, rotation)


class LinkFrames:
    """All links of a description.

    Attributes:
        fixed: Poses of the links that never move in their parents.

    Raises:
        ConfigurationError: A joint is of a kind that is not known, or has no parent or child.
    """

    def __init__(self, urdf: Urdf) -> None:
        joints = joints_of(urdf)
        self.fixed = tuple(_LinkFrame(each).still for each in joints if each.type == "fixed")
        self._moving = tuple(_LinkFrame(each) for each in joints if each.type != "fixed")

    def at(self, positions: Mapping[str, float]) -> list[Transform]:
        """Return the poses of the links whose positions are known.

        Args:
            positions: Of the joints, by name [rad or m]; NaN where unknown.
        """
        return [
            frame.at(positions[frame.source])
            for frame in self._moving
            if math.isfinite(positions.get(frame.source, math.nan))
        ]


def _about(axis: Triple, angle: float) -> Quaternion:
    sine = math.sin(0.5 * angle)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(0.5 * angle)


def _product(first: Quaternion, second: Quaternion) -> Quaternion:
    (ax, ay, az, aw), (bx, by, bz, bw) = first, second
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
