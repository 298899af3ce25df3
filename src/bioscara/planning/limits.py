"""Joint limits used by planning."""

from __future__ import annotations

from typing import Protocol

from bioscara.arguments import number
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Range

SLOWEST = 1e-3
"""Least speed share of a motion: with it, a motion of one second takes a quarter of an hour."""


def check_share(speed: float) -> float:
    """Check a speed share and return it.

    Args:
        speed: From :data:`SLOWEST` to 1.

    Raises:
        InvalidArgumentError: It is outside that range.
    """
    speed = number("speed", speed)
    if not SLOWEST <= speed <= 1.0:
        raise InvalidArgumentError(
            f"speed {speed} is outside {SLOWEST:g} .. 1; it is a share of what is possible"
        )
    return speed


class JointLimits(Range, Protocol):
    """Limits of one joint; :class:`bioscara.model.JointParameters` is one."""

    @property
    def max_velocity(self) -> float:
        """Highest speed [unit/s]."""
        ...

    @property
    def max_acceleration(self) -> float:
        """Highest acceleration [unit/s^2]."""
        ...

    @property
    def max_jerk(self) -> float:
        """Highest jerk [unit/s^3]."""
        ...
