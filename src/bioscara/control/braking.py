"""The ramp on which a joint comes to rest, evenly, from a mean velocity.

The mean velocity of a cycle belongs to its middle, and there the ramp begins. So a ramp that
begins anew after any cycle of another one, from the position and the mean velocity there, leads to
the same place. Ways are given as the times in which the initial velocity covers them.
"""

from __future__ import annotations

import math


def braking_way(duration: float, period: float) -> float:
    """Return the distance from the end of the cycle until a joint stands [s].

    Args:
        duration: Of the ramp, from the middle of the cycle on [s].
        period: Of the cycle [s].
    """
    return 0.5 * duration - ramp(0.5 * period, duration)


def braking_duration(way: float, period: float) -> float:
    """Return the duration of a ramp of this distance, the inverse of :func:`braking_way` [s]."""
    return 0.5 * period + way + math.sqrt(way * (way + period))


def ramp(time: float, duration: float) -> float:
    """Return the distance in a time since the ramp began [s]."""
    at = min(time, duration)
    return at - at * at / (2.0 * duration) if duration else 0.0
