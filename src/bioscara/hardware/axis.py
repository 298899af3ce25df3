"""One joint inside the hardware component: its handles, its mode and what it said last."""

from __future__ import annotations

import math

from bioscara.clock import Clock
from bioscara.drivers import Joint, JointSample, Quality, Setpoint
from bioscara.drivers.sample import UNKNOWN
from bioscara.errors import BioscaraError
from bioscara.hardware.homing import Homing
from bioscara.hardware.interfaces import (
    HOME,
    POSITION,
    VELOCITY,
    CommandInterface,
    StateInterface,
)
from bioscara.hardware.modes import Mode


class Axis:
    """One joint and everything that is remembered about it from cycle to cycle.

    Args:
        joint: The joint.
        clock: Time of its bus.

    Attributes:
        joint: As given.
        homing: Its homing.
        mode: What it does with its command interfaces.
        halted: Why it takes no commands until somebody intervenes; None while it does.
        sample: What it said last.
        answered: Whether it said so while it was written to in the last cycle.
        arrival: How long after the begin of a cycle its setpoint arrives [s], as last seen.
        stamp: When ``sample`` was measured [s].
    """

    __slots__ = (
        "answered", "arrival", "halted", "home", "home_command", "homing", "joint", "lower",
        "mode", "name", "position", "position_command", "previous", "sample", "stamp", "upper",
        "velocity", "velocity_command", "velocity_limit",
    )  # fmt: skip

    def __init__(self, joint: Joint, clock: Clock) -> None:
        self.joint, self.name = joint, joint.name
        self.homing = Homing(joint, clock)
        self.mode = Mode.NONE
        self.halted: BioscaraError | None = None
        self.sample: JointSample = UNKNOWN
        self.answered = False
        self.arrival = 0.0
        self.stamp = -math.inf
        self.previous = math.nan
        self.lower, self.upper = joint.parameters.lower, joint.parameters.upper
        self.velocity_limit = joint.parameters.max_velocity
        self.position = StateInterface(joint.name, POSITION)
        self.velocity = StateInterface(joint.name, VELOCITY)
        self.home = StateInterface(joint.name, HOME)
        self.position_command = CommandInterface(joint.name, POSITION)
        self.velocity_command = CommandInterface(joint.name, VELOCITY)
        self.home_command = CommandInterface(joint.name, HOME)

    @property
    def homed(self) -> bool:
        """Whether the joint knew its position when it spoke last."""
        return self.sample.position is not None

    def take(self, sample: JointSample, stamp: float) -> None:
        """Remember what the joint said; a stale sample keeps the time at which it was fresh."""
        self.sample = sample
        if sample.quality is Quality.FRESH:
            self.stamp = stamp

    def publish(self) -> None:
        """Copy what the joint said last to the state interfaces."""
        sample, stamp = self.sample, self.stamp
        position, velocity, home = self.position, self.velocity, self.home
        velocity.value, velocity.quality, velocity.stamp = sample.velocity, sample.quality, stamp
        if sample.position is None:
            position.value, position.quality, home.value = math.nan, Quality.UNKNOWN, 0.0
        else:
            position.value, position.quality, home.value = sample.position, sample.quality, 1.0
        position.stamp = home.stamp = stamp
        home.quality = sample.quality

    def forget(self) -> None:
        """Know nothing about the joint any more."""
        self.sample, self.stamp, self.answered = UNKNOWN, -math.inf, False
        self.publish()

    def rest_here(self) -> None:
        """Make the commands what was measured: inside the limits, at rest, not homing."""
        measured = self.sample.position
        bounded = math.nan if measured is None else min(max(measured, self.lower), self.upper)
        self.position_command.value, self.previous = bounded, math.nan
        self.velocity_command.value = self.home_command.value = 0.0

    def setpoint(self, period: float) -> Setpoint:
        """Return where the joint is to be one period after the setpoint arrives.

        The position command belongs to one period after the begin of the cycle; the frame arrives
        later than that by ``arrival``, for which the velocity carries it on.

        Args:
            period: Time from cycle to cycle [s].
        """
        position = self.position_command.value
        if self.mode is Mode.TRACK:
            velocity = self.velocity_command.value
        else:
            before = self.previous
            velocity = 0.0 if before != before else (position - before) / period  # noqa: PLR0124
            velocity = min(max(velocity, -self.velocity_limit), self.velocity_limit)
        self.previous = position
        if self.lower <= position <= self.upper:
            # A host that was held up once is not held up again: never more than a period.
            ahead = position + velocity * min(self.arrival, period)
            return Setpoint(min(max(ahead, self.lower), self.upper), velocity)
        return Setpoint(position, velocity)
