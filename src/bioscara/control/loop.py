"""The control loop: one cycle at each deadline, counted, watched, never in bursts."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from bioscara.clock import Clock
from bioscara.control.faults import FaultKind
from bioscara.control.flight_record import FlightRecord, Timing
from bioscara.control.manager import ControllerManager
from bioscara.control.supervisor import Supervisor
from bioscara.errors import ConfigurationError, OverrunError

STUCK = 2.0
"""A cycle that takes this long [s] counts as stuck: the joints have long stopped by themselves."""
_IN_A_ROW = 3
_WARN_SHARE, _STOP_SHARE = 0.05, 0.2


class Cycle(NamedTuple):
    """One cycle of the loop.

    Attributes:
        time: Its begin [s].
        period: Time since the one before [s].
        timing: What it cost.
    """

    time: float
    period: float
    timing: Timing


class Loop:
    """Runs a manager at a fixed rate.

    Deadlines that have passed are dropped: setpoints never come in a burst.

    Args:
        manager: What is run.
        supervisor: Watches it.
        record: Keeps it.
        clock: Time; simulated or not.
        rate: Cycles per second [Hz].
        alive: Called after every good cycle: feeds a watchdog.

    Raises:
        ConfigurationError: The rate is not above zero.
    """

    def __init__(
        self,
        manager: ControllerManager,
        supervisor: Supervisor,
        record: FlightRecord,
        clock: Clock,
        rate: int,
        alive: Callable[[], None] | None = None,
    ) -> None:
        if not 0 < rate <= 10_000:
            raise ConfigurationError(f"rate {rate} Hz is outside 1 .. 10000 Hz")
        self._manager, self._supervisor, self._record = manager, supervisor, record
        self._clock, self._alive = clock, alive
        self.rate, self.period = rate, 1.0 / rate
        self._deadline = math.nan
        self._last = math.nan
        self._window: deque[bool] = deque(maxlen=rate)
        self._in_a_row = 0
        self.cycles = self.overruns = 0

    def restart(self) -> None:
        """Begin anew after a pause in which nothing ran: that is no overrun."""
        self._deadline = self._last = math.nan
        self._in_a_row = 0

    def step(self) -> Cycle:
        """Wait for the next deadline and run one cycle."""
        clock = self._clock
        if math.isnan(self._deadline):
            self._deadline = clock.now()
        else:
            clock.sleep_until(self._deadline)
        time = clock.now()
        period = self.period if math.isnan(self._last) else time - self._last
        self._last = time
        manager = self._manager
        manager.cycle(time, period)
        self._supervisor.check(time, self.period)
        timing = Timing(time - self._deadline, *manager.timing)
        self._record.append(time, timing)
        self._count(time)
        if self._alive is not None and not manager.failures:
            self._alive()
        return Cycle(time, period, timing)

    def _count(self, time: float) -> None:
        """Set the next deadline and judge whether this one was kept."""
        now = self._clock.now()
        missed = int((now - self._deadline) / self.period)
        self._deadline += (missed + 1) * self.period
        self.cycles += 1
        self._window.append(missed > 0)
        self._in_a_row = self._in_a_row + 1 if missed else 0
        if not missed:
            return
        self.overruns += 1
        share = sum(self._window) / len(self._window)
        if now - time >= STUCK:
            text = f"a cycle took {now - time:.2f} s"
        elif self._in_a_row >= _IN_A_ROW:
            text = f"{self._in_a_row} cycles in a row missed their deadline"
        elif share > _STOP_SHARE and len(self._window) == self._window.maxlen:
            text = f"{share:.0%} of the cycles of the last second missed their deadline"
        else:
            return
        self._supervisor.fault(
            OverrunError(f"the loop does not keep {self.rate} Hz: {text}"),
            "loop",
            time,
            FaultKind.OVERRUN,
        )
