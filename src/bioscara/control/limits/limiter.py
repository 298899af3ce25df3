"""The last host stage before the bus: every command of every source is bounded here.

First each joint alone, by its own limits; then, in stages, all joints of the arm together.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Protocol

from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.hardware import HardwareComponent


class Stage(Protocol):
    """Bounds the joint commands together."""

    def foresee(self, period: float) -> None:
        """Evaluate the requests before each joint is bounded; arguments as :meth:`apply`."""

    def apply(self, period: float) -> None:
        """Bound the commands left by the single-joint limits and the stages before.

        Args:
            period: Time since the last cycle [s].
        """


class Limiter:
    """Bounds the commands of all joints that have limits.

    Args:
        components: The hardware.

    Attributes:
        guards: One for each joint, by name.
        stages: Bound joints together, one after the other; none at first.
    """

    def __init__(self, components: Sequence[HardwareComponent]) -> None:
        self.guards: dict[str, JointLimiter] = {}
        self.stages: tuple[Stage, ...] = ()
        for component in components:
            for name, limits in component.limits.items():
                self.guards[name] = JointLimiter(
                    limits,
                    component.commands[f"{name}/position"],
                    component.commands[f"{name}/velocity"],
                    component.states[f"{name}/position"],
                    component.states[f"{name}/velocity"],
                )
        self._all = tuple(self.guards.values())

    def moving(self) -> set[str]:
        """Return the joints whose position or velocity is commanded."""
        return {guard.name for guard in self._all if guard.commanded}

    def begin(self, joints: Iterable[str], moving: Collection[str]) -> None:
        """Let a controller take joints over; preset their commands to continue their motion.

        Args:
            joints: Their names; those without limits are skipped.
            moving: Joints under command until now, which continue from their last commands; the
                others start from the measured state.
        """
        for name in joints:
            guard = self.guards.get(name)
            if guard is not None:
                if name not in moving:
                    guard.begin()
                guard.resume()

    def speeds(self, joints: Collection[str]) -> dict[str, float]:
        """Return the velocity that was commanded last, of those joints that have limits."""
        return {name: guard.speed for name, guard in self.guards.items() if name in joints}

    def apply(self, period: float) -> None:
        """Bound every command.

        Args:
            period: Time since the last cycle [s].
        """
        for stage in reversed(self.stages):
            stage.foresee(period)
        for guard in self._all:
            guard.apply(period)
        for stage in self.stages:
            stage.apply(period)
