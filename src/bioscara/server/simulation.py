"""Faults and speed of an arm that the owner itself simulates."""

from __future__ import annotations

import math
from collections.abc import Callable

from bioscara.api import messages as m
from bioscara.arguments import number
from bioscara.errors import LimitError, NotSupportedError
from bioscara.robot.arm import Arm
from bioscara.robot.connection.pacing import PacedClock
from bioscara.sim import Bench, BenchBus

SLOWEST, FASTEST = 0.1, 20.0
"""Range of the speed that a client may choose. At 20 a lease of 2 s is 40 s of the arm's time; at
0.1 a cycle takes 0.1 s, and clients see fresh states ten times a second."""


def bench_of(arm: Arm) -> Bench:
    """Return the bench of an arm.

    Raises:
        NotSupportedError: It is not simulated in this process.
    """
    bus = arm.session.bus
    if not isinstance(bus, BenchBus):
        raise NotSupportedError(
            "faults and speed can be chosen for the arm that bioscara serve --bus sim simulates; "
            "this one is real, or simulated by another process"
        )
    return bus.bench


def simulate(arm: Arm, task: m.SimulateFault) -> None:
    """Let a simulated arm fail, in the thread that runs its control loop.

    Raises:
        NotSupportedError: It is not simulated in this process.
        InvalidArgumentError: There is no such fault or joint, or the value is out of range.
    """
    bench_of(arm).apply(task.fault, task.joint, task.value)


class Simulation:
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

    def step(self, now: float) -> None:
        """End the faults whose time is over; called at the end of each cycle.

        Args:
            now: Time on the arm's clock [s].
        """
        if self._bench is not None:
            self._bench.step(now)

    def state(self) -> m.SimulationState:
        """Return the faults and the speed now."""
        bench, clock = self._bench, self._clock
        faults = () if bench is None else bench.faults
        return m.SimulationState(
            available=bench is not None,
            speed=math.nan if bench is None or clock is None else clock.speed,
            faults=tuple([m.SimulatedFaultValue(*fault) for fault in faults]),
        )

    def set_speed(self, speed: float, client: str) -> None:
        """Let the arm's time pass faster or slower from the next cycle on.

        Args:
            speed: Simulated time in a second of real time.
            client: Name of the client.

        Raises:
            NotSupportedError: The arm is not simulated in this process.
            LimitError: The speed is outside its range.
        """
        bench_of(self._arm)
        speed = number("speed of the simulation", speed)
        if not SLOWEST <= speed <= FASTEST:
            raise LimitError("speed of the simulation", speed, SLOWEST, FASTEST, "")
        if self._clock is not None:
            self._clock.speed = speed
            self._changed(f"{client} set the speed of the simulation to {speed:g}")
