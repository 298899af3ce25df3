"""Values in a robot description, against the parameters with which its owner drives the arm.

A description carries the values of the existing arms where nobody changed them, so that one equal
to these says nothing about this arm. Of the others, a limit may differ, and the narrower one
applies; any other value must be the owner's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple
from xml.etree.ElementTree import Element

from bioscara.control.controllers.joint_trajectory import JointTrajectory
from bioscara.errors import ConfigurationError, GoalRejectedError
from bioscara.hardware import Urdf
from bioscara.model import ArmParameters, load_parameters
from bioscara.model.tags import GRIPPER_TAGS, HOMING_TAGS, JOINT_TAGS

_LIMITS = {
    "min": "lower",
    "max": "upper",
    "max_velocity": "velocity",
    "max_acceleration": "acceleration",
}
"""Limits by the ``<param>`` tags that hold them; ``<limit>`` has them by these names."""
_SLACK = 1e-9
"""Distance beyond a limit that is rounding."""


class Described(NamedTuple):
    """A value of a joint in a description.

    Attributes:
        tag: Name of the ``<param>`` tag that has this value, or would.
        name: Its name in messages.
        text: As written.
        element: Where it is.
    """

    tag: str
    name: str
    text: str
    element: Element


class Limits(NamedTuple):
    """Limits of a joint that are narrower in the description than in the parameters.

    Attributes:
        joint: Name of the joint in the description.
        lower: Lowest position [rad or m].
        upper: Highest position [rad or m].
        velocity: Highest speed [rad/s or m/s].
        acceleration: Highest acceleration [rad/s^2 or m/s^2].
    """

    joint: str
    lower: float = -math.inf
    upper: float = math.inf
    velocity: float = math.inf
    acceleration: float = math.inf

    def check(self, kind: str, value: float) -> None:
        """Check a commanded value; one that is not finite is for the owner to refuse.

        Args:
            kind: ``"position"``, ``"velocity"`` or ``"acceleration"``.
            value: The value.

        Raises:
            GoalRejectedError: It is beyond.
        """
        most = self.upper if kind == "position" else getattr(self, kind)
        least = self.lower if kind == "position" else -most
        if value < least - _SLACK or value > most + _SLACK:
            raise GoalRejectedError(
                f"{self.joint}: {kind} {value:g} is outside {least:g} .. {most:g}, which the "
                "robot_description allows; stay within, or start the node with wider limits in it"
            )


def compare(
    urdf: Urdf, joints: Mapping[str, str], used: ArmParameters
) -> tuple[list[str], dict[str, Limits]]:
    """Compare a description with the parameters in use.

    Args:
        urdf: The description.
        joints: The owner's names of its joints.
        used: The parameters of the owner.

    Returns:
        A warning for each limit that differs, and the limits that are narrower in the description,
        by the owner's names of the joints.

    Raises:
        ConfigurationError: A value contradicts the parameters.
    """
    shipped, warnings = load_parameters(), list[str]()
    narrower: dict[str, Limits] = {}
    for joint, own in joints.items():
        ours, theirs = _values(used, own), _values(shipped, own)
        for value in _described(urdf, joint):
            here, number = ours.get(value.tag), _number(value.text)
            if here is None or _same(number, here) or _same(number, theirs[value.tag]):
                continue
            place = f"{urdf.place(value.element)}{joint}: {value.name} is {value.text}"
            known = f"{int(here):#04x}" if value.tag == JOINT_TAGS["address"] else f"{here:.10g}"
            limit = _LIMITS.get(value.tag)
            if math.isnan(number) or limit is None:
                raise ConfigurationError(
                    f"{place}, and {known} in the parameters of the arm; give both the same "
                    "value: the arm has those of $BIOSCARA_PARAMETERS over parameters.yaml"
                )
            inside = number > here if limit == "lower" else number < here
            if not inside:
                warnings.append(f"{place}; the {known} of the arm's parameters applies")
                continue
            warnings.append(
                f"{place}, narrower than the {known} of the arm's parameters: it applies to the "
                "commands of clients of ROS"
            )
            limits = narrower.get(own, Limits(joint))
            tighter = max if limit == "lower" else min
            narrower[own] = limits._replace(**{limit: tighter(number, getattr(limits, limit))})
    return list(dict.fromkeys(warnings)), narrower


def check(trajectory: JointTrajectory, limits: Mapping[str, Limits]) -> JointTrajectory:
    """Return a trajectory whose points keep to the limits.

    Raises:
        GoalRejectedError: A point, or the mean speed from one point to the next, is beyond.
    """
    for place, joint in enumerate(trajectory.joint_names):
        if joint not in limits:
            continue
        before: tuple[float, float] | None = None
        for point in trajectory.points:
            for kind, values in (
                ("position", point.positions),
                ("velocity", point.velocities),
                ("acceleration", point.accelerations),
            ):
                if len(values) > place:
                    limits[joint].check(kind, values[place])
            if len(point.positions) > place:
                here = point.time, point.positions[place]
                if before is not None and here[0] > before[0]:
                    limits[joint].check("velocity", (here[1] - before[1]) / (here[0] - before[0]))
                before = here
    return trajectory


def _values(parameters: ArmParameters, own: str) -> dict[str, float]:
    """Return the values of a joint by the ``<param>`` tags that would hold them."""
    joint = next((each for each in parameters.joints if each.name == own), None)
    if joint is None:
        jaws = parameters.gripper
        return {
            **{tag: getattr(jaws, field) for field, tag in GRIPPER_TAGS.items()},
            "max_velocity": jaws.max_velocity,
        }
    return {
        **{tag: getattr(joint, field) for field, tag in JOINT_TAGS.items()},
        **{tag: getattr(joint.homing, field) for field, tag in HOMING_TAGS.items()},
    }


def _described(urdf: Urdf, joint: str) -> Iterator[Described]:
    """Yield the values that a description has for a joint."""
    for element in _of_joint(urdf, "joint", joint):
        for limit in element.findall("limit"):
            for tag, name in _LIMITS.items():
                if name in limit.attrib:
                    yield Described(tag, f"<limit> {name}", limit.attrib[name], limit)
    for controlled in _of_joint(urdf, "ros2_control/joint", joint):
        for param in controlled.findall("param"):
            name = param.attrib.get("name", "")
            yield Described(name, f"<param> {name}", (param.text or "").strip(), param)
        for command in controlled.findall("command_interface"):
            yield from _of_interface(command)


def _of_joint(urdf: Urdf, path: str, joint: str) -> list[Element]:
    # Not by a predicate of the path, in which a name with a quote is an error.
    return [element for element in urdf.root.iterfind(path) if element.get("name") == joint]


def _of_interface(command: Element) -> Iterator[Described]:
    """Yield the limits of a command interface."""
    kind = command.attrib.get("name", "")
    for param in command.findall("param"):
        name, text = param.attrib.get("name", ""), (param.text or "").strip()
        tag = name if kind == "position" else "max_velocity"
        if kind in ("position", "velocity") and name in ("min", "max"):
            # Speeds have one limit for both directions.
            text = text.removeprefix("-") if kind == "velocity" else text
            yield Described(tag, f"<command_interface> {kind} {name}", text, param)


def _number(text: str) -> float:
    """Return a number as written, also an address; NaN for anything else."""
    if "_" in text:
        return math.nan  # Python would read 1_0 as 10.
    try:
        return float(int(text, 16)) if text.lower().startswith("0x") else float(text)
    except ValueError:
        return math.nan


def _same(one: float, other: float) -> bool:
    return math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-12)
