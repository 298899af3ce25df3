"""Time as an argument: code that waits or stamps receives a :class:`Clock`.

On a real arm that is :class:`MonotonicClock`. In simulation the joints' firmware and the host
share one :class:`SimulatedClock`: simulated time passes by waiting.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from contextlib import closing
from typing import Protocol

Waits = Generator[float, None, None]
"""A procedure that takes time: runs up to each wait and yields its end [s]. One that is closed
while it waits ends as after an interruption."""


class Clock(Protocol):
    """A monotonic time base.

    ``now`` is in seconds from an arbitrary origin and never decreases.
    """

    def now(self) -> float:
        """Return the present time [s]."""
        ...

    def sleep_until(self, deadline: float) -> None:
        """Return at ``deadline`` [s], or at once if that has passed."""
        ...


def wait_through(clock: Clock, waits: Waits) -> None:
    """Run a procedure to its end, and wait for it here."""
    with closing(waits):
        for due in waits:
            clock.sleep_until(due)


class MonotonicClock:
    """The machine's monotonic clock; steps of the wall clock do not affect it."""

    # The function itself: a cycle takes the time often, and a method around it takes twice as long.
    now = staticmethod(time.monotonic)

    def sleep_until(self, deadline: float) -> None:
        """Sleep until ``deadline`` [s]."""
        remaining = deadline - time.monotonic()
        if remaining > 0.0:
            time.sleep(remaining)


class SimulatedClock:
    """Clock whose time passes only while a caller waits for it.

    Args:
        read: Returns the simulated time [s].
        advance: Lets the simulation run for the given duration [s].

    Attributes:
        now: As ``read``.
    """

    def __init__(self, read: Callable[[], float], advance: Callable[[float], None]) -> None:
        self.now = read
        self._advance = advance

    def sleep_until(self, deadline: float) -> None:
        """Run the simulation until ``deadline`` [s]."""
        remaining = deadline - self.now()
        if remaining > 0.0:
            self._advance(remaining)
