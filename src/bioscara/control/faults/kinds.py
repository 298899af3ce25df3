"""Kinds of arm faults, with the reaction to each and the action required of a person."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from bioscara.errors import (
    BioscaraError,
    BusStuckError,
    CommunicationError,
    ControllerError,
    FollowingError,
    HardwareError,
    HomingError,
    JointError,
    JointFaultError,
    JointLostError,
    JointResetError,
    NoAcknowledgeError,
    NotEnabledError,
    OverrunError,
    RefusedError,
    StalledError,
)
from bioscara.printing import brief
from bioscara.protocol import Fault as JointFault, ResetCause


class Stop(Enum):
    """How the arm is brought to rest; the names in brackets are those of IEC 60204-1."""

    POWERLESS = "motor power was removed"
    """Power was removed by hardware (category 0): targets are dropped."""
    DISABLE = "ramp down, then release the motors"
    """Category 1."""
    HOLD = "ramp down and hold"
    """Category 2."""
    SLOW = "continue at half speed"
    """A warning: motion continues."""


class FaultKind(Enum):
    """Kind of a fault; the value is its stop and the action required of a person."""

    JOINT_LOST = (Stop.HOLD, "check the joint's power and wiring")
    BUS_STUCK = (Stop.HOLD, BusStuckError.REMEDY)
    BUS_FAILED = (Stop.HOLD, "check the bus adapter")
    JOINT_RESET = (Stop.HOLD, "check the joint's supply")
    STALL = (Stop.HOLD, "remove the obstacle")
    FOLLOWING_ERROR = (Stop.HOLD, "look for friction or load on the joint")
    SETPOINT_LOST = (Stop.HOLD, "find out why the host stopped sending setpoints")
    HOMING_FAILED = (Stop.HOLD, "clear the joint's path to its end stop")
    JOINT_FAULT = (Stop.HOLD, "remove the cause that the joint names")
    OVERTEMPERATURE = (Stop.DISABLE, "let the joint's motor driver cool down")
    POWER_LOST = (Stop.POWERLESS, "release the emergency stop or restore the supply")
    OVERRUN = (Stop.HOLD, "free the computer of other work, or lower the rate")
    LATE = (Stop.SLOW, "free the computer of other work, or lower the rate")
    CONTROLLER_FAILED = (Stop.HOLD, "read the cause; it is a defect of the controller")
    LOOP_FAILED = (Stop.DISABLE, "read the cause; it is a defect of this software")
    HARDWARE_FAILED = (Stop.DISABLE, "remove the cause, then configure the hardware again")

    @property
    def stop(self) -> Stop:
        """How the arm is brought to rest."""
        return self.value[0]

    @property
    def action(self) -> str:
        """Action required of a person before the fault can be recovered from."""
        return self.value[1]


@dataclass(frozen=True, slots=True)
class ArmFault:
    """One fault.

    Attributes:
        kind: Its kind.
        source: Name of the joint, component or controller.
        cause: The exception behind it.
        time: When it was detected [s].
        evidence: File with the flight record of the time before it; None until it is written.
    """

    kind: FaultKind
    source: str
    cause: BaseException
    time: float
    evidence: Path | None = None

    def __str__(self) -> str:
        cause = self.cause
        what: object = cause
        if self.kind is FaultKind.POWER_LOST and isinstance(cause, JointLostError):
            what = f"the joints do not acknowledge any more, {cause.joint} first"
        elif isinstance(cause, JointError | BusStuckError):
            what = cause.what
        elif isinstance(cause, BioscaraError):
            what = brief(cause.message)  # without the file, which is an attribute of the fault
        return f"{self.kind.name}: {what}; {self.action}"

    def __repr__(self) -> str:
        evidence = "" if self.evidence is None else f" (evidence: {self.evidence})"
        return f"<ArmFault at {self.time:.2f} s: {self}{evidence}>"

    @property
    def action(self) -> str:
        """Action required of a person.

        One joint alone may be without supply, and a joint restarts for several reasons.
        """
        if isinstance(self.cause, JointResetError):
            return _RESET_ACTIONS.get(self.cause.reset_cause, self.kind.action)
        missing = isinstance(self.cause, BioscaraError) and reports_missing_supply(self.cause)
        return FaultKind.POWER_LOST.action if missing else self.kind.action

    def error(self) -> BaseException:
        """Return the cause for the user of the arm, with the remedy for the fault as a whole."""
        if isinstance(self.cause, JointError | BusStuckError):
            self.cause.remedy = self.action
        if self.evidence is not None:
            if isinstance(self.cause, BioscaraError):
                self.cause.evidence = str(self.evidence)
            elif not hasattr(self.cause, "__notes__"):
                self.cause.add_note(f"evidence: {self.evidence}")
        return self.cause


_RESET_ACTIONS = {
    ResetCause.PIN.name: "check the joint's supply and its reset button",
    ResetCause.SOFTWARE.name: "report the exception of its firmware, with the evidence",
    ResetCause.WATCHDOG.name: "report that its firmware hung, with the evidence",
}
"""Actions after a restart of a joint of which its supply may not be the reason, by reset cause."""
_JOINT_FAULTS = {
    JointFault.FOLLOWING.name: FaultKind.FOLLOWING_ERROR,
    JointFault.SETPOINT_LOST.name: FaultKind.SETPOINT_LOST,
    JointFault.OVERTEMPERATURE.name: FaultKind.OVERTEMPERATURE,
}
_POWER = frozenset({JointFault.DRIVER.name, JointFault.DRIVER_RESET.name})
_UNDERVOLTAGE = 4.0
"""Data of a joint's fault DRIVER when its motor alone has no supply: the bit in GSTAT, alone."""
_NO_FAULT_OF_HOMING = frozenset({JointFault.ENCODER.name, JointFault.INTERNAL.name}) | _POWER
"""Faults of a joint that end homing and have nothing to do with its path."""

_KINDS: tuple[tuple[type[BaseException], FaultKind], ...] = (
    (FollowingError, FaultKind.FOLLOWING_ERROR),
    (OverrunError, FaultKind.OVERRUN),
    (HomingError, FaultKind.HOMING_FAILED),
    (JointLostError, FaultKind.JOINT_LOST),
    (JointResetError, FaultKind.JOINT_RESET),
    (StalledError, FaultKind.STALL),
    (BusStuckError, FaultKind.BUS_STUCK),
    (RefusedError, FaultKind.JOINT_FAULT),
    (CommunicationError, FaultKind.BUS_FAILED),
    (JointError, FaultKind.JOINT_FAULT),
    (ControllerError, FaultKind.CONTROLLER_FAILED),
    (HardwareError, FaultKind.HARDWARE_FAILED),
)


def classify(cause: BaseException) -> FaultKind:
    """Return the kind of fault that an exception stands for."""
    if isinstance(cause, JointFaultError) and cause.fault in _JOINT_FAULTS:
        return _JOINT_FAULTS[cause.fault]
    if isinstance(cause, HomingError):
        # Nothing blocks the joint where the host was late, or where its driver has a fault.
        if cause.fault == JointFault.SETPOINT_LOST.name:
            return FaultKind.SETPOINT_LOST
        if cause.fault == JointFault.OVERTEMPERATURE.name:
            return FaultKind.OVERTEMPERATURE
        if cause.fault in _NO_FAULT_OF_HOMING:
            return FaultKind.JOINT_FAULT
    for error, kind in _KINDS:
        if isinstance(cause, error):
            return kind
    return FaultKind.CONTROLLER_FAILED


def source_of(cause: BaseException, fallback: str) -> str:
    """Return the joint that an exception is about, or ``fallback``."""
    return getattr(cause, "joint", "") or fallback


def reports_missing_supply(cause: BioscaraError) -> bool:
    """Return whether a joint reports that its motor has no supply."""
    return (
        isinstance(cause, JointFaultError)
        and cause.fault == JointFault.DRIVER.name
        and cause.data == _UNDERVOLTAGE
    )


def indicates_power_loss(cause: BioscaraError) -> bool:
    """Return whether a joint fails like this, or stays silent, when its power is lost."""
    if isinstance(cause, JointFaultError | HomingError):
        return cause.fault in _POWER
    if isinstance(cause, JointLostError):
        # Without its supply the whole joint is off, and nothing acknowledges. Exchanges that do not
        # end, or arrive corrupted, show that something is wrong with the bus.
        return isinstance(cause.reason, NoAcknowledgeError)
    # A version 1 joint latches no fault: it only reports that it is no longer enabled.
    return isinstance(cause, NotEnabledError)
