"""Power of the joints, and the recovery from a fault; nothing moves."""

from __future__ import annotations

from bioscara.robot.operations import fault_handling, power
from bioscara.robot.tasks.scope import Scope
from bioscara.robot.tasks.task import Task

__all__ = ["Acknowledge", "Disable", "Enable", "PowerTask", "Recover"]


class Enable(Task, frozen=True, tag="enable"):
    """Enable all joints at their positions."""

    scope = Scope.OPERATE
    simple_operation = power.Enable


class Disable(Task, frozen=True, tag="disable"):
    """Bring all joints to rest and disable them."""

    scope = Scope.OPERATE
    simple_operation = power.Disable


class Acknowledge(Task, frozen=True, tag="acknowledge"):
    """Acknowledge the faults and write their evidence."""

    scope = Scope.OPERATE
    simple_operation = fault_handling.Acknowledge


class Recover(Task, frozen=True, tag="recover"):
    """Clear acknowledged faults."""

    scope = Scope.OPERATE
    simple_operation = fault_handling.Recover


PowerTask = Enable | Disable | Acknowledge | Recover
"""The tasks of power and faults."""
