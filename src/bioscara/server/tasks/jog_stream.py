"""The velocities that a client streams to a jog."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

from bioscara.api import messages as m
from bioscara.arguments import number
from bioscara.errors import InvalidArgumentError, JogExpiredError, LimitError
from bioscara.planning.motions.jog import JointVelocity
from bioscara.robot.operations.motions.jog import Velocity

SHORTEST, LONGEST = 0.05, 0.5
"""Range of the expiry [s]. A hidden page sends once a second, and must not keep a jog alive."""
_TIMEOUT = 0.15
"""Time for which a velocity applies without another one where no expiry is given [s], as in
``Robot.jog``."""


class JogStream:
    """The velocities that a client streams to a jog.

    A velocity applies from its arrival. Without an expiry the arm rests while no new one arrives,
    and moves on with the next one. With an expiry the jog ends: it cannot be known why the client
    fell silent, and the arm must not move again after a person has released a key.

    Args:
        expiry: Time without a velocity after which the jog ends [s]; None to rest until then.
        velocity: The first velocity; None for rest.
        clock: Returns the time [s]; monotonic.

    Raises:
        LimitError: The expiry is outside its range.
    """

    def __init__(
        self,
        expiry: float | None = None,
        velocity: Velocity | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if expiry is not None and not SHORTEST <= (expiry := number("expiry", expiry)) <= LONGEST:
            raise LimitError("expiry of the jog", expiry, SHORTEST, LONGEST, "s")
        self._expiry, self._clock = expiry, clock
        self._lock = threading.Lock()
        self._velocity: Velocity = JointVelocity() if velocity is None else velocity
        self._at = -math.inf if expiry is None and velocity is None else clock()
        self._ended = False

    def set(self, velocity: Velocity) -> None:
        """Set the velocity from now on.

        Raises:
            JogExpiredError: It arrives too late; the jog is over.
            InvalidArgumentError: The jog was ended.
        """
        with self._lock:
            self._require_fresh()
            if self._ended and self._expiry is not None:
                raise InvalidArgumentError("the jog was ended; begin another one")
            self._velocity, self._at = velocity, self._clock()

    def end(self) -> None:
        """Bring the arm to rest and end the jog."""
        self._ended = True

    def __call__(self) -> Velocity | None:
        """Return the velocity now, zero if the last one is too old; None at the end.

        Raises:
            JogExpiredError: The jog has expired.
        """
        if self._ended:
            return None
        with self._lock:
            self._require_fresh()
            if self._expiry is None and self._clock() - self._at > _TIMEOUT:
                return type(self._velocity)()
            return self._velocity

    def _require_fresh(self) -> None:
        """Raise if the jog has expired; from then on no velocity is taken."""
        if self._expiry is None or self._ended:
            return
        if self._clock() - self._at > self._expiry:
            raise JogExpiredError(
                f"the jog expired: no velocity arrived for {self._expiry:g} s, and the arm was "
                "brought to rest; begin another jog",
                self._expiry,
            )


def velocity_of(message: m.Jog | m.SetJogVelocity) -> Velocity:
    """Return the velocity in a message: of the joints or of the tool.

    Raises:
        InvalidArgumentError: It has both, or none.
    """
    if (message.joints is None) == (message.tool is None):
        raise InvalidArgumentError("give the velocity of the joints or that of the tool")
    velocity = message.tool if message.joints is None else message.joints
    assert velocity is not None  # noqa: S101  checked above
    return velocity
