"""Publishes the state of all joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from bioscara.control.controllers.controller import Controller, interfaces
from bioscara.control.controllers.parameter_types import Parameters
from bioscara.errors import ConfigurationError
from bioscara.hardware import POSITION, VELOCITY, CommandInterface, StateInterface
from bioscara.hardware.interfaces import Quality
from bioscara.notebook import table


class JointStates(NamedTuple):
    """Last known state of all joints; every field but the first has one entry per joint.

    Attributes:
        time: Begin of the cycle [s].
        names: The joints.
        positions: [rad or m]; NaN where unknown.
        velocities: [rad/s or m/s]; NaN where unknown.
        qualities: Reliability of the position.
        stamps: When it was measured [s].
    """

    time: float
    names: tuple[str, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    qualities: tuple[Quality, ...]
    stamps: tuple[float, ...]

    def __repr__(self) -> str:
        parts = (
            f"{name} {_told(position)}"
            for name, position in zip(self.names, self.positions, strict=True)
        )
        return f"<JointStates at {self.time:.2f} s [rad or m]: {', '.join(parts)}>"

    def _repr_html_(self) -> str:
        rows = [
            (name, _told(position), _told(velocity), quality.value)
            for name, position, velocity, quality in zip(
                self.names, self.positions, self.velocities, self.qualities, strict=True
            )
        ]
        heading = (f"at {self.time:.2f} s", "position [rad or m]", "velocity [1/s]", "quality")
        return table(rows, heading)


def _told(value: float) -> str:
    return "unknown" if math.isnan(value) else f"{value:z.4f}"


class DynamicJointState(NamedTuple):
    """Every interface of one joint.

    Attributes:
        joint: Its name.
        interfaces: Its measured quantities, for example ``"home"``.
        values: One for each, SI units; NaN where unknown.
    """

    joint: str
    interfaces: tuple[str, ...]
    values: tuple[float, ...]


class JointStateParameters(Parameters):
    """Parameters, named as in ros2_controllers.

    Attributes:
        joints: Names of the joints.
        extra_joints: Joints that no hardware has; they are reported at 0.
    """

    joints: tuple[str, ...]
    extra_joints: tuple[str, ...] = ()


class JointStateBroadcaster(Controller[JointStateParameters]):
    """Keeps the last known state of the joints; publishes nothing while it is inactive.

    The records are made from the interfaces when they are asked for.
    """

    TYPE = "joint_state_broadcaster/JointStateBroadcaster"
    PARAMETERS = JointStateParameters

    def __init__(self, name: str, parameters: JointStateParameters) -> None:
        super().__init__(name, parameters)
        self._updated = math.nan
        self._names = (*parameters.joints, *parameters.extra_joints)
        self._handles: dict[str, StateInterface] = {}
        self._positions: tuple[StateInterface, ...] = ()
        self._velocities: tuple[StateInterface, ...] = ()

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        """Position of each joint; its other interfaces are published without being required."""
        return interfaces(self.parameters.joints, (POSITION,))

    @property
    def states(self) -> JointStates | None:
        """The states since the last cycle; None while it is inactive."""
        time, positions, velocities = self._updated, self._positions, self._velocities
        if math.isnan(time):
            return None
        extra = len(self.parameters.extra_joints)
        zeros = (0.0,) * extra
        return JointStates(
            time,
            self._names,
            (*[handle.value for handle in positions], *zeros),
            (*[handle.value for handle in velocities], *zeros),
            (*[handle.quality for handle in positions], *(Quality.FRESH,) * extra),
            (*[handle.stamp for handle in positions], *(time,) * extra),
        )

    @property
    def dynamic_states(self) -> tuple[DynamicJointState, ...]:
        """Current value of every interface of every joint; none while it is inactive."""
        found: dict[str, list[StateInterface]] = {joint: [] for joint in self.parameters.joints}
        for handle in self._handles.values():
            if handle.joint in found:
                found[handle.joint].append(handle)
        return tuple(
            DynamicJointState(joint, tuple(h.kind for h in hs), tuple(h.value for h in hs))
            for joint, hs in found.items()
            if hs
        )

    def on_configure(self) -> None:
        """Check that there is a joint to publish, and none twice."""
        if not self.parameters.joints:
            raise ConfigurationError(f"{self.name}: parameter joints names none")
        for name in self._names:
            if self._names.count(name) > 1:
                raise ConfigurationError(f"{self.name}: {name} is named twice")

    def bind(
        self,
        commands: Mapping[str, CommandInterface],
        states: Mapping[str, StateInterface],
    ) -> None:
        """Take also the handles that not every joint has."""
        super().bind(commands, states)
        self._handles = dict(states)
        self._positions = self.state_handles
        self._velocities = tuple(
            # A joint without this interface gets a handle that is never written.
            states.get(f"{joint}/{VELOCITY}") or StateInterface(joint, VELOCITY)
            for joint in self.parameters.joints
        )

    def unbind(self) -> None:
        """Release the handles, and stop publishing."""
        super().unbind()
        self._handles, self._positions, self._velocities = {}, (), ()
        self._updated = math.nan

    def update(self, time: float, period: float) -> None:
        """Record the time of the measured states."""
        self._updated = time
