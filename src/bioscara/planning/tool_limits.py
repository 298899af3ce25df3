"""Limits of the tool on a path through space, independent of the joints' limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from bioscara.arguments import number
from bioscara.errors import InvalidArgumentError
from bioscara.planning.motions.tool_speed import REDUCED_SPEED

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
