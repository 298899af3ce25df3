"""Controller types and loaded controllers: load, configure, clean up, unload."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, MutableSequence

from bioscara.arguments import text
from bioscara.control.controllers.controller import AnyController
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.hold_controller import HoldController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.jog_controller import JogController
from bioscara.control.controllers.joint_state_broadcaster import JointStateBroadcaster
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.manager.switch_request import unknown
from bioscara.control.manager.update_rate import Schedule
from bioscara.errors import SwitchError
from bioscara.hardware import LifecycleState

TYPES: dict[str, type[AnyController]] = {
    controller.TYPE: controller
    for controller in (
        ForwardCommandController,
        GripperActionController,
        HoldController,
        HomingController,
        JogController,
        JointStateBroadcaster,
        JointTrajectoryController,
    )
}
"""Every controller type by the name that ROS gives it."""


class ControllerRegistry:
    """Loaded controllers by name, in the order in which they were loaded.

    Args:
        rate: Cycles per second of the manager that runs them [Hz].
        warnings: Takes messages about a controller that are no reason to refuse it.

    Attributes:
        controllers: All of them.
        changes: How often one was loaded, configured, cleaned up or removed.
    """

    def __init__(self, rate: int, warnings: MutableSequence[str]) -> None:
        self._rate, self._warnings = rate, warnings
        self.controllers: dict[str, AnyController] = {}
        self.changes = 0

    def get(self, name: str) -> AnyController:
        """Return the loaded controller of that name.

        Raises:
            SwitchError: There is none.
        """
        if text("the name of a controller", name) not in self.controllers:
            raise SwitchError(unknown(name, self.controllers))
        return self.controllers[name]

    def add(self, controller: AnyController) -> None:
        """Load a controller that was made; errors as ``ControllerManager.add``."""
        name = controller.name
        if name in self.controllers:
            raise SwitchError(f"a controller named {name} is loaded already")
        self.controllers[name] = controller
        self.changes += 1

    @staticmethod
    def make(name: str, kind: str, values: Mapping[str, object]) -> AnyController:
        """Make a controller; arguments and errors as ``ControllerManager.make``."""
        text("the name of a controller", name)
        if text("the type of a controller", kind) not in TYPES:
            raise SwitchError(unknown(kind, TYPES, "controller type"))
        made = TYPES[kind]
        parameters = made.PARAMETERS.read(name, values)
        if name in parameters.fallback_controllers:
            raise SwitchError(f"{name} cannot be its own fallback")
        return made(name, parameters)

    def configure(self, name: str) -> None:
        """Make it INACTIVE, from INACTIVE too; errors as ``ControllerManager.configure``."""
        controller = self.get(name)
        if controller.state is LifecycleState.INACTIVE:
            self.cleanup(name)
        if controller.state is not LifecycleState.UNCONFIGURED:
            raise SwitchError(f"{name} is {controller.state.label}: it cannot be configured")
        controller.on_configure()
        for names in (controller.command_interfaces, controller.state_interfaces):
            twice, count = Counter(names).most_common(1)[0] if names else ("", 0)
            if count > 1:
                controller.on_cleanup()
                raise SwitchError(f"{name} names {twice} twice")
        self._warn_about_rate(controller)
        self._enter(controller, LifecycleState.INACTIVE)

    def cleanup(self, name: str) -> None:
        """Make it UNCONFIGURED; errors as ``ControllerManager.cleanup``."""
        controller = self.get(name)
        if controller.state is LifecycleState.UNCONFIGURED:
            return
        if controller.state is not LifecycleState.INACTIVE:
            raise SwitchError(f"{name} is {controller.state.label}: deactivate it first")
        for other in self.controllers.values():
            if other.state is LifecycleState.ACTIVE and name in self.fallbacks(other):
                raise SwitchError(
                    f"{name} is a fallback of {other.name}: deactivate {other.name} first"
                )
        controller.on_cleanup()
        self._enter(controller, LifecycleState.UNCONFIGURED)

    def unload(self, name: str) -> None:
        """Remove it; errors as ``ControllerManager.unload``."""
        self.cleanup(name)
        self._enter(self.controllers.pop(name), LifecycleState.FINALIZED)

    def finalize(self) -> None:
        """Make all controllers FINALIZED: none can be used again."""
        for controller in self.controllers.values():
            self._enter(controller, LifecycleState.FINALIZED)

    def fallbacks(self, controller: AnyController) -> list[str]:
        """Return the names of all fallbacks of a controller, and theirs, nearest first."""
        found: list[str] = []
        waiting = list(controller.parameters.fallback_controllers)
        while waiting:
            name = waiting.pop(0)
            if name not in found:
                found.append(name)
                if name in self.controllers:
                    waiting += self.controllers[name].parameters.fallback_controllers
        return found

    def check_fallbacks(self, controller: AnyController) -> list[AnyController]:
        """Return all fallbacks of ``controller``, each of which is in a state to take over.

        Raises:
            SwitchError: One is not, or they lead back to where they started.
        """
        ready: list[AnyController] = []
        refused = f"{controller.name} cannot be activated: "
        for name in self.fallbacks(controller):
            fallback = self.controllers.get(name)
            if fallback is None:
                raise SwitchError(f"{refused}fallback: {unknown(name, self.controllers)}")
            if name == controller.name or name in self.fallbacks(fallback):
                raise SwitchError(f"{refused}its fallbacks lead back to {name}")
            if fallback.state not in (LifecycleState.INACTIVE, LifecycleState.ACTIVE):
                raise SwitchError(
                    f"{refused}its fallback {name} is {fallback.state.label}; configure it first"
                )
            ready.append(fallback)
        return ready

    def _enter(self, controller: AnyController, state: LifecycleState) -> None:
        controller.state = state
        self.changes += 1

    def _warn_about_rate(self, controller: AnyController) -> None:
        asked = controller.parameters.update_rate
        got = Schedule(self._rate, asked).rate
        if asked and got != asked:
            self._warnings.append(
                f"{controller.name}: update_rate {asked} Hz becomes {got:g} Hz: it must divide "
                f"the {self._rate} Hz of the cycle"
            )
