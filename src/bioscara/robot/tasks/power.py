"""Power of the joints, and the recovery from a fault; nothing moves."""

from __future__ import annotations

from bioscara.robot.arm import Arm
from bioscara.robot.operations import fault_handling, power
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.tasks.task import Conditions, Task

__all__ = ["Acknowledge", "Disable", "Enable", "PowerTask", "Recover"]


class Enable(Task, frozen=True, tag="enable"):
    """Enable all joints at their positions."""

    scope = Scope.OPERATE

    def operation(self, arm: Arm, conditions: Conditions) -> power.Enable:  # noqa: ARG002
        """Return the operation."""
        return power.Enable()


class Disable(Task, frozen=True, tag="disable"):
    """Bring all joints to rest and disable them."""

    scope = Scope.OPERATE

    def operation(self, arm: Arm, conditions: Conditions) -> power.Disable:  # noqa: ARG002
        """Return the operation."""
        return power.Disable()


class Acknowledge(Task, frozen=True, tag="acknowledge"):
    """Acknowledge the faults and write their evidence."""

    scope = Scope.OPERATE

    def operation(self, arm: Arm, conditions: Conditions) -> fault_handling.Acknowledge:  # noqa: ARG002
        """Return the operation."""
        return fault_handling.Acknowledge()


class Recover(Task, frozen=True, tag="recover"):
    """Clear acknowledged faults."""

    scope = Scope.OPERATE

    def operation(self, arm: Arm, conditions: Conditions) -> fault_handling.Recover:  # noqa: ARG002
        """Return the operation."""
        return fault_handling.Recover()


PowerTask = Enable | Disable | Acknowledge | Recover
"""The tasks of power and faults."""
