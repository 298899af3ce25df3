"""Keeps the tool at or below a speed, independent of the source of the commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bioscara.control.controllers.controller import AnyController
from bioscara.control.limits.joint_limiter import JointLimiter

_ROUNDING = 1.0 + 1e-3
"""Share by which the tool may be faster: trajectories are slowed down beforehand to the limit."""


class ToolSpeedCap:
    """Slows all joints down together when the tool would be too fast; the direction is kept.

    Args:
        guards: All joints of the arm, in the order that ``speed_of`` takes them.
        speed_of: Returns the tool's speed [m/s] from joint positions and velocities.
        limit: Highest speed of the tool [m/s].
        driving: Returns the controllers that command the joints.

    Attributes:
        share: Share of the limit that applies to unverified commands.
        soon: Look-ahead times at which the tool keeps to the limit too, because unverified
            commands are averaged and on average sent that much later [s].
        speed_of: As given; changes with the tool.
        limit: As given; may be changed at any time.
        interventions: In how many cycles the joints were slowed down.
    """

    def __init__(
        self,
        guards: Sequence[JointLimiter],
        speed_of: Callable[[Sequence[float], Sequence[float]], float],
        limit: float,
        driving: Callable[[], Sequence[AnyController]] = tuple,
    ) -> None:
        self._guards, self.speed_of = tuple(guards), speed_of
        self._driving, self.share = driving, 1.0
        self.soon: tuple[float, ...] = ()
        self.limit = limit
        self.interventions = 0

    def foresee(self, period: float) -> None:
        """Reduce requested velocities; to be called before joints are bounded.

        Bounded alone afterwards, the joint with the highest acceleration would get the largest
        share of the tool speed, and the tool would not move in the requested direction.
        """
        guards = self._guards
        asked = [guard.asked_velocity for guard in guards]
        if not any(asked):
            return
        speed = self.speed_of([guard.here for guard in guards], asked)
        if speed > self.limit:
            for guard in guards:
                guard.ask_less(self.limit / speed)

    def apply(self, period: float) -> None:
        """Slow down the commands that were bounded joint by joint; to be called after that.

        Args:
            period: Time since the last cycle [s].
        """
        guards = self._guards
        speeds = [guard.speed if guard.commanded else 0.0 for guard in guards]
        if not any(speeds):
            return
        here = [guard.here for guard in guards]
        # These velocities are means over the cycle: they belong to the position in its middle. At
        # its end the tool of a motion exactly at the limit would be rated too fast.
        half = 0.5 * period
        amid = [p - v * half for p, v in zip(here, speeds, strict=True)]
        speed, limit = self.speed_of(amid, speeds), self.limit
        if self.soon and not all(each.collision_checked for each in self._driving()):
            limit *= self.share
            for soon in self.soon:
                there = [p + v * soon for p, v in zip(here, speeds, strict=True)]
                later = self.speed_of(there, speeds)
                speed = later if not later <= speed else speed
        # Not written as speed > limit: an unknown position must not let any command pass.
        if speed <= limit * _ROUNDING:
            return
        share = limit / speed if speed == speed else 0.0  # noqa: PLR0124
        self.interventions += 1
        for guard in guards:
            if guard.commanded:
                guard.slow_down(share, period)
