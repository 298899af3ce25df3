"""Settings of a joint that do not move it, and checks of its setpoints."""

from __future__ import annotations

from bioscara.arguments import shown, whole
from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.drivers.joint.connection import JointConnection
from bioscara.drivers.joint.original import ACCELERATION_DEG
from bioscara.drivers.joint.sample import Setpoint
from bioscara.errors import IncorrectStateError, InvalidArgumentError, LimitError
from bioscara.model import JointParameters
from bioscara.protocol import BrakeMode, Flags, Register

ROUNDING = 1e-9
"""Relative tolerance of limits: less than the resolution of the wire."""


class JointSettings(JointConnection):
    """Currents, limits, stall detection and brake of one joint; checks of its setpoints.

    Attributes:
        outside: Whether the setpoints are returning from outside the limits.
        max_acceleration: The acceleration that was set last [rad/s^2 or m/s^2].
        max_velocity: The maximum velocity that was set last [rad/s or m/s].
    """

    def __init__(self, bus: Bus, clock: Clock, parameters: JointParameters) -> None:
        super().__init__(bus, clock, parameters)
        self._lower, self._upper = parameters.lower, parameters.upper
        self._fastest = parameters.max_velocity
        self.outside = False
        self.max_acceleration = parameters.max_acceleration
        self.max_velocity = parameters.max_velocity

    def set_drive_current(self, percent: int) -> None:
        """Set the motor current in motion.

        Args:
            percent: 0 to 100 of the driver's full scale; 0 disables the joint.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not whole.
        """
        self.session.write(Register.SETCURRENT, self._percent("drive current", percent))

    def set_hold_current(self, percent: int) -> None:
        """Set the motor current at standstill.

        Args:
            percent: 0 to 100 of the driver's full scale; 0 disables the joint.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not whole.
        """
        self.session.write(Register.SETHOLDCURRENT, self._percent("hold current", percent))

    def set_brake_mode(self, mode: BrakeMode) -> None:
        """Set the behaviour of the motor at standstill when its hold current is zero.

        Raises:
            InvalidArgumentError: There is no such mode.
        """
        if not isinstance(mode, int) or mode not in list(BrakeMode):
            raise InvalidArgumentError(
                f"{self.name} brake mode: {shown(mode)} is none of {', '.join(map(str, BrakeMode))}"
            )
        self.session.write(Register.SETBRAKEMODE, BrakeMode(mode))

    def set_max_acceleration(self, acceleration: float) -> None:
        """Set the acceleration and deceleration that the joint uses.

        Args:
            acceleration: Above zero and at most the configured one [rad/s^2 or m/s^2].

        Raises:
            LimitError, InvalidArgumentError: It is above, or not above zero, or original firmware
                would take another value instead.
        """
        acceleration = self.check_acceleration(acceleration)
        deg = self.transmission.size_to_deg(acceleration)
        self.session.write(Register.SETMAXACCELERATION, deg)
        self.max_acceleration = acceleration

    def set_max_velocity(self, velocity: float) -> None:
        """Set the maximum speed of the joint.

        A version 1 joint accepts it in position mode only, that is after ``enable``,
        ``set_position`` or ``move_steps``: in velocity mode, also after ``stop``, its original
        firmware would run away at this speed, and nothing would stop it.

        Args:
            velocity: Above zero and at most the configured one [rad/s or m/s].

        Raises:
            LimitError, InvalidArgumentError: It is above, or not above zero.
            IncorrectStateError: A version 1 joint that is not in position mode.
        """
        limit, unit = self.parameters.max_velocity, f"{self.parameters.unit}/s"
        velocity = self._above_zero("maximum velocity", velocity)
        self._check_limit("maximum velocity", velocity, 0.0, limit, unit)
        if self.version == 1:
            self._require_positioning()
        self.session.write(Register.SETMAXVELOCITY, self.transmission.size_to_deg(velocity))
        self.max_velocity = velocity

    def enable_stallguard(self, threshold: int | None = None) -> None:
        """Switch stall detection on; an earlier stall is cleared.

        Args:
            threshold: 1 to 255, lower is more sensitive; None for the configured one. A stall is
                a position error above 512 + 32 x threshold microsteps of the motor, with original
                firmware above 10 x threshold.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not whole.
        """
        value = self.parameters.stall_threshold
        if threshold is not None:
            value = whole(f"{self.name} stall threshold", threshold)
        # Original firmware would stall at once with a threshold of zero.
        self._check_limit("stall threshold", value, 1, 255, "")
        self.session.write(Register.ENABLESTALLGUARD, value)

    def disable_closed_loop(self) -> None:
        """Switch position correction off, which also disables the joint.

        Original firmware cannot switch it on again until its power is cycled.
        """
        self.session.write(Register.DISABLECLOSEDLOOP)

    def check_setpoint(self, position: float, velocity: float) -> Setpoint:
        """Return both as floats if they are within the limits; as the two methods below, but fast.

        While returning from outside, a position may be as far outside as the last one.

        Args:
            position: Of the joint [rad or m].
            velocity: Velocity at that position [rad/s or m/s].

        Raises:
            LimitError, InvalidArgumentError: One is outside, or not finite.
        """
        position = self._number("position", position)
        velocity = self._number("velocity", velocity)
        if not self._lower <= position <= self._upper:
            self.check_position(position)
        if not -self._fastest <= velocity <= self._fastest:
            self.check_velocity(velocity)
        return Setpoint(position, velocity)

    def start_from(self, position: float) -> None:
        """Start the setpoints at ``position``; from outside the limits they may only lead back.

        Args:
            position: Measured position of the joint, or its last setpoint [rad or m].
        """
        position = self._number("position", position)
        lower, upper = self.parameters.lower, self.parameters.upper
        self._lower, self._upper = min(lower, position), max(upper, position)
        self.outside = not lower <= position <= upper

    def check_position(self, position: float) -> float:
        """Return ``position`` [rad or m] as a float if it is within the limits.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not finite.
        """
        parameters, position = self.parameters, self._number("position", position)
        self._check_limit("position", position, parameters.lower, parameters.upper, parameters.unit)
        return position

    def check_velocity(self, velocity: float) -> float:
        """Return ``velocity`` [rad/s or m/s] as a float if it is within the limits.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not finite.
        """
        limit, velocity = self.parameters.max_velocity, self._number("velocity", velocity)
        self._check_limit("velocity", velocity, -limit, limit, f"{self.parameters.unit}/s")
        return velocity

    def check_acceleration(self, acceleration: float) -> float:
        """Return ``acceleration`` [rad/s^2 or m/s^2] as a float if the joint applies it unchanged.

        Raises:
            LimitError, InvalidArgumentError: As :meth:`set_max_acceleration`.
        """
        limit, unit = self.parameters.max_acceleration, f"{self.parameters.unit}/s^2"
        acceleration = self._above_zero("acceleration", acceleration)
        self._check_limit("acceleration", acceleration, 0.0, limit, unit)
        if self.version == 1:
            lower, upper = map(self.transmission.size_from_deg, ACCELERATION_DEG)
            if not lower <= acceleration <= upper:
                raise LimitError(
                    f"{self.name} acceleration with its original firmware",
                    acceleration,
                    lower,
                    upper,
                    unit,
                    "it would take another value instead: change it in the parameters",
                )
        return acceleration

    def _require_positioning(self) -> None:
        """Raise unless a version 1 joint is in position mode, and stays there for 50 ms.

        Its deadman, which leads to velocity mode, also disables it, and counts from the last
        request.
        """
        session = self.session
        if session.caution.positioning:
            session.read(Register.PING)
        if not session.caution.positioning or session.flags & Flags.NOTENABLED:
            raise IncorrectStateError(
                f"{self.name}: a maximum velocity would start a motion: it is not in position mode",
                self.name,
                "enable(), or set_position() where it stands, first",
            )

    def _percent(self, what: str, value: int) -> int:
        percent = whole(f"{self.name} {what}", value)
        self._check_limit(what, percent, 0, 100, "%")
        return percent

    def _check_limit(
        self, what: str, value: float, lower: float, upper: float, unit: str, remedy: str = ""
    ) -> None:
        if not lower - ROUNDING <= value <= upper + ROUNDING:
            raise LimitError(f"{self.name} {what}", value, lower, upper, unit, remedy)

    def _above_zero(self, what: str, value: float) -> float:
        value = self._number(what, value)
        if value <= 0.0:
            raise InvalidArgumentError(f"{self.name} {what}: {value:g} must be above zero")
        return value
