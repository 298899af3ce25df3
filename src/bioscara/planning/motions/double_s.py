"""Motion of one joint from rest to rest with limited velocity, acceleration and jerk.

In closed form: the joint accelerates in a ramp, cruises, and decelerates in the mirror image of the
ramp. The longest way in a given time uses the limits in full; a shorter one in that time is the
same motion with less of everything.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple


class Bounds(NamedTuple):
    """Limits of one joint, all above zero; units as the joint's.

    Attributes:
        velocity: Highest speed [unit/s].
        acceleration: Highest acceleration [unit/s^2].
        jerk: Highest jerk [unit/s^3]; infinite for none.
    """

    velocity: float
    acceleration: float
    jerk: float


class Knot(NamedTuple):
    """State of one joint, and the jerk from then on.

    Attributes:
        time: Since the start [s].
        position: [unit].
        velocity: [unit/s].
        acceleration: [unit/s^2].
        jerk: Until the next knot [unit/s^3].
    """

    time: float
    position: float
    velocity: float
    acceleration: float
    jerk: float


def least_duration(displacement: float, bounds: Bounds) -> float:
    """Return the least duration from rest to rest [s].

    Args:
        displacement: From start to goal [unit].
        bounds: Limits of the joint.
    """
    way, (most, hardest, jerk) = abs(displacement), bounds
    longest = _longest_ramp(bounds)
    if way >= most * longest:
        return way / most + longest
    # Without a cruise the joint goes half the distance in each of two ramps.
    rise = hardest / jerk
    ramp = rise / 2.0 + math.sqrt(rise * rise / 4.0 + way / hardest)
    # The acceleration does not reach its limit in a ramp that is shorter than two rises.
    return 2.0 * (ramp if ramp >= 2.0 * rise else math.cbrt(4.0 * way / jerk))


def rest_to_rest(
    start: float, displacement: float, duration: float, bounds: Bounds
) -> tuple[Knot, ...]:
    """Return the motion of a given duration.

    Args:
        start: Start position [unit].
        displacement: From there to the goal [unit].
        duration: At least the least one [s].
        bounds: Limits of the joint.
    """
    if duration <= 0.0:
        return (Knot(0.0, start, 0.0, 0.0, 0.0),)
    ramp = min(duration / 2.0, _longest_ramp(bounds))
    rise = min(bounds.acceleration / bounds.jerk, ramp / 2.0)
    velocity = displacement / (duration - ramp)
    acceleration = velocity / (ramp - rise)
    return tuple(_knots(start, displacement, duration, (ramp, rise, velocity, acceleration)))


def _longest_ramp(bounds: Bounds) -> float:
    """Return the duration of the ramp to the highest speed [s]."""
    most, hardest, jerk = bounds
    if most * jerk <= hardest * hardest:
        return 2.0 * math.sqrt(most / jerk)
    return most / hardest + hardest / jerk


def _knots(
    start: float, displacement: float, duration: float, ramp: tuple[float, float, float, float]
) -> Iterator[Knot]:
    length, rise, velocity, acceleration = ramp
    jerk = acceleration / rise if rise > 0.0 else 0.0
    # Speed and way at the end of the first rise, and at the end of the constant acceleration.
    slow, near = acceleration * rise / 2.0, acceleration * rise * rise / 6.0
    hold = length - 2.0 * rise
    fast = slow + acceleration * hold
    far = near + hold * (slow + fast) / 2.0
    first = (
        Knot(0.0, 0.0, 0.0, 0.0 if rise > 0.0 else acceleration, jerk),
        Knot(rise, near, slow, acceleration, 0.0),
        Knot(rise + hold, far, fast, acceleration, -jerk),
        Knot(length, velocity * length / 2.0, velocity, 0.0, 0.0),
    )
    for time, way, speed, force, rate in first:
        yield Knot(time, start + way, speed, force, rate)
    # The mirror image of these: the same distances and speeds, in the reverse order.
    goal = start + displacement
    brake = duration - length
    yield Knot(
        brake, goal - first[3].position, velocity, 0.0 if rise > 0.0 else -acceleration, -jerk
    )
    yield Knot(duration - rise - hold, goal - far, fast, -acceleration, 0.0)
    yield Knot(duration - rise, goal - near, slow, -acceleration, jerk)
    yield Knot(duration, goal, 0.0, 0.0, 0.0)
