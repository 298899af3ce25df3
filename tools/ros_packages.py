"""Generate the parts of the ROS 2 packages in ``ros/`` that follow from the model.

``make generate`` writes the files, ``make fresh`` compares them: the macros of arm and gripper with
their parameter files and meshes, MoveIt's SRDF and joint limits, the definitions of our own
interfaces, and the installed copy of an example. The macros are those of the description that
``tools/description.py`` writes, with a prefix before each name and with the values of their
parameter file.
"""

from __future__ import annotations

import copy
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

from bioscara.model import ArmParameters, load_parameters
from bioscara.model.loading import EXISTING_ARMS
from bioscara.model.tags import (
    ARM_COMPONENT,
    GRIPPER_COMPONENT,
    GRIPPER_TAGS,
    HOMING_TAGS,
    JOINT_TAGS,
)
from bioscara.model.urdf import DESCRIPTION, SRDF, URDF, mesh_file
from tools import generated
from tools.description import render
from tools.generated import ROOT

PACKAGES = ROOT / "ros"
"""Folder of the packages."""
INTERFACES = "bioscara_interfaces"
"""Package with our own interfaces."""
EXAMPLE = ROOT / "examples/ros2/publisher_joint_trajectory_controller.py"
"""Example that a package installs as a program."""
_ARM, _GRIPPER = "bioscara_arm_description", "bioscara_gripper_descriptions"
_MOVEIT = "bioscara_arm_gripper_128_moveit_config"
_GENERATED = "Generated from the model: see tools/ros_packages.py, then make generate."
_EFFORT = (
    "${{round(0.19 * sqrt(2) * 1.48 * (ceil(0.01 * {0}.drive_current * 31) + 1) / 32 "
    "* fabs({0}.reduction), 1)}}"
)
"""Torque or force at which the motor slips, as in ``body.xacro``."""
_GRIPPER_ACCELERATION = 1.0
"""Acceleration of the gripper's width in MoveIt; its servo has none to set [m/s^2]."""

_VELOCITY_SHARE, _ACCELERATION_SHARE = 0.5, 0.2
"""Shares of the limits at which MoveIt plans where a program names none. With less velocity, the
lift takes long: 113 s at 0.1. With more, most motions are slowed down by the reduced speed; with
more acceleration the arm starts harder and gains little."""

_MACRO = """<?xml version="1.0"?>
<!-- {generated} -->
<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
  <!-- Read now: later, paths begin at the file that calls the macro. -->
  <xacro:property name="{config}" lazy_eval="false"
                  value="${{xacro.load_yaml('../config/{config}.yaml')}}"/>

  <!-- {subject}
       parent: link that carries it, at the block origin.  prefix: before each name.
       use_mock_hardware: for a ros2_control that is to simulate the joints itself. -->
  <xacro:macro name="{name}" params="parent prefix:='' use_mock_hardware:=false *origin">
{body}
  </xacro:macro>
</robot>
"""


def files(parameters: ArmParameters) -> dict[str, bytes]:
    """Return the content of every generated file, by its path below ``ros/``.

    Args:
        parameters: Parameters of the arm in the description.
    """
    root = _parsed(URDF)
    tips = [joint.find("child") for joint in root.iterfind("joint[@name='flange_joint']")]
    flange = next(tip.attrib["link"] for tip in tips if tip is not None)
    of_arm, of_gripper = _split(root, flange)
    arm = _macro(
        of_arm, ARM_COMPONENT, "load_arm", "bioscara_arm_parameters",
        "The arm, from its base to the flange.",
    )  # fmt: skip
    gripper = _macro(
        of_gripper, GRIPPER_COMPONENT, "load_gripper", "bioscara_gripper_128_parameters",
        "The gripper, from its mount to the point between its finger tips.",
    )  # fmt: skip
    out = {
        f"{_ARM}/urdf/bioscara_arm.xacro": arm,
        f"{_ARM}/config/bioscara_arm_parameters.yaml": _arm_parameters(parameters),
        f"{_GRIPPER}/urdf/bioscara_gripper_128.xacro": gripper,
        f"{_GRIPPER}/config/bioscara_gripper_128_parameters.yaml": _gripper_parameters(parameters),
        f"{_MOVEIT}/config/scene.srdf": _srdf(),
        f"{_MOVEIT}/config/joint_limits.yaml": _joint_limits(parameters),
        f"bioscara_arm_bringup/scripts/{EXAMPLE.stem}": EXAMPLE.read_text(),
    }
    binary = {name: text.encode() for name, text in out.items()}
    for package, elements in ((_ARM, of_arm), (_GRIPPER, of_gripper)):
        for element in elements:
            for mesh in element.iter("mesh"):
                file = mesh_file(mesh.attrib["filename"])
                binary[f"{package}/{file.relative_to(DESCRIPTION)}"] = file.read_bytes()
    definitions = ROOT / "interfaces/definitions"
    for file in sorted((definitions / INTERFACES).glob("*/*")):
        binary[file.relative_to(definitions).as_posix()] = file.read_bytes()
    return binary


def _split(root: ET.Element, flange: str) -> tuple[list[ET.Element], list[ET.Element]]:
    """Return the elements of the arm, to its flange, and those of the gripper behind it."""
    arm: list[ET.Element] = []
    gripper: list[ET.Element] = []
    behind = {flange}
    parts = [part for part in root if part.tag in {"joint", "ros2_control"}]
    links = {part.attrib["name"]: part for part in root.iter("link")}
    for part in parts:
        if part.tag == "ros2_control":
            (arm if part.attrib["name"] == ARM_COMPONENT else gripper).append(part)
            continue
        child = _end(part, "child")
        if _end(part, "parent") in behind:
            behind.add(child)
            gripper += [part, links[child]]
        else:
            arm += [part, links[child]]
    return arm, gripper


def _end(joint: ET.Element, end: str) -> str:
    """Return the link at an end of a joint, parent or child."""
    return next(joint.iter(end)).attrib["link"]


def _macro(
    elements: Iterable[ET.Element],
    component: str,
    name: str,
    config: str,
    subject: str,
) -> str:
    """Return the file of a macro that has these elements of the description."""
    copies = [copy.deepcopy(element) for element in elements]
    mount = copies[0]
    next(mount.iter("parent")).attrib["link"] = "${parent}"
    mount.remove(next(mount.iter("origin")))
    ET.SubElement(mount, "xacro:insert_block", name="origin")
    for element in copies:
        _use_parameters(element, component, config)
        _use_prefix(element)
    holder = ET.Element("holder")
    holder.extend(copies)
    ET.indent(holder, level=1)
    lines = ET.tostring(holder, encoding="unicode").splitlines()[1:-1]
    return _MACRO.format(
        generated=_GENERATED, name=name, config=config, subject=subject, body="\n".join(lines)
    )


def _use_prefix(element: ET.Element) -> None:
    """Put the prefix before the names of links, joints, materials and components."""
    for part in element.iter():
        if part.tag in {"link", "joint", "material", "ros2_control"}:
            part.set("name", "${prefix}" + part.attrib["name"])
        elif part.tag in {"parent", "child"} and part.attrib["link"] != "${parent}":
            part.set("link", "${prefix}" + part.attrib["link"])
        elif part.tag == "mimic":
            part.set("joint", "${prefix}" + part.attrib["joint"])


def _use_parameters(element: ET.Element, component: str, config: str) -> None:
    """Put expressions of the parameter file in the place of its values."""
    name = element.attrib["name"]
    limit = element.find("limit")
    if element.tag == "ros2_control":
        _choose_plugin(next(element.iter("hardware")))
        for joint in element.iter("joint"):
            for param in joint.iter("param"):
                tag = param.attrib["name"]
                group, _, inner = tag.partition("_")
                path = f"homing.{inner}" if group == "homing" else tag
                param.text = f"${{{config}.{joint.attrib['name']}.{path}}}"
        return
    if limit is None:
        return
    mimic = element.find("mimic")
    values = f"{config}.{name}"
    if mimic is None:
        limit.attrib |= {
            "lower": f"${{{values}.min}}",
            "upper": f"${{{values}.max}}",
            "velocity": f"${{{values}.max_velocity}}",
        }
        if component == ARM_COMPONENT:
            limit.set("effort", _EFFORT.format(values))
        return
    values, share = f"{config}.{mimic.attrib['joint']}", float(mimic.attrib["multiplier"])
    ends = ("min", "max") if share > 0.0 else ("max", "min")
    limit.attrib |= {
        "lower": f"${{{share} * {values}.{ends[0]}}}",
        "upper": f"${{{share} * {values}.{ends[1]}}}",
        "velocity": f"${{{abs(share)} * {values}.max_velocity}}",
    }


def _choose_plugin(hardware: ET.Element) -> None:
    plugin = next(hardware.iter("plugin"))
    hardware.clear()
    for tag, text in (
        ("xacro:if", "mock_components/GenericSystem"),
        ("xacro:unless", plugin.text),
    ):
        choice = ET.SubElement(hardware, tag, value="${use_mock_hardware}")
        ET.SubElement(choice, "plugin").text = text


def _arm_parameters(parameters: ArmParameters) -> str:
    """Return the parameter file of the arm, with the names of the existing arms' file."""
    lines = [
        f"# {_GENERATED}",
        "# rad, m, s; reduction: motor rad per rad or m; currents in percent of the full scale.",
    ]
    for joint in parameters.joints:
        lines.append(f"{joint.name}:")
        lines += _values(joint, JOINT_TAGS, "  ")
        lines.append("  homing:")
        names = {field: tag.removeprefix("homing_") for field, tag in HOMING_TAGS.items()}
        lines += _values(joint.homing, names, "    ")
    return "\n".join([*lines, ""])


def _gripper_parameters(parameters: ArmParameters) -> str:
    lines = [f"# {_GENERATED}", "# m, m/s; reduction: degrees of the servo per m.", "gripper:"]
    lines += _values(parameters.gripper, {**GRIPPER_TAGS, "max_velocity": "max_velocity"}, "  ")
    return "\n".join([*lines, ""])


def _values(group: object, tags: Mapping[str, str], indent: str) -> list[str]:
    """Return a line for each value of a group, by the tags of its fields."""
    lines = []
    for field, tag in tags.items():
        value = getattr(group, field)
        lines.append(
            f"{indent}{tag}: " + (f"'{value:#04x}'" if field == "address" else repr(value))
        )
    return lines


def _srdf() -> str:
    """Return the model's SRDF as that of the scene, which has a table."""
    source = SRDF.with_name(f"{SRDF.name}.xacro")
    root = ET.fromstring(render(source, table="true"))
    root.set("name", "scene")
    body = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0"?>\n<!-- {_GENERATED} -->\n{body}\n'


def _joint_limits(parameters: ArmParameters) -> str:
    """Return MoveIt's limits: those of the parameters."""
    lines = [
        f"# {_GENERATED}",
        f"# At {_VELOCITY_SHARE:g} of its velocity the lift takes 23 s for its whole range, and",
        "# half of all motions keep to the speed at which the arm slows any motion down.",
        f"default_velocity_scaling_factor: {_VELOCITY_SHARE}",
        f"default_acceleration_scaling_factor: {_ACCELERATION_SHARE}",
        "joint_limits:",
    ]
    limits = [
        (joint.name, joint.max_velocity, joint.max_acceleration) for joint in parameters.joints
    ]
    limits.append(("gripper", parameters.gripper.max_velocity, _GRIPPER_ACCELERATION))
    for name, velocity, acceleration in limits:
        lines += [
            f"  {name}:",
            "    has_velocity_limits: true",
            f"    max_velocity: {velocity!r}",
            "    has_acceleration_limits: true",
            f"    max_acceleration: {acceleration!r}",
        ]
    return "\n".join([*lines, ""])


def _parsed(path: Path) -> ET.Element:
    return ET.parse(path).getroot()


def write(folder: Path, *, check: bool = False) -> list[Path]:
    """Bring every generated file up to date.

    Args:
        folder: The packages.
        check: Whether to write nothing.

    Returns:
        The files that were outdated, or that are no longer generated.
    """
    contents = files(load_parameters(EXISTING_ARMS))
    wanted = {folder / name: content for name, content in contents.items()}
    there = [*folder.glob("*/meshes/*/*"), *folder.glob(f"{INTERFACES}/*/*")]
    stale = generated.update(wanted, check=check, there=there)
    for path in stale if not check else ():
        if path.parent.name == "scripts":
            path.chmod(0o755)
    return stale


def main(arguments: list[str] | None = None) -> int:
    """Write or check the generated files; return the exit status."""
    return generated.main(lambda check: write(PACKAGES, check=check), arguments)


if __name__ == "__main__":
    sys.exit(main())
