"""The control loop: one cycle at each deadline, counted, watched, never in bursts."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from itertools import chain
from typing import NamedTuple, Protocol

from bioscara.clock import Clock
from bioscara.control.faults.flight_recorder import FlightRecord, Timing
from bioscara.control.faults.kinds import FaultKind
from bioscara.control.faults.supervisor import Supervisor
from bioscara.control.loop.realtime import conditions
from bioscara.control.loop.systemd import Watchdog
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.statistics import CycleStatistics
from bioscara.control.manager.update_rate import require_rate
from bioscara.errors import BusStuckError, ConfigurationError, NotEnabledError, OverrunError
from bioscara.hardware import LifecycleState
from bioscara.hardware.bus_budget import BUSY_SHARE, highest_rate
from bioscara.protocol import SILENCE

_IN_A_ROW = 3
"""Consecutive missed deadlines after which the arm is slowed down."""
_SLOW_SHARE, _STOP_SHARE = 0.05, 0.2
"""Shares of missed deadlines in the last second at which the arm is slowed down, and after that
stopped."""
_new = tuple.__new__


class _Miss(NamedTuple):
    """Where the time of a cycle went that missed its deadline [s].

    Attributes:
        time: Its begin.
        late: How much later than due the thread woke up.
        bus: Duration of its exchanges.
        host: Duration of the program's other work in and before it.
    """

    time: float
    late: float
    bus: float
    host: float


class Pace(Protocol):
    """Simulated time that is held back to real time, and may be late in real time alone.

    Attributes:
        late: How much later than due the last wait ended, in real time [s].
        real_time_factor: Simulated time in a second of real time.
    """

    late: float
    real_time_factor: float


class CycleReport(NamedTuple):
    """One cycle of the loop.

    Attributes:
        time: Its begin [s].
        period: Time since the one before [s].
        timing: Its timing.
    """

    time: float
    period: float
    timing: Timing


class Loop:
    """Runs a manager at a fixed rate.

    Deadlines are absolute, so that lateness does not add up; those that have passed are dropped,
    so that setpoints are never sent in a burst. An exception of a cycle ends in the supervisor's
    stop. A request to end the program, such as KeyboardInterrupt, is raised after the joints have
    been commanded to come to rest.

    Args:
        manager: The manager to run.
        supervisor: Watches it.
        record: Keeps it.
        clock: Time; simulated or not.
        rate: Cycles per second [Hz].
        bus_time: Duration of a cycle's exchanges [s].
        watchdog: Fed after every good cycle.
        pace: The pace of a simulated clock; None for another one. Lateness in real time alone
            is counted and reported, and is no fault: the joints are as late.

    Attributes:
        rate: As given.
        period: Time from cycle to cycle [s].
        statistics: Of the cycles.

    Raises:
        ConfigurationError: The rate is invalid, or the bus cannot carry it.
    """

    def __init__(
        self,
        manager: ControllerManager,
        supervisor: Supervisor,
        record: FlightRecord,
        clock: Clock,
        rate: int,
        bus_time: float = 0.0,
        watchdog: Watchdog | None = None,
        pace: Pace | None = None,
    ) -> None:
        rate = require_rate(rate)
        highest = highest_rate(bus_time)
        if rate > highest:
            raise ConfigurationError(
                f"rate {rate} Hz: the exchanges of a cycle take {1e3 * bus_time:.2f} ms on this "
                f"bus; it can carry {highest} Hz"
            )
        self._manager, self._supervisor, self._record = manager, supervisor, record
        self._clock, self._watchdog, self._bus_time = clock, watchdog, bus_time
        self._pace = pace
        self.rate, self.period = rate, 1.0 / rate
        self.statistics = CycleStatistics()
        self._deadline = self._last = math.nan
        self._window: deque[bool] = deque([False] * rate, rate)
        self._missed = self._in_a_row = self._kept = 0
        self._slowed = False
        self._woke_late = self._delayed = 0.0
        self._misses: deque[_Miss] = deque(maxlen=rate)

    @property
    def bus_share(self) -> float:
        """Share of each cycle that the exchanges take on the bus, 0 to 1."""
        return self._bus_time / self.period

    def restart(self) -> None:
        """Start again after a pause without cycles, which is no overrun."""
        self._deadline = self._last = math.nan
        self._window.extend([False] * self.rate)
        self._missed = self._in_a_row = 0
        self._manager.statistics.restart()

    def step(self, before: Callable[[], object] | None = None) -> CycleReport:
        """Wait for the next deadline and run one cycle.

        Args:
            before: Called between the two; must raise nothing.
        """
        try:
            return self._step(before)
        except BaseException:
            now = self._clock.now()
            self._deadline = now + self.period
            self._supervisor.halt(now)
            raise

    def _step(self, before: Callable[[], object] | None) -> CycleReport:
        clock, manager, supervisor = self._clock, self._manager, self._supervisor
        ready, late_in_real_time = clock.now(), 0.0
        if not math.isnan(self._deadline):
            clock.sleep_until(self._deadline)
            if (pace := self._pace) is not None:
                late_in_real_time = pace.late
                self.statistics.overruns += late_in_real_time * pace.real_time_factor > self.period
        if before is not None:
            before()
        time = clock.now()
        if math.isnan(self._deadline):
            # The first cycle, also after a restart by one of the calls before it.
            self._deadline = time
        late = time - self._deadline
        # A program that is busy between two cycles does not sleep at all.
        self._delayed = max(ready - self._deadline, 0.0)
        self._woke_late = max(late - self._delayed, 0.0)
        period = self.period if math.isnan(self._last) else time - self._last
        held_up = period > SILENCE + self.period
        self._last = time
        good = False
        try:
            if held_up and self._driving:
                self._overrun(f"no cycle ran for {period:.2f} s", time)
            # The displacement missed while the joints stopped autonomously is not made up for.
            manager.cycle(time, self.period if held_up else period)
            self._require_timely(time, period)
            supervisor.check(time, self.period)
            self._set_deadline(time)
            good = not manager.failures
        except Exception as error:  # noqa: BLE001  after any failure the arm is brought to rest
            supervisor.crash(error, time)
            self._deadline = clock.now() + self.period
        # Timing(...) and CycleReport(...) take twice as long.
        late = max(late, late_in_real_time)
        timing = _new(Timing, (late, *manager.statistics.timing))
        self._record.append(time, timing)
        self._count(period, timing)
        if good and self._watchdog is not None:
            self._watchdog.feed(time)
        return _new(CycleReport, (time, period, timing))

    @property
    def _driving(self) -> bool:
        """Whether joints receive setpoints; a gripper does not stop when it receives none."""
        return any(
            component.state is LifecycleState.ACTIVE and component.limits
            for component in self._manager.components
        )

    def _count(self, period: float, timing: Timing) -> None:
        statistics, (late, read, update, write) = self.statistics, timing
        statistics.cycles += 1
        statistics.note_begin()
        statistics.periods.add(period)
        statistics.late.add(late)
        statistics.read.add(read)
        statistics.update.add(update)
        statistics.write.add(write)

    def _require_timely(self, time: float, period: float) -> None:
        """Latch a fault if the joints must have stopped autonomously, or report that they did."""
        now = self._clock.now()
        behind, silence = now - self._deadline, now - time + period
        if silence <= SILENCE and behind <= SILENCE + self.period:
            return
        if not self._driving:
            return
        if behind > SILENCE + self.period:
            self._overrun(f"a cycle ended {behind:.2f} s after its begin was due", time)
        elif behind > self.period or period > SILENCE:
            problems = chain.from_iterable(each.problems for each in self._manager.components)
            if any(isinstance(problem, NotEnabledError) for problem in problems):
                self._overrun(f"joints received nothing for up to {silence:.2f} s", time)

    def _set_deadline(self, time: float) -> None:
        """Set the next deadline, and react if it has passed already."""
        behind = self._clock.now() - self._deadline
        periods = int(behind / self.period)
        self._deadline += (periods + 1) * self.period
        missed = periods > 0
        self._missed += missed - self._window[0]
        self._window.append(missed)
        if not missed:
            self._in_a_row = 0
            self._kept += 1
            if self._slowed and self._kept >= self.rate:
                self._slowed = False
                self._supervisor.full_speed()
            return
        self._kept = 0
        self.statistics.overruns += 1
        if not self._driving:
            # Releasing or identifying joints takes time, and the delay does no harm.
            return
        self._note_miss(time)
        self._in_a_row += 1
        share = self._missed / self.rate
        text = f"{share:.0%} of the last second's cycles missed their deadline"
        if self._slowed:
            if share > _STOP_SHARE:
                self._overrun(f"{text} although the arm was slowed down", time)
        elif share > _SLOW_SHARE or self._in_a_row >= _IN_A_ROW:
            self._slowed = True
            if share <= _SLOW_SHARE:
                text = f"{self._in_a_row} cycles in a row missed their deadline"
            self._overrun(text, time, FaultKind.LATE)
            # Whether that helps is judged by the cycles from now on.
            self._window.extend([False] * self.rate)
            self._missed = 0

    def _note_miss(self, time: float) -> None:
        bus = sum(component.bus_time for component in self._manager.components)
        work = self._clock.now() - time + self._delayed
        self._misses.append(_Miss(time, self._woke_late, bus, max(work - bus, 0.0)))

    def _cause(self, time: float) -> str:
        """Return in words where the time of the last second's missed cycles went."""
        misses = [miss for miss in self._misses if time - miss.time <= 1.0]
        if not misses:
            self._note_miss(time)
            misses = [self._misses[-1]]
        _, late, bus, host = (sum(column) / len(misses) for column in zip(*misses, strict=True))
        excess = {"late waking": late, "the bus": bus - self._bus_time, "the host's work": host}
        text = (
            f"mostly because of {max(excess, key=excess.__getitem__)}: in such a cycle the host "
            f"woke {1e3 * late:.1f} ms late, worked {1e3 * host:.1f} ms and waited "
            f"{1e3 * bus:.1f} ms for the bus"
        )
        if self._bus_time > BUSY_SHARE * self.period:
            left = self.period - self._bus_time
            text += f"; at this rate the bus leaves {1e3 * left:.1f} ms of each cycle"
        return text

    @property
    def _waits_for_the_bus(self) -> bool:
        """Whether the bus is stuck: the loop waits for its timeouts, which is no other fault."""
        problems = chain.from_iterable(each.problems for each in self._manager.components)
        return any(isinstance(problem, BusStuckError) for problem in problems) or any(
            fault.kind is FaultKind.BUS_STUCK for fault in self._supervisor.faults
        )

    def _overrun(self, text: str, time: float, kind: FaultKind = FaultKind.OVERRUN) -> None:
        if self._waits_for_the_bus:
            return
        late = 1e3 * self.statistics.late.percentile(99.0)
        text = (
            f"the loop does not keep {self.rate} Hz: {text} (p99 {late:.1f} ms late), "
            f"{self._cause(time)}"
        )
        slow = conditions()
        if slow:
            text += f"; the computer reports {slow}"
        self._supervisor.fault(OverrunError(text), "loop", time, kind)
