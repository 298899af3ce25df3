"""Names in a robot description, and those that the owner of the arm has for the same things."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from bioscara.hardware import Urdf
from bioscara.model import ArmParameters
from bioscara.ros.arm.control_tags import Component, read_components
from bioscara.ros.arm.described_values import Limits, compare


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
        ConfigurationError: It is no URDF, or its hardware is not exactly that of an arm, a gripper
            or both.
    """

    def __init__(self, text: str) -> None:
        self.text, self.urdf = text, Urdf(text, "robot_description")
        self.components = read_components(self.urdf)
        self.joints = {name: own for part in self.components for name, own in part.joints.items()}
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
