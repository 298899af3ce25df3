"""The joints of a robot description, with the links that they join."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree.ElementTree import Element

from bioscara.hardware.urdf import Urdf

Triple = tuple[float, float, float]
_KINDS = ("fixed", "revolute", "prismatic")
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


class Origin(NamedTuple):
    """A pose in a link.

    Attributes:
        xyz: Its position [m].
        rpy: Its rotation about the fixed x, y and z axes, in this order [rad].
    """

    xyz: Triple
    rpy: Triple


class UrdfJoint(NamedTuple):
    """A joint of a description.

    Attributes:
        name: Name of the joint.
        kind: ``"fixed"``, ``"revolute"`` or ``"prismatic"``.
        parent: Link that carries the joint.
        child: Link that the joint carries.
        origin: Pose of the joint in its parent, at position zero.
        axis: Direction of translation, or axis of rotation.
        lower: Lowest position [rad or m].
        upper: Highest position [rad or m].
        mimic: Coupling to another joint; None for an independent joint.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Origin
    axis: Triple
    lower: float
    upper: float
    mimic: Mimic | None


def joints_of(urdf: Urdf) -> tuple[str, tuple[UrdfJoint, ...]]:
    """Return the link that no joint carries, and all joints, parents before children.

    Raises:
        ConfigurationError: The links form no tree, or a joint is of another kind.
    """
    pending = [_joint(urdf, tag) for tag in urdf.root.findall("joint")]
    children = {joint.child for joint in pending}
    links = [urdf.attribute(tag, "name") for tag in urdf.root.findall("link")]
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise urdf.error(urdf.root, f"{len(roots)} links have no parent joint, not one")
    joints: list[UrdfJoint] = []
    placed = set(roots)
    while pending:
        ready = [joint for joint in pending if joint.parent in placed]
        if not ready:
            raise urdf.error(urdf.root, f"joint {pending[0].name} has no parent in the tree")
        pending = [joint for joint in pending if joint.parent not in placed]
        placed.update(joint.child for joint in ready)
        joints += ready
    return roots[0], tuple(joints)


def origin_of(tag: Element) -> Origin:
    """Return the ``<origin>`` of a joint or visual; the frame of the link if it has none."""
    origin = tag.find("origin")
    place = _ORIGIN | (origin.attrib if origin is not None else {})
    return Origin(_numbers(place["xyz"]), _numbers(place["rpy"]))


def _joint(urdf: Urdf, tag: Element) -> UrdfJoint:
    kind = urdf.attribute(tag, "type")
    if kind not in _KINDS:
        raise urdf.error(tag, f"type {kind!r} is not one of fixed, revolute, prismatic")
    limit = _part(urdf, tag, "limit").attrib if kind != "fixed" else {}
    axis = _part(urdf, tag, "axis").attrib["xyz"] if kind != "fixed" else "0 0 1"
    return UrdfJoint(
        urdf.attribute(tag, "name"),
        kind,
        urdf.attribute(_part(urdf, tag, "parent"), "link"),
        urdf.attribute(_part(urdf, tag, "child"), "link"),
        origin_of(tag),
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


def _numbers(text: str) -> Triple:
    x, y, z = map(float, text.split())
    return x, y, z
