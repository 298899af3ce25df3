"""Names in a robot description, and those that the owner of the arm has for the same things."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from bioscara.errors import ConfigurationError
from bioscara.hardware import Urdf
from bioscara.model import ArmParameters
from bioscara.model.parameters import JOINTS
from bioscara.ros.arm.described_values import Limits, compare

GRIPPER_JOINT = "gripper"
"""The owner's name of the gripper's joint."""


class Component(NamedTuple):
    """A hardware component of a description.

    Attributes:
        name: Its name.
        type: ``system``, ``actuator`` or ``sensor``.
        plugin: Its plugin; empty if none is named.
        joints: The owner's names of its joints, by their names in the description.
    """

    name: str
    type: str
    plugin: str
    joints: Mapping[str, str]


class RobotDescription:
    """The hardware components of a robot description, and the translation of their names.

    Attributes:
        text: The URDF.
        urdf: The parsed description.
        components: The hardware components.
        joints: The owner's names of all joints, by their names in the description.
        limits: Limits that are narrower than the owner's, by the owner's names; see
            :meth:`compare`.

    Raises:
        ConfigurationError: It is no URDF, has no hardware, or has other joints than this arm.
    """

    def __init__(self, text: str) -> None:
        self.text, self.urdf = text, Urdf(text, "robot_description")
        tags = self.urdf.root.findall("ros2_control")
        self.components = tuple(
            Component(
                name := self.urdf.attribute(tag, "name"),
                self.urdf.attribute(tag, "type"),
                (tag.findtext("hardware/plugin") or "").strip(),
                _joints(
                    name, [self.urdf.attribute(joint, "name") for joint in tag.findall("joint")]
                ),
            )
            for tag in tags
        )
        if not self.components:
            raise self.urdf.error(
                self.urdf.root, "there is no <ros2_control>: the node would have no joints to drive"
            )
        self.joints = {name: own for part in self.components for name, own in part.joints.items()}
        if len({*self.joints.values()}) != sum(len(part.joints) for part in self.components):
            raise self.urdf.error(self.urdf.root, "two <ros2_control> tags have the same joints")
        self._described = {own: name for name, own in self.joints.items()}
        self.limits: Mapping[str, Limits] = {}

    def compare(self, used: ArmParameters) -> list[str]:
        """Compare the values with the parameters of an owner, whose commands they limit from now.

        Returns:
            A warning for each limit that differs.

        Raises:
            ConfigurationError: A value that is not a limit contradicts the parameters.
        """
        warnings, self.limits = compare(self.urdf, self.joints, used)
        return warnings

    def owners(self, name: str) -> str:
        """Return the owner's name of a joint or of an interface; other names are not changed."""
        joint, slash, kind = name.partition("/")
        return self.joints.get(joint, joint) + slash + kind

    def described(self, name: str) -> str:
        """Return the name in the description of a joint or interface of the owner."""
        joint, slash, kind = name.partition("/")
        return self._described.get(joint, joint) + slash + kind

    def has(self, interface: str) -> bool:
        """Return whether an interface of the owner is one of a joint in the description."""
        return interface.partition("/")[0] in self._described

    def owners_value(self, value: Any) -> Any:
        """Return a parameter in which names of joints and interfaces are the owner's."""
        if isinstance(value, Mapping):
            return {self.owners(key): self.owners_value(each) for key, each in value.items()}
        if isinstance(value, str):
            return self.owners(value)
        if isinstance(value, list | tuple):
            return [self.owners_value(each) for each in value]
        return value

    def component_of(self, interfaces: Iterable[str]) -> Component | None:
        """Return the component whose joints have these interfaces of the owner, if it is there."""
        owned = {name.partition("/")[0] for name in interfaces}
        for component in self.components:
            if owned & set(component.joints.values()):
                return component
        return None


def _joints(name: str, joints: list[str]) -> Mapping[str, str]:
    """Return the owner's names of the joints of a component, by their names in the description.

    Raises:
        ConfigurationError: It is neither this arm nor a gripper.
    """
    # Names with the same prefix are in the order of the joints.
    prefix = min(joints, default="").removesuffix(JOINTS[0])
    if sorted(joints) == sorted(prefix + joint for joint in JOINTS):
        return {prefix + joint: joint for joint in JOINTS}
    if len(joints) == 1:
        return {joints[0]: GRIPPER_JOINT}
    raise ConfigurationError(
        f"robot_description: hardware component {name} has the joints "
        f"{', '.join(joints) or '(none)'}; it is an arm with {', '.join(JOINTS)}, all with the "
        "same prefix or none, or a gripper with one joint"
    )
