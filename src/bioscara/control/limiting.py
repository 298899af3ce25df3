"""The last host stage before the bus: every command of every source is bounded here.

What is within its limits passes unchanged. A position that is not is approached as fast as
velocity and acceleration allow, with the way to brake kept in reserve, so that a step becomes a
ramp and a limit is reached at rest.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from bioscara.hardware import HardwareComponent
from bioscara.hardware.interfaces import CommandInterface, StateInterface
from bioscara.model import JointParameters

_ROUNDING = 1.0 + 1e-6
"""Share by which a command may pass a limit of speed or acceleration: differences of samples."""


class Guard:
    """Bounds the commands of one joint.

    Args:
        limits: Of the joint.
        position_command: Its handle.
        velocity_command: Its handle.
        position: What is measured.
        velocity: What is measured.

    Attributes:
        name: Name of the joint.
        reference: Position that was commanded last [rad or m]; NaN before the first.
        speed: Velocity that was commanded last [rad/s or m/s].
        interventions: How many commands were changed.
    """

    __slots__ = (
        "_acceleration", "_fastest", "_lower", "_position", "_position_command", "_raw",
        "_raw_speed", "_upper", "_velocity", "_velocity_command", "interventions", "name",
        "reference", "speed",
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
        self._fastest, self._acceleration = limits.max_velocity, limits.max_acceleration
        self._position_command, self._velocity_command = position_command, velocity_command
        self._position, self._velocity = position, velocity
        self.interventions = 0
        self.reference = self._raw = math.nan
        self.speed = self._raw_speed = 0.0

    @property
    def commanded(self) -> bool:
        """Whether somebody claimed position or velocity of the joint."""
        return bool(self._position_command.owner or self._velocity_command.owner)

    def begin(self) -> None:
        """Start from what is measured: nobody commanded the joint before."""
        measured, speed = self._position.value, self._velocity.value
        self.reference = self._raw = measured
        self.speed = self._raw_speed = speed if math.isfinite(speed) else 0.0

    def resume(self) -> None:
        """Let the next controller go on from where the one before left off."""
        if math.isfinite(self.reference):
            self._position_command.value = self.reference
        self._velocity_command.value = self.speed

    def apply(self, period: float) -> None:
        """Bound what is commanded; arguments as :meth:`Limiter.apply`."""
        if self._position_command.owner:
            self._bound_position(period)
        elif self._velocity_command.owner:
            self._bound_velocity(period)

    def _bound_position(self, period: float) -> None:
        # From beyond a limit, where a joint can only have been pushed, it may but go back.
        lower, upper = min(self._lower, self.reference), max(self._upper, self.reference)
        wanted = min(max(self._position_command.value, lower), upper)
        if wanted != wanted:  # noqa: PLR0124  nothing was commanded yet, or not a number
            return
        step = self._acceleration * period
        towards = (wanted - self._raw) / period
        self._raw = wanted
        self._raw_speed = min(
            max(towards, self._raw_speed - step, -self._fastest),
            self._raw_speed + step,
            self._fastest,
        )
        speed = (wanted - self.reference) / period
        fine = step * _ROUNDING
        if abs(speed - self.speed) > fine or abs(speed) > self._fastest * _ROUNDING:
            speed = self._approach(wanted, period, step)
            wanted = min(max(self.reference + speed * period, lower), upper)
            self._position_command.value = wanted
            self._velocity_command.value = speed
            self.interventions += 1
        elif wanted != self._position_command.value:
            self._position_command.value = wanted
            self.interventions += 1
        self.reference, self.speed = wanted, speed
        velocity = self._velocity_command.value
        bounded = min(max(velocity, -self._fastest), self._fastest)
        if velocity != bounded:
            self._velocity_command.value = bounded if math.isfinite(velocity) else speed

    def _approach(self, wanted: float, period: float, step: float) -> float:
        """Return the speed that brings the joint to a moving target soon and without overshoot."""
        ahead = self._raw_speed
        gap = wanted - self.reference - ahead * period
        speed = ahead + math.copysign(self._brakeable(abs(gap), period), gap)
        speed = min(
            max(speed, -self._brakeable(self.reference - self._lower, period)),
            self._brakeable(self._upper - self.reference, period),
        )
        speed = min(max(speed, self.speed - step), self.speed + step)
        return min(max(speed, -self._fastest), self._fastest)

    def _bound_velocity(self, period: float) -> None:
        wanted = self._velocity_command.value
        if not math.isfinite(wanted):
            wanted = self.speed
        step, here = self._acceleration * period, self._position.value
        speed = min(max(wanted, self.speed - step), self.speed + step)
        speed = min(max(speed, -self._fastest), self._fastest)
        if math.isfinite(here):
            speed = min(
                max(speed, -self._brakeable(here - self._lower, period)),
                self._brakeable(self._upper - here, period),
            )
        if speed != self._velocity_command.value:
            self._velocity_command.value = speed
            self.interventions += 1
        self.speed = speed
        self.reference = self._raw = here
        self._raw_speed = speed

    def _brakeable(self, way: float, period: float) -> float:
        """Return the speed from which one can come to rest within ``way``, after this cycle."""
        if way <= 0.0:
            return 0.0
        acceleration = self._acceleration
        return acceleration * (math.sqrt(period * period + 2.0 * way / acceleration) - period)


class Limiter:
    """Bounds the commands of all joints that have limits.

    Args:
        components: The hardware.

    Attributes:
        guards: One for each joint, by name.
    """

    def __init__(self, components: Sequence[HardwareComponent]) -> None:
        self.guards: dict[str, Guard] = {}
        for component in components:
            for name, limits in component.limits.items():
                self.guards[name] = Guard(
                    limits,
                    component.commands[f"{name}/position"],
                    component.commands[f"{name}/velocity"],
                    component.states[f"{name}/position"],
                    component.states[f"{name}/velocity"],
                )
        self._all = tuple(self.guards.values())

    def begin(self, joints: Iterable[str]) -> None:
        """Start joints that nobody commanded before from what is measured.

        Args:
            joints: Their names; those without limits are passed over.
        """
        for name in joints:
            guard = self.guards.get(name)
            if guard is not None:
                guard.begin()

    def resume(self, joints: Iterable[str]) -> None:
        """Hand joints that are under command to another controller, without a jump.

        Args:
            joints: Their names; those without limits are passed over.
        """
        for name in joints:
            guard = self.guards.get(name)
            if guard is not None:
                guard.resume()

    def apply(self, period: float) -> None:
        """Bound every command.

        Args:
            period: Time since the last cycle [s].
        """
        for guard in self._all:
            guard.apply(period)
