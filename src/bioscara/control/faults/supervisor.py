"""Stops the arm on a fault, and keeps it stopped until a person has dealt with the fault.

The order is always the same: a fault stops the arm in the cycle that detects it, its evidence is
written once the arm is at rest, ``acknowledge`` acknowledges it, ``recover`` clears the faults that
the joints latched, and ``enable`` enables them again. None of these causes motion.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from enum import StrEnum

from bioscara.control.controllers.controller import WARNINGS
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.faults.flight_recorder import FlightRecord
from bioscara.control.faults.following_error import FollowingErrorMonitor, fade
from bioscara.control.faults.kinds import (
    ArmFault,
    FaultKind,
    Stop,
    classify,
    reports_missing_supply,
    source_of,
)
from bioscara.control.faults.log import EvidenceWriter, FaultLog
from bioscara.control.faults.stop import MotionStopper
from bioscara.control.faults.warning import ArmWarning
from bioscara.control.manager.manager import ControllerManager
from bioscara.errors import (
    BioscaraError,
    FaultedError,
    JointError,
    ModeSwitchError,
    NoAcknowledgeError,
)
from bioscara.hardware import ArmHardware, LifecycleState

_SLOW = 0.5
"""Share of the chosen speed at which motion continues when the loop is late."""


class FaultState(StrEnum):
    """Stage of fault handling."""

    CLEAR = "clear"
    STOPPING = "stopping"
    LATCHED = "latched"
    """At rest; not acknowledged yet."""
    ACKNOWLEDGED = "acknowledged"
    """Acknowledged; the joints still have to be recovered."""


_CLEAR = FaultState.CLEAR


def refusal(state: FaultState, fault: str) -> str:
    """Return the message that refuses a motion because of a fault, with the remaining steps.

    Args:
        state: Stage of fault handling.
        fault: The first cause, in words.
    """
    recovery = "recover()" if state is FaultState.ACKNOWLEDGED else "acknowledge() and recover()"
    return f"the arm is stopped by a fault ({state.value}): {fault}; then {recovery}"


class Supervisor:
    """Watches an arm from cycle to cycle.

    Args:
        manager: Runs the arm.
        arm: Its joints.
        hold: Name of the configured controller that brings the arm to rest and holds it.
        record: The last seconds.
        write: Writes the evidence.

    Attributes:
        state: Stage of fault handling.
        faults: Faults since the arm was clear, first cause first.
        warnings: Events that did not stop the arm and that a person should see; the latest hundred.
        calls: Returns the names of the calls that use the arm, for warnings.
        stopper: Brings the arm to rest.
    """

    def __init__(
        self,
        manager: ControllerManager,
        arm: ArmHardware,
        hold: str,
        record: FlightRecord,
        write: EvidenceWriter,
    ) -> None:
        self._manager, self._arm = manager, arm
        self.stopper = MotionStopper(manager, arm, hold)
        self._log = FaultLog(record, write, len(arm.axes))
        self._following = [
            FollowingErrorMonitor(axis, manager.limiter.joints[axis.name]) for axis in arm.axes
        ]
        self._since = 0.0
        self.state = FaultState.CLEAR
        self.faults = self._log.faults
        self.warnings: deque[ArmWarning] = deque(maxlen=WARNINGS)
        self.calls: Callable[[], str] = str

    def require_clear(self) -> None:
        """Raise if a fault prevents motion.

        Raises:
            FaultedError: One does; names the first cause and the remedy.
        """
        if self.state is not FaultState.CLEAR:
            first = self.faults[0]
            error = FaultedError(refusal(self.state, str(first)))
            error.evidence = None if first.evidence is None else str(first.evidence)
            raise error

    def warn(self, text: str, time: float, call: str | None = None, author: str = "") -> None:
        """Add a warning.

        Args:
            text: What happened.
            time: Now [s].
            call: Name of the call in the warning; None for the calls that use the arm now.
            author: Key of the client whose motion it concerns alone; empty for all.
        """
        call = self.calls() if call is None else call
        self.warnings.append(ArmWarning(text, time, call, author))

    def check(self, time: float, period: float) -> None:
        """Check the cycle that just ended, and react.

        Args:
            time: Its begin [s].
            period: Time from cycle to cycle [s].
        """
        manager, arm = self._manager, self._arm
        for problem in arm.problems:
            if isinstance(problem, ModeSwitchError):
                self.warn(str(problem), time)
            else:
                self.fault(problem, arm.name, time)
        # A component that gave up is not read any more and would always report the same.
        arm.problems.clear()
        for failure in manager.failures:
            self.fault(failure.cause, failure.source, failure.time)
        if self.state is _CLEAR:
            fading = fade(period)
            for following in self._following:
                error = following.check(time + period, fading)
                if error is not None:
                    self.fault(error, error.joint, time)
        elif self.state is FaultState.STOPPING and self.stopper.at_rest(time, self._since):
            self.state = FaultState.LATCHED
            self._log.freeze()
            if self._log.stop is Stop.DISABLE:
                self._release(time)

    def fault(
        self, cause: BaseException, source: str, time: float, kind: FaultKind | None = None
    ) -> None:
        """Handle a fault and stop the arm; this raises nothing.

        A fault of the same kind from the same source is not latched twice.

        Args:
            cause: The exception behind it.
            source: Joint, component or controller of origin, unless the cause names one.
            time: Now [s].
            kind: Its kind; by default derived from the cause.
        """
        fault = ArmFault(kind or classify(cause), source_of(cause, source), cause, time)
        if fault.kind.stop is Stop.SLOW:
            self.warn(str(fault), time)
            self._set_pace(_SLOW)
            return
        if self._latch(fault):
            (self._release if self._log.stop is Stop.POWERLESS else self.stop)(time)

    def crash(self, cause: Exception, time: float) -> None:
        """Handle an aborted control cycle; this raises nothing.

        The second time the arm is released: aborted cycles cannot ramp it down.

        Args:
            cause: The exception raised by the cycle.
            time: Now [s].
        """
        again = self.state is not FaultState.CLEAR
        self.fault(cause, "loop", time, FaultKind.LOOP_FAILED)
        if again:
            self._release(time)

    def full_speed(self) -> None:
        """Undo a slow-down: trajectories continue at the speed chosen for them."""
        self._set_pace(1.0)

    def halt(self, time: float) -> None:
        """Bring motion that is not wanted any more to rest; this raises nothing.

        Trajectories and jogs come to rest on their path, which is known to be clear: the hold would
        leave it. All other motion is stopped, and so is all motion after a fault.

        Args:
            time: Now [s].
        """
        try:
            halting = self.state is FaultState.CLEAR and self.stopper.stop_on_path(time)
        except Exception:  # noqa: BLE001  a controller that cannot be halted is stopped
            halting = False
        if not halting:
            self.stop(time)

    @property
    def halted(self) -> bool:
        """Whether no motion is still coming to rest on its path."""
        return self.state is not FaultState.CLEAR or self.stopper.stopped_on_path

    def stop(self, time: float) -> None:
        """Bring all joints to rest and hold them; end a homing run. This raises nothing.

        Args:
            time: Now [s].
        """
        try:
            self.stopper.hold(time)
        except Exception:  # noqa: BLE001  joints that cannot be ramped down are released
            self._release(time)

    def _latch(self, fault: ArmFault) -> bool:
        """Latch a fault; return whether it is new."""
        if not self._log.add(fault):
            return False
        if self.state is FaultState.CLEAR:
            self._manager.lock = f"a fault is latched: {fault}"
        if self.state is not FaultState.STOPPING:
            # A fault after others were acknowledged has to be acknowledged too.
            self.state, self._since = FaultState.STOPPING, fault.time
        return True

    def acknowledge(self) -> Sequence[ArmFault]:
        """Acknowledge the faults and write their evidence; nothing moves or is switched.

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

        Does nothing if all of it is written already; existing files are never replaced.

        Raises:
            OSError: It cannot be written.
        """
        self._log.keep()

    def recover(self, time: float) -> None:
        """Clear the joints' latched faults and initialise restarted joints; the arm is INACTIVE.

        Joints that kept their boot id are still homed.

        Args:
            time: Now [s].

        Raises:
            FaultedError: The faults are not acknowledged.
            JointError: The cause of a joint's fault lasts, as a missing supply; the faults stay.
            BioscaraError: A joint does not answer or cannot be released; the faults stay.
        """
        if self.state is FaultState.CLEAR:
            raise FaultedError("there is no fault to recover from")
        if self.state is not FaultState.ACKNOWLEDGED:
            raise FaultedError(f"not acknowledged yet: {self.faults[-1]}; then acknowledge()")
        manager, arm = self._manager, self._arm
        if arm.available:
            # Joints that cannot be released now are released below, once they are identified again.
            with suppress(BioscaraError):
                manager.set_hardware_state(arm.name, LifecycleState.UNCONFIGURED, time)
        try:
            arm.configure()
        except NoAcknowledgeError as error:
            if all(fault.kind is not FaultKind.POWER_LOST for fault in self.faults):
                raise
            text = f"{error}; {FaultKind.POWER_LOST.action}, then recover() again"
            raise NoAcknowledgeError(text, error.address) from error
        try:
            arm.clear_faults()
        except JointError as error:
            kind = FaultKind.POWER_LOST if reports_missing_supply(error) else classify(error)
            error.remedy = f"{kind.action}, then recover() again"
            raise
        arm.disable()
        if arm.freed_by:
            self.warn(
                f"the bus was stuck until {', '.join(arm.freed_by)} restarted: check the cable "
                "there, and replace the joint's controller if it happens again",
                time,
            )
        self._log.clear()
        self.state, manager.lock = FaultState.CLEAR, ""

    def _release(self, time: float) -> None:
        """Release the joints, even if they refuse or fail; this raises nothing."""
        name = self._arm.name
        try:
            if self._arm.state is LifecycleState.ACTIVE:
                self._manager.set_hardware_state(name, LifecycleState.INACTIVE, time)
        except Exception as error:  # noqa: BLE001  motors may still be energised: report it
            self._latch(ArmFault(FaultKind.HARDWARE_FAILED, source_of(error, name), error, time))

    def _set_pace(self, share: float) -> None:
        """Let trajectories continue at a share of the speed that was chosen for them."""
        for controller in self._manager.controllers:
            if isinstance(controller, JointTrajectoryController):
                controller.slow_down(share)
