"""A URDF and its ``<ros2_control>`` tags, checked; errors name the line.

The XML is plain: no entities, no document types, no large files.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from bioscara.arguments import shown
from bioscara.errors import ConfigurationError
from bioscara.model import GripperParameters, JointParameters
from bioscara.model.parameters import JOINTS, UNITS, JointTable, ambiguous_address
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
from bioscara.model.validation import Location
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
    def load(cls, path: Path | str) -> Urdf:
        """Read a file.

        Raises:
            ConfigurationError: It cannot be read, and as above.
        """
        try:
            with Path(path).open("rb") as file:
                content = file.read(SIZE_MAX + 1)
            return cls(content.decode(), str(path))
        except OSError as error:
            raise ConfigurationError(f"{path}: {error.strerror or error}") from error
        except UnicodeDecodeError as error:
            raise ConfigurationError(f"{path}: not a text file: {error}") from error

    def error(self, element: Element, text: str) -> ConfigurationError:
        """Return an error that states the location of ``element``."""
        return ConfigurationError(f"{self.place(element)}{text}")

    def place(self, element: Element) -> str:
        """Return the begin of a message about ``element``."""
        return f"{self._source}, line {self._lines[element]}: "

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


class _Params:
    """The ``<param>`` tags of joints, by the location of the value that they fill."""

    def __init__(self, urdf: Urdf) -> None:
        self._urdf = urdf
        self._elements: dict[Location, tuple[str, Element]] = {}

    def values(self, joint: Element, tags: Mapping[str, str], *group: str) -> dict[str, object]:
        """Return the values of the tags of a joint, by field; numbers where they are numbers."""
        named = {self._urdf.attribute(part, "name"): part for part in joint.findall("param")}
        found = {field: named[tag] for field, tag in tags.items()}
        owner = joint.attrib["name"]
        self._elements |= {(*group, field): (owner, part) for field, part in found.items()}
        return {field: _value(part) for field, part in found.items()}

    def place(self, location: Location) -> str:
        """Return the begin of a message about a value."""
        return self._urdf.place(self._elements[location][1])

    def name(self, location: Location) -> str:
        """Return the name of a value in the description."""
        owner, part = self._elements[location]
        return f"{owner}: {part.attrib['name']}"


def _value(part: Element) -> object:
    text = (part.text or "").strip()
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
    params, values = _Params(urdf), {}
    for joint in JOINTS:
        element = elements[joint]
        _check_parts(
            urdf, element, ARM_COMMANDS, ARM_STATES, [*JOINT_TAGS.values(), *HOMING_TAGS.values()]
        )
        _check_address(urdf, element)
        if (unit := _unit(urdf, element)) != UNITS[joint]:
            raise urdf.error(element, f"{joint}: its type goes with {unit}, not {UNITS[joint]}")
        values[joint] = {
            **params.values(element, JOINT_TAGS, joint),
            "unit": unit,
            "homing": params.values(element, HOMING_TAGS, joint, "homing"),
            "belt_period": 0.0,  # only planning uses the belts
        }
    return ArmDescription(name, JointTable.checked(values, params.place, params.name).joints)


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
    _check_parts(urdf, element, GRIPPER_COMMANDS, GRIPPER_STATES, [*GRIPPER_TAGS.values()])
    if _unit(urdf, element) != "m":
        raise urdf.error(element, f"{joint} is not prismatic: its position is a width")
    params = _Params(urdf)
    values = vars(servo) | params.values(element, GRIPPER_TAGS)
    return GripperDescription(
        name, joint, GripperParameters.checked(values, params.place, params.name)
    )


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
    urdf: Urdf,
    element: Element,
    commands: Sequence[str],
    states: Sequence[str],
    params: Sequence[str],
) -> None:
    """Raise unless a joint has exactly these tags, and none that would be ignored."""
    name = element.attrib["name"]
    for part in element:
        if part.tag not in _PARTS:
            raise urdf.error(
                part, f"{name}: <{part.tag}> is not known here; {_hint(part.tag, _PARTS)}"
            )
        if len(part) and part.get("name") == "homing":
            raise urdf.error(
                part,
                f"{name}: the values of homing are params of the joint here, not nested in one; "
                f"write {', '.join(HOMING_TAGS.values())}",
            )
        if len(part):
            raise urdf.error(part, f"{name}: <{part.tag}> has nested tags, which are not read")
    _check_names(urdf, element, "command_interface", commands)
    _check_names(urdf, element, "state_interface", states)
    _check_names(urdf, element, "param", params)


def _check_address(urdf: Urdf, element: Element) -> None:
    """Refuse an address without 0x that is another one as a hexadecimal number."""
    name = JOINT_TAGS["address"]
    for part in element.findall("param"):
        text = (part.text or "").strip()
        if part.get("name") != name or not _WHOLE.fullmatch(text) or "x" in text.lower():
            continue
        if problem := ambiguous_address(text):
            raise urdf.error(part, f"{element.attrib['name']}: {name}: {problem}")


def _check_names(urdf: Urdf, element: Element, tag: str, wanted: Sequence[str]) -> None:
    name, seen = element.attrib["name"], []
    kind = "" if tag == "param" else f"{tag} "
    for part in element.findall(tag):
        each = urdf.attribute(part, "name")
        if each not in wanted:
            raise urdf.error(part, f"{name}: {kind}{each} is not known; {_hint(each, wanted)}")
        if each in seen:
            raise urdf.error(part, f"{name}: {kind}{each} is there twice")
        seen.append(each)
    for each in wanted:
        if each not in seen:
            raise urdf.error(
                element, f"{name}: {kind}{each} is missing; it has exactly {', '.join(wanted)}"
            )


def _hint(name: str, known: Sequence[str]) -> str:
    return did_you_mean(name, known, f"known here: {', '.join(known) or 'none'}")
