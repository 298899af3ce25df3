"""Enabling and disabling of the joints and of the gripper's servo; nothing moves."""

from __future__ import annotations

from typing import Any

from bioscara.hardware import LifecycleState
from bioscara.robot.arm import Arm
from bioscara.robot.connection.stack import GRIPPER as GRIPPER_CONTROLLER
from bioscara.robot.operations.arbiter import GRIPPER
from bioscara.robot.operations.operation import Cycles, Operation


class Enable(Operation[None]):
    """Enables all joints at their positions."""

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Enable the joints; a stop meanwhile releases them again."""
        self.claim.require_not_stopped()
        yield from arm.session.enabling(self.claim.require_not_stopped)


class Disable(Operation[None]):
    """Brings all joints to rest and disables them."""

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Disable the joints."""
        yield from arm.session.disabling()
        # Disabling takes longer than a cycle where a joint fails.
        arm.restart_loop(self)


class EnableGripper(Operation[None]):
    """Drives the servo of the gripper at its present position."""

    devices = GRIPPER

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Drive the servo."""
        self.claim.require_not_stopped()
        yield from drive(arm, self)


class DisableGripper(Operation[None]):
    """Releases the servo of the gripper."""

    devices = GRIPPER

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Release the servo, without a control cycle."""
        gripper = arm.session.gripper
        if gripper.state is LifecycleState.ACTIVE:
            now = arm.session.clock.now()
            arm.stack.manager.set_hardware_state(gripper.name, LifecycleState.INACTIVE, now)
        yield from ()


def drive(arm: Arm, operation: Operation[Any]) -> Cycles[None]:
    """Drive the servo of the gripper, unless it is driven.

    Raises:
        FaultedError: A fault is latched.
        GripperError: There is no output for it, or it cannot be used.
    """
    stack, gripper = arm.stack, arm.session.gripper
    stack.supervisor.require_clear()
    if gripper.state is not LifecycleState.ACTIVE:
        gripper.set_state(LifecycleState.ACTIVE)
    if stack.gripper.state is not LifecycleState.ACTIVE:
        arm.restart_loop(operation)
        yield None
        stack.manager.switch(arm.session.clock.now(), (GRIPPER_CONTROLLER,))
