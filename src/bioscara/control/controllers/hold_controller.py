"""Brings joints to rest in their direction of motion, and keeps them there."""

from __future__ import annotations

import math

from bioscara.control.braking import ramp
from bioscara.control.controllers.controller import Controller, interfaces
from bioscara.control.controllers.parameter_types import Parameters
from bioscara.errors import ConfigurationError
from bioscara.hardware import POSITION, VELOCITY
from bioscara.model.validation import Positive

_ARRIVAL = 0.1
"""Time that a joint may take to come to rest at its last setpoint [s]."""


class HoldParameters(Parameters):
    """Parameters of the hold controller.

    Attributes:
        joints: Names of the joints.
        max_deceleration: Of each joint in that order [rad/s^2 or m/s^2].
        command_interfaces: ``("position",)`` or ``("position", "velocity")``.
    """

    joints: tuple[str, ...]
    max_deceleration: tuple[Positive, ...]
    command_interfaces: tuple[str, ...] = (POSITION,)


class HoldController(Controller[HoldParameters]):
    """The fallback: it takes over at any speed, ramps down, and holds.

    All joints come to rest together, each at a constant deceleration: the one that needs longest
    sets the time, so that the arm continues in the direction in which it was moving.
    """

    TYPE = "bioscara_controllers/HoldController"
    PARAMETERS = HoldParameters

    @property
    def ended(self) -> bool:
        """Whether the ramp has ended, and the joints had time to reach its end."""
        return self._elapsed >= self._duration + _ARRIVAL

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """Position of each joint, then velocity of each where that is commanded too."""
        return interfaces(self.parameters.joints, self.parameters.command_interfaces)

    @property
    def collision_checked(self) -> bool:
        """True: it only brakes, which must never be prevented."""
        return True

    def on_configure(self) -> None:
        """Check that the parameters are consistent."""
        parameters = self.parameters
        if not parameters.joints or len(parameters.joints) != len(parameters.max_deceleration):
            raise ConfigurationError(
                f"{self.name}: {len(parameters.max_deceleration)} max_deceleration for "
                f"{len(parameters.joints)} joints; give one for each of at least one joint"
            )
        if parameters.command_interfaces not in ((POSITION,), (POSITION, VELOCITY)):
            raise ConfigurationError(
                f"{self.name}: command_interfaces {', '.join(parameters.command_interfaces)}: "
                "it is position, or position and velocity"
            )

    def on_activate(self, time: float) -> None:
        """Start from the last commands, at their speed."""
        joints = self.parameters.joints
        self._start = [handle.value for handle in self.command_handles[: len(joints)]]
        self._speed = [self.commanded_speeds.get(joint, 0.0) for joint in joints]
        self._duration = max(
            abs(speed) / limit
            for speed, limit in zip(self._speed, self.parameters.max_deceleration, strict=True)
        )
        self._elapsed = 0.0
        self._begin = math.nan

    def update(self, time: float, period: float) -> None:
        """Command the ramp, one cycle ahead, and then its end."""
        if math.isnan(self._begin):
            # The speeds are means of the cycle before: the ramp begins in its middle.
            self._begin = 0.5 * period
        self._elapsed += period
        duration, at = self._duration, self._begin + self._elapsed
        share = ramp(at, duration) - ramp(self._begin, duration)
        left = max(1.0 - at / duration, 0.0) if duration else 0.0
        count = len(self._start)
        for index, handle in enumerate(self.command_handles):
            if index < count:
                handle.value = self._start[index] + self._speed[index] * share
            else:
                handle.value = self._speed[index - count] * left
