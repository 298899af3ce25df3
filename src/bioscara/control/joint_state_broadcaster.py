"""Tells the state of all joints."""

from __future__ import annotations

import math
from typing import NamedTuple

from bioscara.control.controller import Controller
from bioscara.control.parameters import Parameters
from bioscara.drivers import Quality
from bioscara.errors import ConfigurationError
from bioscara.hardware import POSITION, VELOCITY, StateInterface


class JointStates(NamedTuple):
    """What all joints were last seen to do; every field but the first has one entry per joint.

    Attributes:
        time: Begin of the cycle [s].
        names: The joints.
        positions: [rad or m]; NaN where unknown.
        velocities: [rad/s or m/s]; NaN where unknown.
        qualities: How far the position can be believed.
        stamps: When it was measured [s].
    """

    time: float
    names: tuple[str, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    qualities: tuple[Quality, ...]
    stamps: tuple[float, ...]


class JointStateParameters(Parameters):
    """Parameters, named as in ros2_controllers.

    Attributes:
        joints: Names of the joints.
        interfaces: What is told of each joint that has it.
        extra_joints: Joints that no hardware has; they are told to be at 0.
    """

    joints: tuple[str, ...]
    interfaces: tuple[str, ...] = (POSITION, VELOCITY)
    extra_joints: tuple[str, ...] = ()


class JointStateBroadcaster(Controller[JointStateParameters]):
    """Keeps what the joints were last seen to do; silent while it is inactive.

    Attributes:
        states: What the last cycle brought; None while it is inactive.
    """

    TYPE = "joint_state_broadcaster/JointStateBroadcaster"
    PARAMETERS = JointStateParameters

    def __init__(self, name: str, parameters: JointStateParameters) -> None:
        super().__init__(name, parameters)
        self.states: JointStates | None = None
        self._names = (*parameters.joints, *parameters.extra_joints)
        self._positions: tuple[StateInterface, ...] = ()
        self._velocities: tuple[StateInterface, ...] = ()

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """None."""
        return ()

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        """Each kind of all joints, one kind after the other."""
        parameters = self.parameters
        return tuple(
            f"{joint}/{kind}" for kind in parameters.interfaces for joint in parameters.joints
        )

    def on_configure(self) -> None:
        """Check that there is something to tell."""
        if not self.parameters.joints:
            raise ConfigurationError(f"{self.name}: parameter joints names none")
        if POSITION not in self.parameters.interfaces:
            raise ConfigurationError(f"{self.name}: parameter interfaces must have position")

    def on_activate(self, time: float) -> None:
        """Sort the handles by kind."""
        handles = self.state_handles
        self._positions = tuple(handle for handle in handles if handle.kind == POSITION)
        self._velocities = tuple(handle for handle in handles if handle.kind == VELOCITY)

    def on_deactivate(self, time: float) -> None:
        """Tell nothing any more."""
        self.states = None

    def update(self, time: float, period: float) -> None:
        """Take what was measured."""
        extra = len(self.parameters.extra_joints)
        zeros, positions = (0.0,) * extra, self._positions
        velocities = [handle.value for handle in self._velocities] or [math.nan] * len(positions)
        self.states = JointStates(
            time,
            self._names,
            (*(handle.value for handle in positions), *zeros),
            (*velocities, *zeros),
            (*(handle.quality for handle in positions), *(Quality.FRESH,) * extra),
            (*(handle.stamp for handle in positions), *(time,) * extra),
        )
