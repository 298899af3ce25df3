"""Faults and speed of an arm that the owner itself simulates."""

from __future__ import annotations

import math
from collections.abc import Callable

from bioscara.api import messages as m
from bioscara.arguments import number
from bioscara.errors import LimitError
from bioscara.robot.arm import Arm
from bioscara.robot.connection.pacing import PacedClock
from bioscara.robot.simulated_faults import bench_of
from bioscara.sim import BenchBus

SLOWEST, FASTEST = 0.1, 20.0
"""Range of the speed that a client may choose. At 20 a lease of 2 s is 40 s of the arm's time; at
0.1 a cycle takes 0.1 s, and clients see fresh states ten times a second."""


class ServedBench:
    """Faults and speed of an arm, if its owner simulates it.

    Args:
        arm: The arm.
        changed: Called with a sentence after each change, by any thread.
    """

    def __init__(self, arm: Arm, changed: Callable[[str], object]) -> None:
        self._changed = changed
        bus, clock = arm.session.bus, arm.session.clock
        self._arm = arm
        self._bench = bus.bench if isinstance(bus, BenchBus) else None
        self._clock = clock if isinstance(clock, PacedClock) else None
        if self._bench is not None:
            self._bench.changed = changed

    def state(self) -> m.SimulationState:
        """Return the faults and the factor of time now."""
        bench, clock = self._bench, self._clock
        faults = () if bench is None else bench.faults
        return m.SimulationState(
            available=bench is not None,
            real_time_factor=math.nan if bench is None or clock is None else clock.real_time_factor,
            faults=tuple([m.SimulatedFaultValue(*fault) for fault in faults]),
        )

    def set_factor(self, factor: float, client: str) -> None:
        """Let the arm's time pass faster or slower from the next cycle on.

        Args:
            factor: Simulated time in a second of real time.
            client: Name of the client.

        Raises:
            NotSupportedError: The arm is not simulated in this process.
            LimitError: The factor is outside its range.
        """
        bench_of(self._arm)
        factor = number("real_time_factor", factor)
        if not SLOWEST <= factor <= FASTEST:
            raise LimitError("real_time_factor", factor, SLOWEST, FASTEST, "")
        if self._clock is not None:
            self._clock.real_time_factor = factor
            self._changed(f"{client} set the real_time_factor to {factor:g}")
