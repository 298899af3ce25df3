"""One joint, with all functions of the original driver, in SI joint units."""

from __future__ import annotations

from contextlib import suppress

from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.drivers.joint.cyclic import Cycle
from bioscara.drivers.joint.motion import JointMotion
from bioscara.drivers.joint.polling import Cancel, Progress, check_callbacks, idle
from bioscara.drivers.joint.sample import FLAGS, JointSample, Quality
from bioscara.errors import (
    BioscaraError,
    CommunicationError,
    HomingError,
    IncorrectStateError,
    JointError,
    JointFaultError,
    LimitError,
    StalledError,
)
from bioscara.model import JointParameters
from bioscara.protocol import WATCHDOG_MS, Capability, Flags, Register

HOMING_RPM = (1.0, 250.0)
"""Motor speeds between which homing is allowed, as in the original driver [rpm]."""

_TRAVEL_SHARE = 1.2
"""Distance covered at the homing speed, as a share of the joint's range."""
_HOMING_MARGIN = 10.0
"""Time for backing off, the second touch and the remaining steps [s]."""


class Joint(JointMotion):
    """One joint on a bus, in rad or m and seconds; supports protocol versions 1 and 2.

    Life cycle of a joint: ``init``, ``enable``, ``home``, motion, ``disable``, ``deinit``. Nothing
    moves in ``init`` and ``deinit``. What a version 1 joint cannot do raises
    :class:`~bioscara.errors.NotSupportedError`; every exchange may raise
    :class:`~bioscara.errors.CommunicationError` or :class:`~bioscara.errors.JointResetError`.

    Args:
        bus: Bus of the joint.
        clock: Time of that bus.
        parameters: Parameters of the joint.

    Attributes:
        cycle: The joint's part of a control cycle, for :mod:`bioscara.drivers.joint.group`.
    """

    def __init__(self, bus: Bus, clock: Clock, parameters: JointParameters) -> None:
        super().__init__(bus, clock, parameters)
        self.cycle = Cycle(self)
        self._homing_velocity = parameters.homing.velocity

    def track(self, position: float, velocity: float = 0.0) -> JointSample:
        """Send the setpoint for one interval from now and return the present state.

        Args:
            position: Within the joint's limits [rad or m].
            velocity: Velocity at that position, within the joint's limits [rad/s or m/s].

        Raises:
            LimitError: Outside the limits; nothing was sent.
            NotEnabledError, NotHomedError, StalledError, JointFaultError: The joint cannot move.
            NotSupportedError: A version 1 joint has no TRACK; use ``set_position``.
            CommunicationError: The exchange failed three times.
        """
        self.session.require_v2("track")
        self.require_ready()
        position, velocity = self.check_setpoint(position, velocity)
        transmission = self.transmission
        answer = self.session.write(
            Register.TRACK,
            transmission.position_to_deg(position),
            transmission.velocity_to_rpm(velocity),
        )
        self.last = JointSample(
            self.position_of(answer.values[0], answer.flags),
            transmission.velocity_from_rpm(answer.values[1]),
            FLAGS[answer.flags],
            None,
            None,
            Quality.FRESH,
            self.clock.now(),
        )
        return self.last

    def home(
        self,
        velocity: float | None = None,
        progress: Progress | None = None,
        cancel: Cancel | None = None,
    ) -> None:
        """Seek the end stop and make it the joint's home; return when it is homed.

        The joint is enabled first if need be, and stays enabled.

        Args:
            velocity: Least speed of the approach [rad/s or m/s]; its sign is the direction. None
                for the configured one. Our firmware approaches at 95 rpm of the motor (j2: 110)
                where that is faster.
            progress: Called with each sample.
            cancel: Called with each sample; True aborts homing, the joint is then not homed.

        Raises:
            HomingError: No trustworthy home was found; states the reason.
            MotionCancelledError: ``cancel`` returned True.
        """
        check_callbacks(progress, cancel)
        self.start_homing(velocity)
        try:
            self._supervise(idle, self.homing_timeout, "homing", progress, cancel)
        except (IncorrectStateError, JointFaultError, StalledError) as error:
            raise HomingError(f"{self.name}: homing failed: {error}", self.name) from error
        self.post_homing()

    @property
    def homing_timeout(self) -> float:
        """Time limit of the homing that was started last [s]."""
        span = self.parameters.upper - self.parameters.lower
        return _TRAVEL_SHARE * span / abs(self._homing_velocity) + _HOMING_MARGIN

    def start_homing(self, velocity: float | None = None) -> None:
        """Start homing and return; call :meth:`keep_alive` until it ends, then :meth:`post_homing`.

        Until then, a version 2 joint needs a write of WATCHDOG at least every 60 ms
        (``keep_alive``), our firmware in version 1 any exchange every 250 ms. Original firmware
        continues to the end stop whether it is polled or not; only :meth:`stop` ends that. It takes
        the command within 25 ms, during which nothing is sent to it.

        Args:
            velocity: As in :meth:`home`.

        Raises:
            LimitError: The motor speed is not between 1 and 250 rpm, or original firmware does not
                accept the configured homing acceleration.
            IncorrectStateError: A blocking command is running.
        """
        homing = self.parameters.homing
        self._require_no_blocking()
        chosen = homing.velocity if velocity is None else self.check_velocity(velocity)
        rpm = self.transmission.velocity_to_rpm(chosen)
        if not HOMING_RPM[0] < abs(rpm) < HOMING_RPM[1]:
            raise LimitError(f"{self.name} homing speed of the motor", abs(rpm), *HOMING_RPM, "rpm")
        if not self._homes_itself():
            self.check_acceleration(homing.acceleration)
        if self.session.flags & (Flags.NOTENABLED | Flags.STALL):
            self.enable()
        # Invalidates the offset of an earlier home: if this host dies before a new one is written,
        # the next host must not trust the old one.
        self._offset_known = False
        self.session.write(Register.HOMEOFFSET, 0.0)
        if not self._homes_itself():
            self.set_max_acceleration(homing.acceleration)
        self._homing_velocity = chosen
        self._blocking = Register.HOME
        try:
            self.session.write(
                Register.HOME,
                int(rpm > 0.0),
                int(abs(rpm)),
                homing.threshold,
                homing.current_percent,
                # Original firmware would home a second time after it has homed.
                repeat=False,
            )
        except BioscaraError:
            if self.version == 1:
                # If only the answer is lost it runs to the end stop, whether it is polled or not.
                with suppress(CommunicationError, JointError):
                    self.stop()
            self._blocking = Register.NONE
            raise

    def keep_alive(self) -> Flags:
        """Feed the watchdog of a joint in an autonomous motion; return its flags."""
        if self.version == 2:
            return FLAGS[self.session.write(Register.WATCHDOG, WATCHDOG_MS).flags]
        return self.get_flags()

    def stop(self, *, hard: bool = False) -> None:
        """Stop as every joint; first restores the higher deceleration if homing is in progress."""
        if self._blocking is Register.HOME and not self._homes_itself():
            # At the homing acceleration the ramp would take seconds. Must never prevent STOP.
            with suppress(CommunicationError, JointError):
                self.set_max_acceleration(self.parameters.max_acceleration)
        super().stop(hard=hard)

    def post_homing(self) -> None:
        """Complete a homing that has ended: set the joint's offset and restore its limits.

        Raises:
            HomingError: The joint is not homed; states the reason.
            IncorrectStateError: No homing was started, or it is still running.
        """
        if self._blocking is not Register.HOME:
            raise IncorrectStateError(f"{self.name}: no homing was started", self.name)
        flags = self.get_flags()
        if flags & Flags.BUSY:
            raise IncorrectStateError(f"{self.name}: homing is still running", self.name)
        self._blocking = Register.NONE
        if flags & Flags.NOTHOMED:
            raise self._homing_error()
        upwards = self._homing_velocity > 0.0
        self.set_homing_offset(self.parameters.upper if upwards else self.parameters.lower)
        self.set_max_acceleration(self.parameters.max_acceleration)

    def _homes_itself(self) -> bool:
        """Return whether the firmware chooses the approach speed, and thereby the acceleration."""
        hello = self.hello
        return hello is not None and bool(hello.capabilities & Capability.TWO_TOUCH_HOMING)

    def _homing_error(self) -> HomingError:
        if self.version < 2:
            return HomingError(f"{self.name}: homing ended without a home", self.name)
        report = self.get_fault()
        return HomingError(
            f"{self.name}: homing ended without a home: {report.fault} (data {report.data:g})",
            self.name,
            report.fault,
            report.data,
            "remove the cause, then clear_fault() and home() again",
        )
