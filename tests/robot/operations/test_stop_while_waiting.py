"""A stop that comes while the loop waits for its deadline counts in the cycle at that deadline."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bioscara import MotionCancelledError, Robot
from bioscara.clock import Clock
from bioscara.control.loop.loop import CycleReport
from bioscara.sim import FirmwareBus
from simulated import ARM, simulated_bus


class Waiting:
    """A clock that calls a function during its waits."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.now = clock.now
        self.meanwhile: Callable[[], None] = lambda: None

    def sleep_until(self, deadline: float) -> None:
        self.meanwhile()
        self._clock.sleep_until(deadline)


@pytest.mark.parametrize("cycles", [30, 100, 163])
def test_the_setpoint_of_the_next_cycle_brakes(cycles: int) -> None:
    arm = simulated_bus(homed=True, at=(0.0, 0.3, 0.0, 0.0)).arm
    clock = Waiting(arm.clock)
    with Robot(FirmwareBus(arm), clock, ARM, "simulated") as robot:
        robot.enable()
        lift = robot.runner.arm.stack.manager.limiter.joints["j2"]
        speeds: list[float] = []

        def stop() -> None:
            if len(speeds) == cycles:
                robot.stop()

        def observe(_: CycleReport) -> None:
            speeds.append(abs(lift.speed))

        robot.runner.observers = (observe,)
        clock.meanwhile = stop
        with pytest.raises(MotionCancelledError):
            robot.move_joints((0.0, 0.05, 0.0, 0.0), velocity_scaling=0.2)
        robot.runner.observers = ()
        # It was as fast or faster in each cycle before; now it gains less, or becomes slower.
        gain = speeds[cycles - 1] - speeds[cycles - 2]
        assert gain > -1e-9
        assert speeds[cycles] - speeds[cycles - 1] < gain - 1e-6
