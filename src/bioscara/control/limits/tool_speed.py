"""Keeps the tool at or below a speed, independent of the source of the commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.control.limits.limiter import CommandSource, Property

_ROUNDING = 1.0 + 1e-3
"""Share by which the tool may be faster: trajectories are slowed down beforehand to the limit."""


class ToolSpeedCap:
    """Slows all joints down together when the tool would be too fast; the direction is kept.

    Args:
        joints: All joints of the arm, in the order that ``speed_of`` takes them.
        speed_of: Returns the tool's speed [m/s] from joint positions and velocities.
        limit: Highest speed of the tool [m/s].

    Attributes:
        share: Share of the limit that applies to raw commands.
        soon: Look-ahead times at which the tool keeps to the limit too, because raw
            commands are averaged and on average sent that much later [s].
        speed_of: As given; changes with the tool.
        limit: As given; may be changed at any time.
        interventions: In how many cycles the joints were slowed down.
    """

    CONCERNS: ClassVar[Property] = "smooth"

    def __init__(
        self,
        joints: Sequence[JointLimiter],
        speed_of: Callable[[Sequence[float], Sequence[float]], float],
        limit: float,
    ) -> None:
        self._joints, self.speed_of = tuple(joints), speed_of
        self.share = 1.0
        self.soon: tuple[float, ...] = ()
        self.limit = limit
        self.interventions = 0

    def prepare(self, period: float, raw: Sequence[CommandSource]) -> None:
        """Reduce requested velocities; to be called before joints are bounded.

        Bounded alone afterwards, the joint with the highest acceleration would get the largest
        share of the tool speed, and the tool would not move in the requested direction.
        """
        joints = self._joints
        requested = [joint.requested_velocity for joint in joints]
        if not any(requested):
            return
        speed = self.speed_of([joint.here for joint in joints], requested)
        if speed > self.limit:
            for joint in joints:
                joint.scale_request(self.limit / speed)

    def apply(self, period: float, raw: Sequence[CommandSource]) -> None:
        """Slow down the commands that were bounded joint by joint; to be called after that.

        Args:
            period: Time since the last cycle [s].
            raw: Sources whose commands keep to ``share`` and ``soon``.
        """
        # These velocities are means over the cycle: they belong to the position in its middle. At
        # its end the tool of a motion exactly at the limit would be rated too fast.
        half, middle, speeds = 0.5 * period, [], []
        for joint in self._joints:
            position, velocity = joint.state
            middle.append(position - velocity * half)
            speeds.append(velocity)
        if not any(speeds):
            return
        speed, limit = self.speed_of(middle, speeds), self.limit
        if self.soon and raw:
            limit *= self.share
            states = [joint.state for joint in self._joints]
            for soon in self.soon:
                ahead = [position + velocity * soon for position, velocity in states]
                later = self.speed_of(ahead, speeds)
                speed = later if not later <= speed else speed
        # Not written as speed > limit: an unknown position must not let any command pass.
        if speed <= limit * _ROUNDING:
            return
        share = limit / speed if speed == speed else 0.0  # noqa: PLR0124
        self.interventions += 1
        for joint in self._joints:
            if joint.commanded:
                joint.slow_down(share, period)
