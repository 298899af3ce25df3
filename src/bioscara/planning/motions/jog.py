"""Motion by streamed velocities from which the arm can come to rest at every instant.

Each step takes the largest share of the commanded velocity after which the arm can still brake,
every joint with its own acceleration, without violating a joint limit, the tool's speed limit or a
zone's margin. If no share allows it, the arm brakes along the stopping path checked one step
before. It therefore slows down towards a zone and rests at its border; leaving it is always
possible.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from operator import mul
from typing import NamedTuple

import numpy as np

from bioscara.arguments import number, numbers, shown
from bioscara.errors import InvalidArgumentError, LimitError, UnreachableError
from bioscara.kinematics import Joints, Scara
from bioscara.planning.arrays import Array
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.stopping import PositionBounds, StoppingCheck, VelocityBounds
from bioscara.planning.limits import REDUCED_SPEED, JointLimits
from bioscara.planning.moving_average import Smoothed

EXPIRY = 0.15
"""Validity of a command [s]: the arm must not keep moving when its client disconnects."""
_FASTEST = 1.0
"""Largest tool velocity accepted as a command [m/s]: a larger one is taken for mm/s."""
_STRETCHED = 0.02
"""Elbow angle from stretched or folded that tool velocities keep [rad]: beyond it the elbow would
change sides."""
_ROUNDING = 1e-12
_REST = (0.0,) * 4
_FOLLOWED = 0.8
"""Share of a joint's acceleration for changes of the command; the rest is for path curvature."""
_GENTLE = 0.4
"""Acceleration of the tool when its speed increases and commands are averaged [m/s^2]."""
_APPROACH = 0.2
"""Share of its deceleration with which a joint approaches its limits if commands are averaged."""
_RESTART = 0.8
"""Share of the target velocity below which averaging restarts from the present velocity."""
_SHARES = (0.97, 0.9, 0.8, 0.65, 0.5, 0.3, 0.1, 0.0)
"""Shares of the target velocity that are tried if the whole is not possible."""


class JointVelocity(NamedTuple):
    """Velocities of the joints.

    Attributes:
        j1: [rad/s].
        j2: [m/s].
        j3: [rad/s].
        j4: [rad/s].
    """

    j1: float = 0.0
    j2: float = 0.0
    j3: float = 0.0
    j4: float = 0.0


class ToolVelocity(NamedTuple):
    """Velocity of the tool in the frame in which poses are given.

    Attributes:
        x: [m/s].
        y: [m/s].
        z: [m/s].
        yaw: [rad/s].
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0


class JogGenerator:
    """Velocity control of an arm.

    Args:
        arm: The arm with its tool.
        limits: Of its joints.
        start: Positions of the joints, at rest [rad, m, rad, rad].
        scene: Scene to keep clear of; None for no checks.
        tool_speed: Highest speed of the tool [m/s].
        windows: Windows over which commands are averaged, one after the other [s].

    Attributes:
        tool_speed: As given; may be changed at any time.
        positions: Commanded positions of the joints [rad, m, rad, rad].
        velocities: Commanded velocities of the joints [rad/s, m/s, rad/s, rad/s].
        reason: Why the arm does not fully follow the command: ``"expired"``, ``"stretched"``,
            ``"resting"`` between velocities of joints and of the tool, ``"tool speed"``,
            ``"j1 limit"``, the name of a zone, ``"table"`` or a link of the arm; ``""`` if it
            does.

    Raises:
        LimitError: The start is outside a joint's limits, or the tool speed is not above zero.
        ZoneError: The start is nearer to a body than the scene's margin.
    """

    def __init__(
        self,
        arm: Scara,
        limits: Sequence[JointLimits],
        start: Sequence[float],
        scene: Scene | None = None,
        tool_speed: float = REDUCED_SPEED,
        windows: Sequence[float] = (),
    ) -> None:
        start = Joints(*numbers("the start of the jog", start))
        for limit, value in zip(limits, start, strict=True):
            if not limit.lower - 1e-9 <= value <= limit.upper + 1e-9:
                raise LimitError(
                    f"{limit.name} at the start", value, limit.lower, limit.upper, limit.unit
                )
        tool_speed = number("tool speed", tool_speed, infinite=True)
        if not tool_speed > 0.0:
            raise InvalidArgumentError(f"tool speed {tool_speed} m/s must be above zero")
        self._arm, self._limits = arm, tuple(limits)
        self._stops = StoppingCheck(arm, limits, scene)
        self.tool_speed = tool_speed
        self.positions, self.velocities = Joints(*start), Joints(0.0, 0.0, 0.0, 0.0)
        self.reason = ""
        self._velocity: JointVelocity | ToolVelocity = JointVelocity()
        self._since, self._slowed = -math.inf, False
        self._windows = tuple(windows)
        self._soon = (0.0, *itertools.accumulate(windows))
        self._smoothed = Smoothed(windows, _REST)
        self._average: Sequence[float] = _REST
        self._accelerating = False
        self._kind: type[JointVelocity | ToolVelocity] = JointVelocity
        self._stops.check_start(self.positions)

    def command(
        self, velocity: JointVelocity | ToolVelocity, time: float, share: float = 1.0
    ) -> None:
        """Set the commanded velocity; it is valid until the next one, at most for :data:`EXPIRY`.

        Args:
            velocity: Of the joints or of the tool.
            time: Time of its reception [s].
            share: Share of the velocity to use, 0 to 1.

        Raises:
            LimitError: It is larger than any velocity of the arm.
            InvalidArgumentError: It is not a velocity, a value is not finite, or the share is
                invalid.
        """
        if not isinstance(velocity, JointVelocity | ToolVelocity):
            raise InvalidArgumentError(
                f"jog: the velocity is {shown(velocity)}; give JointVelocity or ToolVelocity"
            )
        share, time = number("jog: the share", share), number("jog: the time", time)
        if not 0.0 <= share <= 1.0:
            raise InvalidArgumentError(f"jog: a share of {share:g} cannot be; give 0 to 1")
        wanted = [
            number(f"jog: {name} velocity", value)
            for name, value in zip(velocity._fields, velocity, strict=True)
        ]
        if isinstance(velocity, JointVelocity):
            most = [(limit.name, limit.max_velocity, limit.unit) for limit in self._limits]
        else:
            yaw = self._limits[3].max_velocity
            most = [(axis, _FASTEST, "m") for axis in "xyz"] + [("yaw", yaw, "rad")]
        for (name, limit_, unit), value in zip(most, wanted, strict=True):
            if abs(value) > limit_ * (1.0 + 1e-9):
                remedy = "are these mm/s or degrees? velocities are m/s and rad/s"
                raise LimitError(f"{name} velocity", value, -limit_, limit_, f"{unit}/s", remedy)
        self._velocity = type(velocity)(*[share * value for value in wanted])
        self._since = time

    def step(self, time: float, period: float) -> tuple[Joints, Joints]:
        """Advance by one period.

        Args:
            time: Present time [s], on the clock of :meth:`command`.
            period: Until the next step [s].

        Returns:
            Positions and velocities of the joints at the end of the period.

        Raises:
            InvalidArgumentError: The period is not above zero, or the time is not a number.
        """
        time, period = number("jog: the time", time), number("jog: the period", period)
        if period <= 0.0:
            raise InvalidArgumentError(f"jog: a step of {period:g} s is not above 0")
        target = np.array(self._target(time, period))
        here, moving = np.array(self.positions), np.array(self.velocities)
        ranges, straight = self._ranges(), self._kind is ToolVelocity
        # An arm that was slowed down before usually still is: then all shares are checked at once.
        for shares in ((1.0, *_SHARES),) if self._slowed else ((1.0,), _SHARES):
            next_ = self._stops.approach(moving, np.outer(shares, target), period, straight)
            there = here + (moving + next_) * (period / 2.0)
            first, hindrance = self._stops.allowed(
                here, moving, there, next_, period, self.tool_speed, ranges
            )
            self._slowed = first is None or shares[first] < 1.0
            if self._slowed:
                self.reason = hindrance or self.reason
            if first is not None:
                if shares[first] < _RESTART:
                    self._restart_averaging(next_[first].tolist())
                return self._set(there[first], next_[first])
        positions, velocities = self._stops.brake(here, moving, period)
        self._restart_averaging(velocities.tolist())
        return self._set(positions, velocities)

    def _set(self, positions: Array, velocities: Array) -> tuple[Joints, Joints]:
        self.positions = Joints(*positions.tolist())
        self.velocities = Joints(*velocities.tolist())
        return self.positions, self.velocities

    def _restart_averaging(self, velocities: Sequence[float]) -> None:
        """Restart averaging from the present velocity: the reason may vanish at any instant."""
        self._average = self._as_commanded(velocities)
        self._smoothed.fill(self._average)

    def _as_commanded(self, velocities: Sequence[float]) -> Sequence[float]:
        """Convert joint velocities to the kind commanded: of the joints, or of the tool."""
        if self._kind is JointVelocity:
            return velocities
        return [sum(map(mul, row, velocities)) for row in self._arm.jacobian(self.positions)]

    def _command_now(self, time: float, ahead: Sequence[float]) -> tuple[float, ...]:
        """Return the present command, reduced to the tool's speed limit."""
        expired = not 0.0 <= time - self._since <= EXPIRY
        if expired or not any(self._velocity):
            if self._accelerating or self._slowed:
                # The averages would go on rising, or are above the velocities of an arm that was
                # slowed down: a released arm slows down from the next step on.
                self._restart_averaging(self.velocities)
            if any(self._velocity):
                self.reason = "expired"
            return _REST
        kind = type(self._velocity)
        if kind is ToolVelocity and self._rates(ahead, self._velocity) is None:
            self.reason = "stretched"
            kind = JointVelocity
        if kind is not self._kind:
            if self._windows and any(self.velocities) and not self.reason:
                # A smooth motion of the tool is not smooth for the joints, and vice versa.
                self.reason = "resting"
                return _REST
            self._kind = kind
            self._restart_averaging(self.velocities)
        if self.reason:
            return _REST
        if self._kind is JointVelocity:
            # The command takes effect over all averages, during which the arm may extend.
            speed = max(
                self._arm.tool_speed(
                    [p + v * soon for p, v in zip(ahead, self.velocities, strict=True)],
                    self._velocity,
                )
                for soon in self._soon
            )
        else:
            speed = self._arm.speed_at(self._velocity)
        return self._within_tool_speed(self._velocity, speed)

    def _within_tool_speed(self, velocity: Sequence[float], speed: float) -> tuple[float, ...]:
        """Return a velocity, scaled down if the tool's speed at it exceeds the limit.

        Args:
            velocity: Of the joints or of the tool.
            speed: Speed of the tool at this velocity [m/s].
        """
        if speed <= self.tool_speed:
            return tuple(velocity)
        self.reason = self.reason or "tool speed"
        return tuple([value * self.tool_speed / speed for value in velocity])

    def _rates(self, positions: Sequence[float], velocity: Sequence[float]) -> Joints | None:
        """Return the joint velocities for a velocity of the tool, None on a stretched arm."""
        try:
            return self._arm.rates(positions, velocity)
        except UnreachableError:
            return None

    def _rate_limited(self, command: Sequence[float], ahead: Sequence[float]) -> Sequence[float]:
        """Return the command, its change bounded to one that the joints can follow.

        Components decrease as fast as the joints can. They increase gently, and rest before they
        reverse: a load that breaks away from its friction swings.
        """
        if not self._windows:
            return command
        oldest = self._smoothed.oldest
        less, more = [0.0] * 4, [0.0] * 4
        for index, (before, after) in enumerate(zip(oldest, command, strict=True)):
            aim = after if before * after >= 0.0 else 0.0
            (less if abs(aim) < abs(before) else more)[index] = aim - before
        less, more = self._feasible(less, ahead), self._feasible(more, ahead, _GENTLE)
        return [a + b + c for a, b, c in zip(oldest, less, more, strict=True)]

    def _feasible(
        self, change: list[float], ahead: Sequence[float], gentle: float = math.inf
    ) -> list[float]:
        """Return the share of a change that joints and tool can make in the first average.

        Args:
            change: Change of the command.
            ahead: Positions of the joints.
            gentle: Acceleration of the tool [m/s^2].
        """
        if not any(change):
            return change
        rates = change if self._kind is JointVelocity else self._rates(ahead, change)
        if rates is None:
            return change
        window = self._windows[0]
        share = max(
            self._arm.tool_speed(ahead, rates) / (gentle * window),
            *[
                abs(rate) / (_FOLLOWED * limit.max_acceleration * window)
                for rate, limit in zip(rates, self._limits, strict=True)
            ],
        )
        return change if share <= 1.0 else [each / share for each in change]

    def _target(self, time: float, period: float) -> tuple[float, ...]:
        """Return the target joint velocities, within limits of joints and tool."""
        self.reason = ""
        ahead = [p + v * period for p, v in zip(self.positions, self.velocities, strict=True)]
        a, b, c, d = self._rate_limited(self._command_now(time, ahead), ahead)
        before = self._average
        self._average = command = self._smoothed.step((a, b, c, d), period)
        self._accelerating = any(
            abs(after) > abs(each) for each, after in zip(before, command, strict=True)
        )
        if not any(command):
            return _REST
        share = _APPROACH if self._windows else 1.0
        bounds = self._stops.speeds(self.positions, self.velocities, self._ranges(), period, share)
        if self._kind is JointVelocity:
            wanted = self._clipped(command, bounds)
        else:
            rates = self._rates(ahead, command)
            if rates is None:
                self.reason = "stretched"
                self._restart_averaging(self.velocities)
                return _REST
            wanted = self._scaled(rates, bounds)
        return self._within_tool_speed(wanted, self._arm.tool_speed(ahead, wanted))

    def _ranges(self) -> PositionBounds:
        """Return the allowed joint positions; tool velocities keep the elbow on its side."""
        lower = [limit.lower for limit in self._limits]
        upper = [limit.upper for limit in self._limits]
        if self._kind is ToolVelocity:
            elbow = self.positions.j3
            # Half turns: at each the arm is stretched or folded.
            side = math.pi * math.floor(elbow / math.pi)
            lower[2] = max(lower[2], min(elbow, side + _STRETCHED))
            upper[2] = min(upper[2], max(elbow, side + math.pi - _STRETCHED))
        return np.array(lower), np.array(upper)

    def _clipped(self, wanted: Sequence[float], bounds: VelocityBounds) -> tuple[float, ...]:
        result = []
        for limit, value, low, high in zip(self._limits, wanted, *bounds, strict=True):
            result.append(min(max(value, low), high))
            if result[-1] != value:
                self.reason = f"{limit.name} limit"
        return tuple(result)

    def _scaled(self, wanted: Sequence[float], bounds: VelocityBounds) -> tuple[float, ...]:
        """Return all velocities times one share, so that the tool keeps its direction."""
        share = 1.0
        for index, (value, low, high) in enumerate(zip(wanted, *bounds, strict=True)):
            most = max(high, 0.0) if value > 0.0 else max(-low, 0.0)
            if abs(value) * share > most + _ROUNDING:
                share = most / abs(value)
                limit, up = self._limits[index], value > 0.0
                own = self._ranges()[int(up)][index] == (limit.upper if up else limit.lower)
                self.reason = f"{limit.name} limit" if own else "stretched"
        if share < _RESTART:
            self._restart_averaging(self.velocities)
        return tuple(value * share for value in wanted)
