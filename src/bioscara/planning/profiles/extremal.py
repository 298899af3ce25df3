"""Extremal (maximum-displacement) profiles of a joint for a given duration."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import NamedTuple

from bioscara.planning.profiles.segments import Bounds, MotionState, Phase

_EXACT = 1e-13
"""Share of a joint's usual displacement that is treated as zero: rounding of the sums here."""
_INSTANT = 1e-9
"""Duration below which a change of velocity is treated as zero [s]."""


class Member(NamedTuple):
    """A member of a family: its parameter, and its time at the highest velocity [s]."""

    depth: float
    cruise: float


class ExtremalProfiles(NamedTuple):
    """Profiles of largest displacement, with given velocities and accelerations at both ends.

    Member ``depth``: the acceleration rises from a0 to a peak, falls to a valley, rises to a1. The
    valley is at ``depth``, or at -A if the depth is lower; the excess, divided by the jerk, is then
    the time spent there. Durations grow as the depth falls. The members are those of one or two
    ranges of depths; the last range continues with times at the highest velocity.

    The family is stored such that peaks are positive: otherwise it is reversed in time.
    """

    v0: float
    a0: float
    v1: float
    a1: float
    bounds: Bounds
    backwards: bool
    gain: float
    """Peak squared minus valley squared for the required change of velocity."""
    gap: float
    """Depths within -gap .. gap would need a peak below a0."""
    cap: float
    """Depth at which the highest velocity is reached."""

    @classmethod
    def of(
        cls, start: MotionState, goal: MotionState, bounds: Bounds, sign: float
    ) -> ExtremalProfiles:
        """Return the family of largest displacements, or for sign -1 of the smallest, mirrored."""
        highest, limit, jerk = bounds
        (v0, a0), (v1, a1) = (sign * x for x in start[1:]), (sign * x for x in goal[1:])
        gain = jerk * (v1 - v0) + (a0 * a0 - a1 * a1) / 2.0
        terms = jerk * (abs(v0) + abs(v1)) + a0 * a0 + a1 * a1
        if abs(gain) <= _EXACT * terms + (jerk * _INSTANT) ** 2:
            gain = 0.0  # else rounding would require a detour for a velocity change of zero
        backwards = gain < 0.0
        if backwards:
            v0, a0, v1, a1, gain = v1, -a1, v0, -a0, -gain
        gap = math.sqrt(max(a0 * a0 - gain, 0.0)) if a0 > 0.0 else 0.0
        room = jerk * max(highest - v1 + a1 * a1 / (2.0 * jerk), 0.0)
        square = limit * limit
        cap = -math.sqrt(room) if room <= square else -limit - (room - square) / limit
        return cls(v0, a0, v1, a1, bounds, backwards, gain, gap, min(cap, -gap, a1))

    def shape(self, depth: float) -> tuple[float, float, float, float]:
        """Return the peak, the time at it, the valley and the time at it of a member."""
        _, limit, jerk = self.bounds
        if depth >= -limit:
            valley, low, square = depth, 0.0, self.gain + depth * depth
        else:
            valley, low, square = -limit, (-limit - depth) / jerk, self.gain - limit * depth
        if square > limit * limit:
            return limit, (square - limit * limit) / (jerk * limit), valley, low
        return max(math.sqrt(square), self.a0, valley), 0.0, valley, low

    def duration(self, depth: float) -> float:
        """Return the duration of a member [s]."""
        peak, high, valley, low = self.shape(depth)
        return (2.0 * (peak - valley) + self.a1 - self.a0) / self.bounds.jerk + high + low

    def displacement(self, point: Member) -> float:
        """Return the displacement of a member [unit]."""
        # The cruise is added separately: integrated with the phases, a rounding error of the
        # acceleration would act throughout it.
        p, v, a = point.cruise * self.bounds.velocity, self.v0, self.a0
        for t, jerk in self._phases(Member(point.depth, 0.0)):
            p += t * (v + t * (a / 2.0 + t * jerk / 6.0))
            v += t * (a + t * jerk / 2.0)
            a += t * jerk
        return p

    def rounding(self, duration: float) -> float:
        """Return the displacement that counts as zero for a duration [unit].

        It scales with the speed reachable in that time, which may be far below the limit.
        """
        highest, limit, jerk = self.bounds
        hardest = min(limit, abs(self.a0) + abs(self.a1) + jerk * duration)
        gained = hardest * (duration + hardest / jerk)
        speed = min(highest, abs(self.v0) + abs(self.v1) + gained)
        usual = speed * (duration + speed / limit)
        return _EXACT * usual + jerk * _INSTANT**2 * (duration + _INSTANT)

    def growth(self, depth: float) -> float:
        """Return the derivative of a member's displacement by its duration [unit/s]."""
        jerk = self.bounds.jerk
        peak, _, valley, low = self.shape(depth)
        after = self.v1 - (self.a1 * self.a1 - valley * valley) / (2.0 * jerk) - valley * low
        return after - valley * (peak - valley) / (2.0 * jerk)

    def phases(self, point: Member) -> list[Phase]:
        """Return a member's phases, in the order of time."""
        return self._phases(point)[:: -1 if self.backwards else 1]

    def _phases(self, point: Member) -> list[Phase]:
        jerk = self.bounds.jerk
        peak, high, valley, low = self.shape(point.depth)
        rise, end = ((peak - self.a0) / jerk, jerk), ((self.a1 - valley) / jerk, jerk)
        if point.cruise <= 0.0:
            fall = [((peak - valley) / jerk, -jerk)]
        else:
            fall = [(peak / jerk, -jerk), (point.cruise, 0.0), (-valley / jerk, -jerk)]
        return [rise, (high, 0.0), *fall, (low, 0.0), end]

    def ranges(self) -> list[tuple[float, float]]:
        """Return the ranges of depths, each from its shortest duration to its longest."""
        last = (min(-self.gap, self.a1), self.cap)
        if self.a1 > 0.0 and self.a1 >= self.gap * (1.0 - _EXACT):
            return [(self.a1, min(self.gap, self.a1)), last]
        return [last]

    def lasting(self, duration: float) -> Member | None:
        """Return the member of a duration [s], or None if there is none."""
        for first, last in self.ranges():
            if duration < self.duration(first) * (1.0 - _EXACT):
                return None
            if duration <= self.duration(last):
                return Member(_root(lambda y: self.duration(y) - duration, first, last), 0.0)
        return Member(self.cap, duration - self.duration(self.cap))

    def crossings(self, displacement: float) -> Iterator[tuple[float, Member]]:
        """Yield duration and member of every profile with this displacement [unit]."""

        def excess(depth: float) -> float:
            return self.displacement(Member(depth, 0.0)) - displacement

        def tiny(depth: float) -> float:
            return self.rounding(self.duration(depth)) + _EXACT * abs(displacement)

        for first, last in self._monotone():
            before, after = excess(first), excess(last)
            if abs(before) <= tiny(first):
                yield self.duration(first), Member(first, 0.0)
            elif before * after < 0.0:
                depth = _root(excess, first, last)
                yield self.duration(depth), Member(depth, 0.0)
        missing = -excess(self.cap)
        if missing >= -tiny(self.cap):
            cruise = max(missing, 0.0) / self.bounds.velocity
            yield self.duration(self.cap) + cruise, Member(self.cap, cruise)

    def _monotone(self) -> Iterator[tuple[float, float]]:
        """Yield the ranges of depths, split at the extrema of the displacement."""
        limit = self.bounds.acceleration
        # Depths where the growth itself has an extremum: with a peak below the limit, and with one
        # at the limit; and where one becomes the other. Below zero it has none.
        turns = (
            math.sqrt(self.gain) * (2.0 - math.sqrt(3.0)) / math.sqrt(4.0 * math.sqrt(3.0) - 6.0),
            limit / 4.0,
            math.sqrt(max(limit * limit - self.gain, 0.0)),
        )
        for first, last in self.ranges():
            inner = sorted((turn for turn in turns if last < turn < first), reverse=True)
            edges = [first, *inner, last]
            for high, low in pairwise(edges):
                if self.growth(high) * self.growth(low) < 0.0:
                    middle = _root(self.growth, high, low)
                    yield high, middle
                    yield middle, low
                else:
                    yield high, low


def _root(function: Callable[[float], float], left: float, right: float) -> float:
    """Return the point where a function changes its sign, at full precision.

    Bisection and inverse quadratic interpolation, as T. R. Chandrupatla combines them (1997).
    """
    a, b = left, right
    fa, fb = function(a), function(b)
    if fa == 0.0 or fa * fb > 0.0:
        return a if abs(fa) <= abs(fb) else b
    share, c, fc = 0.5, b, fb
    for _ in range(100):
        x = a + share * (b - a)
        fx = function(x)
        if (fx > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, b, fc, fb = b, a, fb, fa
        a, fa = x, fx
        best, least = (a, fa) if abs(fa) < abs(fb) else (b, fb)
        tolerance = 2.0 * math.ulp(best) / abs(b - a) if a != b else 1.0
        if least == 0.0 or tolerance >= 0.5:
            return best
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (
                fc - fb
            )
        else:
            share = 0.5
        share = min(max(share, tolerance), 1.0 - tolerance)
    return best
