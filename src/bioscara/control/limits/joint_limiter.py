"""Bounds the commands of one joint, from any source.

A command within its limits passes unchanged. A position that is not is approached as fast as
velocity and acceleration allow, with the braking distance kept in reserve, so that a step becomes
a ramp and a limit is reached at rest.
"""

from __future__ import annotations

import math
from math import isfinite

from bioscara.hardware.interfaces import CommandInterface, StateInterface
from bioscara.model import JointParameters
from bioscara.protocol import SILENCE

_ROUNDING = 1e-6
"""Share by which a command may exceed its bound: it is a difference of samples."""
_RESIDUE = 1e-12
"""Rounding residue of a completed displacement [rad or m]."""
_REACTION = 2.0 * SILENCE
"""Time that a joint under velocity control may continue before it brakes [s]: it stops
autonomously when it receives nothing for its watchdog time; its driver requires room for that."""
_CREEP = 0.01
"""Share of the highest speed for which a joint under velocity control keeps room to brake at a
limit: the speed that its driver measures is not finer than this."""


class JointLimiter:
    """Bounds the commands of one joint.

    Velocities of positions are means over the time between two of them, which belong to the
    middle of that time; so an acceleration is their difference over the mean of two periods.

    Args:
        limits: Of the joint.
        position_command: Its handle.
        velocity_command: Its handle.
        position: Its measured position.
        velocity: Its measured velocity.

    Attributes:
        name: Name of the joint.
        max_velocity: Its highest velocity [rad/s or m/s].
        max_acceleration: Its highest acceleration [rad/s^2 or m/s^2].
        reference: Position that was commanded last [rad or m]; NaN before the first.
        speed: Velocity that was commanded last [rad/s or m/s].
        interventions: In how many cycles a command was changed.
        lag: Distance of the sent position behind the bounded one [rad or m], still to be covered.
    """

    __slots__ = (
        "_bounded", "_last_period", "_lower", "_position", "_position_command", "_requested",
        "_requested_speed", "_upper", "_velocity", "_velocity_command", "interventions", "lag",
        "max_acceleration", "max_velocity", "name", "reference", "speed",
    )  # fmt: skip

    def __init__(
        self,
        limits: JointParameters,
        position_command: CommandInterface,
        velocity_command: CommandInterface,
        position: StateInterface,
        velocity: StateInterface,
    ) -> None:
        self.name = limits.name
        self._lower, self._upper = limits.lower, limits.upper
        self.max_velocity, self.max_acceleration = limits.max_velocity, limits.max_acceleration
        self._position_command, self._velocity_command = position_command, velocity_command
        self._position, self._velocity = position, velocity
        self.interventions, self.lag = 0, 0.0
        self.reference = self._requested = math.nan
        self.speed = self._requested_speed = 0.0
        self._last_period, self._bounded = 0.0, (math.nan, 0.0)

    @property
    def commanded(self) -> bool:
        """Whether position or velocity of the joint is claimed."""
        return bool(self._position_command.owner or self._velocity_command.owner)

    @property
    def velocity_alone(self) -> bool:
        """Whether its velocity is claimed and its position is not."""
        return bool(self._velocity_command.owner and not self._position_command.owner)

    @property
    def state(self) -> tuple[float, float]:
        """Position and velocity that are commanded; else measured, at rest."""
        if self._position_command.owner or self._velocity_command.owner:
            return self.reference, self.speed
        return self._position.value, 0.0

    @property
    def here(self) -> float:
        """Position that was commanded last or, where none was, measured [rad or m]."""
        if self._position_command.owner or self._velocity_command.owner:
            return self.reference
        return self._position.value

    @property
    def sent(self) -> float:
        """Position that was sent last, or measured where none is sent [rad or m]."""
        return self.reference - self.lag if self._position_command.owner else self.here

    def stops_inside(self, time: float) -> bool:
        """Return whether the joint is inside its limits after continuing for a time.

        False where its velocity alone is commanded: it is not certain there.

        Args:
            time: At the velocity that is commanded [s].
        """
        if self._position_command.owner:
            return self._lower <= self.reference + self.speed * time <= self._upper
        return not self._velocity_command.owner

    def within(self, position: float) -> float:
        """Return the position nearest to ``position`` that the joint may move to [rad or m].

        Beyond a limit, where a joint can only have been pushed, it may stay.
        """
        if self._lower <= position <= self._upper:
            return position
        here = self.here
        return min(max(position, min(self._lower, here)), max(self._upper, here))

    @property
    def displacement(self) -> float:
        """Displacement to the requested position [rad or m]; 0 where none is requested."""
        asked = self._position_command.value
        if not self._position_command.owner or not isfinite(asked):
            return 0.0
        return self.within(asked) - self.reference

    def request(self, velocity: float, period: float) -> None:
        """Replace the request by a velocity [rad/s or m/s].

        Args:
            velocity: Until the next cycle.
            period: Time since the last cycle [s].
        """
        if self._position_command.owner:
            self._position_command.value = self.reference + velocity * period
        if self._velocity_command.owner:
            self._velocity_command.value = velocity

    def after(self, time: float) -> float:
        """Return the position of the joint after continuing for a time [rad or m].

        Args:
            time: At the commanded velocity, after the bounded command was sent [s].
        """
        if self._position_command.owner:
            return self.reference + self.speed * time
        if self._velocity_command.owner:
            return self.reference + self.speed * time + self.lag
        return self._position.value

    def reaction(self, period: float) -> float:
        """Return how long the joint may continue at its last command before it brakes [s].

        Args:
            period: Time from cycle to cycle [s].
        """
        return _REACTION + 2.0 * period if self.velocity_alone else 0.0

    def distance_kept(self, period: float) -> float:
        """Return how near its limits the joint comes [rad or m]: less far under velocity alone.

        Args:
            period: Time from cycle to cycle [s].
        """
        return _CREEP * self.max_velocity * self.reaction(period)

    @property
    def requested_velocity(self) -> float:
        """Requested velocity where velocity alone is commanded, else 0 [rad/s or m/s]."""
        asked = self._velocity_command.value
        return asked if self.velocity_alone and isfinite(asked) else 0.0

    def scale_request(self, share: float) -> None:
        """Scale a requested velocity by ``share``, as :meth:`slow_down` does."""
        if self.requested_velocity:
            self._velocity_command.value *= share

    def slow_down(self, share: float, period: float) -> None:
        """Scale the command of this cycle by ``share``.

        Args:
            share: Remaining share of the velocity, 0 to 1.
            period: Time since the last cycle [s].
        """
        speed = self.speed * share
        self.reference -= (self.speed - speed) * period
        self.speed = speed
        if self._position_command.owner:
            self._position_command.value = self.reference
            if self._velocity_command.owner:
                self._velocity_command.value *= share
        elif self._velocity_command.owner:
            self._velocity_command.value = speed

    def replace_command(self, position: float, mean: float, velocity: float, period: float) -> None:
        """Replace the request by another command in this cycle.

        Args:
            position: Position to move to [rad or m].
            mean: Velocity that leads there from the last position [rad/s or m/s].
            velocity: At that position [rad/s or m/s].
            period: Time since the last cycle [s].
        """
        if self._position_command.owner:
            self.reference, self.speed = position, mean
            self._position_command.value = position
        elif self._velocity_command.owner:
            velocity = self._in_reserve(velocity, period)
            # Its position follows from the measured one.
            self.reference -= (self.speed - velocity) * period
            self.speed = velocity
        if self._velocity_command.owner:
            self._velocity_command.value = velocity

    def continue_from_bounded(self) -> None:
        """Continue from the last bounded command instead of the sent one."""
        command = self._position_command
        if not (command.owner or self._velocity_command.owner):
            return
        position, speed = self._bounded
        if command.owner and command.value == self.reference:
            # No new command: the previous request still applies.
            command.value = position
        self.reference, self.speed = position, speed

    def approach_lag(self) -> None:
        """Approach the rest of the lag as a displacement of its own.

        An average of cycles of unequal length ends a little off the bounded position.
        """
        if self._position_command.owner:
            self.reference -= self.lag
        self.lag = 0.0

    def continue_from_sent(self) -> None:
        """Continue from the sent command and drop the lag behind the bounded one."""
        self.lag = 0.0
        self._requested, self._requested_speed = self.reference, self.speed

    def send(self, speed: float, before: float, period: float) -> None:
        """Send another velocity than the bounded one, and the position that follows from it.

        Args:
            speed: Of this cycle [rad/s or m/s].
            before: Position that was sent in the cycle before [rad or m].
            period: Time since the last cycle [s].
        """
        position, velocity = self._position_command, self._velocity_command
        if not (position.owner or velocity.owner) or not isfinite(self.reference):
            return
        self._bounded = self.reference, self.speed
        lag = self.lag + (self.speed - speed) * period
        if not speed and abs(lag) < _RESIDUE:
            lag = 0.0
        if position.owner:
            sent = self.reference - lag
            if not self._lower <= sent <= self._upper:
                # See approach_lag.
                sent = min(max(sent, min(self._lower, before)), max(self._upper, before))
                lag, speed = self.reference - sent, (sent - before) / period
            self.reference = position.value = sent
        self.lag, self.speed = lag, speed
        if velocity.owner:
            velocity.value = speed

    def begin(self) -> None:
        """Start from the measured state: the joint was not commanded before."""
        measured, speed = self._position.value, self._velocity.value
        self.reference = self._requested = measured
        speed = speed if isfinite(speed) else 0.0
        self.speed = self._requested_speed = min(max(speed, -self.max_velocity), self.max_velocity)
        self._bounded = self.reference, self.speed
        self._last_period = self.lag = 0.0

    def resume(self) -> None:
        """Let a controller continue from there: preset its commands to the last ones."""
        if isfinite(self.reference):
            self._position_command.value = self.reference
        self._velocity_command.value = self.speed

    def apply(self, period: float) -> None:
        """Bound the command.

        Args:
            period: Time since the last cycle [s].
        """
        if self._position_command.owner:
            self._bound_position(period)
        elif self._velocity_command.owner:
            self._bound_velocity(period)
        self._last_period = period

    def _bound_position(self, period: float) -> None:
        # Runs for each joint in each cycle: comparisons take a third of the time of min and max.
        command, lower, upper = self._position_command, self._lower, self._upper
        if not lower <= self.reference <= upper:
            if not isfinite(self.reference):
                self.begin()
                if not isfinite(self.reference):
                    command.value = math.nan
                    return
            # From beyond a limit, where a joint can only have been pushed, it may only return.
            lower, upper = min(lower, self.reference), max(upper, self.reference)
        asked, reference, last = command.value, self.reference, self.speed
        if lower <= asked <= upper:
            wanted = asked
        elif isfinite(asked):
            wanted = lower if asked < lower else upper
        else:
            # It commands nothing: the joint continues to its last target.
            wanted = self._requested
        fastest, acceleration = self.max_velocity, self.max_acceleration
        step = acceleration * 0.5 * (period + (self._last_period or period))
        requested, before = self._requested, self._requested_speed
        # The velocity of the request, as far as the joint could follow it.
        ahead, slower, faster = (wanted - requested) / period, before - step, before + step
        least = slower if slower > -fastest else -fastest
        most = faster if faster < fastest else fastest
        self._requested_speed = most if ahead > most else least if ahead < least else ahead
        self._requested = wanted
        speed, fine = (wanted - reference) / period, step * _ROUNDING
        left = upper - reference if speed > 0.0 else reference - lower
        if (
            reference != requested
            or abs(speed - last) > step + fine
            or abs(speed) > fastest + fine
            or abs(speed) > mean_speed_within(left, acceleration, period) + fine
        ):
            bounded = self._approach(wanted, period, step)
            if abs(bounded - speed) > fine:
                wanted = min(max(reference + bounded * period, lower), upper)
                speed = (wanted - reference) / period
        self.reference, self.speed = wanted, speed
        kept, command.value = wanted == asked, wanted
        velocity_command = self._velocity_command
        if velocity_command.owner:
            rate, reach = velocity_command.value, acceleration * period * (0.5 + _ROUNDING)
            if not (kept and abs(rate - speed) <= reach and abs(rate) <= fastest):
                self._match_velocity(period, last, reach, kept=kept)
                kept = False
        if not kept:
            self.interventions += 1

    def _match_velocity(self, period: float, last: float, reach: float, *, kept: bool) -> None:
        """Replace a velocity that the joint cannot have at its position by one that it can have.

        Args:
            period: Time since the last cycle [s].
            last: Mean velocity of the cycle before [rad/s or m/s].
            reach: Difference that it may have from the mean velocity of this cycle [rad/s or m/s].
            kept: Whether the position is the one that the controller gave.
        """
        asked, speed = self._velocity_command.value, self.speed
        # The mean belongs to the middle of the cycle, the velocity to its end.
        end = speed + (speed - last) * period / (period + (self._last_period or period))
        end = max(end, 0.0) if speed > 0.0 else min(end, 0.0) if speed < 0.0 else 0.0
        if kept and isfinite(asked):
            end = min(max(asked, speed - reach), speed + reach)
        self._velocity_command.value = min(max(end, -self.max_velocity), self.max_velocity)

    def _approach(self, wanted: float, period: float, step: float) -> float:
        """Return the speed that brings the joint to a moving target soon and without overshoot."""
        ahead, acceleration = self._requested_speed, self.max_acceleration
        gap = wanted - self.reference - ahead * period
        speed = ahead + math.copysign(mean_speed_within(abs(gap), acceleration, period), gap)
        down = mean_speed_within(self.reference - self._lower, acceleration, period)
        up = mean_speed_within(self._upper - self.reference, acceleration, period)
        speed = min(max(speed, -down), up)
        speed = min(max(speed, self.speed - step), self.speed + step)
        return min(max(speed, -self.max_velocity), self.max_velocity)

    def _bound_velocity(self, period: float) -> None:
        wanted, here = self._velocity_command.value, self._position.value
        step = self.max_acceleration * period
        goal = wanted if isfinite(wanted) else self.speed
        if not isfinite(here):
            goal = 0.0
        speed = min(max(goal, self.speed - step), self.speed + step)
        speed = min(max(speed, -self.max_velocity), self.max_velocity)
        if isfinite(here):
            speed = self._in_reserve(speed, period)
            here = min(max(here + speed * period, self._lower), self._upper)
        if speed != wanted:
            self._velocity_command.value = speed
            self.interventions += 1
        self.speed = self._requested_speed = speed
        self.reference = self._requested = here

    def _in_reserve(self, speed: float, period: float) -> float:
        """Clamp a velocity so that the braking distance within the limits stays in reserve."""
        here, reaction = self._position.value + self.lag, self.reaction(period)
        creep = self.distance_kept(period)
        down = speed_within(here - self._lower - creep, self.max_acceleration, reaction)
        up = speed_within(self._upper - here - creep, self.max_acceleration, reaction)
        return min(max(speed, -down), up)


def mean_speed_within(distance: float, acceleration: float, period: float) -> float:
    """Return the mean speed of a cycle after which a joint can still come to rest in ``distance``.

    Braking began in the middle of that cycle; the last part of the distance takes one cycle.

    Args:
        distance: Distance available [rad or m]; the speed is 0 beyond its end, never a return.
        acceleration: Of the braking [rad/s^2 or m/s^2].
        period: Of the cycle [s].
    """
    if distance <= 0.5 * acceleration * period * period:
        return max(distance, 0.0) / period
    return math.sqrt(2.0 * acceleration * distance) - 0.5 * acceleration * period


def speed_within(distance: float, acceleration: float, reaction: float) -> float:
    """Return the speed from which a joint comes to rest in ``distance``, braking after a time.

    Args:
        distance: Distance available [rad or m].
        acceleration: Of the braking [rad/s^2 or m/s^2].
        reaction: How long the joint continues before it brakes [s].
    """
    if distance <= 0.0:
        return 0.0
    return acceleration * (math.sqrt(reaction**2 + 2.0 * distance / acceleration) - reaction)
