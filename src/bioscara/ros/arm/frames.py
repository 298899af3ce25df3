"""Poses of links in their parents, for the transforms that RViz and MoveIt look up."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple
from xml.etree.ElementTree import Element

from bioscara.hardware import Urdf

_MOVABLE = ("revolute", "continuous", "prismatic")

Quaternion = tuple[float, float, float, float]
"""Rotation: x, y, z, w."""
Vector = tuple[float, float, float]


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
    translation: Vector
    rotation: Quaternion


class FrameJoint(NamedTuple):
    """A joint of a description, as far as frames depend on it.

    Attributes:
        kind: ``"fixed"``, ``"revolute"``, ``"continuous"`` or ``"prismatic"``.
        origin: Pose of the child at position zero.
        axis: Of rotation or translation.
        source: Joint whose position moves it: itself, or the one that it follows.
        multiplier: Its position for a unit of that.
        offset: Its position while that is at zero [rad or m].
    """

    kind: str
    origin: Transform
    axis: Vector
    source: str
    multiplier: float
    offset: float

    def at(self, position: float) -> Transform:
        """Return the pose of the child.

        Args:
            position: Position of ``source`` [rad or m].
        """
        value = self.multiplier * position + self.offset
        parent, child, place, turn = self.origin
        if self.kind == "prismatic":
            x, y, z = _rotated(turn, self.axis)
            return Transform(
                parent,
                child,
                (place[0] + x * value, place[1] + y * value, place[2] + z * value),
                turn,
            )
        return Transform(parent, child, place, _product(turn, _about(self.axis, value)))


class Frames:
    """All joints of a description.

    Attributes:
        fixed: Poses of the links that never move in their parents.

    Raises:
        ConfigurationError: A joint is of a kind that is not known, or has no parent or child.
    """

    def __init__(self, urdf: Urdf) -> None:
        frames = [_frame(urdf, tag) for tag in urdf.root.findall("joint")]
        self.fixed = tuple(frame.origin for frame in frames if frame.kind == "fixed")
        self._moving = tuple(frame for frame in frames if frame.kind != "fixed")

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


def _frame(urdf: Urdf, tag: Element) -> FrameJoint:
    name, kind = urdf.attribute(tag, "name"), urdf.attribute(tag, "type")
    if kind not in (*_MOVABLE, "fixed"):
        raise urdf.error(tag, f"{name}: type {kind!r} is not one of fixed, {', '.join(_MOVABLE)}")
    links = {}
    for part in ("parent", "child"):
        found = tag.find(part)
        if found is None:
            raise urdf.error(tag, f"joint {name} has no <{part}>")
        links[part] = urdf.attribute(found, "link")
    origin, axis, mimic = tag.find("origin"), tag.find("axis"), tag.find("mimic")
    place = {} if origin is None else origin.attrib
    pose = Transform(
        links["parent"],
        links["child"],
        _vector(urdf, tag, place.get("xyz", "0 0 0")),
        _from_angles(_vector(urdf, tag, place.get("rpy", "0 0 0"))),
    )
    direction = _vector(urdf, tag, "1 0 0" if axis is None else axis.attrib.get("xyz", "1 0 0"))
    length = math.hypot(*direction) or 1.0
    unit = (direction[0] / length, direction[1] / length, direction[2] / length)
    if mimic is None:
        return FrameJoint(kind, pose, unit, name, 1.0, 0.0)
    ratio, shift = (
        float(mimic.get(key, value)) for key, value in (("multiplier", 1), ("offset", 0))
    )
    return FrameJoint(kind, pose, unit, urdf.attribute(mimic, "joint"), ratio, shift)


def _vector(urdf: Urdf, tag: Element, text: str) -> Vector:
    try:
        x, y, z = map(float, text.split())
    except ValueError:
        raise urdf.error(tag, f"{text!r} are not three numbers") from None
    return x, y, z


def _from_angles(angles: Vector) -> Quaternion:
    """Return the rotation about the fixed axes x, then y, then z."""
    turn: Quaternion = (0.0, 0.0, 0.0, 1.0)
    axes: tuple[Vector, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    for axis, angle in zip(axes, angles, strict=True):
        turn = _product(_about(axis, angle), turn)
    return turn


def _about(axis: Vector, angle: float) -> Quaternion:
    sine = math.sin(0.5 * angle)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(0.5 * angle)


def _product(first: Quaternion, second: Quaternion) -> Quaternion:
    a, b, c, d = first
    e, f, g, h = second
    return (
        d * e + a * h + b * g - c * f,
        d * f - a * g + b * h + c * e,
        d * g + a * f - b * e + c * h,
        d * h - a * e - b * f - c * g,
    )


def _rotated(turn: Quaternion, vector: Vector) -> Vector:
    back = (-turn[0], -turn[1], -turn[2], turn[3])
    x, y, z, _ = _product(_product(turn, (*vector, 0.0)), back)
    return x, y, z
