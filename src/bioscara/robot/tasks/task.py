"""A task of an arm, as a value."""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import msgspec

from bioscara.arguments import shown
from bioscara.errors import InvalidArgumentError, NotSupportedError
from bioscara.robot.arm import Arm
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory
from bioscara.robot.operations.operation import OnCycle, Operation
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.tasks.checks import check_fields
from bioscara.robot.tasks.fields import Share
from bioscara.robot.tasks.scope import Scope


class Conditions(NamedTuple):
    """How a task is carried out.

    Attributes:
        timeout: Longest duration [s]; None for no limit.
        on_cycle: Receives the record of each cycle; None for no records.
    """

    timeout: float | None = None
    on_cycle: OnCycle | None = None


class Task(msgspec.Struct, frozen=True, tag_field="kind", forbid_unknown_fields=True):
    """Something that an arm can be asked to do; its fields are the arguments.

    A method of :class:`bioscara.robot.arm_methods.ArmMethods` makes it, a client sends it as it is,
    and a step of a sequence has it.

    Attributes:
        scope: The right that a client needs.
        method: The method or property of a robot that does it, where it is not named as its kind.
        step: Whether a step of a sequence may be one.
        simple_operation: The operation that carries it out, where that takes only its name; None
            where it takes more.

    Raises:
        InvalidArgumentError: A value cannot be used; nothing moved.
    """

    scope: ClassVar[Scope] = Scope.ADMIN
    method: ClassVar[str] = ""
    step: ClassVar[bool] = False
    simple_operation: ClassVar[type[Operation[Any]] | None] = None

    def __post_init__(self) -> None:
        check_fields(self)

    @classmethod
    def kind(cls) -> str:
        """Return its name in messages and files."""
        return str(cls.__struct_config__.tag)

    @classmethod
    def call(cls) -> str:
        """Return the method or property of a robot that does it, as ``gripper.move``."""
        return cls.method or cls.kind()

    def operation(self, arm: Arm, conditions: Conditions) -> Operation[Any]:  # noqa: ARG002  of those below
        """Return the operation that carries it out, which is not begun.

        Args:
            arm: The arm.
            conditions: Its longest duration, and the receiver of the records.

        Raises:
            NotSupportedError: Only the owner of an arm can carry it out.
        """
        if self.simple_operation is not None:
            return self.simple_operation(f"{self.call()}()")
        raise NotSupportedError(
            f"{self.kind()} is carried out by the owner of an arm: use Robot.connect('arm:NAME')"
        )


class PlannedMotion(Task, frozen=True, kw_only=True):
    """A motion that is planned, then followed: by the planner's method of its name.

    Attributes:
        velocity_scaling: Share of the speed limits to use, 0.001 to 1.
        acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.
    """

    scope = Scope.OPERATE

    velocity_scaling: Share = 1.0
    acceleration_scaling: Share = 1.0

    def plan(self, planner: Planner) -> Plan:
        """Return the plan from where the arm is; nothing moves."""
        plan: Plan = getattr(planner, self.kind())(**msgspec.structs.asdict(self))
        return plan

    def operation(self, arm: Arm, conditions: Conditions) -> FollowTrajectory:  # noqa: ARG002
        """Return the operation that plans and follows it."""
        return FollowTrajectory(f"{self.call()}()", self.plan, **conditions._asdict())


def require_task(given: object) -> None:
    """Raise unless a value is a task.

    Raises:
        InvalidArgumentError: It is something else.
    """
    if not isinstance(given, Task):
        raise InvalidArgumentError(f"the task is {shown(given)}; give one of bioscara.robot.tasks")
