"""Limits of a joint's setpoints: position, velocity, and the distance that it needs to stop."""

from __future__ import annotations

import math

from bioscara.arguments import number, shown
from bioscara.drivers.joint.sample import JointSample, Setpoint
from bioscara.errors import InvalidArgumentError, LimitError, NotHomedError
from bioscara.model import JointParameters
from bioscara.protocol import SILENCE

ROUNDING = 1e-9
"""Relative tolerance of limits: less than the resolution of the wire."""


class SetpointLimits:
    """Checks setpoints of one joint before they are sent.

    Attributes:
        returning: Whether the setpoints are returning from outside the limits.
    """

    __slots__ = ("_fastest", "_lower", "_parameters", "_slowest", "_upper", "returning")

    def __init__(self, parameters: JointParameters) -> None:
        self._parameters = parameters
        self._lower, self._upper = parameters.lower, parameters.upper
        self._slowest, self._fastest = -parameters.max_velocity, parameters.max_velocity
        self.returning = False

    def check_setpoint(self, setpoint: Setpoint) -> Setpoint:
        """Return the setpoint with plain floats if it is within the limits.

        While returning from outside, a position may be as far outside as the last one.

        Raises:
            LimitError: A value is outside.
            InvalidArgumentError: A value is not finite, or it is no setpoint.
        """
        if type(setpoint) is Setpoint:
            position, velocity = setpoint
            # The usual case, at once: a comparison with NaN is false.
            if (
                type(position) is float
                and type(velocity) is float
                and self._lower <= position <= self._upper
                and self._slowest <= velocity <= self._fastest
            ):
                return setpoint
        elif isinstance(setpoint, tuple) and len(setpoint) == 2:
            position, velocity = setpoint
        else:
            raise InvalidArgumentError(f"{shown(setpoint)} is not a Setpoint(position, velocity)")
        position = self._number("position", position)
        velocity = self._number("velocity", velocity)
        if not self._lower <= position <= self._upper:
            self.check_position(position)
        return Setpoint(position, self.check_velocity(velocity))

    def start_from(self, position: float) -> None:
        """Start the setpoints at ``position``; from outside the limits they may only lead back.

        Args:
            position: Measured position of the joint, or its last setpoint [rad or m].
        """
        position = self._number("position", position)
        lower, upper = self._parameters.lower, self._parameters.upper
        self._lower, self._upper = min(lower, position), max(upper, position)
        self.returning = not lower <= position <= upper

    def check_position(self, position: float) -> float:
        """Return ``position`` [rad or m] as a float if it is within the limits.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not finite.
        """
        parameters, position = self._parameters, self._number("position", position)
        what = f"{parameters.name} position"
        check_limit(what, position, parameters.lower, parameters.upper, parameters.unit)
        return position

    def check_velocity(self, velocity: float) -> float:
        """Return ``velocity`` [rad/s or m/s] as a float if it is within the limits.

        Raises:
            LimitError, InvalidArgumentError: It is outside, or not finite.
        """
        slowest, fastest = self._slowest, self._fastest
        if type(velocity) is float and slowest <= velocity <= fastest:
            return velocity
        parameters, velocity = self._parameters, self._number("velocity", velocity)
        what = f"{parameters.name} velocity"
        check_limit(what, velocity, slowest, fastest, f"{parameters.unit}/s")
        return velocity

    def check_stopping(
        self, velocity: float, state: JointSample, time: float, deceleration: float
    ) -> None:
        """Raise if the joint, driven at ``velocity`` from now, could not stop within its limits.

        Args:
            velocity: Not zero [rad/s or m/s].
            state: Its last state.
            time: Present time [s]; the joint may have moved since the state.
            deceleration: Its deceleration when no further setpoint arrives [rad/s^2 or m/s^2].

        Raises:
            LimitError: It could not stop in time.
            NotHomedError: Its position is unknown.
        """
        parameters, velocity = self._parameters, self._number("velocity", velocity)
        name, lower, upper = parameters.name, parameters.lower, parameters.upper
        if state.position is None:
            raise NotHomedError(f"{name}: its position is not known; home() again", name)
        sign = math.copysign(1.0, velocity)
        speed = max(velocity * sign, state.velocity * sign)
        ahead = SILENCE + time - state.stamp
        end = state.position + sign * (speed * ahead + speed**2 / (2.0 * deceleration))
        if end * sign <= (upper if sign > 0.0 else -lower):
            return
        raise LimitError(
            f"{name} position where {velocity:g} {parameters.unit}/s would end",
            end,
            lower,
            upper,
            parameters.unit,
            "the joint was stopped: turn back, go slower or use set_position()",
        )

    def _number(self, what: str, value: float) -> float:
        """Return a finite number as a float."""
        return number(f"{self._parameters.name} {what}", value)


def check_limit(
    what: str, value: float, lower: float, upper: float, unit: str, remedy: str = ""
) -> None:
    """Raise unless a value is within its limits, up to rounding.

    Args:
        what: Name of the value, for the message.
        value: The value.
        lower: Lowest allowed value.
        upper: Highest allowed value.
        unit: Unit of all three.
        remedy: Advice for the message.

    Raises:
        LimitError: It is outside.
    """
    if not lower - ROUNDING <= value <= upper + ROUNDING:
        raise LimitError(what, value, lower, upper, unit, remedy)
