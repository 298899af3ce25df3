"""Simulated time held back to the pace of the wall clock, for observers."""

from __future__ import annotations

from bioscara.clock import Clock, MonotonicClock

_LOST = 0.25
"""Lag behind the wall clock beyond which it is no longer made up for [s]."""


class PacedClock:
    """A clock that advances no faster than the wall clock while it is paced.

    It can only delay: a simulation that is slower than real time is not sped up.

    Args:
        clock: Clock of the simulation; waiting on it advances it.
        wall: Clock of real time.

    Attributes:
        paced: Whether time is held back; may be changed at any time.
        real_time_factor: Simulated time that may pass in a second of real time ; may be changed
            at any time, and then applies from the next wait on.
        late: How much later than due the last wait ended, in real time [s]; 0 if it was not paced.
    """

    def __init__(self, clock: Clock, wall: Clock | None = None) -> None:
        self._clock = clock
        self._wall: Clock = MonotonicClock() if wall is None else wall
        self._paced = False
        self.real_time_factor = self._applied = 1.0
        self.late = 0.0
        self._lead = 0.0

    @property
    def paced(self) -> bool:
        """Whether time is held back."""
        return self._paced

    @paced.setter
    def paced(self, paced: bool) -> None:
        self._paced = paced
        self._restart()

    def now(self) -> float:
        """Return the simulated time [s]."""
        return self._clock.now()

    def sleep_until(self, deadline: float) -> None:
        """Let the simulation run until ``deadline`` [s]; if paced, return no earlier than due."""
        self._clock.sleep_until(deadline)
        self.late = 0.0
        if not self._paced:
            return
        if self.real_time_factor != self._applied:
            # Here, in the thread of the loop: its settings are never half changed.
            self._restart()
        due = self._clock.now() / self._applied + self._lead
        self._wall.sleep_until(due)
        self.late = max(self._wall.now() - due, 0.0)
        if self.late > _LOST:
            self._lead += self.late

    def _restart(self) -> None:
        """Hold time back from now on, so that no time before counts."""
        self._applied = self.real_time_factor
        self._lead = self._wall.now() - self._clock.now() / self._applied
