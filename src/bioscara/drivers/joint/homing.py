"""Homing of a joint: approach to an end stop, which defines the zero of its position."""

from __future__ import annotations

from bioscara.arguments import number
from bioscara.drivers.joint.feedback import EncoderFeedback
from bioscara.drivers.joint.limits import SetpointLimits
from bioscara.drivers.joint.settings import Settings
from bioscara.drivers.link.session import Session
from bioscara.errors import HomingSpeedError, InvalidArgumentError
from bioscara.model import JointParameters
from bioscara.protocol import Capability, Register

HOMING_RPM = (1.0, 250.0)
"""Motor speeds between which homing is allowed, as in the original driver [rpm]."""

_TRAVEL_SHARE = 1.2
"""Distance covered at the homing speed, as a share of the joint's range."""
_MARGIN = 10.0
"""Time for backing off, the second touch and the remaining steps [s]."""


class HomingProcedure:
    """The steps of one homing, in the order of the methods.

    Args:
        session: Session with the joint.
        feedback: Its measured state.
        settings: Its settings.
        limits: Limits of its setpoints.
        parameters: Parameters of the joint.
    """

    __slots__ = ("_feedback", "_limits", "_parameters", "_session", "_settings", "_velocity")

    def __init__(
        self,
        session: Session,
        feedback: EncoderFeedback,
        settings: Settings,
        limits: SetpointLimits,
        parameters: JointParameters,
    ) -> None:
        self._session, self._feedback = session, feedback
        self._settings, self._limits = settings, limits
        self._parameters = parameters
        self._velocity = parameters.homing.velocity

    @property
    def timeout(self) -> float:
        """Time limit of the homing that was started last [s]."""
        span = self._parameters.upper - self._parameters.lower
        return _TRAVEL_SHARE * span / abs(self._velocity) + _MARGIN

    def check(self, velocity: float | None) -> float:
        """Return the velocity of the approach [rad/s or m/s]; nothing is sent.

        Args:
            velocity: The requested one; None for the configured one.

        Raises:
            HomingSpeedError: The motor's speed is outside :data:`HOMING_RPM`.
            LimitError, InvalidArgumentError: It is zero, not finite or faster than the joint, or
                original firmware does not accept the configured acceleration.
        """
        homing = self._parameters.homing
        what = f"{self._parameters.name} homing speed"
        chosen = homing.velocity if velocity is None else number(what, velocity)
        if not chosen:
            raise InvalidArgumentError(f"{what}: 0 has no direction; give a speed with its sign")
        rpm = abs(self._feedback.transmission.velocity_to_rpm(chosen))
        if not HOMING_RPM[0] < rpm < HOMING_RPM[1]:
            raise HomingSpeedError(f"{what} of the motor", rpm, *HOMING_RPM, "rpm")
        self._limits.check_velocity(chosen)
        if not self._firmware_sets_speed():
            self._settings.check_acceleration(homing.acceleration)
        return chosen

    def prepare(self, velocity: float) -> None:
        """Erase the previous home and set the acceleration of the approach.

        Args:
            velocity: Result of :meth:`check`.
        """
        self._feedback.erase_offset()
        if not self._firmware_sets_speed():
            self._settings.set_max_acceleration(self._parameters.homing.acceleration)
        self._velocity = velocity

    def start(self) -> None:
        """Send HOME."""
        homing, rpm = (
            self._parameters.homing,
            self._feedback.transmission.velocity_to_rpm(self._velocity),
        )
        self._session.write(
            Register.HOME,
            int(rpm > 0.0),
            int(abs(rpm)),
            homing.threshold,
            homing.current_percent,
            # Original firmware would home a second time after it has homed.
            repeat=False,
        )

    def restore_acceleration(self) -> None:
        """Set the configured acceleration again; at that of the approach a stop takes seconds."""
        if not self._firmware_sets_speed():
            self._settings.set_max_acceleration(self._parameters.max_acceleration)

    def complete(self) -> None:
        """Make the end stop that was touched the joint's home, and restore its acceleration."""
        upwards = self._velocity > 0.0
        self._feedback.store_offset(self._parameters.upper if upwards else self._parameters.lower)
        self._settings.set_max_acceleration(self._parameters.max_acceleration)

    def _firmware_sets_speed(self) -> bool:
        """Return whether the firmware chooses the approach speed, and thereby the acceleration."""
        hello = self._session.hello
        return hello is not None and bool(hello.capabilities & Capability.TWO_TOUCH_HOMING)
