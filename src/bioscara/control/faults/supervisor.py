"""Stops the arm when something goes wrong, and keeps it stopped until a person has dealt with it.

The order is always the same: a fault stops the arm in the cycle that notices it, its evidence is
written once the arm is at rest, ``acknowledge`` takes note of it, ``recover`` clears what the
joints latched, and ``enable`` engages them again. None of these moves anything.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from enum import Enum
from pathlib import Path

from bioscara.control.controllers.controller import WARNINGS
from bioscara.control.faults.log import FaultLog
from bioscara.control.faults.kinds import Fault, FaultKind, Stop, classify, source_of
from bioscara.control.faults.flight_recorder import FlightRecord
from bioscara.control.faults.following_error import Following
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.faults.stop import Resting
from bioscara.errors import BioscaraError, FaultedError, HardwareError, ModeSwitchError
from bioscara.hardware import ArmHardware, State
from bioscara.hardware.safe_stop import stop_and_disable

_SLOW = 0.5
"""Share of the chosen speed at which a loop that is late goes on."""


class FaultState(Enum):
    """Where the arm is between a fault and its end."""

    CLEAR = "clear"
    STOPPING = "stopping"
    LATCHED = "latched"
    """At rest; nobody has taken note yet."""
    ACKNOWLEDGED = "acknowledged"
    """Somebody has; the joints still have to be recovered."""


class Supervisor(Resting):
    """Watches an arm from cycle to cycle.

    Args:
        manager: Runs the arm.
        arm: Its joints.
        hold: Name of the configured controller that brings the arm to rest and holds it.
        record: The last seconds.
        folder: Where evidence is written; created when there is some.

    Attributes:
        state: Where the arm is between a fault and its end.
        faults: What went wrong since it was clear, first cause first.
        warnings: What was worth saying but stopped nothing.
    """

    def __init__(
        self,
        manager: ControllerManager,
        arm: ArmHardware,
        hold: str,
        record: FlightRecord,
        folder: Path,
    ) -> None:
        super().__init__(manager, arm, hold)
        self._log = FaultLog(record, folder, len(arm.axes))
        self._following = [Following(axis, manager.limiter.guards[axis.name]) for axis in arm.axes]
        self._since = 0.0
        self.state = FaultState.CLEAR
        self.faults = self._log.faults
        self.warnings: deque[str] = deque(maxlen=WARNINGS)

    def require_clear(self) -> None:
        """Raise unless no fault is in the way of motion.

        Raises:
            FaultedError: One is; names the first cause and what to do.
        """
        if self.state is not FaultState.CLEAR:
            raise FaultedError(
                f"the arm is stopped by a fault ({self.state.value}): {self.faults[0]}; then "
                "acknowledge() and recover()"
            )

    def check(self, time: float, period: float) -> None:
        """Look at the cycle that just ended, and react.

        Args:
            time: Its begin [s].
            period: Time from cycle to cycle [s].
        """
        manager, arm = self._manager, self._arm
        for problem in arm.problems:
            if isinstance(problem, ModeSwitchError):
                self.warnings.append(str(problem))
            else:
                self.fault(problem, arm.name, time)
        # A component that gave up is not read any more and tells the same for ever.
        arm.problems.clear()
        for failure in manager.failures:
            self.fault(failure.cause, failure.source, failure.time)
        if self.state is FaultState.CLEAR:
            for following in self._following:
                error = following.check(time, period)
                if error is not None:
                    self.fault(error, error.joint, time)
        elif self.state is FaultState.STOPPING and self.at_rest(time, self._since):
            self.state = FaultState.LATCHED
            self._log.freeze()
            if self._log.stop is Stop.DISABLE:
                self._release(time)

    def fault(
        self, cause: BaseException, source: str, time: float, kind: FaultKind | None = None
    ) -> None:
        """Take a fault and stop the arm; this raises nothing.

        A fault of the same kind from the same source is not taken twice.

        Args:
            cause: The exception behind it.
            source: Joint, component or controller that it came from, unless the cause says.
            time: Now [s].
            kind: What it is; by default what the cause stands for.
        """
        fault = Fault(kind or classify(cause), source_of(cause, source), cause, time)
        if fault.kind.stop is Stop.SLOW:
            self.warnings.append(str(fault))
            self._pace(_SLOW)
            return
        if self._take(fault):
            (self._release if self._log.stop is Stop.POWERLESS else self.stop)(time)

    def crash(self, cause: Exception, time: float) -> None:
        """Take it that a cycle broke off; this raises nothing.

        A second time the arm is released: cycles that break off cannot ramp it down.

        Args:
            cause: What the cycle raised.
            time: Now [s].
        """
        again = self.state is not FaultState.CLEAR
        self.fault(cause, "loop", time, FaultKind.LOOP_FAILED)
        if again:
            self._release(time)

    def full_speed(self) -> None:
        """Take back what was slowed down: trajectories go on at the speed chosen for them."""
        self._pace(1.0)

    def halt(self, time: float) -> None:
        """Let what nobody wants to go on any more come to rest; this raises nothing.

        Trajectories and jogs do so on their way, which is known to be clear: the hold would leave
        it. All else is stopped, and so is everything after a fault.

        Args:
            time: Now [s].
        """
        try:
            halting = self.state is FaultState.CLEAR and self._let_halt(time)
        except Exception:  # noqa: BLE001  who does not take it is stopped
            halting = False
        if not halting:
            self.stop(time)

    @property
    def halted(self) -> bool:
        """Whether nothing is coming to rest on its way any more."""
        return self.state is not FaultState.CLEAR or self._halted()

    def stop(self, time: float) -> None:
        """Bring all joints to rest and hold them; a homing is ended. This raises nothing.

        Args:
            time: Now [s].
        """
        try:
            self._let_hold(time)
        except Exception:  # noqa: BLE001  what cannot be ramped down is let go
            self._release(time)

    def _take(self, fault: Fault) -> bool:
        """Latch a fault; return whether it is news."""
        if not self._log.add(fault):
            return False
        if self.state is FaultState.CLEAR:
            self._manager.lock = f"a fault is latched: {fault}"
        if self.state is not FaultState.STOPPING:
            # Also a fault that comes after others were acknowledged has to be.
            self.state, self._since = FaultState.STOPPING, fault.time
        return True

    def acknowledge(self) -> Sequence[Fault]:
        """Take note of the faults: their evidence is written; nothing moves or is switched.

        Returns:
            The faults with their evidence.

        Raises:
            FaultedError: The arm is still coming to rest, or there is no fault.
            OSError: The evidence cannot be written; the fault stays.
        """
        if self.state is FaultState.CLEAR:
            raise FaultedError("there is no fault to acknowledge")
        if self.state is FaultState.STOPPING:
            raise FaultedError("the arm is still coming to rest; acknowledge when it stands")
        if self.state is FaultState.LATCHED:
            self.keep_evidence()
            self.state = FaultState.ACKNOWLEDGED
        return tuple(self.faults)

    def keep_evidence(self) -> None:
        """Write the flight record as it was each time the arm had come to rest, and the faults.

        Does nothing if all of it is written already; what was written before is never replaced.

        Raises:
            OSError: It cannot be written.
        """
        self._log.keep()

    def recover(self, time: float) -> None:
        """Clear what the joints latched and greet those that restarted; the arm is INACTIVE.

        Joints that kept their boot id are still homed.

        Args:
            time: Now [s].

        Raises:
            FaultedError: The faults are not acknowledged.
            BioscaraError: A joint does not answer or cannot be released; the faults stay.
        """
        if self.state is FaultState.CLEAR:
            raise FaultedError("there is no fault to recover from")
        if self.state is not FaultState.ACKNOWLEDGED:
            raise FaultedError(f"not acknowledged yet: {self.faults[-1]}; then acknowledge()")
        manager, arm = self._manager, self._arm
        if arm.available:
            # What cannot be released now is released below, once it was greeted again.
            with suppress(BioscaraError):
                manager.set_hardware_state(arm.name, State.UNCONFIGURED, time)
        arm.configure()
        arm.clear_faults()
        problems = stop_and_disable(arm.joints)
        if problems:
            raise HardwareError("; ".join(problems), arm.name)
        self._log.clear()
        self.state, manager.lock = FaultState.CLEAR, ""

    def _release(self, time: float) -> None:
        """Let go of the joints, whatever they say to it; this raises nothing."""
        name = self._arm.name
        try:
            if self._arm.state is State.ACTIVE:
                self._manager.set_hardware_state(name, State.INACTIVE, time)
        except Exception as error:  # noqa: BLE001  somebody has to know what may be energised
            self._take(Fault(FaultKind.HARDWARE_FAILED, source_of(error, name), error, time))

    def _pace(self, share: float) -> None:
        """Let trajectories go on at a share of the speed that was chosen for them."""
        for controller in self._manager.controllers:
            if isinstance(controller, JointTrajectoryController):
                controller.slow_down(share)
