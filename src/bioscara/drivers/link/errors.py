"""Conversion of failures in an exchange to exceptions."""

from __future__ import annotations

from typing import TypeGuard

from bioscara.drivers.link.joint_reports import FaultReport
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    IncorrectStateError,
    JointError,
    JointFaultError,
    NotEnabledError,
    RefusedError,
    StalledError,
)
from bioscara.protocol import Fault, Refusal, Register

_TRANSIENT = frozenset(
    reason.name
    for reason in (
        Refusal.LENGTH,
        Refusal.UNKNOWN_REGISTER,
        Refusal.CRC,
        Refusal.OLD_SEQUENCE,
        Refusal.TRAILER_REQUIRED,
        Refusal.DIRECTION,
        Refusal.QUEUE_FULL,
    )
)
"""Refusal reasons caused by a broken or untimely frame: retried, since nothing was executed."""

_STATE = frozenset(
    reason.name for reason in (Refusal.FAULT_LATCHED, Refusal.NOT_ENABLED, Refusal.STALLED)
)


MAY_MOVE = "may be moving; switch the arm's power off, then on"
"""What to do where a joint with original firmware may hold the bus."""


def fault_error(joint: str, report: FaultReport) -> JointError:
    """Return the latched fault of ``joint`` as an exception; a stall as a StalledError."""
    if report.fault == Fault.STALL.name:
        return _stalled(joint, joint, report)
    return JointFaultError(
        f"{joint}: stopped by its fault {report.fault} (data {report.data:g})",
        joint,
        report.fault,
        report.data,
        "remove the cause, then clear_fault() and enable()",
    )


def refused_error(
    joint: str, address: int, register: Register, report: FaultReport
) -> BioscaraError:
    """Return the exception for a refusal of ``register``, by the reason that the joint reported.

    A joint that is disabled because of a fault is reported with the fault, which is more specific.
    """
    reason, what = report.refusal, f"{joint}: {register.name} was refused"
    if reason == Refusal.STALLED.name or (reason in _STATE and report.fault == Fault.STALL.name):
        return _stalled(what, joint, report)
    if reason in _STATE and report.fault != Fault.NONE.name:
        return fault_error(joint, report)
    if reason == Refusal.NOT_ENABLED.name:
        return NotEnabledError(f"{what}: it is not enabled", joint, "enable() first")
    if reason == Refusal.BUSY.name:
        return IncorrectStateError(
            f"{what}: another command is running, or the motor still runs down after a fault",
            joint,
            "stop() it, or wait 0.3 s",
        )
    return RefusedError(f"{what}: {reason}", address, reason, joint)


def _stalled(what: str, joint: str, report: FaultReport) -> StalledError:
    return StalledError(
        f"{what}: the joint stalled (position error {report.data:g} microsteps, more than its "
        "stall_threshold allows)",
        joint,
        "remove the obstacle, then clear_stall()",
    )


def exchange_failed(outcome: object) -> TypeGuard[CommunicationError]:
    """Return whether this outcome is a failed exchange, for which a retry may succeed.

    A joint that refuses because of its state would refuse again.
    """
    if isinstance(outcome, RefusedError):
        return outcome.reason in _TRANSIENT
    return isinstance(outcome, CommunicationError)


def named_error(
    joint: str,
    address: int,
    register: Register,
    error: BioscaraError,
    tries: int,
    held: bool = False,
) -> BioscaraError:
    """Return a bus ``error`` with joint, address and register added; a joint's error unchanged.

    Args:
        joint: Name of the joint.
        address: Its address.
        register: The requested register.
        error: The error.
        tries: Number of tries.
        held: Whether a joint with original firmware may hold the bus.
    """
    if not isinstance(error, CommunicationError) or isinstance(error, RefusedError):
        return error
    text = (
        f"{joint} ({address:#04x}), {register.name}: {error} "
        f"({tries} {'tries' if tries > 1 else 'try, not repeated: it may have been executed'})"
    )
    return type(error)(f"{text}; it {MAY_MOVE}" if held else text, address)
