"""The transforms of a robot description, from the positions of its joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple
from xml.etree import ElementTree as ET

Transform = tuple[float, float, float, float, float, float, float]
"""Translation x, y, z [m], then rotation as quaternion x, y, z, w."""
_Quaternion = tuple[float, float, float, float]
_Vector = tuple[float, float, float]


class JointFrame(NamedTuple):
    """A joint as the transform from its parent link to its child.

    Attributes:
        parent: Link that carries the joint.
        child: Link that the joint carries.
        source: Index of the position that moves it, in the order given to :func:`joint_frames`;
            None for a fixed joint.
        factor: Ratio of its position to that one.
        offset: Its position where that one is zero [rad or m].
        turns: Whether it turns about its axis, instead of moving along it.
        place: Translation at position zero [m].
        along: Its axis in the parent.
        rotation: Quaternion at position zero.
        turned: Quaternion at position pi.
    """

    parent: str
    child: str
    source: int | None
    factor: float
    offset: float
    turns: bool
    place: _Vector
    along: _Vector
    rotation: _Quaternion
    turned: _Quaternion

    def at(self, positions: Sequence[float]) -> Transform:
        """Return the child in the parent.

        Args:
            positions: Positions in the given order [rad or m].
        """
        if self.source is None:
            return (*self.place, *self.rotation)
        position = self.factor * positions[self.source] + self.offset
        if not self.turns:
            (x, y, z), (ax, ay, az) = self.place, self.along
            return (x + ax * position, y + ay * position, z + az * position, *self.rotation)
        cosine, sine = math.cos(0.5 * position), math.sin(0.5 * position)
        (qx, qy, qz, qw), (tx, ty, tz, tw) = self.rotation, self.turned
        return (
            *self.place,
            qx * cosine + tx * sine,
            qy * cosine + ty * sine,
            qz * cosine + tz * sine,
            qw * cosine + tw * sine,
        )


def joint_frames(urdf: str, names: Sequence[str]) -> list[JointFrame]:
    """Return the joints of a robot description, in its order.

    Args:
        urdf: The description, from :func:`bioscara.model.urdf.urdf_of`.
        names: Names of the joints whose positions are known; others do not move.
    """
    root = ET.fromstring(urdf)  # noqa: S314  made by this package
    return [_frame(tag, list(names)) for tag in root.findall("joint")]


def _frame(tag: ET.Element, names: list[str]) -> JointFrame:
    origin, axis, mimic = tag.find("origin"), tag.find("axis"), tag.find("mimic")
    place = _numbers(origin, "xyz", "0 0 0")
    rotation = _quaternion(*_numbers(origin, "rpy", "0 0 0"))
    direction = _numbers(axis, "xyz", "1 0 0")
    turned = _product(rotation, (*direction, 0.0))
    x, y, z, _ = _product(turned, _conjugate(rotation))
    followed = tag.attrib["name"] if mimic is None else mimic.attrib["joint"]
    moves = tag.attrib["type"] != "fixed" and followed in names
    return JointFrame(
        _link(tag, "parent"),
        _link(tag, "child"),
        names.index(followed) if moves else None,
        1.0 if mimic is None else float(mimic.get("multiplier", "1")),
        0.0 if mimic is None else float(mimic.get("offset", "0")),
        tag.attrib["type"] == "revolute",
        place,
        (x, y, z),
        rotation,
        turned,
    )


def _link(tag: ET.Element, role: str) -> str:
    return next(tag.iter(role)).attrib["link"]


def _numbers(tag: ET.Element | None, name: str, default: str) -> _Vector:
    x, y, z = map(float, (default if tag is None else tag.get(name, default)).split())
    return x, y, z


def _quaternion(roll: float, pitch: float, yaw: float) -> _Quaternion:
    about_x = (math.sin(0.5 * roll), 0.0, 0.0, math.cos(0.5 * roll))
    about_y = (0.0, math.sin(0.5 * pitch), 0.0, math.cos(0.5 * pitch))
    about_z = (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
    return _product(about_z, _product(about_y, about_x))


def _product(first: _Quaternion, second: _Quaternion) -> _Quaternion:
    (ax, ay, az, aw), (bx, by, bz, bw) = first, second
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _conjugate(quaternion: _Quaternion) -> _Quaternion:
    x, y, z, w = quaternion
    return -x, -y, -z, w
