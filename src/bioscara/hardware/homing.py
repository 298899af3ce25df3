"""Homing of one joint, cycle by cycle."""

from __future__ import annotations

import math
from contextlib import suppress

from bioscara.clock import Clock, Waits
from bioscara.drivers import Joint
from bioscara.errors import BioscaraError, HomingError, InvalidArgumentError
from bioscara.protocol import Flags


class Homing:
    """Homing of one joint: started by a command, supervised by the cycle, ended by either.

    Attributes:
        running: Whether the joint is, or may be, seeking its end stop: homing was sent and its end
            was not reported.
        sensitivity: Position error that counts as a touch from the next start on [microsteps of the
            motor]; None for the configured one.
        current: Drive current, likewise [%]; None for the configured one.
    """

    __slots__ = (
        "_clock", "_deadline", "_due", "_joint", "_start", "current", "running", "sensitivity",
    )  # fmt: skip

    def __init__(self, joint: Joint, clock: Clock) -> None:
        self._joint, self._clock = joint, clock
        self._start: Waits | None = None
        self._due, self._deadline = -math.inf, math.inf
        self.running = False
        self.sensitivity: int | None = None
        self.current: int | None = None

    def start(self, direction: float) -> None:
        """Begin to seek the end stop; the joint is enabled, and brought to rest, first.

        The cycle does not wait for that: :meth:`watch` continues it.

        Args:
            direction: Its sign is the direction; the speed is the configured one.

        Raises:
            InvalidArgumentError: Its sign defines no direction.
            BioscaraError: As :meth:`bioscara.drivers.Joint.start_homing`.
        """
        if not math.isfinite(direction):
            raise InvalidArgumentError(
                f"{self._joint.name}: home command {direction} is not a finite number"
            )
        # If only the answer is lost, the joint moves.
        self.running = True
        self._due = -math.inf
        self._start = self._joint.starting_homing(
            math.copysign(self._joint.parameters.homing.velocity, direction),
            sensitivity=self.sensitivity,
            current=self.current,
        )
        self._continue()

    def watch(self) -> bool:
        """Keep it alive; return whether it is still running.

        Raises:
            HomingError: It ended without a trustworthy home.
            CommunicationError: The joint does not answer.
        """
        if self._joint.session.paused:
            # A version 1 joint has not taken the command yet. The cycle does not wait for it.
            return True
        if self._start is not None:
            self._continue()
            return True
        if self._joint.keep_alive() & Flags.BUSY:
            if self._clock.now() < self._deadline:
                return True
            self.stop()
            text = (
                f"{self._joint.name}: homing did not end in time and was stopped; check that "
                "the joint moves freely and reaches its end stop"
            )
            if self._joint.version == 1:
                # Possible if its controller is fed from elsewhere. With the supply back, it would
                # take its place for the end stop.
                text += (
                    ". If the motors had no supply, switch all joints off and on, and home them "
                    "again"
                )
            raise HomingError(text, self._joint.name)
        self.running = False
        self._joint.post_homing()
        return False

    def _continue(self) -> None:
        """Continue the start where its wait is over."""
        if self._start is None or self._clock.now() < self._due:
            return
        start, self._start = self._start, None
        due = next(start, None)
        if due is None:
            self._deadline = self._clock.now() + self._joint.homing_timeout
        else:
            self._start, self._due = start, due

    def stop_lost(self) -> None:
        """Try to end it on a joint that was lost during homing; the cycle does not wait for it.

        One with its original firmware continues to its end stop, whether it is polled or not.
        """
        with suppress(BioscaraError):
            if self._joint.session.listens():
                self.stop()

    def stop(self) -> None:
        """End it; the joint ramps down and is not homed.

        Raises:
            CommunicationError: The joint did not receive it and may still be moving.
        """
        self._interrupt_start()
        self._joint.stop()
        self.running = False

    def abandon(self) -> None:
        """Forget it: the joint was stopped, or is not supervised any more."""
        self._interrupt_start()
        self.running = False

    def _interrupt_start(self) -> None:
        start, self._start = self._start, None
        if start is not None:
            # If it was enabling the joint, it stops it.
            start.close()
