"""Motion of one joint from state to state with limited velocity, acceleration and jerk.

The theory in short. For fixed velocities and accelerations at both ends, and a fixed duration, the
possible displacements of a joint form an interval, because all limits are convex. For the largest
displacement the acceleration rises to a peak, falls to a valley and rises again, staying constant
at the limits; the smallest one is its mirror image. So both families have one parameter, and

- the fastest motion is the first whose displacement is one of the two extremes;
- a motion of a longer duration is a mixture of its two extremes, which keeps every limit again.

If no mixture exists for a duration, no motion does: see :func:`durations`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from bioscara.planning.profiles.extremal import ExtremalProfiles, Member
from bioscara.planning.profiles.segments import Bounds, MotionState, Phase, Profile


def durations(start: MotionState, goal: MotionState, bounds: Bounds) -> list[float]:
    """Return the durations at which a motion begins or ceases to be possible [s], ascending.

    The first is the least one. From the last on, every duration is possible.

    Args:
        start: Start state of the motion, within the bounds.
        goal: Its end state, within the bounds.
        bounds: Limits of the joint.
    """
    displacement = goal.position - start.position
    return sorted(
        duration
        for sign in (1.0, -1.0)
        for duration, _ in ExtremalProfiles.of(start, goal, bounds, sign).crossings(
            sign * displacement
        )
    )


def fastest(start: MotionState, goal: MotionState, bounds: Bounds) -> Profile:
    """Return the motion of least duration.

    Args:
        start: Its start state, within the bounds.
        goal: Its end state, within the bounds.
        bounds: Limits of the joint.
    """
    displacement = goal.position - start.position
    best: tuple[float, float, ExtremalProfiles, Member] | None = None
    for sign in (1.0, -1.0):
        family = ExtremalProfiles.of(start, goal, bounds, sign)
        for duration, point in family.crossings(sign * displacement):
            if best is None or duration < best[0]:
                best = duration, sign, family, point
    if best is None:  # the two families share their ends, so that one has every displacement
        raise ArithmeticError(f"no motion from {start} to {goal} within {bounds}")
    _, sign, family, point = best
    return Profile(start, [(t, sign * jerk) for t, jerk in family.phases(point)])


def lasting(
    duration: float, start: MotionState, goal: MotionState, bounds: Bounds
) -> Profile | None:
    """Return the motion of a given duration, or None if the bounds allow none.

    It is the mixture of the motions with the largest and the smallest displacement of that
    duration. From rest to rest that is the former with less jerk.

    Args:
        duration: [s]; at least the least one.
        start: Its start state, within the bounds.
        goal: Its end state, within the bounds.
        bounds: Limits of the joint.
    """
    displacement = goal.position - start.position
    ends = []
    for sign in (1.0, -1.0):
        family = ExtremalProfiles.of(start, goal, bounds, sign)
        point = family.lasting(duration)
        if point is None:
            return None
        phases = [(t, sign * jerk) for t, jerk in family.phases(point)]
        ends.append((sign * family.displacement(point), phases))
    (longest, up), (shortest, down) = ends
    room, tiny = longest - shortest, family.rounding(duration)
    if not shortest - tiny <= displacement <= longest + tiny:
        return None
    share = min(max((displacement - shortest) / room, 0.0), 1.0) if room > tiny else 0.5
    return Profile(start, list(_mixed(up, down, share)))


def _mixed(ups: Sequence[Phase], downs: Sequence[Phase], share: float) -> Iterator[Phase]:
    """Yield the weighted mean of two motions of equal duration, ``share`` of the first."""
    up, down = list(reversed(ups)), list(reversed(downs))
    held, last = 0.0, 0.0
    while up and down:
        (rest, one), (other_rest, other) = up.pop(), down.pop()
        step, jerk = min(rest, other_rest), share * one + (1.0 - share) * other
        if jerk != last:
            yield held, last
            held, last = 0.0, jerk
        held += step
        if rest > step:
            up.append((rest - step, one))
        if other_rest > step:
            down.append((other_rest - step, other))
    yield held, last
