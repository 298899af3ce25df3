"""Where every joint should be at any time of a motion that has several parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from bioscara.report import Phase


class Reference(NamedTuple):
    """Where all joints should be and how fast, in the order of the robot's joints.

    Attributes:
        positions: Positions [rad or m].
        velocities: Velocities [rad/s or m/s].
    """

    positions: tuple[float, ...]
    velocities: tuple[float, ...]


class Segment(NamedTuple):
    """One part of a motion.

    Attributes:
        phase: What it is reported as.
        duration: How long it takes [s].
        sample: Reference at a time since its begin [s], for times of 0 to ``duration``.
    """

    phase: Phase
    duration: float
    sample: Callable[[float], Reference]


class Timeline:
    """Parts of a motion one after the other; after the last one its end is held.

    Args:
        segments: The parts; each begins where the one before ends.
        zero: Time since the begin of the first part that counts as 0 in the trajectory [s].
    """

    def __init__(self, segments: Sequence[Segment], zero: float = 0.0) -> None:
        self.zero = zero
        self._segments: list[tuple[float, Segment]] = []
        end = 0.0
        for segment in segments:
            self._segments.append((end, segment))
            end += segment.duration
        self.duration = end

    def phase(self, time: float) -> Phase:
        """Return which part is under way at ``time`` [s]."""
        return self._find(time)[1].phase

    def sample(self, time: float) -> Reference:
        """Return the reference at ``time`` [s]; before the begin and after the end it rests."""
        begin, segment = self._find(time)
        return segment.sample(min(max(time - begin, 0.0), segment.duration))

    def _find(self, time: float) -> tuple[float, Segment]:
        found = self._segments[0]
        for candidate in self._segments:
            if candidate[0] > time:
                break
            found = candidate
        return found


def hold(phase: Phase, positions: tuple[float, ...], duration: float) -> Segment:
    """Return a part in which all joints rest at ``positions``."""
    rest = Reference(positions, (0.0,) * len(positions))
    return Segment(phase, duration, lambda _: rest)
