"""Motion by streamed velocities from which the arm can come to rest at every instant.

Each step takes the largest share of the commanded velocity after which the arm can still brake,
every joint with its own acceleration, without violating a joint limit, the tool's speed limit or a
zone's margin. If no share allows it, the arm brakes along the stopping path checked one step
before. It therefore slows down towards a zone and rests at its border; leaving it is always
possible.

Where the elbow is straight, x and y of a tool velocity move the wrist only as far as the joints
can; z and yaw are not slowed down with them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from operator import mul
from typing import NamedTuple

import numpy as np

from bioscara.arguments import number, numbers, shown
from bioscara.errors import InvalidArgumentError, LimitError
from bioscara.kinematics import Joints, Scara
from bioscara.planning.arrays import Array
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.stopping import (
    Hindrance,
    PositionBounds,
    StoppingCheck,
    VelocityBounds,
)
from bioscara.planning.limits import REDUCED_SPEED, JointLimits
from bioscara.planning.motions.elbow_side import ElbowSide
from bioscara.planning.motions.jog_limitation import JogLimit, JogLimitation, LimitCause
from bioscara.planning.moving_average import Smoothed

EXPIRY = 0.15
"""Validity of a command [s]: the arm must not keep moving when its client disconnects."""
_FASTEST = 1.0
"""Largest tool velocity accepted as a command [m/s]: a larger one is taken for mm/s."""
_ROUNDING = 1e-12
_REST = (0.0,) * 4
_FOLLOWED = 0.8
"""Share of a joint's acceleration for changes of the command; the rest is for path curvature."""
_GENTLE = 0.4
"""Acceleration of the tool when its speed increases and commands are averaged [m/s^2]."""
_APPROACH = 0.2
"""Share of its deceleration with which a joint approaches its limits if commands are averaged, or
are those of the tool."""
_RESTART = 0.8
"""Share of the target velocity below which averaging restarts from the present velocity."""
_SHARES = (0.97, 0.9, 0.8, 0.65, 0.5, 0.3, 0.1, 0.0)
"""Shares of the target velocity that are tried if the whole is not possible."""
_HELD = 0.02
"""Share of the command below which a limited quantity counts as held."""
_LEVEL = (0, 1)
"""Numbers of x and y in a velocity of the tool."""


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


def require_velocity(
    velocity: object, *kinds: type[JointVelocity | ToolVelocity]
) -> JointVelocity | ToolVelocity:
    """Return a velocity, with its values as floats.

    A bare tuple is refused: it does not say whether it is of the joints or of the tool.

    Args:
        velocity: The passed value.
        *kinds: Which velocities it may be; those of the joints and of the tool by default.

    Raises:
        InvalidArgumentError: It is no such velocity, or a value is not a finite number.
    """
    kinds = kinds or (JointVelocity, ToolVelocity)
    if not isinstance(velocity, kinds):
        names = " or ".join(kind.__name__ for kind in kinds)
        raise InvalidArgumentError(f"jog: the velocity is {shown(velocity)}; give {names}")
    values = zip(velocity._fields, velocity, strict=True)
    return type(velocity)(*[number(f"jog: {name} velocity", value) for name, value in values])


class JogGenerator:
    """Velocity control of an arm.

    Args:
        kinematics: The arm with its tool.
        limits: Of its joints.
        start: Positions of the joints, at rest [rad, m, rad, rad].
        scene: Scene to keep clear of; None for no checks.
        tool_speed: Highest speed of the tool [m/s].
        windows: Windows over which commands are averaged, one after the other [s].
        elbow: A position of j3 in which the elbow was bent last [rad], to whose side a straight
            one bends; None if it is unknown, see :mod:`~bioscara.planning.motions.elbow_side`.

    Attributes:
        tool_speed: As given; may be changed at any time.
        positions: Commanded positions of the joints [rad, m, rad, rad].
        velocities: Commanded velocities of the joints [rad/s, m/s, rad/s, rad/s].

    Raises:
        LimitError: The start is outside a joint's limits, or the tool speed is not above zero.
        ZoneError: The start is nearer to a body than the scene's margin.
    """

    def __init__(
        self,
        kinematics: Scara,
        limits: Sequence[JointLimits],
        start: Sequence[float],
        scene: Scene | None = None,
        tool_speed: float = REDUCED_SPEED,
        windows: Sequence[float] = (),
        elbow: float | None = None,
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
        self._kinematics, self._limits = kinematics, tuple(limits)
        self._stops = StoppingCheck(kinematics, limits, scene)
        self.tool_speed = tool_speed
        self.positions, self.velocities = Joints(*start), Joints(0.0, 0.0, 0.0, 0.0)
        elbow = None if elbow is None else number("the former elbow of the jog", elbow)
        self._side = ElbowSide(kinematics, limits, start, elbow)
        self._cause: LimitCause | None = None
        self._level_share, self._wrist_held = 1.0, False
        self._elbow_speeds = -math.inf, math.inf
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
        wanted = require_velocity(velocity)
        share, time = number("jog: the share", share), number("jog: the time", time)
        if not 0.0 <= share <= 1.0:
            raise InvalidArgumentError(f"jog: a share of {share:g} cannot be; give 0 to 1")
        if isinstance(wanted, JointVelocity):
            most = [(limit.name, limit.max_velocity, limit.unit) for limit in self._limits]
        else:
            yaw = self._limits[3].max_velocity
            most = [(axis, _FASTEST, "m") for axis in "xyz"] + [("yaw", yaw, "rad")]
        for (name, limit_, unit), value in zip(most, wanted, strict=True):
            if abs(value) > limit_ * (1.0 + 1e-9):
                remedy = "are these mm/s or degrees? velocities are m/s and rad/s"
                raise LimitError(f"{name} velocity", value, -limit_, limit_, f"{unit}/s", remedy)
        self._velocity = type(wanted)(*[share * value for value in wanted])
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
        ranges, straight = self._ranges(), self._keeps_direction(moving, target, period)
        # An arm that was slowed down before usually still is: then all shares are checked at once.
        for shares in ((1.0, *_SHARES),) if self._slowed else ((1.0,), _SHARES):
            next_ = self._stops.approach(moving, np.outer(shares, target), period, straight)
            there = here + (moving + next_) * (period / 2.0)
            first, hindrance = self._stops.allowed(
                here, moving, there, next_, period, self.tool_speed, ranges
            )
            self._slowed = first is None or shares[first] < 1.0
            if self._slowed and hindrance is not None:
                self._cause = self._cause_of_hindrance(hindrance)
            if first is not None:
                if shares[first] < _RESTART:
                    self._restart_averaging(next_[first].tolist())
                return self._set(there[first], next_[first])
        positions, velocities = self._stops.brake(here, moving, period)
        self._restart_averaging(velocities.tolist())
        return self._set(positions, velocities)

    def _keeps_direction(self, moving: Array, target: Array, period: float) -> bool:
        """Return whether all joints make the same share of their change: the tool then turns least.

        Not where the elbow has to stop at the end of the reach sooner than the others can.
        """
        if self._kind is JointVelocity or not self._side.near(self.positions.j3):
            return self._kind is ToolVelocity
        elbow = self._stops.approach(moving, target[None], period, True)[0, 2]
        low, high = self._elbow_speeds
        return bool(low - _ROUNDING <= elbow <= high + _ROUNDING)

    def _set(self, positions: Array, velocities: Array) -> tuple[Joints, Joints]:
        self.positions = Joints(*positions.tolist())
        self.velocities = Joints(*velocities.tolist())
        self._side.follow(self.positions.j3, free=self._kind is JointVelocity)
        return self.positions, self.velocities

    @property
    def limitation(self) -> JogLimitation | None:
        """Why the arm does not fully follow the command; None if it does, or if that is rest."""
        cause, command = self._cause, self._velocity
        if cause is None or not any(command):
            return None
        level = self._kind is ToolVelocity and any(command[:2])
        if cause.level:
            held = self._level_share < _HELD
        elif cause.limit in {JogLimit.EXPIRED, JogLimit.CHANGE}:
            held = True
        else:
            shares = [
                abs(after / before)
                for after, before in zip(self._as_commanded(self.velocities), command, strict=True)
                if before
            ]
            if self._kind is JointVelocity and cause.joint in self._limits:
                shares = [abs(self.velocities[self._limits.index(cause.joint)])]
            held = max(shares) < _HELD
        return cause.limitation(held, level)

    def _restart_averaging(self, velocities: Sequence[float]) -> None:
        """Restart averaging from the present velocity: the reason may vanish at any instant."""
        self._average = self._as_commanded(velocities)
        self._smoothed.fill(self._average)

    def _restart_averaging_level(self) -> None:
        """Restart averaging of the tool's x and y, likewise; z and yaw are not limited."""
        x, y, _, _ = self._as_commanded(self.velocities)
        self._average = [x, y, *self._average[2:]]
        self._smoothed.refill(self._average, _LEVEL)

    def _as_commanded(self, velocities: Sequence[float]) -> Sequence[float]:
        """Convert joint velocities to the kind commanded: of the joints, or of the tool."""
        if self._kind is JointVelocity:
            return velocities
        return [sum(map(mul, row, velocities)) for row in self._kinematics.jacobian(self.positions)]

    def _command_now(self, time: float, ahead: Sequence[float]) -> tuple[float, ...]:
        """Return the present command, reduced to the tool's speed limit."""
        expired = not 0.0 <= time - self._since <= EXPIRY
        if expired or not any(self._velocity):
            if self._accelerating or self._slowed:
                # The averages would go on rising, or are above the velocities of an arm that was
                # slowed down: a released arm slows down from the next step on.
                self._restart_averaging(self.velocities)
            if any(self._velocity):
                self._cause = LimitCause(JogLimit.EXPIRED)
            return _REST
        kind = type(self._velocity)
        if kind is not self._kind:
            if self._windows and any(self.velocities):
                # A smooth motion of the tool is not smooth for the joints, and vice versa.
                self._cause = LimitCause(JogLimit.CHANGE)
                return _REST
            self._kind = kind
            self._restart_averaging(self.velocities)
        if self._kind is JointVelocity:
            # The command takes effect over all averages, during which the arm may extend.
            speed = max(
                self._kinematics.tool_speed(
                    [p + v * soon for p, v in zip(ahead, self.velocities, strict=True)],
                    self._velocity,
                )
                for soon in self._soon
            )
        else:
            speed = self._kinematics.speed_at(self._velocity)
        return self._within_tool_speed(self._velocity, speed)

    def _within_tool_speed(self, velocity: Sequence[float], speed: float) -> tuple[float, ...]:
        """Return a velocity, scaled down if the tool's speed at it exceeds the limit.

        Args:
            velocity: Of the joints or of the tool.
            speed: Speed of the tool at this velocity [m/s].
        """
        if speed <= self.tool_speed:
            return tuple(velocity)
        self._cause = self._cause or LimitCause(JogLimit.TOOL_SPEED, speed=self.tool_speed)
        return tuple([value * self.tool_speed / speed for value in velocity])

    def _rates(self, positions: Sequence[float], velocity: Sequence[float]) -> Joints:
        """Return the joint velocities for a velocity of the tool."""
        return self._kinematics.rates(self._side.regular(positions), velocity)

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
        if self._kind is JointVelocity:
            return _shared(change, self._needed(change, ahead, gentle))
        if not self._side.near(ahead[2]):
            return _shared(change, self._needed(self._rates(ahead, change), ahead, gentle))
        # Here x and y change slowly, and z and yaw do not wait: the wrist's axis need not move.
        x, y, z, yaw = change
        needed = self._needed(self._rates(ahead, (x, y, 0.0, 0.0)), ahead, gentle)
        if needed > 1.0:
            self._cause = self._cause or self._at_end_of_reach()
        x, y, _, _ = _shared([x, y, 0.0, 0.0], needed)
        needed = self._needed((0.0, z, 0.0, yaw), ahead, gentle)
        _, _, z, yaw = _shared([0.0, 0.0, z, yaw], needed)
        return [x, y, z, yaw]

    def _needed(self, rates: Sequence[float], ahead: Sequence[float], gentle: float) -> float:
        """Return the duration of a change of joint velocities, in windows of the first average."""
        window = self._windows[0]
        return max(
            self._kinematics.tool_speed(ahead, rates) / (gentle * window),
            *[
                abs(rate) / (_FOLLOWED * limit.max_acceleration * window)
                for rate, limit in zip(rates, self._limits, strict=True)
            ],
        )

    def _target(self, time: float, period: float) -> tuple[float, ...]:
        """Return the target joint velocities, within limits of joints and tool."""
        self._wrist_held = self._level_share == 0.0
        self._cause, self._level_share = None, 1.0
        self._elbow_speeds = -math.inf, math.inf
        ahead = [p + v * period for p, v in zip(self.positions, self.velocities, strict=True)]
        wanted_now = self._command_now(time, ahead)
        a, b, c, d = self._rate_limited(wanted_now, ahead)
        before = self._average
        self._average = command = self._smoothed.step((a, b, c, d), period)
        self._accelerating = any(
            abs(after) > abs(each) for each, after in zip(before, command, strict=True)
        )
        if not any(command):
            return _REST
        # A joint that keeps the tool on its line cannot brake faster than the others permit.
        share = _APPROACH if self._windows or self._kind is ToolVelocity else 1.0
        bounds = self._stops.speeds(self.positions, self.velocities, self._ranges(), period, share)
        self._elbow_speeds = bounds[0][2], bounds[1][2]
        if self._kind is JointVelocity:
            wanted = self._clipped(command, bounds)
        else:
            rates = self._rates(ahead, command)
            # A released tool stays on its line to the end, where it can.
            if any(wanted_now) or self._side.near(ahead[2]):
                rates = self._level_limited(rates, bounds, wanted_now)
            wanted = self._scaled(rates, bounds)
        return self._within_tool_speed(wanted, self._kinematics.tool_speed(ahead, wanted))

    def _ranges(self) -> PositionBounds:
        """Return the allowed joint positions; tool velocities keep the elbow on its side."""
        lower = [limit.lower for limit in self._limits]
        upper = [limit.upper for limit in self._limits]
        if self._kind is ToolVelocity:
            low, high = self._side.range
            lower[2], upper[2] = max(lower[2], low), min(upper[2], high)
        return np.array(lower), np.array(upper)

    def _clipped(self, wanted: Sequence[float], bounds: VelocityBounds) -> tuple[float, ...]:
        result = []
        for index, (value, low, high) in enumerate(zip(wanted, *bounds, strict=True)):
            result.append(min(max(value, low), high))
            if result[-1] != value:
                self._cause = self._cause_of_bound(index, value, bounds)
        return tuple(result)

    def _level_limited(
        self, rates: Joints, bounds: VelocityBounds, wanted: Sequence[float]
    ) -> Joints:
        """Return rates whose part for the wrist's axis is limited alone where the reach ends.

        Elsewhere all rates are limited together. Turning the hand and the lift go on.

        Args:
            rates: Velocities of the joints for the averaged command.
            bounds: Of these.
            wanted: The command.
        """
        share, near = 1.0, self._side.near(self.positions.j3)
        if near and self._wrist_waits(rates, wanted):
            share, self._level_share, self._cause = 0.0, 0.0, self._at_end_of_reach()
        for index in (0, 2):
            value, most = rates[index], _most(rates[index], bounds, index)
            if abs(value) * share <= most + _ROUNDING:
                continue
            cause = self._cause_of_bound(index, value, bounds)
            if near or cause.limit in {JogLimit.STRETCHED, JogLimit.FOLDED}:
                share = most / abs(value)
                fast = cause.limit is JogLimit.JOINT_SPEED
                self._level_share = 1.0 if fast else share
                self._cause = (self._at_end_of_reach() if fast else cause)._replace(level=True)
        if share == 1.0:
            return rates
        if share < _RESTART:
            self._restart_averaging_level()
        j1, j2, j3, j4 = rates
        return Joints(share * j1, j2, share * j3, j4 + (1.0 - share) * (j1 + j3))

    def _wrist_waits(self, rates: Joints, wanted: Sequence[float]) -> bool:
        """Return whether the wrist's axis stands: averages of x and y lag behind that of yaw.

        Args:
            rates: Velocities of the joints for the averaged command.
            wanted: The command.
        """
        if not any(wanted):
            return self._wrist_held
        elbow = self._rates(self.positions, wanted).j3
        return elbow * rates.j3 < 0.0 and self._side.ends(self.positions.j3, elbow)

    def _scaled(self, wanted: Sequence[float], bounds: VelocityBounds) -> tuple[float, ...]:
        """Return all velocities times one share, so that the tool keeps its direction."""
        share = 1.0
        for index, value in enumerate(wanted):
            most = _most(value, bounds, index)
            if abs(value) * share > most + _ROUNDING:
                share = most / abs(value)
                self._cause = self._cause_of_bound(index, value, bounds)
        if share < _RESTART:
            self._restart_averaging(self.velocities)
        return tuple(value * share for value in wanted)

    def _at_end_of_reach(self) -> LimitCause:
        folded = self._side.folded(self.positions.j3)
        return LimitCause(JogLimit.FOLDED if folded else JogLimit.STRETCHED, level=True)

    def _cause_of_bound(self, index: int, value: float, bounds: VelocityBounds) -> LimitCause:
        """Return why a joint may not have a velocity.

        Args:
            index: Number of the joint, from 0.
            value: The velocity.
            bounds: Of the velocities.
        """
        limit, upper = self._limits[index], value > 0.0
        if _most(value, bounds, index) >= limit.max_velocity:
            return LimitCause(JogLimit.JOINT_SPEED, limit)
        return self._cause_of_range(index, upper)

    def _cause_of_range(self, index: int, upper: bool) -> LimitCause:
        """Return the cause for a joint that may not leave its range."""
        limit = self._limits[index]
        if self._ranges()[int(upper)][index] != (limit.upper if upper else limit.lower):
            return self._at_end_of_reach()
        return LimitCause(JogLimit.JOINT_LIMIT, limit, upper)

    def _cause_of_hindrance(self, hindrance: Hindrance) -> LimitCause:
        if hindrance.pair is not None:
            return LimitCause.of_pair(hindrance.pair)
        if hindrance.joint is not None:
            return self._cause_of_range(hindrance.joint, hindrance.upper)
        return LimitCause(JogLimit.TOOL_SPEED, speed=self.tool_speed)


def _most(value: float, bounds: VelocityBounds, index: int) -> float:
    """Return the highest speed of a joint in the direction of a velocity."""
    low, high = bounds
    return max(high[index], 0.0) if value > 0.0 else max(-low[index], 0.0)


def _shared(change: list[float], needed: float) -> list[float]:
    """Return the share of a change that is possible in the time of one of ``needed``."""
    return change if needed <= 1.0 else [each / needed for each in change]
