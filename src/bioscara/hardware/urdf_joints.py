"""The joints of a robot description, with the links that they join."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import msgspec

from bioscara.hardware.urdf import Urdf

Triple = tuple[float, float, float]
Place = tuple[float, float, float, float, float, float]
"""A pose in a link: x, y, z [m], then rotation about its axes x, y and z, in this order [rad]."""
_KINDS = ("fixed", "revolute", "continuous", "prismatic")


class UrdfMimic(msgspec.Struct, frozen=True):
    """The joint that another one follows.

    Attributes:
        joint: Its name.
        multiplier: Ratio of the follower's position to the joint's.
        offset: Position of the follower when the joint is at zero [rad or m].
    """

    joint: str
    multiplier: float
    offset: float


class UrdfJoint(msgspec.Struct, frozen=True):
    """A joint, or a fixed connection, of two links.

    Attributes:
        name: Its name.
        type: ``fixed``, ``revolute``, ``continuous`` or ``prismatic``.
        parent: Link that carries it.
        child: Link that it carries.
        origin: Its pose in the parent at position zero.
        axis: Axis of rotation, or direction of translation.
        lower: Lowest position [rad or m].
        upper: Highest position [rad or m].
        mimic: The joint that it follows, or null.
    """

    name: str
    type: str
    parent: str
    child: str
    origin: Place
    axis: Triple
    lower: float
    upper: float
    mimic: UrdfMimic | None


def joints_of(urdf: Urdf) -> tuple[UrdfJoint, ...]:
    """Return all joints, in the order of the description.

    Raises:
        ConfigurationError: One is of another kind, or has no parent or child.
    """
    return tuple(_joint(urdf, tag) for tag in urdf.root.findall("joint"))


def tree_of(urdf: Urdf) -> tuple[UrdfJoint, ...]:
    """Return all joints, parents before children.

    Raises:
        ConfigurationError: The links form no tree; otherwise as :func:`joints_of`.
    """
    pending = joints_of(urdf)
    children = {joint.child for joint in pending}
    links = [urdf.attribute(tag, "name") for tag in urdf.root.findall("link")]
    placed = {name for name in links if name not in children}
    if len(placed) != 1:
        raise urdf.error(urdf.root, f"{len(placed)} links have no parent joint, not one")
    joints: list[UrdfJoint] = []
    while pending:
        ready = [joint for joint in pending if joint.parent in placed]
        if not ready:
            raise urdf.error(urdf.root, f"joint {pending[0].name} has no parent in the tree")
        pending = tuple(joint for joint in pending if joint.parent not in placed)
        placed.update(joint.child for joint in ready)
        joints += ready
    return tuple(joints)


def origin_of(urdf: Urdf, tag: Element) -> Place:
    """Return the ``<origin>`` of a joint or visual; the frame of the link if it has none."""
    origin = tag.find("origin")
    place = {} if origin is None else origin.attrib
    position, rotation = (place.get(name, "0 0 0") for name in ("xyz", "rpy"))
    return (*_triple(urdf, tag, position), *_triple(urdf, tag, rotation))


def _joint(urdf: Urdf, tag: Element) -> UrdfJoint:
    name, kind = urdf.attribute(tag, "name"), urdf.attribute(tag, "type")
    if kind not in _KINDS:
        raise urdf.error(tag, f"{name}: type {kind!r} is not one of {', '.join(_KINDS)}")
    axis, limit, mimic = tag.find("axis"), tag.find("limit"), tag.find("mimic")
    lower, upper = (
        0.0 if limit is None else _number(urdf, limit, end, "0") for end in ("lower", "upper")
    )
    return UrdfJoint(
        name,
        kind,
        urdf.attribute(_part(urdf, tag, "parent"), "link"),
        urdf.attribute(_part(urdf, tag, "child"), "link"),
        origin_of(urdf, tag),
        _triple(urdf, tag, "1 0 0" if axis is None else axis.get("xyz", "1 0 0")),
        lower,
        upper,
        None
        if mimic is None
        else UrdfMimic(
            urdf.attribute(mimic, "joint"),
            _number(urdf, mimic, "multiplier", "1"),
            _number(urdf, mimic, "offset", "0"),
        ),
    )


def _part(urdf: Urdf, tag: Element, name: str) -> Element:
    part = tag.find(name)
    if part is None:
        raise urdf.error(tag, f"joint {tag.get('name')} has no <{name}>")
    return part


def _triple(urdf: Urdf, tag: Element, text: str) -> Triple:
    try:
        x, y, z = map(float, text.split())
    except ValueError:
        raise urdf.error(tag, f"{text!r} are not three numbers") from None
    return x, y, z


def _number(urdf: Urdf, tag: Element, name: str, usual: str) -> float:
    text = tag.get(name, usual)
    try:
        return float(text)
    except ValueError:
        raise urdf.error(tag, f"{name} {text!r} is no number") from None
