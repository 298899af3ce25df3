"""Limits of the joints, and of the tool on a path through space."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import NamedTuple, Protocol

from bioscara.arguments import number
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import PositionLimits

REDUCED_SPEED = 0.25
"""Speed limit of the tool unless full speed is requested [m/s]: reduced speed of ISO 10218-1."""
SLOWEST = 1e-3
"""Least speed share of a motion: with it, a motion of one second takes a quarter of an hour."""


def check_share(share: float, name: str = "velocity_scaling") -> float:
    """Check a share of a limit and return it.

    Args:
        share: From :data:`SLOWEST` to 1.
        name: Its name in messages.

    Raises:
        InvalidArgumentError: It is outside that range.
    """
    share = number(name, share)
    if not SLOWEST <= share <= 1.0:
        what = "acceleration" if name.startswith("acceleration") else "speed"
        raise InvalidArgumentError(
            f"{name} {share} is outside {SLOWEST:g} .. 1; it is a share of the highest {what}"
        )
    return share


class JointLimits(PositionLimits, Protocol):
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


class MotionLimits(NamedTuple):
    """Limits of one joint in a motion, as :class:`JointLimits`; need not be those of the joint."""

    name: str
    unit: str
    lower: float
    upper: float
    max_velocity: float
    max_acceleration: float
    max_jerk: float

    @classmethod
    def of(cls, limits: JointLimits, acceleration_scaling: float = 1.0) -> MotionLimits:
        """Return the limits of a joint, with a share of its acceleration and jerk."""
        return cls(
            limits.name,
            limits.unit,
            limits.lower,
            limits.upper,
            limits.max_velocity,
            acceleration_scaling * limits.max_acceleration,
            acceleration_scaling * limits.max_jerk,
        )


LEAST = 1e-6
"""Least limit of the tool, in its unit; below it, a path of one metre takes days."""


@dataclass(frozen=True, slots=True)
class ToolLimits:
    """Limits of the tool on lines and arcs; infinity means that only the joints limit it.

    The defaults are the reduced speed, and the values of the original's planner for its paths:
    1.57 rad/s, with accelerations that reach either speed in a quarter of a second.

    Attributes:
        speed: Through space [m/s].
        acceleration: Through space, along and across the path together [m/s^2].
        yaw_speed: About the vertical [rad/s].
        yaw_acceleration: About the vertical [rad/s^2].

    Raises:
        InvalidArgumentError: A limit is below :data:`LEAST`.
    """

    speed: float = REDUCED_SPEED
    acceleration: float = 1.0
    yaw_speed: float = 1.57
    yaw_acceleration: float = 6.0

    def __post_init__(self) -> None:
        for field in fields(self):
            name = f"tool limit {field.name.replace('_', ' ')}"
            value = number(name, getattr(self, field.name), infinite=True)
            if not value >= LEAST:
                raise InvalidArgumentError(f"{name} is {value}; give {LEAST:g} or more")
            object.__setattr__(self, field.name, value)


FULL = ToolLimits(math.inf, math.inf, math.inf, math.inf)
"""Limits at full speed: only the joints limit the tool."""
