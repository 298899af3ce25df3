"""The last host stage before the bus: every command of every source is bounded here.

First each joint alone, by its own limits; then, in stages, all joints of the arm together.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import ClassVar, Literal, Protocol

from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.hardware import HardwareComponent


class CommandSource(Protocol):
    """An active controller, as far as the limits depend on it."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def collision_checked(self) -> bool:
        """Whether its commands, begun from rest, are verified to keep the arm clear."""

    @property
    def smooth(self) -> bool:
        """Whether its commands, begun from rest, are too gentle for the belts to swing."""

    def on_collision_stop(self, reason: str, rest: Mapping[str, float]) -> None:
        """React to a stop of the arm because the commanded motion is not clear.

        Args:
            reason: Why, in words.
            rest: Where the joints come to rest, by name [rad or m].
        """


Property = Literal["collision_checked", "smooth"]
"""A property of the sources of commands."""


class Stage(Protocol):
    """Bounds the commands of several joints together.

    Attributes:
        CONCERNS: The property that sources lack whose commands the stage treats.
    """

    CONCERNS: ClassVar[Property]

    def prepare(self, period: float, concerned: Sequence[CommandSource]) -> None:
        """Evaluate the requests before each joint is bounded; arguments as :meth:`apply`."""

    def apply(self, period: float, concerned: Sequence[CommandSource]) -> None:
        """Bound the commands left by the single-joint limits and the stages before.

        Args:
            period: Time since the last cycle [s].
            concerned: Sources of the commands that lack the property.
        """


def joint_limiters(components: Iterable[HardwareComponent]) -> dict[str, JointLimiter]:
    """Return a limiter for each joint that has limits, by name."""
    return {
        name: JointLimiter(
            limits,
            component.commands[f"{name}/position"],
            component.commands[f"{name}/velocity"],
            component.states[f"{name}/position"],
            component.states[f"{name}/velocity"],
        )
        for component in components
        for name, limits in component.limits.items()
    }


class Limiter:
    """Bounds the commands of all joints that have limits.

    Args:
        joints: The limiter of each joint, by name.
        stages: Bound joints together, one after the other.

    Attributes:
        joints: As given.
        stages: As given; may be replaced while the arm is at rest.
    """

    def __init__(self, joints: Mapping[str, JointLimiter], stages: Sequence[Stage] = ()) -> None:
        self.joints, self.stages = joints, tuple(stages)
        self._limit_each = tuple(joint.apply for joint in joints.values())

    def moving(self) -> set[str]:
        """Return the joints whose position or velocity is commanded."""
        return {name for name, joint in self.joints.items() if joint.commanded}

    def begin(self, joints: Iterable[str], moving: Collection[str]) -> None:
        """Let a controller take joints over; preset their commands to continue their motion.

        Args:
            joints: Their names; those without limits are skipped.
            moving: Joints under command until now, which continue from their last commands; the
                others start from the measured state.
        """
        for name in joints:
            joint = self.joints.get(name)
            if joint is not None:
                if name not in moving:
                    joint.begin()
                joint.resume()

    def speeds(self, joints: Collection[str]) -> dict[str, float]:
        """Return the velocity that was commanded last, of those joints that have limits."""
        return {name: joint.speed for name, joint in self.joints.items() if name in joints}

    def lag_of(self, joint: str) -> float:
        """Return how far the setpoints of a joint lag behind its commands [rad or m]."""
        limiter = self.joints.get(joint)
        return 0.0 if limiter is None else limiter.lag

    def apply(self, period: float, sources: Sequence[CommandSource]) -> None:
        """Bound every command.

        Args:
            period: Time since the last cycle [s].
            sources: The active controllers that command a position or a velocity.
        """
        concerned: dict[Property, list[CommandSource]] = {
            "collision_checked": [source for source in sources if not source.collision_checked],
            "smooth": [source for source in sources if not source.smooth],
        }
        stages = [(stage, concerned[stage.CONCERNS]) for stage in self.stages]
        for stage, those in reversed(stages):
            stage.prepare(period, those)
        for limit in self._limit_each:
            limit(period)
        for stage, those in stages:
            stage.apply(period, those)
