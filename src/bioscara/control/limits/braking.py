"""How fast a joint may be with the way to brake in reserve."""

from __future__ import annotations

import math


def mean_speed_within(way: float, acceleration: float, period: float) -> float:
    """Return the mean speed of a cycle after which one can still come to rest in ``way``.

    Braking began in the middle of that cycle; the last of the way takes one cycle.

    Args:
        way: How far one may go [rad or m]; no speed leads back from behind its end.
        acceleration: With which one brakes [rad/s^2 or m/s^2].
        period: Of the cycle [s].
    """
    if way <= 0.5 * acceleration * period * period:
        return max(way, 0.0) / period
    return math.sqrt(2.0 * acceleration * way) - 0.5 * acceleration * period


def speed_within(way: float, acceleration: float, reaction: float) -> float:
    """Return the speed from which one comes to rest in ``way``, braking after a time.

    Args:
        way: How far one may go [rad or m].
        acceleration: With which one brakes [rad/s^2 or m/s^2].
        reaction: How long one goes on before [s].
    """
    if way <= 0.0:
        return 0.0
    return acceleration * (math.sqrt(reaction**2 + 2.0 * way / acceleration) - reaction)
