"""Conversion between joint units and the motor units of the wire; done only here."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

_DEG_PER_RAD = 180.0 / math.pi
_RPM_PER_RAD_S = 30.0 / math.pi
MICROSTEPS_PER_RAD = 51200.0 / (2.0 * math.pi)
"""The motor has 200 steps per turn, the driver 256 microsteps per step."""
DEG_PER_MICROSTEP = 360.0 / 51200.0
"""The same in the angle unit of the wire."""


@dataclass(frozen=True, slots=True)
class Transmission:
    """``motor = (joint - offset) * reduction``, with motor angles in the units of the wire.

    Attributes:
        reduction: Motor radians per joint unit (rad or m); negative where they turn in opposite
            directions.
        offset: Joint position at encoder zero [joint unit].
    """

    reduction: float
    offset: float = 0.0
    _deg: float = field(init=False, repr=False, compare=False)
    _rpm: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_deg", self.reduction * _DEG_PER_RAD)
        object.__setattr__(self, "_rpm", self.reduction * _RPM_PER_RAD_S)

    def to_motor(self, setpoint: tuple[float, float]) -> tuple[float, float]:
        """Return the encoder angle [deg] and motor speed [rpm] of a joint position and velocity."""
        position, velocity = setpoint
        return (position - self.offset) * self._deg, velocity * self._rpm

    def from_motor(self, angle_deg: float, velocity_rpm: float) -> tuple[float, float]:
        """Return the joint position and velocity of an encoder angle [deg] and speed [rpm]."""
        return angle_deg / self._deg + self.offset, velocity_rpm / self._rpm

    def position_to_deg(self, position: float) -> float:
        """Return the encoder angle [deg] of a joint position."""
        return (position - self.offset) * self._deg

    def position_from_deg(self, angle_deg: float) -> float:
        """Return the joint position of an encoder angle [deg]."""
        return angle_deg / self._deg + self.offset

    def velocity_to_rpm(self, velocity: float) -> float:
        """Return the motor speed [rpm] of a joint velocity."""
        return velocity * self._rpm

    def velocity_from_rpm(self, velocity_rpm: float) -> float:
        """Return the joint velocity of a motor speed [rpm]."""
        return velocity_rpm / self._rpm

    def size_to_deg(self, size: float) -> float:
        """Return the motor's value [deg, deg/s, deg/s^2] of a joint limit; has no sign."""
        return abs(size * self._deg)

    def size_from_deg(self, size_deg: float) -> float:
        """Return the joint's value of a motor limit [deg, deg/s, deg/s^2]; has no sign."""
        return abs(size_deg / self._deg)

    def microsteps_to_displacement(self, steps: float) -> float:
        """Return the joint displacement for a number of microsteps of the motor."""
        return steps / MICROSTEPS_PER_RAD / self.reduction
