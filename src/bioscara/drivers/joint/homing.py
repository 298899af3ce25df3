"""Homing of a joint: approach to an end stop, which defines the zero of its position."""

from __future__ import annotations

from typing import NamedTuple

from bioscara.arguments import number, whole
from bioscara.drivers.joint.feedback import EncoderFeedback
from bioscara.drivers.joint.limits import SetpointLimits, check_limit
from bioscara.drivers.joint.rest import Rest
from bioscara.drivers.joint.settings import Settings
from bioscara.drivers.link.session import Session
from bioscara.errors import HomingSpeedError, InvalidArgumentError
from bioscara.model import JointParameters
from bioscara.protocol import Capability, Register

HOMING_RPM = (1.0, 250.0)
"""Motor speeds between which homing is allowed, as in the original driver [rpm]."""

SENSITIVITY = (1, 255)
"""Position errors that can count as a touch [microsteps of the motor]."""
CURRENT = (1, 100)
"""Drive currents for homing [% of the driver's full scale]."""
_TRAVEL_SHARE = 1.2
"""Distance covered at the homing speed, as a share of the joint's range."""
_MARGIN = 10.0
"""Time for backing off, the second touch and the remaining steps [s]."""


class Approach(NamedTuple):
    """How a joint seeks its end stop.

    Attributes:
        velocity: Least speed [rad/s or m/s]; its sign is the direction.
        sensitivity: Position error that counts as a touch [microsteps of the motor].
        current: Drive current [%].
    """

    velocity: float
    sensitivity: int
    current: int


def check_sensitivity(joint: str, sensitivity: int) -> int:
    """Return the position error that counts as a touch [microsteps of the motor].

    Raises:
        LimitError, InvalidArgumentError: It is outside :data:`SENSITIVITY`, or not whole.
    """
    return _checked(f"{joint} homing sensitivity", sensitivity, SENSITIVITY, "microsteps")


def check_current(joint: str, current: int) -> int:
    """Return the drive current for homing [%].

    Raises:
        LimitError, InvalidArgumentError: It is outside :data:`CURRENT`, or not whole.
    """
    return _checked(f"{joint} homing current", current, CURRENT, "%")


def _checked(what: str, value: int, limits: tuple[int, int], unit: str) -> int:
    value = whole(what, value)
    check_limit(what, value, *limits, unit)
    return value


class HomingProcedure:
    """The steps of one homing, in the order of the methods."""

    __slots__ = (
        "_approach", "_feedback", "_limits", "_parameters", "_rest", "_session", "_settings",
    )  # fmt: skip

    def __init__(
        self,
        session: Session,
        feedback: EncoderFeedback,
        rest: Rest,
        settings: Settings,
        limits: SetpointLimits,
        parameters: JointParameters,
    ) -> None:
        self._session, self._feedback = session, feedback
        self._rest, self._settings, self._limits = rest, settings, limits
        self._parameters = parameters
        homing = parameters.homing
        self._approach = Approach(homing.velocity, homing.threshold, homing.current_percent)

    @property
    def timeout(self) -> float:
        """Time limit of the homing that was started last [s]."""
        span = self._parameters.upper - self._parameters.lower
        return _TRAVEL_SHARE * span / abs(self._approach.velocity) + _MARGIN

    def check(
        self, velocity: float | None, sensitivity: int | None, current: int | None
    ) -> Approach:
        """Return the approach; nothing is sent.

        Args:
            velocity: Requested velocity [rad/s or m/s]; None for the configured one.
            sensitivity: Likewise [microsteps of the motor].
            current: Likewise [%].

        Raises:
            HomingSpeedError: The motor's speed is outside :data:`HOMING_RPM`.
            LimitError, InvalidArgumentError: The velocity is zero, not finite or faster than the
                joint; another value is outside its limits or not whole; or original firmware does
                not accept the configured acceleration.
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
        name = self._parameters.name
        return Approach(
            chosen,
            check_sensitivity(name, homing.threshold if sensitivity is None else sensitivity),
            check_current(name, homing.current_percent if current is None else current),
        )

    def prepare(self, approach: Approach) -> None:
        """Erase the previous home and set the acceleration of the approach, of a joint at rest.

        Args:
            approach: Result of :meth:`check`.
        """
        self._feedback.erase_offset()
        if not self._firmware_sets_speed():
            self._rest.set_acceleration(self._parameters.homing.acceleration)
        self._approach = approach

    def start(self) -> None:
        """Send HOME."""
        velocity, sensitivity, current = self._approach
        rpm = self._feedback.transmission.velocity_to_rpm(velocity)
        self._session.write(
            Register.HOME,
            int(rpm > 0.0),
            int(abs(rpm)),
            sensitivity,
            current,
            # Original firmware would home a second time after it has homed.
            repeat=False,
        )

    def restore_acceleration(self) -> None:
        """Set the configured acceleration again; at that of the approach a stop takes seconds."""
        if not self._firmware_sets_speed():
            self._rest.set_acceleration(self._parameters.max_acceleration)

    def complete(self) -> None:
        """Make the end stop that was touched the joint's home, and restore its acceleration."""
        upwards = self._approach.velocity > 0.0
        self._feedback.store_offset(self._parameters.upper if upwards else self._parameters.lower)
        self._rest.set_acceleration(self._parameters.max_acceleration)

    def _firmware_sets_speed(self) -> bool:
        """Return whether the firmware chooses the approach speed, and thereby the acceleration."""
        hello = self._session.hello
        return hello is not None and bool(hello.capabilities & Capability.TWO_TOUCH_HOMING)
