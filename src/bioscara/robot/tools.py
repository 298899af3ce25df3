"""Tools by name: where the point is that is moved, and what hangs on the flange."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from bioscara.arguments import number, shown
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Geometry, Pose, Scara
from bioscara.kinematics.pose import ANGLE_MAX, require_pose
from bioscara.model import ArmParameters
from bioscara.spelling import did_you_mean

OFFSET_MAX = 1.0
"""How far a tool may reach from the flange, along each axis [m]: three forearms."""
MASS_MAX = 10.0
"""Heaviest tool that is taken for one [kg]; the arm carries less."""
FINGERS = "fingers"
"""Name of the tool that the parameters describe."""

_HINTS = {"m": "; are these millimetres?", "rad": "; are these degrees?"}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")


@dataclass(frozen=True, slots=True)
class Tool:
    """Something on the flange.

    Attributes:
        name: Letters, digits, ``_`` and ``-``; begins with a letter.
        pose_tool_in_flange: The point that is moved.
        mass: Of all of it [kg]; a record, no motion depends on it.

    Raises:
        InvalidArgumentError: A value is not finite or cannot be.
    """

    name: str
    pose_tool_in_flange: Pose
    mass: float

    def __post_init__(self) -> None:
        check_name("tool", self.name)
        offset = require_pose(f"tool {self.name}, its pose", self.pose_tool_in_flange)
        for axis, value in zip("xyz", offset, strict=False):
            check_number(f"tool {self.name}, {axis}", value, OFFSET_MAX, "m")
        check_number(f"tool {self.name}, yaw", offset.yaw, ANGLE_MAX, "rad")
        mass = check_number(f"tool {self.name}, mass", self.mass, MASS_MAX, "kg")
        if mass < 0.0:
            raise InvalidArgumentError(f"tool {self.name}, mass: {mass:g} kg is below zero")
        object.__setattr__(self, "pose_tool_in_flange", offset)
        object.__setattr__(self, "mass", mass)


def fingers(parameters: ArmParameters) -> Tool:
    """Return the gripper of the arm; the point is between the finger tips."""
    built = parameters.geometry
    return Tool(FINGERS, Pose(built.tool_x, built.tool_y, built.tool_z), built.tool_mass)


def kinematics_with(parameters: ArmParameters, tool: Tool) -> Scara:
    """Return the kinematics of the arm with a tool on its flange."""
    built = parameters.geometry
    geometry = Geometry(built.upper_arm, built.forearm, built.height)
    return Scara(geometry, parameters.joints, tool.pose_tool_in_flange)


def kinematics_of(parameters: ArmParameters) -> Scara:
    """Return the kinematics of an arm; the tool is the point between the finger tips."""
    return kinematics_with(parameters, fingers(parameters))


def check_name(what: str, name: str) -> None:
    """Raise unless ``name`` can be the name of a tool or pose.

    Raises:
        InvalidArgumentError: It cannot.
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InvalidArgumentError(
            f"{what} name {shown(name)}: a name begins with a letter and has up to 64 letters, "
            "digits, '_' or '-'"
        )


def check_number(what: str, value: float, size: float, unit: str) -> float:
    """Return a number of at most ``size`` either way.

    Raises:
        InvalidArgumentError: It is not.
    """
    value = number(what, value)
    if not -size <= value <= size:
        raise InvalidArgumentError(
            f"{what}: {value:g} {unit} is outside {-size:.4g} .. {size:.4g} {unit}"
            f"{_HINTS.get(unit, '')}"
        )
    return value


def unknown(what: str, name: str, known: Iterable[str]) -> InvalidArgumentError:
    """Return the complaint about a name that there is not, with a proposal."""
    names = sorted(known)
    hint = f"there are {', '.join(names)}"
    if isinstance(name, str):
        hint = did_you_mean(name, names, hint)
    return InvalidArgumentError(f"there is no {what} {shown(name)}; {hint}")
