"""Settings of a joint that do not move it: currents, limits, stall detection, brake."""

from __future__ import annotations

from bioscara.arguments import number, shown, whole
from bioscara.clock import Clock, wait_through
from bioscara.drivers.joint.limits import check_limit
from bioscara.drivers.joint.rest import Rest
from bioscara.drivers.joint.transmission import Transmission
from bioscara.drivers.link.original import ACCELERATION_DEG
from bioscara.drivers.link.session import Session
from bioscara.errors import IncorrectStateError, InvalidArgumentError, LimitError, StalledError
from bioscara.model import JointParameters
from bioscara.protocol import BrakeMode, Flags, Register


class Settings:
    """Currents, speed and acceleration limits, stall detection and brake of one joint.

    Attributes:
        max_velocity: The maximum velocity that was set last [rad/s or m/s].
        may_be_energised: Whether the motor was given a current, or found enabled, and was not
            observed to be disabled since; outlives the session.
    """

    def __init__(
        self, session: Session, rest: Rest, clock: Clock, parameters: JointParameters
    ) -> None:
        self._session, self._rest, self._clock = session, rest, clock
        self._parameters = parameters
        self._transmission = Transmission(parameters.reduction)
        self.max_velocity = parameters.max_velocity
        self.may_be_energised = False

    @property
    def max_acceleration(self) -> float:
        """The acceleration that was set last [rad/s^2 or m/s^2]."""
        return self._rest.acceleration

    def set_drive_current(self, percent: int) -> None:
        """Set the motor current in motion; our firmware engages no disabled joint with it.

        Args:
            percent: 0 to 100 of the driver's full scale; 0 disables the joint.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not whole.
        """
        self._set_current(Register.SETCURRENT, self._percent("drive current", percent))

    def set_hold_current(self, percent: int) -> None:
        """Set the motor current at standstill; our firmware engages no disabled joint with it.

        ``enable`` sends its own: ``enable(hold_percent=...)``.

        Args:
            percent: 0 to 100 of the driver's full scale; 0 disables the joint.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not whole.
        """
        self._set_current(Register.SETHOLDCURRENT, self._percent("hold current", percent))

    def set_brake_mode(self, mode: BrakeMode) -> None:
        """Set the behaviour of the motor at standstill when its hold current is zero.

        Raises:
            InvalidArgumentError: There is no such mode.
        """
        if not isinstance(mode, int) or mode not in list(BrakeMode):
            raise InvalidArgumentError(
                f"{self._parameters.name} brake mode: {shown(mode)} is none of "
                f"{', '.join(map(str, BrakeMode))}"
            )
        if mode == BrakeMode.HARD_BRAKE:
            self._energising()
        self._session.write(Register.SETBRAKEMODE, BrakeMode(mode))

    def set_max_acceleration(self, acceleration: float) -> None:
        """Set the acceleration and deceleration that the joint uses; it is brought to rest first.

        That takes up to its ramp from full speed and 1 s.

        Args:
            acceleration: Above zero and at most the configured one [rad/s^2 or m/s^2].

        Raises:
            LimitError, InvalidArgumentError: It is above, or not above zero, or original firmware
                would take another value instead.
            IncorrectStateError: The joint did not come to rest.
        """
        acceleration = self.check_acceleration(acceleration)
        positioned = self._session.timing.in_position_mode
        wait_through(self._clock, self._rest.coming("the acceleration is set"))
        self._rest.set_acceleration(acceleration)
        if positioned and not self._session.timing.in_position_mode:
            # It was stopped, which is velocity mode, and refuses a maximum velocity there.
            self._session.write(Register.MOVESTEPS, 0)

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
        parameters, what = self._parameters, f"{self._parameters.name} maximum velocity"
        velocity = _above_zero(what, velocity)
        check_limit(what, velocity, 0.0, parameters.max_velocity, f"{parameters.unit}/s")
        if self._session.version == 1:
            self._require_position_mode()
        self._session.write(Register.SETMAXVELOCITY, self._transmission.size_to_deg(velocity))
        self.max_velocity = velocity

    def enable_stallguard(self, threshold: int | None = None) -> None:
        """Switch stall detection on, or change its threshold, of a joint that did not stall.

        Args:
            threshold: 1 to 255, lower is more sensitive; None for the configured one. A stall is
                a position error above 512 + 32 x threshold microsteps of the motor, with original
                firmware above 10 x threshold.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not whole.
            StalledError: The joint stalled; ``clear_stall()`` of the joint ends that.
        """
        value = self._stall_threshold(threshold)
        # The register clears the flag, and with version 1 the stall itself.
        if self._session.read(Register.PING).flags & Flags.STALL:
            name = self._parameters.name
            remedy = "remove the obstacle, then clear_stall()"
            raise StalledError(f"{name}: the joint stalled", name, remedy)
        self._session.write(Register.ENABLESTALLGUARD, value)

    def restart_stallguard(self) -> None:
        """Switch stall detection on with the configured threshold, and clear the flag STALL.

        Raises:
            LimitError: The configured threshold is 0.
        """
        self._session.write(Register.ENABLESTALLGUARD, self._stall_threshold(None))

    def _stall_threshold(self, threshold: int | None) -> int:
        value, what = self._parameters.stall_threshold, f"{self._parameters.name} stall threshold"
        if threshold is not None:
            value = whole(what, threshold)
        # Original firmware would stall at once with a threshold of zero.
        check_limit(what, value, 1, 255, "")
        return value

    def disable_closed_loop(self) -> None:
        """Switch position correction off, which also disables the joint.

        Original firmware cannot switch it on again until its power is cycled.
        """
        self._session.write(Register.DISABLECLOSEDLOOP)

    def check_acceleration(self, acceleration: float) -> float:
        """Return ``acceleration`` [rad/s^2 or m/s^2] as a float if the joint applies it unchanged.

        Raises:
            LimitError, InvalidArgumentError: As :meth:`set_max_acceleration`.
        """
        parameters, what = self._parameters, f"{self._parameters.name} acceleration"
        limit, unit = parameters.max_acceleration, f"{parameters.unit}/s^2"
        acceleration = _above_zero(what, acceleration)
        check_limit(what, acceleration, 0.0, limit, unit)
        if self._session.version == 1:
            lower, upper = map(self._transmission.size_from_deg, ACCELERATION_DEG)
            if not lower <= acceleration <= upper:
                raise LimitError(
                    f"{what} with its original firmware",
                    acceleration,
                    lower,
                    upper,
                    unit,
                    "it would take another value instead: change it in the parameters",
                )
        return acceleration

    def _require_position_mode(self) -> None:
        """Raise unless a version 1 joint is in position mode, and stays there for 50 ms.

        Its deadman, which leads to velocity mode, also disables it, and counts from the last
        request.
        """
        session, name = self._session, self._parameters.name
        if session.timing.in_position_mode:
            session.read(Register.PING)
        if not session.timing.in_position_mode or session.flags & Flags.NOTENABLED:
            raise IncorrectStateError(
                f"{name}: a maximum velocity would start a motion: it is not in position mode",
                name,
                "enable(), or set_position() at its present position, first",
            )

    def _set_current(self, register: Register, percent: int) -> None:
        if percent:
            self._energising()
        self._session.write(register, percent)

    def _energising(self) -> None:
        """Record that a setting may energise the motor: original firmware does not ask its flag."""
        if self._session.version == 1:
            self.may_be_energised = True

    def _percent(self, what: str, value: int) -> int:
        what = f"{self._parameters.name} {what}"
        percent = whole(what, value)
        check_limit(what, percent, 0, 100, "%")
        return percent


def _above_zero(what: str, value: float) -> float:
    value = number(what, value)
    if value <= 0.0:
        raise InvalidArgumentError(f"{what}: {value:g} must be above zero")
    return value
