"""The course through points that arrive one at a time, each shortly before it is to be reached."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bioscara.control.controllers.joint_trajectory.interpolation import CurveState
from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.hardware.interfaces import POSITION, VELOCITY, CommandInterface, StateInterface
from bioscara.model import JointParameters
from bioscara.planning import Sample
from bioscara.planning.moving_average import Smoothed, Values

LONGEST = 0.5
"""Longest time between two points of a stream, and to the time that a point is for [s]."""
DELAY = 0.05
"""Time by which a stream is followed later than its points are for, without the averaging [s]: the
next point has arrived then, also where it is sent for 10 ms ahead, or is late by 10 ms."""
_CATCHING_UP = 1.5
"""Factor by which a stream is followed faster than its points are for, after it has waited."""
_STILL = 1e-9
"""Averaged velocity that is a rounding residue of none [rad/s or m/s]."""
_KEPT = 0.3
"""Time for which the course is known behind its end [s]: a measurement is not older."""
_JOINTS = 4
"""Number of values that are averaged together."""


class StreamedPoint(NamedTuple):
    """A point of a stream.

    Attributes:
        time: For which it is [s, arm clock].
        positions: Of all joints of the controller [rad or m].
        anew: Whether points before it that have not been reached are left out.
        start: Where the joints were sent to, and how fast they move: of a stream that begins.
        windows: Durations of the averages of such a one [s].
    """

    time: float
    positions: tuple[float, ...]
    anew: bool
    start: Sample
    windows: tuple[float, ...]


class Stream:
    """A course without a known end: straight from point to point, bounded, and averaged.

    A point that is farther away than its joints can go is approached as fast as they can.
    Velocities and accelerations of the points are not used: those of the course follow from the
    positions. The averages are those of raw commands, so that the belts do not swing.

    Args:
        start: Where the joints were sent to, and how fast they move; it begins there at time 0.
        limits: Of each joint.
        windows: Durations of the averages, applied one after the other [s].
        period: Time from cycle to cycle [s].

    Attributes:
        continuable: Whether a new trajectory may continue from it.
        arrived: When the last point arrived [s, arm clock].
        warned: Whether there was a warning that it is too fast.
    """

    continuable = True

    def __init__(
        self,
        start: Sample,
        limits: Sequence[JointParameters],
        windows: Sequence[float],
        period: float,
    ) -> None:
        self.arrived, self.warned = -math.inf, False
        self._period = period
        count = math.ceil(_KEPT / period) + 2
        nothing = (0.0,) * len(limits)
        first = Sample(tuple(start.positions), tuple(start.velocities), nothing)
        self._states: deque[tuple[float, Sample]] = deque([(0.0, first)], count)
        self._averages = Smoothed(windows, _padded(start.velocities))
        ahead = np.zeros((math.ceil(sum(windows) / period) + 2, _JOINTS))
        lags = self._averages.ahead(ahead, period).sum(axis=0) * period
        self._joints = [
            _followed(each, at + float(lag), speed)
            for each, at, lag, speed in zip(
                limits, start.positions, lags, start.velocities, strict=False
            )
        ]
        self._targets = [(0.0, tuple(joint.reference for joint, _ in self._joints))]
        self._settled, self._passed = False, 0.0

    @property
    def begins(self) -> float:
        """Time from which it is known [s]."""
        return self._states[0][0]

    @property
    def duration(self) -> float:
        """Time at which the joints came to rest, or up to which it is known [s]."""
        return self._states[-1][0]

    @property
    def end(self) -> tuple[float, ...]:
        """Where the joints are to rest [rad or m]."""
        return self._targets[-1][1]

    def start_of(self, time: float) -> tuple[float, tuple[float, ...]]:
        """Return time and positions from which a point for a time is approached.

        It is the point before, or, where that is later, :attr:`here`.

        Args:
            time: Of the point [s].
        """
        before = self._targets[-1]
        return before if before[0] < time else self.here

    @property
    def here(self) -> tuple[float, tuple[float, ...]]:
        """The time up to which the points are passed, and the positions there."""
        return self._passed, self._target(self._passed)

    def add(self, time: float, positions: Sequence[float], *, anew: bool) -> None:
        """Add a point.

        Args:
            time: For which it is [s].
            positions: Of the joints [rad or m].
            anew: Whether points that have not been passed are left out.
        """
        here = self.here
        begin = here[0]
        anew = anew or time <= self._targets[-1][0]
        later = [] if anew else [each for each in self._targets if each[0] > begin]
        point = max(time, begin + self._period), tuple(positions)
        self._targets = [here, *later, point]
        self._settled = False

    def stop(self) -> None:
        """Let the joints come to rest, each on its own, as fast as it can."""
        ends = []
        for joint, _ in self._joints:
            way = joint.speed * abs(joint.speed) / (2.0 * joint.max_acceleration)
            ends.append(joint.within(joint.reference + way))
        self._targets, self._settled = [(self._passed, tuple(ends))], False

    def sample(self, time: float) -> CurveState:
        """Return the state at ``time`` [s], and 0 for the point that is approached."""
        states = self._states
        while states[-1][0] < time and not self._settled:
            self._step()
        index = len(states) - 1
        while index > 0 and states[index - 1][0] > time:
            index -= 1
        if not index or states[index][0] <= time:
            return CurveState(states[index][1], 0)
        (begin, before), (end, after) = states[index - 1], states[index]
        share = (time - begin) / (end - begin)
        values = [_between(a, b, share) for a, b in zip(before, after, strict=True)]
        return CurveState(Sample(*values), 0)

    def _step(self) -> None:
        """Continue by one period."""
        period, (before, last) = self._period, self._states[-1]
        time = before + period
        catching_up = min(time - DELAY, self._passed + _CATCHING_UP * period)
        # Without a further point the joints wait, and the points after it are not hurried through.
        self._passed = max(min(catching_up, self._targets[-1][0]), self._passed)
        wanted = self._target(self._passed)
        for (joint, command), value in zip(self._joints, wanted, strict=True):
            command.value = value
            joint.apply(period)
        speeds = [joint.speed for joint, _ in self._joints]
        averaged = self._averages.step(_padded(speeds), period)[: len(speeds)]
        rest = not any(speeds) and max(map(abs, averaged)) < _STILL
        positions = tuple(
            [joint.reference for joint, _ in self._joints]
            if rest
            else [at + speed * period for at, speed in zip(last.positions, averaged, strict=True)]
        )
        changes = [(b - a) / period for a, b in zip(last.velocities, averaged, strict=True)]
        self._states.append((time, Sample(positions, averaged, tuple(changes))))
        self._settled = rest and self._passed >= self._targets[-1][0]

    def _target(self, time: float) -> tuple[float, ...]:
        targets = self._targets
        for (begin, before), (end, after) in pairwise(targets):
            if begin <= time < end:
                return _between(before, after, (time - begin) / (end - begin))
        return targets[0][1] if time < targets[0][0] else targets[-1][1]


def _followed(
    limits: JointParameters, position: float, velocity: float
) -> tuple[JointLimiter, CommandInterface]:
    """Return the limiter of a joint on its course, and the command that takes its targets."""
    command, at, moves = (
        CommandInterface(limits.name, POSITION),
        StateInterface(limits.name, POSITION),
        StateInterface(limits.name, VELOCITY),
    )
    command.owner, at.value, moves.value = "stream", position, velocity
    joint = JointLimiter(limits, command, CommandInterface(limits.name, VELOCITY), at, moves)
    joint.begin()
    return joint, command


def _between(before: Sequence[float], after: Sequence[float], share: float) -> tuple[float, ...]:
    return tuple([a + share * (b - a) for a, b in zip(before, after, strict=True)])


def _padded(values: Sequence[float]) -> Values:
    a, b, c, d = (*values, 0.0, 0.0, 0.0)[:_JOINTS]
    return a, b, c, d
