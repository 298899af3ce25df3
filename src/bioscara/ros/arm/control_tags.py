"""The ``<ros2_control>`` tags of a robot description, read strictly; errors name the line.

A tag that is not read would seem to have an effect: each component has the tags of its kind, each
once, and no others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

from bioscara.arguments import shown
from bioscara.hardware import HOME, POSITION, VELOCITY, Urdf
from bioscara.model.parameters import JOINTS, UNITS
from bioscara.model.tags import GRIPPER_TAGS, HOMING_TAGS, JOINT_TAGS
from bioscara.spelling import did_you_mean

GRIPPER_JOINT = "gripper"
"""The owner's name of the gripper's joint."""

_TYPES = ("system", "actuator")
_PARTS = ("param", "command_interface", "state_interface")
_KINDS = {"rad": "revolute", "m": "prismatic"}
"""Types of joints in the robot, by the unit of their positions."""
_LIMITED = (POSITION, VELOCITY)
"""Command interfaces that may have limits of their own."""


class Component(NamedTuple):
    """A hardware component of a description.

    Attributes:
        name: Its name.
        type: ``system`` or ``actuator``.
        plugin: Its plugin.
        joints: The owner's names of its joints, by their names in the description.
    """

    name: str
    type: str
    plugin: str
    joints: Mapping[str, str]


class _Tags(NamedTuple):
    """The names that a joint of a component has, of each kind once."""

    param: tuple[str, ...]
    command_interface: tuple[str, ...]
    state_interface: tuple[str, ...]


_ARM = _Tags(
    (*JOINT_TAGS.values(), *HOMING_TAGS.values()),
    (POSITION, VELOCITY, HOME),
    (POSITION, VELOCITY, HOME),
)
_GRIPPER = _Tags((*GRIPPER_TAGS.values(),), (POSITION,), (POSITION, VELOCITY))


def read_components(urdf: Urdf) -> tuple[Component, ...]:
    """Return the hardware components of a description: an arm, a gripper, or both.

    Raises:
        ConfigurationError: There is none, or a tag is unknown, missing, nested, there twice, or
            belongs to other hardware.
    """
    tags = urdf.root.findall("ros2_control")
    for tag in urdf.root.iter("ros2_control"):
        if tag not in tags:
            raise urdf.error(tag, "<ros2_control> is inside of another tag; put it into <robot>")
    if not tags:
        raise urdf.error(
            urdf.root, "there is no <ros2_control>: the node would have no joints to drive"
        )
    components: dict[str, Component] = {}
    for tag in tags:
        component = _component(urdf, tag)
        if component.name in components:
            raise urdf.error(tag, f"two <ros2_control> tags are named {component.name}")
        driven = {own for each in components.values() for own in each.joints.values()}
        if driven & {*component.joints.values()}:
            raise urdf.error(tag, "two <ros2_control> tags have the same joints")
        components[component.name] = component
    return tuple(components.values())


def _component(urdf: Urdf, tag: Element) -> Component:
    _check_attributes(urdf, tag, "name", "type")
    name, kind = urdf.attribute(tag, "name"), urdf.attribute(tag, "type")
    if kind not in _TYPES:
        raise urdf.error(tag, f"{name}: type {shown(kind)} is not one of {', '.join(_TYPES)}")
    elements: dict[str, Element] = {}
    hardware: list[Element] = []
    for element in tag:
        if element.tag == "hardware":
            hardware.append(element)
            continue
        if element.tag != "joint":
            raise urdf.error(
                element,
                f"{name}: <{element.tag}> is not read; every interface is one of a joint, home too",
            )
        _check_attributes(urdf, element, "name")
        joint = urdf.attribute(element, "name")
        if joint in elements:
            raise urdf.error(element, f"{name}: joint {joint} is there twice")
        elements[joint] = element
    joints = _joints(urdf, tag, elements)
    for joint, own in joints.items():
        is_arm = own in JOINTS
        _check_joint(urdf, elements[joint], _ARM if is_arm else _GRIPPER)
        _check_type(urdf, elements[joint], UNITS[own] if is_arm else "m")
    return Component(name, kind, _plugin(urdf, tag, hardware), joints)


def _plugin(urdf: Urdf, tag: Element, hardware: Sequence[Element]) -> str:
    """Return the plugin, which is all that ``<hardware>`` has here."""
    name = tag.attrib["name"]
    if len(hardware) != 1:
        raise urdf.error(
            hardware[1] if hardware else tag, f"{name}: {len(hardware)} <hardware>; it has one"
        )
    _check_attributes(urdf, hardware[0])
    plugins = []
    for part in hardware[0]:
        if part.tag != "plugin" or len(part):
            raise urdf.error(
                part,
                f"{name}: <{part.tag}> of <hardware> is not read; it has a <plugin> alone, values "
                "are <param> of the joints",
            )
        _check_attributes(urdf, part)
        plugins.append((part.text or "").strip())
    if len(plugins) != 1 or not plugins[0]:
        raise urdf.error(hardware[0], f"{name}: <hardware> does not name one <plugin>")
    return plugins[0]


def _joints(urdf: Urdf, tag: Element, joints: Mapping[str, Element]) -> Mapping[str, str]:
    """Return the owner's names of the joints of a component, by their names in the description."""
    # Names with the same prefix are in the order of the joints.
    prefix = min(joints, default="").removesuffix(JOINTS[0])
    if sorted(joints) == sorted(prefix + joint for joint in JOINTS):
        return {prefix + joint: joint for joint in JOINTS}
    if len(joints) == 1 and not {*joints} & {*JOINTS}:
        return dict.fromkeys(joints, GRIPPER_JOINT)
    raise urdf.error(
        tag,
        f"hardware component {tag.attrib['name']} has the joints {', '.join(joints) or '(none)'}; "
        f"it is an arm with {', '.join(JOINTS)}, all with the same prefix or none, or a gripper "
        "with one joint",
    )


def _check_joint(urdf: Urdf, joint: Element, tags: _Tags) -> None:
    """Check that a joint has these tags and no others."""
    name = joint.attrib["name"]
    for part in joint:
        if part.tag not in _PARTS:
            raise urdf.error(part, f"{name}: <{part.tag}> is not known; {_hint(part.tag, _PARTS)}")
        _check_attributes(urdf, part, "name")
    for tag, wanted in zip(_PARTS, tags, strict=True):
        _check_names(urdf, joint, tag, wanted)
    for part in joint:
        kind = part.attrib["name"]
        if part.tag == "command_interface" and kind in _LIMITED:
            _check_limits(urdf, name, part)
        elif len(part):
            raise urdf.error(part[0], f"{name}: <{part[0].tag}> in {kind} is nested, and not read")


def _check_names(urdf: Urdf, joint: Element, tag: str, wanted: Sequence[str]) -> None:
    name, seen = joint.attrib["name"], list[str]()
    for part in joint.findall(tag):
        each = urdf.attribute(part, "name")
        what = f"{name}: <{tag}> {each}"
        if tag == "param" and each == "homing":
            raise urdf.error(
                part,
                f"{what}: its values are params of the joint here, not nested in one; write "
                f"{', '.join(HOMING_TAGS.values())}",
            )
        if each not in wanted:
            raise urdf.error(part, f"{what} is not known; {_hint(each, wanted)}")
        if each in seen:
            raise urdf.error(part, f"{what} is there twice")
        seen.append(each)
    for each in wanted:
        if each not in seen:
            raise urdf.error(
                joint, f"{name}: <{tag}> {each} is missing; it has each of {', '.join(wanted)}"
            )


def _check_limits(urdf: Urdf, name: str, command: Element) -> None:
    """Check that a command interface has no other params than limits."""
    seen = list[str]()
    for part in command:
        limit = part.attrib.get("name", "")
        if part.tag != "param" or limit not in ("min", "max") or len(part) or limit in seen:
            raise urdf.error(
                part,
                f"{name}: <{part.tag}> {limit} of a command interface is not read; it has a "
                "<param> min and a <param> max at most",
            )
        _check_attributes(urdf, part, "name")
        seen.append(limit)


def _check_type(urdf: Urdf, joint: Element, unit: str) -> None:
    """Check that the robot has the joint once, with the type that its unit requires."""
    name = joint.attrib["name"]
    found = [each for each in urdf.root.findall("joint") if each.attrib.get("name") == name]
    if len(found) != 1:
        raise urdf.error(
            joint, f"{name}: the robot has {len(found)} joints of that name instead of one"
        )
    kind = found[0].attrib.get("type", "")
    if kind != _KINDS[unit]:
        raise urdf.error(
            found[0], f"{name}: type {shown(kind)} is not {_KINDS[unit]}: its position is in {unit}"
        )


def _check_attributes(urdf: Urdf, element: Element, *known: str) -> None:
    for name in element.attrib:
        if name not in known:
            raise urdf.error(
                element,
                f"<{element.tag}> {name} is not read; its attributes are "
                f"{', '.join(known) or '(none)'}",
            )


def _hint(name: str, known: Sequence[str]) -> str:
    return did_you_mean(name, known, f"known here: {', '.join(known)}")
