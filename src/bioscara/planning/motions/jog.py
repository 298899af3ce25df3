"""Motion by streamed velocities, which at every instant has room to come to rest.

Each step takes the largest share of what is asked for after which the arm can still brake, every
joint with its own acceleration, without passing a joint limit, the tool's speed or a zone's margin
on the way. Where no share allows it, the arm brakes along the way that was looked at a step before.
So it slows down towards a zone and rests at its border; leaving it is always possible.
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
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.shapes import Array
from bioscara.planning.collision.stopping import Bounds, Ranges, StoppingCheck
from bioscara.planning.limits import JointLimits
from bioscara.planning.motions.tool_speed import REDUCED_SPEED
from bioscara.planning.moving_average import Smoothed

EXPIRY = 0.15
"""How long a command holds [s]: a client that vanishes must not leave the arm moving."""
_FASTEST = 1.0
"""Tool velocity that no command asks for [m/s]: a larger one is in millimetres."""
_STRETCHED = 0.02
"""Elbow angle that tool velocities do not pass [rad]: beyond it the arm would flip over."""
_ROUNDING = 1e-12
_REST = (0.0,) * 4
_FOLLOWED = 0.8
"""Share of a joint's acceleration that what is asked for makes; the rest is for the way's bends."""
_GENTLE = 0.4
"""Acceleration with which the tool gets faster where what is asked for is averaged [m/s^2]."""
_EARLY = 0.2
"""Share of its deceleration with which a joint then comes to its limits."""
_MUCH = 0.8
"""Share of what was wanted below which the arm begins again from the speed that it has."""
_SHARES = (0.97, 0.9, 0.8, 0.65, 0.5, 0.3, 0.1, 0.0)
"""What is tried when all of what is asked for is too much."""


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
    """Velocity of the tool in the frame that poses are given in.

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


class Jog:
    """An arm that is moved by velocities.

    Args:
        arm: The arm with its tool.
        limits: Of its joints.
        start: Where the joints are, at rest [rad, m, rad, rad].
        scene: What to keep clear of; None for nothing.
        tool_speed: Highest speed of the tool [m/s].
        windows: Over how long what is asked for is averaged, once for each [s].

    Attributes:
        tool_speed: As given; may be changed at any time.
        positions: Where the joints are commanded to be [rad, m, rad, rad].
        velocities: How they are commanded to move [rad/s, m/s, rad/s, rad/s].
        reason: Why the arm does not do all that is asked: ``"expired"``, ``"stretched"``,
            ``"resting"`` between velocities of joints and of the tool, ``"tool speed"``,
            ``"j1 limit"``, the name of a zone, ``"table"`` or a link of the arm; ``""`` where it
            does.

    Raises:
        LimitError: The start is outside a joint's limits, or the tool speed is not above zero.
        ZoneError: The start is nearer to something than the scene's margin.
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
        self._since, self._held_up = -math.inf, False
        self._windows = tuple(windows)
        self._soon = (0.0, *itertools.accumulate(windows))
        self._smoothed = Smoothed(windows, _REST)
        self._kind: type[JointVelocity | ToolVelocity] = JointVelocity
        self._stops.check_start(self.positions)

    def command(
        self, velocity: JointVelocity | ToolVelocity, time: float, share: float = 1.0
    ) -> None:
        """Ask for a velocity; it holds until the next one, at most for :data:`EXPIRY`.

        Args:
            velocity: Of the joints or of the tool.
            time: When it was received [s].
            share: Of the velocity that is wanted, 0 to 1.

        Raises:
            LimitError: It is larger than any that the arm can do.
            InvalidArgumentError: It is no velocity, a value is not finite, or the share is none.
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
        """Move on by one period.

        Args:
            time: Now [s], on the clock of :meth:`command`.
            period: Until the next step [s].

        Returns:
            Positions and velocities of the joints at the end of the period.

        Raises:
            InvalidArgumentError: The period is not above zero, or the time not a number.
        """
        time, period = number("jog: the time", time), number("jog: the period", period)
        if period <= 0.0:
            raise InvalidArgumentError(f"jog: a step of {period:g} s is not above 0")
        target = np.array(self._target(time, period))
        here, moving = np.array(self.positions), np.array(self.velocities)
        ranges, straight = self._ranges(), self._kind is ToolVelocity
        # Who was held up mostly still is: then all shares are looked at together.
        for shares in ((1.0, *_SHARES),) if self._held_up else ((1.0,), _SHARES):
            next_ = self._stops.approach(moving, np.outer(shares, target), period, straight)
            there = here + (moving + next_) * (period / 2.0)
            first, hindrance = self._stops.allowed(
                here, moving, there, next_, period, self.tool_speed, ranges
            )
            self._held_up = first is None or shares[first] < 1.0
            if self._held_up:
                self.reason = hindrance or self.reason
            if first is not None:
                if shares[first] < _MUCH:
                    self._begin_again(next_[first].tolist())
                return self._go(there[first], next_[first])
        positions, velocities = self._stops.brake(here, moving, period)
        self._begin_again(velocities.tolist())
        return self._go(positions, velocities)

    def _go(self, positions: Array, velocities: Array) -> tuple[Joints, Joints]:
        self.positions = Joints(*positions.tolist())
        self.velocities = Joints(*velocities.tolist())
        return self.positions, self.velocities

    def _begin_again(self, velocities: Sequence[float]) -> None:
        """Average from how the arm moves now on: what hindered it may be gone in an instant."""
        self._smoothed.fill(self._as_asked(velocities))

    def _as_asked(self, velocities: Sequence[float]) -> Sequence[float]:
        """Return velocities of the joints as what is asked for: theirs, or the tool's."""
        if self._kind is JointVelocity:
            return velocities
        return [sum(map(mul, row, velocities)) for row in self._arm.jacobian(self.positions)]

    def _asked(self, time: float, ahead: Sequence[float]) -> tuple[float, ...]:
        """Return what is asked for now, no faster than the tool may be."""
        if not any(self._velocity):
            return _REST
        if not 0.0 <= time - self._since <= EXPIRY:
            self.reason = "expired"
            return _REST
        kind = type(self._velocity)
        if kind is ToolVelocity:
            try:
                self._arm.rates(ahead, self._velocity)
            except UnreachableError:
                self.reason = "stretched"
                kind = JointVelocity
        if kind is not self._kind:
            if self._windows and any(self.velocities) and not self.reason:
                # What is even for the tool is not for the joints, and the other way round.
                self.reason = "resting"
                return _REST
            self._kind = kind
            self._begin_again(self.velocities)
        if self.reason:
            return _REST
        if self._kind is JointVelocity:
            # What is asked for now is gone at over all of the averages: the arm may be longer then.
            speed = max(
                self._arm.tool_speed(
                    [p + v * soon for p, v in zip(ahead, self.velocities, strict=True)],
                    self._velocity,
                )
                for soon in self._soon
            )
        else:
            speed = math.hypot(*self._velocity[:3])
        if speed <= self.tool_speed:
            return tuple(self._velocity)
        self.reason = "tool speed"
        return tuple([value * self.tool_speed / speed for value in self._velocity])

    def _in_time(self, asked: Sequence[float], ahead: Sequence[float]) -> Sequence[float]:
        """Return what is asked for, no farther from how it was than the joints can follow.

        What gets less does so as fast as they can. What gets more does so gently, and what turns
        round rests between: a load that breaks away from its friction swings.
        """
        if not self._windows:
            return asked
        oldest = self._smoothed.oldest
        less, more = [0.0] * 4, [0.0] * 4
        for index, (before, after) in enumerate(zip(oldest, asked, strict=True)):
            aim = after if before * after >= 0.0 else 0.0
            (less if abs(aim) < abs(before) else more)[index] = aim - before
        less, more = self._followed(less, ahead), self._followed(more, ahead, _GENTLE)
        return [a + b + c for a, b, c in zip(oldest, less, more, strict=True)]

    def _followed(
        self, change: list[float], ahead: Sequence[float], gentle: float = math.inf
    ) -> list[float]:
        """Return the share of a change that joints and tool can make in the first average.

        Args:
            change: Of what is asked for.
            ahead: Where the joints are.
            gentle: Acceleration of the tool [m/s^2].
        """
        if not any(change):
            return change
        rates: Sequence[float] = change
        if self._kind is ToolVelocity:
            try:
                rates = self._arm.rates(ahead, change)
            except UnreachableError:
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
        """Return the joint velocities to go for, within limits of joints and tool."""
        self.reason = ""
        ahead = [p + v * period for p, v in zip(self.positions, self.velocities, strict=True)]
        a, b, c, d = self._in_time(self._asked(time, ahead), ahead)
        asked = self._smoothed.step((a, b, c, d), period)
        if not any(asked):
            return _REST
        share = _EARLY if self._windows else 1.0
        bounds = self._stops.speeds(self.positions, self.velocities, self._ranges(), period, share)
        if self._kind is JointVelocity:
            wanted = self._clipped(asked, bounds)
        else:
            try:
                rates = self._arm.rates(ahead, asked)
            except UnreachableError:
                self.reason = "stretched"
                self._begin_again(self.velocities)
                return _REST
            wanted = self._scaled(rates, bounds)
        speed = self._arm.tool_speed(ahead, wanted)
        if speed <= self.tool_speed:
            return wanted
        self.reason = self.reason or "tool speed"
        return tuple(value * self.tool_speed / speed for value in wanted)

    def _ranges(self) -> Ranges:
        """Return where the joints may be; tool velocities keep the elbow on its side."""
        lower = [limit.lower for limit in self._limits]
        upper = [limit.upper for limit in self._limits]
        if self._kind is ToolVelocity:
            elbow = self.positions.j3
            # Half turns: at each the arm is stretched or folded.
            side = math.pi * math.floor(elbow / math.pi)
            lower[2] = max(lower[2], min(elbow, side + _STRETCHED))
            upper[2] = min(upper[2], max(elbow, side + math.pi - _STRETCHED))
        return np.array(lower), np.array(upper)

    def _clipped(self, wanted: Sequence[float], bounds: Bounds) -> tuple[float, ...]:
        result = []
        for limit, value, low, high in zip(self._limits, wanted, *bounds, strict=True):
            result.append(min(max(value, low), high))
            if result[-1] != value:
                self.reason = f"{limit.name} limit"
        return tuple(result)

    def _scaled(self, wanted: Sequence[float], bounds: Bounds) -> tuple[float, ...]:
        """Return all velocities times one share, so that the tool keeps its direction."""
        share = 1.0
        for index, (value, low, high) in enumerate(zip(wanted, *bounds, strict=True)):
            most = max(high, 0.0) if value > 0.0 else max(-low, 0.0)
            if abs(value) * share > most + _ROUNDING:
                share = most / abs(value)
                limit, up = self._limits[index], value > 0.0
                own = self._ranges()[int(up)][index] == (limit.upper if up else limit.lower)
                self.reason = f"{limit.name} limit" if own else "stretched"
        if share < _MUCH:
            self._begin_again(self.velocities)
        return tuple(value * share for value in wanted)
