"""What a joint can do, as planning needs to know it."""

from __future__ import annotations

from typing import Protocol

from bioscara.kinematics import Range


class JointLimits(Range, Protocol):
    """Limits of one joint; :class:`bioscara.model.JointParameters` is one."""

    @property
    def max_velocity(self) -> float:
        """Highest speed [unit/s]."""
        ...

    @property
    def max_acceleration(self) -> float:
        """Highest acceleration [unit/s^2]."""
        ...

    @property
    def max_jerk(self) -> float:
        """Highest jerk [unit/s^3]."""
        ...
