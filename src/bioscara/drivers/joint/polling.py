"""Wait for an autonomous motion of a joint, and keep it alive during the wait."""

from __future__ import annotations

import math
from collections.abc import Callable

from bioscara.arguments import function
from bioscara.drivers.joint.sample import JointSample
from bioscara.drivers.joint.settings import JointSettings
from bioscara.drivers.joint.transmission import DEG_PER_MICROSTEP
from bioscara.errors import IncorrectStateError, MotionCancelledError
from bioscara.protocol import WATCHDOG_MS, Flags, JointState, Register

Progress = Callable[[JointSample], None]
"""Called with each sample while a motion runs."""
Cancel = Callable[[], bool]
"""Called at each sample; True ends the motion."""

REST = frozenset((JointState.DISABLED, JointState.HOLDING, JointState.FAULTED))
"""States of a joint at rest."""
REST_RPM = 1.0
"""Motor speed below which a version 1 joint may be at rest [rpm]; its filter lags 63 ms."""
STILL_DEG = 0.1
"""Motor angle by which the encoder of a version 1 joint at rest may differ from sample to
sample [deg]: the speed alone is also low at the start of a slow motion."""
ARRIVED_DEG = 64 * DEG_PER_MICROSTEP
"""Motor angle within which a version 1 joint is at its target [deg]: it corrects its own count of
steps where that differs from the encoder by more than 15 microsteps, at both ends of a move."""
_EARLIEST = 0.95
"""Share of a ramp's time before which a move does not count as ended; ramps are right to 3 %."""
_FAILED = int(Flags.STALL | Flags.NOTENABLED)

_INTERVAL = {1: 0.05, 2: 0.02}
"""Time between two keep-alive frames [s]: a third of what the joint allows in version 2 (60 ms), a
fifth of what our firmware allows in version 1 (250 ms). Original firmware needs none."""
_REST_MARGIN = 1.0
"""Time beyond its ramp that a joint may take to come to rest [s]."""


def check_callbacks(progress: Progress | None, cancel: Cancel | None) -> None:
    """Raise unless both can be called or are None.

    Raises:
        InvalidArgumentError: One cannot.
    """
    for what, callback in (("progress", progress), ("cancel", cancel)):
        if callback is not None:
            function(what, callback)


def wait_for(
    joint: JointSettings,
    done: Callable[[JointSample], bool],
    timeout: float,
    what: str,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> JointSample:
    """Wait until ``done`` and return the last sample.

    Raises:
        IncorrectStateError: ``timeout`` [s] passed; the joint is not stopped.
        MotionCancelledError: ``cancel`` returned True; the joint is not stopped.
        CommunicationError: The joint stopped answering; a version 2 joint then stops autonomously,
            one with its original firmware continues to its target or end stop.
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


def wait_for_rest(joint: JointSettings, what: str) -> JointSample:
    """Wait until a joint that is ramping down is at rest; raises as :func:`wait_for`."""
    timeout = joint.parameters.max_velocity / joint.max_acceleration + _REST_MARGIN
    return wait_for(joint, at_rest(joint), timeout, f"ramping down after {what}")


def idle(sample: JointSample) -> bool:
    """Return whether no blocking command is running."""
    return not sample.flags & Flags.BUSY


def at_rest(joint: JointSettings) -> Callable[[JointSample], bool]:
    """Return the test for standstill: the joint's state; in version 1 three consistent samples."""
    slow = abs(joint.transmission.velocity_from_rpm(REST_RPM))
    count, before = 0, math.nan

    def resting(sample: JointSample) -> bool:
        nonlocal count, before
        if joint.version == 2:
            return sample.state in REST
        moved, before = abs(joint.encoder_deg - before), joint.encoder_deg
        count = count + 1 if abs(sample.velocity) < slow and moved <= STILL_DEG else 0
        return count >= 2

    return resting


def arrived(
    joint: JointSettings, target_deg: float, duration: float
) -> Callable[[JointSample], bool]:
    """Return the test for the end of a move: the joint's state; in version 1 its encoder.

    A stalled or disabled joint has ended its move too, wherever it is.

    Args:
        joint: The joint, to which a move was just sent.
        target_deg: Encoder angle of the target [deg].
        duration: Time that the move should take [s].
    """
    resting, earliest = at_rest(joint), joint.clock.now() + _EARLIEST * duration

    def there(sample: JointSample) -> bool:
        still = resting(sample)
        if joint.version == 2 or sample.flags & _FAILED:
            return still
        near = abs(joint.encoder_deg - target_deg) <= ARRIVED_DEG
        return still and near and sample.stamp >= earliest

    return there
