"""Wait for a motion that the joint performs by itself, and keep it alive meanwhile."""

from __future__ import annotations

from collections.abc import Callable

from bioscara.arguments import function
from bioscara.drivers.connection import JointConnection
from bioscara.drivers.sample import JointSample
from bioscara.drivers.session import WATCHDOG_MS
from bioscara.errors import IncorrectStateError, MotionCancelledError
from bioscara.protocol import Flags, JointState, Register

Progress = Callable[[JointSample], None]
"""Called with each sample while a motion runs."""
Cancel = Callable[[], bool]
"""Asked at each sample; True ends the motion."""

REST = frozenset((JointState.DISABLED, JointState.HOLDING, JointState.FAULTED))
"""What a joint is doing when it does not move."""
REST_RPM = 1.0
"""Motor speed below which a version 1 joint counts as standing [rpm]; its filter lags 63 ms."""

_INTERVAL = {1: 0.05, 2: 0.02}
"""Time between two signs of life [s]: a third of what the joint allows in version 2 (60 ms), a
fifth in version 1 (250 ms), where existing firmware also needs 10 ms to take a command."""
_REST_MARGIN = 1.0
"""Time that a joint may take to rest beyond that of its ramp [s]."""


def check_callbacks(progress: Progress | None, cancel: Cancel | None) -> None:
    """Raise unless both can be called or are None.

    Raises:
        InvalidArgumentError: One cannot.
    """
    for what, callback in (("progress", progress), ("cancel", cancel)):
        if callback is not None:
            function(what, callback)


def wait_for(
    joint: JointConnection,
    done: Callable[[JointSample], bool],
    timeout: float,
    what: str,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> JointSample:
    """Wait until ``done`` and return the last sample.

    Raises:
        IncorrectStateError: ``timeout`` [s] passed; the joint is not stopped.
        MotionCancelledError: ``cancel`` said so; the joint is not stopped.
        CommunicationError: The joint stopped answering; a version 2 joint then stops by itself.
    """
    interval = _INTERVAL[joint.version]
    due = joint.clock.now()
    deadline = due + timeout
    while True:
        due += interval
        joint.clock.sleep_until(due)
        if joint.version == 2:
            joint.session.write(Register.WATCHDOG, WATCHDOG_MS)
        sample = joint.read_state()
        if progress is not None:
            progress(sample)
        if done(sample):
            return sample
        if cancel is not None and cancel():
            raise MotionCancelledError(f"{joint.name}: {what} was cancelled")
        if joint.clock.now() >= deadline:
            raise IncorrectStateError(
                f"{joint.name}: {what} did not end within {timeout:.3g} s", joint.name
            )


def wait_for_rest(joint: JointConnection, what: str) -> JointSample:
    """Wait until a joint that is ramping down stands still; raises as :func:`wait_for`."""
    parameters = joint.parameters
    timeout = parameters.max_velocity / parameters.max_acceleration + _REST_MARGIN
    return wait_for(joint, at_rest(joint), timeout, f"ramping down after {what}")


def idle(sample: JointSample) -> bool:
    """Return whether no blocking command is running."""
    return not sample.flags & Flags.BUSY


def at_rest(joint: JointConnection) -> Callable[[JointSample], bool]:
    """Return the judge of standstill: the joint's word, or two slow samples in version 1."""
    slow = abs(joint.transmission.velocity_from_rpm(REST_RPM))
    count = 0

    def resting(sample: JointSample) -> bool:
        nonlocal count
        if joint.version == 2:
            return sample.state in REST
        count = count + 1 if abs(sample.velocity) < slow else 0
        return count >= 2

    return resting
