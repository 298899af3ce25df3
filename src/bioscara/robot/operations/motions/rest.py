"""Rest for a time of the arm's clock; nothing moves."""

from __future__ import annotations

from bioscara.arguments import number
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import MotionCancelledError, MotionTimeoutError
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import Device
from bioscara.robot.operations.fault_handling import keep_evidence
from bioscara.robot.operations.operation import Cycle, Cycles, OnCycle, Operation


class Rest(Operation[None]):
    """Runs control cycles for a time, also of an arm that is disabled; uses no device.

    Args:
        seconds: The time [s]; what passes in a pause does not count.
        timeout: Longest duration [s]; None for no limit.
        on_cycle: Receives the record of each cycle.
    """

    devices: frozenset[Device] = frozenset()
    pausable = True

    def __init__(
        self, seconds: float, *, timeout: float | None = None, on_cycle: OnCycle | None = None
    ) -> None:
        super().__init__("rest()", timeout=timeout, on_cycle=on_cycle)
        self._seconds, self._rested = number("seconds", seconds), 0.0

    def prepare(self, arm: Arm) -> None:
        """Refuse to wait for cycles that do not come, or with a fault."""
        arm.stack.supervisor.require_clear()

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Run cycles until the time has passed."""
        self.claim.require_not_stopped()
        if not any(each.devices for each in arm.operations):
            arm.pace(homing=False)
        arm.restart_loop(self)
        supervisor, clock = arm.stack.supervisor, arm.session.clock
        before = clock.now()
        deadline = before + self.timeout
        while self._rested < self._seconds:
            if self.claim.stopped:
                raise MotionCancelledError(
                    f"interrupted {self._rested:.2f} s into a rest of {self._seconds:g} s"
                )
            if before >= deadline:
                raise MotionTimeoutError(f"not done within {self.timeout:g} s; the arm rests")
            yield Cycle(Phase.WATCHING)
            if supervisor.state is not FaultState.CLEAR:
                while supervisor.state is FaultState.STOPPING:
                    yield Cycle(Phase.STOPPING)
                keep_evidence(arm)
                raise supervisor.faults[0].error()
            now = clock.now()
            if arm.pause_remedy(self) is None:
                self._rested += now - before
            before = now

    @property
    def progress(self) -> float:
        """Share of the time that has passed, 0 to 1."""
        if self.done and self.error is None:
            return 1.0
        return min(self._rested / max(self._seconds, 1e-9), 1.0)
