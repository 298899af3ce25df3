"""The robot description that comes with the package, and that of an arm with other values.

It is generated from ``parameters.yaml``, the xacro files next to it and the drawing in ``parts`` by
``tools/description.py``; ``make check`` compares. Values that follow from the parameters alone are
changed here for another arm; meshes and masses are those of the drawing and stay.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

from bioscara.errors import ConfigurationError
from bioscara.model.loading import load_parameters
from bioscara.model.overlay import DRAWN, REBUILD
from bioscara.model.parameters import ArmParameters, JointParameters
from bioscara.model.tags import GRIPPER_TAGS, HOMING_TAGS, JOINT_TAGS

DESCRIPTION = Path(__file__).with_name("description")
"""Folder of the description."""
URDF = DESCRIPTION / "bioscara.urdf"
"""The expanded robot description of the existing arms."""
SRDF = DESCRIPTION / "bioscara.srdf"
"""Groups, states and pairs of links that never touch."""

_TORQUE = 0.19 * math.sqrt(2.0) * 1.48
"""Torque at which a motor with its full current slips [N m]; see ``body.xacro``."""
_STEPS = 32
"""Steps in which the board sets the current."""
_NEVER = (
    "pairs of links were found never to touch, which the SRDF frees from collision checks; find "
    "them anew"
)


def mesh_file(name: str) -> Path:
    """Return the file of a mesh by its name in the description, ``package://PACKAGE/meshes/...``.

    The package is that of ``ros/`` which has a copy, for users of the description in ROS 2.
    """
    return DESCRIPTION / name[name.index("meshes/") :]


def urdf_of(parameters: ArmParameters) -> str:
    """Return the robot description of an arm: its frames, limits and ``<ros2_control>`` tags.

    Raises:
        ConfigurationError: Its meshes or masses would be others than those of the package.
    """
    _require_drawn(parameters, load_parameters())
    root = _parsed(URDF)
    joints = {tag.attrib["name"]: tag for tag in root.findall("joint")}
    for joint in parameters.joints:
        limit = next(joints[joint.name].iter("limit"))
        _set(limit, lower=joint.lower, upper=joint.upper, velocity=joint.max_velocity,
             effort=_effort(joint))  # fmt: skip
    shape, jaws = parameters.geometry, parameters.gripper
    _set_origin(joints["j1"], 0.0, 0.0, shape.height)
    _set_origin(joints["tool"], shape.tool_y, -shape.tool_x, shape.tool_z)
    for name, share in (("gripper", 1.0), ("gripper_l_mimic", 0.5), ("gripper_r_mimic", -0.5)):
        lower, upper = sorted((share * jaws.lower, share * jaws.upper))
        limit = next(joints[name].iter("limit"))
        _set(limit, lower=lower, upper=upper, velocity=abs(share) * jaws.max_velocity)
    controlled = {tag.attrib["name"]: tag for tag in root.findall("ros2_control/joint")}
    for joint in parameters.joints:
        _set_params(controlled[joint.name], JOINT_TAGS, joint)
        _set_params(controlled[joint.name], HOMING_TAGS, joint.homing)
    _set_params(controlled["gripper"], GRIPPER_TAGS, jaws)
    return _written(root)


def srdf_of(parameters: ArmParameters) -> str:
    """Return the groups, states and pairs of links that never touch, of an arm.

    Raises:
        ConfigurationError: As :func:`urdf_of`; or a range is wider than the one in which the pairs
            were found not to touch.
    """
    committed, jaws = load_parameters(), parameters.gripper
    _require_drawn(parameters, committed)
    checked = _ranges(committed)
    for name, (lower, upper) in _ranges(parameters).items():
        lowest, highest = checked[name]
        if lower < lowest or upper > highest:
            raise ConfigurationError(
                f"{name}: {lower:g} .. {upper:g} is wider than {lowest:g} .. {highest:g}, in which "
                f"{_NEVER}, or narrow the range"
            )
    height, known = parameters.geometry.height, committed.geometry.height
    if height != known:
        raise ConfigurationError(
            f"geometry.height: {height:g} is not the {known:g} at which {_NEVER}"
        )
    root = _parsed(SRDF)
    for state in root.findall("group_state"):
        name, joint = state.attrib["name"], state[0]
        if name in ("open", "close"):
            _set(joint, value=jaws.upper if name == "open" else jaws.lower)
        elif name.startswith("close_") and not (
            jaws.lower <= float(joint.attrib["value"]) <= jaws.upper
        ):
            root.remove(state)
    return _written(root)


def _ranges(parameters: ArmParameters) -> dict[str, tuple[float, float]]:
    """Return the limits of the joints and the gripper, by the name of the group."""
    joints = {f"joints.{each.name}": (each.lower, each.upper) for each in parameters.joints}
    return {**joints, "gripper": (parameters.gripper.lower, parameters.gripper.upper)}


def _require_drawn(parameters: ArmParameters, committed: ArmParameters) -> None:
    for name in DRAWN:
        value, drawn = (getattr(arm.geometry, name) for arm in (parameters, committed))
        if value != drawn:
            raise ConfigurationError(
                f"geometry.{name}: {value:g} is not the {drawn:g} of the description: {REBUILD}"
            )


def _effort(joint: JointParameters) -> float:
    """Return the torque or force at which the motor slips, without friction [N m or N]."""
    step = math.ceil(0.01 * joint.drive_current_percent * (_STEPS - 1)) + 1
    return round(_TORQUE * step / _STEPS * abs(joint.reduction), 1)


def _parsed(path: Path) -> ET.Element:
    return ET.parse(path).getroot()  # noqa: S314  comes with the package


def _written(root: ET.Element) -> str:
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _set(tag: ET.Element, **values: float) -> None:
    for name, value in values.items():
        if float(tag.attrib[name]) != value:
            tag.attrib[name] = repr(value)


def _set_origin(joint: ET.Element, *place: float) -> None:
    origin = next(joint.iter("origin"))
    if [float(part) for part in origin.attrib["xyz"].split()] != [*place]:
        origin.attrib["xyz"] = " ".join(map(repr, place))


def _set_params(
    joint: ET.Element,
    tags: Mapping[str, str],
    part: object,
) -> None:
    """Set the ``<param>`` tags of a joint to the fields that fill them."""
    fields = {tag: field for field, tag in tags.items()}
    for param in joint.findall("param"):
        field = fields.get(param.attrib["name"])
        if field is not None:
            value = getattr(part, field)
            param.text = f"{value:#04x}" if field == "address" else repr(value)
