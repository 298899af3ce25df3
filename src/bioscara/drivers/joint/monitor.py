"""Waits for the end of an autonomous motion of a joint, and keeps it alive during the wait."""

from __future__ import annotations

import math
from collections.abc import Callable
from inspect import signature

from bioscara.arguments import function
from bioscara.clock import Clock, Waits
from bioscara.drivers.joint.feedback import EncoderFeedback
from bioscara.drivers.joint.sample import JointSample
from bioscara.drivers.joint.transmission import DEG_PER_MICROSTEP
from bioscara.drivers.link.session import Session
from bioscara.errors import IncorrectStateError, InvalidArgumentError, MotionCancelledError
from bioscara.model import JointParameters
from bioscara.protocol import WATCHDOG_MS, Flags, JointState, Register

Progress = Callable[[JointSample], None]
"""Called with each sample while a motion runs."""
Cancel = Callable[[], bool]
"""Called without arguments after each sample before the end; True ends the motion."""
Done = Callable[[JointSample], bool]
"""Called with each sample; True if the motion has ended."""

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
"""Time between two keep-alive frames [s]: a third of the joint's limit in version 2 (60 ms), a
fifth of what our firmware allows in version 1 (250 ms). Original firmware needs none."""


class MotionMonitor:
    """Polls one joint until its motion has ended."""

    __slots__ = ("_clock", "_feedback", "_parameters", "_session")

    def __init__(
        self,
        session: Session,
        feedback: EncoderFeedback,
        clock: Clock,
        parameters: JointParameters,
    ) -> None:
        self._session, self._feedback = session, feedback
        self._clock, self._parameters = clock, parameters

    def waits_for(
        self,
        done: Done,
        timeout: float,
        what: str,
        progress: Progress | None = None,
        cancel: Cancel | None = None,
    ) -> Waits:
        """Wait until ``done``, up to each wait; the joint is not stopped if that fails.

        Args:
            done: The test for the end of the motion.
            timeout: Longest duration [s].
            what: Name of the motion, for messages.
            progress: Called with each sample.
            cancel: Called without arguments after each sample with which it is not ``done``.

        Raises:
            IncorrectStateError: ``timeout`` passed.
            MotionCancelledError: ``cancel`` returned True.
            CommunicationError: The joint stopped answering; a version 2 joint then stops
                autonomously, one with its original firmware continues to its target or end stop.
        """
        name, clock, session = self._parameters.name, self._clock, self._session
        interval = _INTERVAL[session.version]
        due = clock.now()
        deadline = due + timeout
        while True:
            due += interval
            yield due
            if session.version == 2:
                session.write(Register.WATCHDOG, WATCHDOG_MS)
            sample = self._feedback.read()
            if progress is not None:
                progress(sample)
            if done(sample):
                return
            if cancel is not None and cancel():
                raise MotionCancelledError(f"{name}: {what} was cancelled")
            if clock.now() >= deadline:
                raise IncorrectStateError(
                    f"{name}: {what} did not end within {timeout:.3g} s", name
                )

    def at_rest(self) -> Done:
        """Return the test for standstill: its state; in version 1 three consistent samples."""
        session, feedback = self._session, self._feedback
        slow = abs(feedback.transmission.velocity_from_rpm(REST_RPM))
        count, before = 0, math.nan

        def resting(sample: JointSample) -> bool:
            nonlocal count, before
            if session.version == 2:
                # Busy without power: its field still turns.
                return sample.state in REST and not_busy(sample)
            moved, before = abs(feedback.encoder_deg - before), feedback.encoder_deg
            count = count + 1 if abs(sample.velocity) < slow and moved <= STILL_DEG else 0
            return count >= 2

        return resting

    def arrived(self, target_deg: float, duration: float) -> Done:
        """Return the test for the end of the move that was just sent.

        It is the joint's state, in version 1 its encoder. A stalled or disabled joint has ended
        its move too, wherever it is.

        Args:
            target_deg: Encoder angle of the target [deg].
            duration: Time that the move should take [s].
        """
        resting, earliest = self.at_rest(), self._clock.now() + _EARLIEST * duration

        def at_target(sample: JointSample) -> bool:
            still = resting(sample)
            if self._session.version == 2 or sample.flags & _FAILED:
                return still
            near = abs(self._feedback.encoder_deg - target_deg) <= ARRIVED_DEG
            return still and near and sample.stamp >= earliest

        return at_target


def not_busy(sample: JointSample) -> bool:
    """Return whether no blocking command is running."""
    return not sample.flags & Flags.BUSY


def check_callbacks(progress: Progress | None, cancel: Cancel | None) -> None:
    """Raise unless both can be called as they will be, or are None.

    Raises:
        InvalidArgumentError: One cannot.
    """
    for what, callback, given in (("progress", progress, ("the sample",)), ("cancel", cancel, ())):
        if callback is None:
            continue
        function(what, callback)
        try:
            signature(callback).bind(*given)
        except TypeError as error:
            raise InvalidArgumentError(
                f"{what} is called {f'with {given[0]}' if given else 'without arguments'}: {error}"
            ) from error
        except ValueError:
            continue  # Some functions written in C have no signature.
