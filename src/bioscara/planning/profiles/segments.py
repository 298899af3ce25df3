"""Motion of one joint in pieces of constant jerk."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple


class Bounds(NamedTuple):
    """Limits of one joint, all above zero; units as the joint's.

    Attributes:
        velocity: Highest speed [unit/s].
        acceleration: Highest acceleration [unit/s^2].
        jerk: Highest jerk [unit/s^3].
    """

    velocity: float
    acceleration: float
    jerk: float


class MotionState(NamedTuple):
    """State of one joint.

    Attributes:
        position: [unit].
        velocity: [unit/s].
        acceleration: [unit/s^2].
    """

    position: float
    velocity: float = 0.0
    acceleration: float = 0.0


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


Phase = tuple[float, float]
"""A phase of constant jerk: its duration [s] and the jerk [unit/s^3]."""


class Profile:
    """A motion of one joint: pieces of constant jerk.

    Args:
        start: Its first state.
        phases: Phases of constant jerk from there.

    Attributes:
        knots: The start of each piece, and the end.
    """

    def __init__(self, start: MotionState, phases: Sequence[Phase]) -> None:
        time, (p, v, a) = 0.0, start
        knots = []
        for t, jerk in phases:
            if t <= 0.0:
                continue
            knots.append(Knot(time, p, v, a, jerk))
            p += t * (v + t * (a / 2.0 + t * jerk / 6.0))
            v += t * (a + t * jerk / 2.0)
            a += t * jerk
            time += t
        self.knots: tuple[Knot, ...] = (*knots, Knot(time, p, v, a, 0.0))
        self._times = [knot.time for knot in self.knots]

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return self._times[-1]

    def at(self, time: float) -> MotionState:
        """Return the state at a time [s]; before the start or after the end, the state there."""
        index = max(bisect_right(self._times, time) - 1, 0)
        begin, p, v, a, jerk = self.knots[index]
        t = max(time - begin, 0.0) if index < len(self.knots) - 1 else 0.0
        return MotionState(
            p + t * (v + t * (a / 2.0 + t * jerk / 6.0)), v + t * (a + t * jerk / 2.0), a + t * jerk
        )
