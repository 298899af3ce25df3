"""Whether to believe what a version 1 joint answers: its frames carry no check byte."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from bioscara.drivers.joint.sample import JointSample
from bioscara.errors import CorruptFrameError
from bioscara.model import JointParameters
from bioscara.protocol import Flags

_LEAP = 1.5
"""Times the joint's highest speed that a position may have changed by since the last sample."""
_LEAST = 5e-3
"""Two samples closer in time are judged as if so far apart [s]: the encoder has some noise."""
_BEYOND = 0.05
"""Share of the range that a position may be outside of it."""
_OVERSPEED = 3.0
"""Times the joint's highest speed that a velocity may be: its filter overshoots."""
_TELLING = int(Flags.STALL | Flags.NOTHOMED | Flags.NOTENABLED)
_RELEASED = int(Flags.NOTENABLED)


class Plausibility:
    """Drops what the joint cannot have done; what it says again is believed.

    Args:
        parameters: What the joint is.
    """

    def __init__(self, parameters: JointParameters) -> None:
        self._name, self._unit = parameters.name, parameters.unit
        self._speed = parameters.max_velocity
        margin = _BEYOND * (parameters.upper - parameters.lower)
        self._lower, self._upper = parameters.lower - margin, parameters.upper + margin
        self._doubted: tuple[float, float] | None = None

    def judge(
        self,
        last: JointSample,
        position: float | None,
        velocity: float,
        flags: tuple[int, int],
        stamp: float,
    ) -> None:
        """Return if the answers can be true.

        Args:
            last: The last sample that was believed.
            position: Joint position [rad or m]; None while it is not homed.
            velocity: Joint velocity [rad/s or m/s].
            flags: The flags of both answers that make a sample.
            stamp: When they arrived [s].

        Raises:
            CorruptFrameError: The flags differ, or position or velocity is impossible.
        """
        if (flags[0] ^ flags[1]) & _TELLING:
            raise CorruptFrameError(
                f"{self._name}: two answers in a row disagree, flags {flags[0]:#04x} and "
                f"{flags[1]:#04x}"
            )
        if flags[1] & _RELEASED:
            # By hand it may go anywhere.
            return
        if not abs(velocity) <= _OVERSPEED * self._speed:
            raise self._error("velocity", velocity, "/s")
        if position is None:
            return
        if not self._lower <= position <= self._upper:
            raise self._error("position", position, "")
        before = last.position
        if before is None or self._near(position, stamp, (before, last.stamp)):
            self._doubted = None
            return
        doubted, self._doubted = self._doubted, (position, stamp)
        if doubted is None or not self._near(position, stamp, doubted):
            raise self._error("position", position, f" after {before:g} {self._unit}")

    def _near(self, position: float, stamp: float, other: tuple[float, float]) -> bool:
        reach = _LEAP * self._speed * max(stamp - other[1], _LEAST)
        return abs(position - other[0]) <= reach

    def _error(self, what: str, value: float, rest: str) -> CorruptFrameError:
        return CorruptFrameError(
            f"{self._name}: {what} {value:g} {self._unit}{rest} cannot be; the answer is broken"
        )


_T = TypeVar("_T")


def insist(ask: Callable[[], _T], tries: int) -> _T:
    """Return the first answer that is believed.

    Args:
        ask: Asks and judges.
        tries: How often at most.

    Raises:
        CorruptFrameError: None was.
    """
    for _ in range(tries - 1):
        try:
            return ask()
        except CorruptFrameError:
            continue
    return ask()


def said_twice(ask: Callable[[], float], tries: int, what: str) -> float:
    """Return a number that was answered twice in a row.

    Raises:
        CorruptFrameError: No two answers in a row were the same.
    """
    answers = [ask()]
    for _ in range(tries):
        answers.append(ask())
        if answers[-1] == answers[-2]:
            return answers[-1]
    raise CorruptFrameError(f"{what} reads differently each time: {answers}")
