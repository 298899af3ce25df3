"""Forward kinematics of the links of a robot description."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from viser.transforms import SE3, SO3

from bioscara.hardware import Urdf

_ORIGIN = {"xyz": "0 0 0", "rpy": "0 0 0"}


class Mimic(NamedTuple):
    """Coupling of a joint to another joint that it follows.

    Attributes:
        joint: Name of the followed joint.
        multiplier: Ratio of the joint's position to the followed joint's.
        offset: Position of the joint when the followed one is at zero [rad or m].
    """

    joint: str
    multiplier: float
    offset: float


class UrdfJoint(NamedTuple):
    """A joint of a description.

    Attributes:
        name: Name of the joint.
        kind: ``"fixed"``, ``"revolute"`` or ``"prismatic"``.
        parent: Link that carries the joint.
        child: Link that the joint carries.
        origin: Pose of the joint in its parent, at position zero.
        axis: Direction of translation, or axis of rotation, shape (3,).
        lower: Lowest position [rad or m].
        upper: Highest position [rad or m].
        mimic: Coupling to another joint; None for an independent joint.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: SE3
    axis: np.ndarray
    lower: float
    upper: float
    mimic: Mimic | None

    def at(self, position: float) -> SE3:
        """Return the pose of the child in the parent.

        Args:
            position: Position of the joint [rad or m].
        """
        if self.kind == "revolute":
            return self.origin @ SE3.from_rotation(SO3.exp(self.axis * position))
        if self.kind == "prismatic":
            return self.origin @ SE3.from_translation(self.axis * position)
        return self.origin


class KinematicTree:
    """The joints of a description, parents before children.

    Args:
        urdf: The description.

    Attributes:
        root: The link that no joint carries.
        joints: All joints.
        free: The joints that follow no other and are not fixed.

    Raises:
        ConfigurationError: The links form no tree, or a joint is of another kind.
    """

    def __init__(self, urdf: Urdf) -> None:
        pending = [_joint(urdf, tag) for tag in urdf.root.findall("joint")]
        children = {joint.child for joint in pending}
        roots = [
            name
            for tag in urdf.root.findall("link")
            if (name := urdf.attribute(tag, "name")) not in children
        ]
        if len(roots) != 1:
            raise urdf.error(urdf.root, f"{len(roots)} links have no parent joint, not one")
        self.root, joints, placed = roots[0], [], set(roots)
        while pending:
            ready = [joint for joint in pending if joint.parent in placed]
            if not ready:
                raise urdf.error(urdf.root, f"joint {pending[0].name} has no parent in the tree")
            pending = [joint for joint in pending if joint.parent not in placed]
            placed.update(joint.child for joint in ready)
            joints += ready
        self.joints = tuple(joints)
        self.free = tuple(j for j in joints if j.kind != "fixed" and j.mimic is None)

    def place(self, positions: Mapping[str, float]) -> dict[str, SE3]:
        """Return the pose of each link in the frame of the root.

        Args:
            positions: Position of each free joint, by its name [rad or m].
        """
        links = {self.root: SE3.identity()}
        for joint in self.joints:
            if joint.mimic is not None:
                followed = positions[joint.mimic.joint]
                position = joint.mimic.multiplier * followed + joint.mimic.offset
            else:
                position = positions.get(joint.name, 0.0)
            links[joint.child] = links[joint.parent] @ joint.at(position)
        return links


def _joint(urdf: Urdf, tag: Element) -> UrdfJoint:
    kind = urdf.attribute(tag, "type")
    if kind not in ("fixed", "revolute", "prismatic"):
        raise urdf.error(tag, f"type {kind!r} is not one of fixed, revolute, prismatic")
    origin = tag.find("origin")
    place = _ORIGIN | (origin.attrib if origin is not None else {})
    limit = _part(urdf, tag, "limit").attrib if kind != "fixed" else {}
    axis = _part(urdf, tag, "axis").attrib["xyz"] if kind != "fixed" else "0 0 1"
    return UrdfJoint(
        urdf.attribute(tag, "name"),
        kind,
        urdf.attribute(_part(urdf, tag, "parent"), "link"),
        urdf.attribute(_part(urdf, tag, "child"), "link"),
        SE3.from_rotation_and_translation(
            SO3.from_rpy_radians(*_numbers(place["rpy"])), _numbers(place["xyz"])
        ),
        _numbers(axis),
        float(limit.get("lower", 0.0)),
        float(limit.get("upper", 0.0)),
        _mimic(urdf, tag.find("mimic")),
    )


def _mimic(urdf: Urdf, tag: Element | None) -> Mimic | None:
    if tag is None:
        return None
    values = (float(tag.get(name, default)) for name, default in (("multiplier", 1), ("offset", 0)))
    return Mimic(urdf.attribute(tag, "joint"), *values)


def _part(urdf: Urdf, tag: Element, name: str) -> Element:
    part = tag.find(name)
    if part is None:
        raise urdf.error(tag, f"joint {tag.get('name')} has no <{name}>")
    return part


def _numbers(text: str) -> np.ndarray:
    return np.array([float(number) for number in text.split()])
