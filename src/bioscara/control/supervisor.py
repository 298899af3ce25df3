"""Stops the arm when something goes wrong, and keeps it stopped until a person has dealt with it.

The order is always the same: a fault stops the arm in the cycle that notices it, its evidence is
written once the arm is at rest, ``acknowledge`` takes note of it, ``recover`` clears what the
joints latched, and ``enable`` engages them again. None of these moves anything.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from enum import Enum
from pathlib import Path

from bioscara.control.faults import Fault, FaultKind, Stop, classify, says_power_is_gone, source_of
from bioscara.control.flight_record import Evidence, FlightRecord
from bioscara.control.following import Following
from bioscara.control.hold_controller import HoldController
from bioscara.control.joint_trajectory import JointTrajectoryController
from bioscara.control.manager import ControllerManager
from bioscara.errors import BioscaraError, FaultedError, ModeSwitchError
from bioscara.hardware import HOME, ArmHardware, State

REST_SHARE = 0.002
"""Share of its highest speed below which a joint counts as standing."""
_REST_TIME = 5.0
"""Time after which a stop counts as ended whatever the joints say [s]."""
_AT_ONCE = 0.1
"""Joints that drop out within this time dropped out together [s]."""
_SLOW = 0.5
_WARNINGS = 100
"""How many warnings are kept: the latest."""


class FaultState(Enum):
    """Where the arm is between a fault and its end."""

    CLEAR = "clear"
    STOPPING = "stopping"
    LATCHED = "latched"
    """At rest; nobody has taken note yet."""
    ACKNOWLEDGED = "acknowledged"
    """Somebody has; the joints still have to be recovered."""


class Supervisor:
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
        self._manager, self._arm, self._hold = manager, arm, hold
        self._record, self._folder = record, folder
        self._following = [Following(axis, manager.limiter.guards[axis.name]) for axis in arm.axes]
        self._since = 0.0
        self._evidence: Evidence | None = None
        self.state = FaultState.CLEAR
        self.faults: list[Fault] = []
        self.warnings: deque[str] = deque(maxlen=_WARNINGS)

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
            self._evidence = self._record.freeze()
            if self.faults[0].kind.stop is Stop.DISABLE:
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
        if any((old.kind, old.source) == (fault.kind, fault.source) for old in self.faults):
            return
        self.faults.append(fault)
        self._name_power_loss(time)
        if self.state is FaultState.CLEAR:
            self._manager.lock = f"a fault is latched: {fault}"
        if self.state is not FaultState.STOPPING:
            # Also a fault that comes after others were acknowledged has to be.
            self.state, self._since = FaultState.STOPPING, time
        if self.faults[0].kind.stop is Stop.POWERLESS:
            self._release(time)
        else:
            self.stop(time)

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

    def stop(self, time: float) -> None:
        """Bring all joints to rest and hold them; a homing is ended. This raises nothing.

        Args:
            time: Now [s].
        """
        try:
            self._let_hold(time)
        except Exception:  # noqa: BLE001  what cannot be ramped down is let go
            self._release(time)

    def _let_hold(self, time: float) -> None:
        manager, arm = self._manager, self._arm
        if arm.state is not State.ACTIVE:
            return
        for command in arm.commands.values():
            if command.kind == HOME:
                command.value = 0.0
        leaving, moving = [], False
        for controller in manager.controllers:
            claimed = arm.commands.keys() & controller.command_interfaces
            if claimed and controller.state is State.ACTIVE and controller.name != self._hold:
                leaving.append(controller.name)
                moving = moving or any(arm.commands[name].kind != HOME for name in claimed)
        if moving and manager.controller(self._hold).state is not State.ACTIVE:
            # Where a joint that moves cannot be held, each comes to rest by itself.
            with suppress(ModeSwitchError):
                manager.take_over(self._hold, leaving, time)
                return
        if leaving:
            manager.switch(time, (), leaving)

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
        """Write the flight record as it was when the arm had come to rest, and the faults.

        Does nothing if all of it is written already; what was written before is never replaced.

        Raises:
            OSError: It cannot be written.
        """
        if all(fault.evidence is not None for fault in self.faults):
            return
        evidence = self._evidence or self._record.freeze()
        first = self.faults[0]
        name = f"fault-{first.kind.name.lower()}-{datetime.now(UTC):%Y%m%dT%H%M%S}"
        path = evidence.write(self._folder, name, [str(fault) for fault in self.faults])
        self.faults[:] = [replace(fault, evidence=path) for fault in self.faults]

    def recover(self, time: float) -> None:
        """Clear what the joints latched and greet those that restarted; the arm is INACTIVE.

        Joints that kept their boot id are still homed.

        Args:
            time: Now [s].

        Raises:
            FaultedError: The faults are not acknowledged.
            BioscaraError: A joint does not answer; the faults stay.
        """
        if self.state is not FaultState.ACKNOWLEDGED:
            raise FaultedError(f"the fault is {self.state.value}: acknowledge() it first")
        manager, arm = self._manager, self._arm
        if arm.available:
            with suppress(BioscaraError):
                manager.set_hardware_state(arm.name, State.UNCONFIGURED, time)
        arm.configure()
        arm.clear_faults()
        self.faults.clear()
        self._evidence = None
        self.state, manager.lock = FaultState.CLEAR, ""

    def at_rest(self, time: float, since: float) -> bool:
        """Return whether all joints that can be reached stand, or had long enough to do so.

        Args:
            time: Now [s].
            since: When they were told to stop [s].
        """
        if self._arm.state is not State.ACTIVE or time - since > _REST_TIME:
            return True
        hold = self._manager.controller(self._hold)
        if isinstance(hold, HoldController) and hold.state is State.ACTIVE and not hold.ended:
            return False
        return all(
            axis.halted is not None
            or (
                not axis.homing.running
                and abs(axis.sample.velocity) < REST_SHARE * axis.velocity_limit
            )
            for axis in self._arm.axes
        )

    def _name_power_loss(self, time: float) -> None:
        """Make it POWER_LOST where several joints dropped out together as they then do."""
        recent = {
            fault.source
            for fault in self.faults
            if time - fault.time <= _AT_ONCE
            and isinstance(fault.cause, BioscaraError)
            and says_power_is_gone(fault.cause)
        }
        if len(recent) >= len(self._arm.axes) - 1 and self.faults[0].source in recent:
            self.faults[0] = replace(self.faults[0], kind=FaultKind.POWER_LOST)

    def _release(self, time: float) -> None:
        """Let go of the joints, whatever they say to it; this raises nothing."""
        with suppress(Exception):
            if self._arm.state is State.ACTIVE:
                self._manager.set_hardware_state(self._arm.name, State.INACTIVE, time)

    def _pace(self, share: float) -> None:
        """Let trajectories go on at a share of the speed that was chosen for them."""
        for controller in self._manager.controllers:
            if isinstance(controller, JointTrajectoryController):
                controller.slow_down(share)
