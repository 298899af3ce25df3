"""Highest speeds at which a joint keeps its braking distance in reserve."""

from __future__ import annotations

import math


def mean_speed_within(distance: float, acceleration: float, period: float) -> float:
    """Return the mean speed of a cycle after which a joint can still come to rest in ``distance``.

    Braking began in the middle of that cycle; the last part of the distance takes one cycle.

    Args:
        distance: Distance available [rad or m]; the speed is 0 beyond its end, never a return.
        acceleration: Of the braking [rad/s^2 or m/s^2].
        period: Of the cycle [s].
    """
    if distance <= 0.5 * acceleration * period * period:
        return max(distance, 0.0) / period
    return math.sqrt(2.0 * acceleration * distance) - 0.5 * acceleration * period


def speed_within(distance: float, acceleration: float, reaction: float) -> float:
    """Return the speed from which a joint comes to rest in ``distance``, braking after a time.

    Args:
        distance: Distance available [rad or m].
        acceleration: Of the braking [rad/s^2 or m/s^2].
        reaction: How long the joint continues before it brakes [s].
    """
    if distance <= 0.0:
        return 0.0
    return acceleration * (math.sqrt(reaction**2 + 2.0 * distance / acceleration) - reaction)
