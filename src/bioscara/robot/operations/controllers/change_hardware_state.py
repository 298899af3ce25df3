"""Lifecycle states of hardware components, set by clients as in ros2_control."""

from __future__ import annotations

from bioscara.control.controllers.controller import AnyController
from bioscara.control.manager.switch_request import Strictness
from bioscara.hardware import HardwareComponent, LifecycleState
from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import Device
from bioscara.robot.operations.controllers.run_controllers import RunControllers, commanding, switch
from bioscara.robot.operations.operation import Cycles, Operation


class ChangeHardwareState(Operation[LifecycleState]):
    """Brings a hardware component to a lifecycle state; clients' controllers of it are left first.

    Args:
        component: Name of the component.
        state: The state.
        uses: The used devices.
        claim: Whether to claim that; not where :class:`RunControllers` has claimed it.
    """

    def __init__(
        self, component: str, state: LifecycleState, uses: frozenset[Device], *, claim: bool
    ) -> None:
        self.devices, self._uses = uses if claim else frozenset(), uses
        super().__init__(f"setting {component} {state.label}")
        self._component, self._state = component, state

    def cycles(self, arm: Arm) -> Cycles[LifecycleState]:
        """Let controllers bring it to rest, then change its state without a control cycle."""
        stack, clock = arm.stack, arm.session.clock
        self.claim.require_not_stopped()
        (component,) = (each for each in stack.manager.components if each.name == self._component)
        if self._state is LifecycleState.ACTIVE:
            stack.supervisor.require_clear()
            yield from self._activate(arm, component)
        elif component is stack.hardware and component.state is LifecycleState.ACTIVE:
            leaving = [each.name for each in commanding(stack) if _commands(each, component)]
            switch(stack, clock.now(), (), leaving, Strictness.STRICT)
            since = clock.now()
            while not stack.supervisor.stopper.at_rest(clock.now(), since):
                yield None
            self._require_alone(arm)
        if component.state is not self._state:
            stack.manager.set_hardware_state(component.name, self._state, clock.now())
        if stack.hardware.available:
            stack.broadcast(clock.now())
        # It takes longer than a cycle.
        stack.loop.restart()
        return component.state

    def _require_alone(self, arm: Arm) -> None:
        """Raise if another operation has begun since the controllers were left."""
        for other in arm.operations:
            others = not (other is self or isinstance(other, RunControllers))
            if others and other.devices & self._uses:
                raise other.claim.refuse(self.name)

    def _activate(self, arm: Arm, component: HardwareComponent) -> Cycles[None]:
        if component is arm.stack.hardware:
            yield from arm.session.enabling(self.claim.require_not_stopped)
        else:
            component.set_state(LifecycleState.ACTIVE)


def _commands(controller: AnyController, component: HardwareComponent) -> bool:
    return any(name in component.commands for name in controller.command_interfaces)
