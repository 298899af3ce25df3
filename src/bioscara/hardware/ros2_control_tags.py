"""A URDF and its ``<ros2_control>`` tags, checked; errors name the line.

The XML is plain: no entities, no document types, no large files.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError
from bioscara.model import GripperParameters, JointParameters
from bioscara.model.checks import (
    JOINTS,
    UNITS,
    check_addresses,
    check_jaws,
    check_joint,
    check_reach,
)
from bioscara.model.section import Section
from bioscara.model.tags import (
    ARM_COMMANDS,
    ARM_COMPONENT,
    ARM_STATES,
    GRIPPER_COMMANDS,
    GRIPPER_COMPONENT,
    GRIPPER_STATES,
    GRIPPER_TAGS,
    HOMING_TAGS,
    JOINT_TAGS,
)
from bioscara.spelling import did_you_mean

SIZE_MAX = 4_000_000
"""Largest file that is read [bytes]: some hundred times a description of this arm."""

_UNITS = {"revolute": "rad", "prismatic": "m"}
_WHOLE = re.compile(r"[+-]?(0x[0-9a-f]+|\d+)", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|[+-]?(nan|inf(inity)?)", re.IGNORECASE)
_PARTS = ("param", "command_interface", "state_interface")


@dataclass(frozen=True, slots=True)
class ArmDescription:
    """The joints of an arm.

    Attributes:
        name: Name of the component.
        joints: Its joints, in the order of their numbers.
    """

    name: str
    joints: tuple[JointParameters, ...]


@dataclass(frozen=True, slots=True)
class GripperDescription:
    """A gripper.

    Attributes:
        name: Name of the component.
        joint: Name of its joint.
        parameters: Its parameters.
    """

    name: str
    joint: str
    parameters: GripperParameters


class Urdf:
    """A parsed robot description.

    Args:
        text: The XML.
        source: Name of the source in messages.

    Attributes:
        root: The ``<robot>`` element.

    Raises:
        ConfigurationError: It is not XML of the plain kind, too large, or no robot.
    """

    def __init__(self, text: str, source: str) -> None:
        self._source = source
        self._lines: dict[Element, int] = {}
        if len(text) > SIZE_MAX:
            raise ConfigurationError(
                f"{source}: {len(text)} characters; a robot description has at most {SIZE_MAX}"
            )
        self.root = self._parse(text)
        if self.root.tag != "robot":
            raise self.error(self.root, f"<{self.root.tag}> is not <robot>: this is no URDF")

    @classmethod
    def load(cls, path: Path) -> Urdf:
        """Read a file.

        Raises:
            ConfigurationError: It cannot be read, and as above.
        """
        try:
            with path.open("rb") as file:
                content = file.read(SIZE_MAX + 1)
            return cls(content.decode(), str(path))
        except OSError as error:
            raise ConfigurationError(f"{path}: {error.strerror or error}") from error
        except UnicodeDecodeError as error:
            raise ConfigurationError(f"{path}: not a text file: {error}") from error

    def error(self, element: Element, text: str) -> ConfigurationError:
        """Return an error that states the location of ``element``."""
        return ConfigurationError(f"{self._source}, line {self._lines[element]}: {text}")

    def attribute(self, element: Element, name: str) -> str:
        """Return an attribute.

        Raises:
            ConfigurationError: The element has none of that name, or it is empty.
        """
        value = element.attrib.get(name, "").strip()
        if not value:
            raise self.error(element, f"<{element.tag}> has no {name}")
        return value

    def _parse(self, text: str) -> Element:
        builder = TreeBuilder()
        parser = expat.ParserCreate()
        parser.buffer_text = True

        def start(tag: str, attributes: Mapping[str, str]) -> None:
            self._lines[builder.start(tag, dict(attributes))] = parser.CurrentLineNumber

        def refuse(*_: object) -> None:
            raise ConfigurationError(
                f"{self._source}, line {parser.CurrentLineNumber}: a robot description has no "
                "document type and no entities; remove <!DOCTYPE ...>"
            )

        parser.StartElementHandler = start
        parser.EndElementHandler = builder.end
        parser.CharacterDataHandler = builder.data
        parser.StartDoctypeDeclHandler = refuse
        parser.EntityDeclHandler = refuse
        try:
            parser.Parse(text, True)
        except expat.ExpatError as error:
            raise ConfigurationError(
                f"{self._source}, line {error.lineno}: not XML: {expat.ErrorString(error.code)}"
            ) from error
        except UnicodeEncodeError as error:
            raise ConfigurationError(f"{self._source}: not a text: {error}") from error
        return builder.close()


class _Params(Section):
    """The ``<param>`` tags of one joint, by the keys of the parameters that they fill."""

    def __init__(self, urdf: Urdf, joint: Element, tags: Mapping[str, str]) -> None:
        self._urdf, self._joint, self._tags = urdf, joint, tags
        self._elements = {
            urdf.attribute(element, "name"): element for element in joint.findall("param")
        }

    def error(self, text: str, key: str | None = None) -> ConfigurationError:
        element = self._elements.get(self._tags.get(key, key)) if key is not None else None
        return self._urdf.error(self._joint if element is None else element, text)

    def name(self, key: str) -> str:
        return f"{self._joint.attrib['name']}: {self._tags.get(key, key)}"

    def keys(self) -> Iterable[str]:
        return tuple(self._elements)

    def value(self, key: str) -> Any:
        element = self._elements.get(self._tags[key])
        if element is None:
            raise self.error(f"{self.name(key)} is missing")
        text = (element.text or "").strip()
        if _WHOLE.fullmatch(text):
            # A decimal number may begin with zeros.
            return int(text, 16 if "x" in text.lower() else 10)
        return float(text) if _NUMBER.fullmatch(text) else text


def read_arm(urdf: Urdf, name: str = ARM_COMPONENT) -> ArmDescription:
    """Return the arm's part of a description.

    Args:
        urdf: The description.
        name: Name of the ``<ros2_control>`` tag.

    Raises:
        ConfigurationError: Something is missing, unknown, duplicated, or out of its range.
    """
    component = _component(urdf, name)
    elements = _joints(urdf, component)
    for found, element in elements.items():
        if found not in JOINTS:
            raise urdf.error(element, f"{found} is not a joint of the arm; {_hint(found, JOINTS)}")
    for joint in JOINTS:
        if joint not in elements:
            raise urdf.error(component, f"{name}: joint {joint} is missing")
    joints = []
    for joint in JOINTS:
        element = elements[joint]
        _check_parts(urdf, element, ARM_COMMANDS, ARM_STATES)
        section, homing = (_Params(urdf, element, tags) for tags in (JOINT_TAGS, HOMING_TAGS))
        section.refuse_unknown((*JOINT_TAGS.values(), *HOMING_TAGS.values()))
        if (unit := _unit(urdf, element)) != UNITS[joint]:
            raise urdf.error(element, f"{joint}: its type goes with {unit}, not {UNITS[joint]}")
        joints.append((check_joint(joint, section, homing), section))
    check_addresses(joints)
    return ArmDescription(name, tuple(joint for joint, _ in joints))


def read_gripper(
    urdf: Urdf, servo: GripperParameters, name: str = GRIPPER_COMPONENT
) -> GripperDescription:
    """Return the gripper's part of a description.

    Args:
        urdf: The description.
        servo: Source of the pulses and wiring, which a URDF does not contain.
        name: Name of the ``<ros2_control>`` tag.

    Raises:
        ConfigurationError: Something is missing, unknown, duplicated, or out of its range.
    """
    component = _component(urdf, name)
    elements = _joints(urdf, component)
    if len(elements) != 1:
        raise urdf.error(component, f"{name}: {len(elements)} joints; a gripper has one")
    joint, element = next(iter(elements.items()))
    _check_parts(urdf, element, GRIPPER_COMMANDS, GRIPPER_STATES)
    section = _Params(urdf, element, GRIPPER_TAGS)
    section.refuse_unknown(GRIPPER_TAGS.values())
    if _unit(urdf, element) != "m":
        raise urdf.error(element, f"{joint} is not prismatic: its position is a width")
    gripper = replace(servo, **check_jaws(section)._asdict())
    return GripperDescription(name, joint, check_reach(section, gripper))


def _component(urdf: Urdf, name: str) -> Element:
    tags = urdf.root.findall("ros2_control")
    names = [urdf.attribute(tag, "name") for tag in tags]
    if names.count(name) == 1:
        return tags[names.index(name)]
    if name in names:
        raise urdf.error(tags[names.index(name)], f"there are {names.count(name)} <ros2_control> "
                         f"tags named {name}")  # fmt: skip
    raise urdf.error(urdf.root, f"no <ros2_control> tag is named {name}; {_hint(name, names)}")


def _joints(urdf: Urdf, component: Element) -> dict[str, Element]:
    elements: dict[str, Element] = {}
    for element in component:
        if element.tag == "hardware":
            continue
        if element.tag != "joint":
            raise urdf.error(
                element,
                f"{component.attrib['name']}: <{element.tag}> is not read; every interface is one "
                "of a joint, home too",
            )
        name = urdf.attribute(element, "name")
        if name in elements:
            raise urdf.error(element, f"joint {name} is there twice")
        elements[name] = element
    return elements


def _unit(urdf: Urdf, element: Element) -> str:
    """Return the unit of a joint, by its type in the robot."""
    name = element.attrib["name"]
    found = [joint for joint in urdf.root.findall("joint") if joint.attrib.get("name") == name]
    if len(found) != 1:
        raise urdf.error(
            element, f"{name}: the robot has {len(found)} joints of that name, not one"
        )
    kind = found[0].attrib.get("type", "")
    if kind not in _UNITS:
        raise urdf.error(found[0], f"{name}: type {shown(kind)} is not one of {', '.join(_UNITS)}")
    return _UNITS[kind]


def _check_parts(
    urdf: Urdf, element: Element, commands: Sequence[str], states: Sequence[str]
) -> None:
    """Raise unless a joint has exactly these interfaces, and no tag that would be ignored."""
    name = element.attrib["name"]
    for part in element:
        if part.tag not in _PARTS:
            raise urdf.error(
                part, f"{name}: <{part.tag}> is not known here; {_hint(part.tag, _PARTS)}"
            )
        if len(part):
            raise urdf.error(part, f"{name}: <{part.tag}> has nested tags, which are not read")
    for tag, wanted in (("command_interface", commands), ("state_interface", states)):
        _check_names(urdf, element, tag, wanted)
    names = [urdf.attribute(part, "name") for part in element.findall("param")]
    twice = [each for each, count in Counter(names).items() if count > 1]
    if twice:
        raise urdf.error(element, f"{name}: {twice[0]} is there twice")


def _check_names(urdf: Urdf, element: Element, tag: str, wanted: Sequence[str]) -> None:
    name, seen = element.attrib["name"], []
    for part in element.findall(tag):
        each = urdf.attribute(part, "name")
        if each not in wanted:
            raise urdf.error(part, f"{name}: {tag} {each} is not known; {_hint(each, wanted)}")
        if each in seen:
            raise urdf.error(part, f"{name}: {tag} {each} is there twice")
        seen.append(each)
    for each in wanted:
        if each not in seen:
            raise urdf.error(
                element, f"{name}: {tag} {each} is missing; it has exactly {', '.join(wanted)}"
            )


def _hint(name: str, known: Sequence[str]) -> str:
    return did_you_mean(name, known, f"known here: {', '.join(known) or 'none'}")
