"""Forwards commands to the joints unchanged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

from bioscara.arguments import items, number
from bioscara.control.controllers.controller import Controller, interfaces
from bioscara.control.controllers.parameter_types import Parameters
from bioscara.errors import ConfigurationError, InvalidArgumentError
from bioscara.hardware import VELOCITY, CommandInterface


class ForwardCommandParameters(Parameters):
    """Parameters, named as in ros2_controllers.

    Attributes:
        joints: Names of the joints.
        interface_name: Their commanded interface.
    """

    joints: tuple[str, ...]
    interface_name: Literal["position", "velocity"]


class ForwardCommandController(Controller[ForwardCommandParameters]):
    """Writes the last command.

    Until there is one the joints come to rest: a velocity is 0, a position stays as commanded.

    Attributes:
        share: Share of the speed, 0 to 1. Below 1 velocities are scaled, and positions are
            approached at no more than this share of each joint's highest speed; 0 brings the joints
            to rest.
    """

    TYPE = "forward_command_controller/ForwardCommandController"
    PARAMETERS = ForwardCommandParameters
    _command: tuple[float, ...] | None = None
    share = 1.0

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """The named interface of each joint."""
        return interfaces(self.parameters.joints, (self.parameters.interface_name,))

    def on_configure(self) -> None:
        """Check that there is a joint."""
        if not self.parameters.joints:
            raise ConfigurationError(f"{self.name}: parameter joints names none")

    def on_activate(self, time: float) -> None:
        """Discard earlier commands."""
        moves = self.parameters.interface_name == VELOCITY
        self._command = (0.0,) * len(self.parameters.joints) if moves else None

    def command(self, values: Sequence[float]) -> None:
        """Set the command of the next cycle and of all that follow.

        Args:
            values: One for each joint, SI units.

        Raises:
            InvalidArgumentError: There is not one for each joint, or one is not finite.
        """
        joints, kind = self.parameters.joints, self.parameters.interface_name
        given = items(f"{self.name}: the values", values, "give one for each joint")
        if len(given) != len(joints):
            raise InvalidArgumentError(
                f"{self.name}: {len(given)} values for the joints {', '.join(joints)}"
            )
        self._command = tuple(
            number(f"{self.name}: {joint} {kind}", value)
            for joint, value in zip(joints, given, strict=True)
        )

    def update(self, time: float, period: float) -> None:
        """Write the last command, at the share of the speed."""
        command = self._command
        if command is None:
            return
        if self.parameters.interface_name == VELOCITY:
            for handle, value in zip(self.command_handles, command, strict=True):
                handle.value = self.share * value
            return
        for handle, value in zip(self.command_handles, command, strict=True):
            handle.value = self._approached(handle, value, period)

    def _approached(self, handle: CommandInterface, value: float, period: float) -> float:
        """Return the next position towards a command; the limiter brakes to a lower speed."""
        limits, here = self.limits.get(handle.joint), handle.value
        if self.share >= 1.0 or limits is None or not math.isfinite(here):
            return value
        reach = self.share * limits.max_velocity * period
        return here + min(max(value - here, -reach), reach)
