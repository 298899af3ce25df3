"""Plausibility check of version 1 answers, whose frames carry no check byte."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from bioscara.drivers.joint.sample import JointSample
from bioscara.errors import CorruptFrameError
from bioscara.model import JointParameters
from bioscara.protocol import Flags

_JUMP = 1.5
"""Highest plausible mean speed between two samples, as a multiple of the joint's highest speed."""
_SHORTEST = 5e-3
"""Minimum time between two samples for the check [s], since the encoder has some noise."""
_BEYOND = 0.05
"""Distance by which a position may be outside the range, as a share of it."""
_OVERSPEED = 3.0
"""Largest plausible velocity, as a multiple of the joint's highest speed: its filter overshoots."""
_COMPARED = int(Flags.STALL | Flags.NOTHOMED | Flags.NOTENABLED)
_DISABLED = int(Flags.NOTENABLED)


class Plausibility:
    """Rejects physically impossible answers; a repeated answer is accepted."""

    def __init__(self, parameters: JointParameters) -> None:
        self._name, self._unit = parameters.name, parameters.unit
        self._speed = parameters.max_velocity
        margin = _BEYOND * (parameters.upper - parameters.lower)
        self._lower, self._upper = parameters.lower - margin, parameters.upper + margin
        self._doubted: tuple[float, float] | None = None

    def check(
        self,
        last: JointSample,
        position: float | None,
        velocity: float,
        flags: tuple[int, int],
        stamp: float,
    ) -> None:
        """Check that the answers are plausible.

        Args:
            last: The last accepted sample.
            position: Joint position [rad or m]; None while it is not homed.
            velocity: Joint velocity [rad/s or m/s].
            flags: The flags of both answers that make a sample.
            stamp: Time of their arrival [s].

        Raises:
            CorruptFrameError: The flags differ, or position or velocity is impossible.
        """
        if (flags[0] ^ flags[1]) & _COMPARED:
            raise CorruptFrameError(
                f"{self._name}: two answers in a row disagree, flags {flags[0]:#04x} and "
                f"{flags[1]:#04x}"
            )
        if flags[1] & _DISABLED:
            # It may be moved by hand anywhere.
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
        reach = _JUMP * self._speed * max(stamp - other[1], _SHORTEST)
        return abs(position - other[0]) <= reach

    def _error(self, what: str, value: float, rest: str) -> CorruptFrameError:
        return CorruptFrameError(
            f"{self._name}: {what} {value:g} {self._unit}{rest} cannot be; the answer is broken"
        )


_T = TypeVar("_T")


def first_plausible(request: Callable[[], _T], tries: int) -> _T:
    """Return the first plausible answer.

    Args:
        request: Sends the request and checks the answer.
        tries: Maximum number of requests.

    Raises:
        CorruptFrameError: No answer was plausible.
    """
    for _ in range(tries - 1):
        try:
            return request()
        except CorruptFrameError:
            continue
    return request()


def read_twice(request: Callable[[], float], tries: int, what: str) -> float:
    """Return a number that was answered twice in a row.

    Args:
        request: Sends the request and returns the answer.
        tries: Maximum number of repetitions.
        what: Name of the number, for messages.

    Raises:
        CorruptFrameError: No two answers in a row were the same.
    """
    answers = [request()]
    for _ in range(tries):
        answers.append(request())
        if answers[-1] == answers[-2]:
            return answers[-1]
    raise CorruptFrameError(f"{what} reads differently each time: {answers}")
