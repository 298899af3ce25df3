"""Rest of a joint, which some commands need: HOME, SETUP, CHECKORIENTATION, a changed acceleration.

They act on the ramp of the joint. A low acceleration that is set while it runs makes it run on for
minutes, and no later command ends that; SETUP makes an original joint return to where it received
it. With our firmware a lower acceleration moves the place where a joint comes to rest.
"""

from __future__ import annotations

import math

from bioscara.clock import Clock, Waits
from bioscara.drivers.joint.feedback import EncoderFeedback
from bioscara.drivers.joint.monitor import Done, MotionMonitor
from bioscara.drivers.joint.readiness import Readiness
from bioscara.drivers.joint.sample import JointSample
from bioscara.drivers.joint.transmission import Transmission
from bioscara.drivers.link.session import TICK_PAUSE, Session
from bioscara.errors import IncorrectStateError
from bioscara.model import JointParameters
from bioscara.protocol import Flags, JointState, Register

STOP_HARD, STOP_SOFT = 0, 1
"""Modes of STOP."""
_MARGIN = 1.0
"""Time beyond its ramp that a joint may take to come to rest [s]."""


class Rest:
    """Brings one joint to rest, and sets the acceleration with which it does so.

    Attributes:
        acceleration: The acceleration that was set last [rad/s^2 or m/s^2].
    """

    __slots__ = (
        "_clock", "_feedback", "_monitor", "_parameters", "_readiness", "_session",
        "_transmission", "_written", "acceleration",
    )  # fmt: skip

    def __init__(
        self,
        session: Session,
        feedback: EncoderFeedback,
        readiness: Readiness,
        monitor: MotionMonitor,
        clock: Clock,
        parameters: JointParameters,
    ) -> None:
        self._session, self._feedback, self._monitor = session, feedback, monitor
        self._readiness, self._clock, self._parameters = readiness, clock, parameters
        self._transmission = Transmission(parameters.reduction)
        self.acceleration = parameters.max_acceleration
        self._written = False

    def begin(self) -> None:
        """Set the configured acceleration in a joint that was just identified and is enabled.

        An earlier host may have set another one.
        """
        self.acceleration, self._written = self._parameters.max_acceleration, False
        if not self._session.flags & Flags.NOTENABLED:
            self.set_acceleration(self.acceleration)

    def set_acceleration(self, acceleration: float) -> None:
        """Set an acceleration that was checked [rad/s^2 or m/s^2]; a lower one only at rest."""
        deg = self._transmission.size_to_deg(acceleration)
        self._session.write(Register.SETMAXACCELERATION, deg)
        self.acceleration, self._written = acceleration, True

    def coming(self, before: str) -> Waits:
        """Bring the joint to rest, unless it is; runs up to each wait.

        One that moves is stopped with the configured acceleration, so that this takes no longer
        than its ramp from full speed and 1 s; an acceleration that was set is set again afterwards.

        Args:
            before: What needs the rest, for messages.

        Raises:
            IncorrectStateError: A blocking command is running, or it did not come to rest in that
                time.
        """
        self._readiness.require_no_command()
        timing = self._session.timing
        if self._session.version == 1:
            # It may have been disabled since its last answer, as by a restart.
            self._session.read(Register.PING)
            rests = self._written and self._ramp_ended()
            stopping = timing.stopped_at < math.inf
        else:
            # Its state follows the last command in the next tick.
            yield self._clock.now() + TICK_PAUSE
            sample = self._feedback.read()
            rests, stopping = self._monitor.at_rest()(sample), sample.state is JointState.STOPPING
        if rests:
            return
        own, highest = self.acceleration, self._parameters.max_acceleration
        if own != highest or not self._written:
            self.set_acceleration(highest)
            stopping, timing.stopped_at = False, math.inf
        if not stopping:
            self._session.stop(STOP_SOFT)
        what = f"coming to rest before {before}"
        try:
            yield from self._monitor.waits_for(self._at_rest(), self._ramp + _MARGIN, what)
        except IncorrectStateError as error:
            error.remedy = "keep away what turns it, then repeat the call"
            raise
        timing.stopped_at = -math.inf
        if own != highest:
            self.set_acceleration(own)

    @property
    def _ramp(self) -> float:
        """Longest duration of a ramp to rest [s]."""
        return self._parameters.max_velocity / self.acceleration

    def _ramp_ended(self) -> bool:
        """Return whether the ramp of a version 1 joint has ended for certain."""
        timing = self._session.timing
        # A homing that was stopped in its first half second moves once more.
        return self._clock.now() >= max(timing.stopped_at + self._ramp, timing.deferred_from)

    def _at_rest(self) -> Done:
        """Return the test for rest; in version 1 the ramp's end and a standstill of the encoder."""
        still = self._monitor.at_rest()

        def resting(sample: JointSample) -> bool:
            return still(sample) and (self._session.version == 2 or self._ramp_ended())

        return resting
