"""Named tools: their tool centre point and their mass."""

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
"""Largest offset of a tool from the flange along each axis [m]: three forearms."""
MASS_MAX = 10.0
"""Largest mass accepted for a tool [kg]; the arm carries less."""
FINGERS = "fingers"
"""Name of the tool that the parameters describe."""

_HINTS = {"m": "; are these millimetres?", "rad": "; are these degrees?"}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
_WORDS = re.compile(r"(?=.{1,64}$)[A-Za-z][A-Za-z0-9_-]*(?: [A-Za-z0-9_-]+)*")


@dataclass(frozen=True, slots=True)
class Tool:
    """A tool on the flange.

    Attributes:
        name: Letters, digits, ``_`` and ``-``; begins with a letter.
        pose_tool_in_flange: Pose of the tool centre point in the flange.
        mass: Total mass [kg]; a record only, no motion depends on it. 0 if it is not known.

    Raises:
        InvalidArgumentError: A value is not finite or not possible.
    """

    name: str
    pose_tool_in_flange: Pose
    mass: float = 0.0

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
    """Return the gripper of the arm; its tool centre point is between the finger tips."""
    built = parameters.geometry
    return Tool(FINGERS, Pose(built.tool_x, built.tool_y, built.tool_z), built.tool_mass)


def kinematics_with(parameters: ArmParameters, tool: Tool, overhang: float = 0.0) -> Scara:
    """Return the kinematics of the arm with a tool on its flange.

    Args:
        parameters: Parameters of the arm.
        tool: The tool.
        overhang: Horizontal distance from its point to the farthest point of its load [m].
    """
    built = parameters.geometry
    geometry = Geometry(built.upper_arm, built.forearm, built.height)
    return Scara(geometry, parameters.joints, tool.pose_tool_in_flange, overhang=overhang)


def kinematics_of(parameters: ArmParameters) -> Scara:
    """Return the kinematics of an arm; the tool centre point is between the finger tips."""
    return kinematics_with(parameters, fingers(parameters))


def check_name(what: str, name: str, *, words: bool = False) -> None:
    """Raise unless ``name`` can be the name of a tool, frame, load or pose.

    Args:
        what: What it names.
        name: The name.
        words: Whether it may have several words with a space between, as that of a pose.

    Raises:
        InvalidArgumentError: The name is not valid.
    """
    if not isinstance(name, str) or not (_WORDS if words else _NAME).fullmatch(name):
        spaces = ", with single spaces between" if words else ""
        raise InvalidArgumentError(
            f"{what} name {shown(name)}: a name begins with a letter and has up to 64 letters, "
            f"digits, '_' or '-'{spaces}"
        )


def check_number(what: str, value: float, size: float, unit: str) -> float:
    """Return a number whose magnitude is at most ``size``.

    Raises:
        InvalidArgumentError: The value is no such number.
    """
    value = number(what, value)
    if not -size <= value <= size:
        raise InvalidArgumentError(
            f"{what}: {value:g} {unit} is outside {-size:.4g} .. {size:.4g} {unit}"
            f"{_HINTS.get(unit, '')}"
        )
    return value


def unknown(what: str, name: str, known: Iterable[str]) -> InvalidArgumentError:
    """Return the error for an unknown name, with a proposal."""
    names = sorted(known)
    hint = f"there are {', '.join(names)}"
    if isinstance(name, str):
        hint = did_you_mean(name, names, hint)
    return InvalidArgumentError(f"there is no {what} {shown(name)}; {hint}")
