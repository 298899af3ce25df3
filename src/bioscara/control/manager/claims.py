"""Claims: the interfaces of all hardware, and their owners."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from bioscara.control.controllers.controller import AnyController
from bioscara.errors import SwitchError
from bioscara.hardware import (
    POSITION,
    VELOCITY,
    CommandInterface,
    HardwareComponent,
    LifecycleState,
    StateInterface,
)
from bioscara.spelling import did_you_mean

_MOTION = frozenset({POSITION, VELOCITY})
"""Kinds of command interfaces that move a joint."""


class Claims:
    """All interfaces of some components.

    Args:
        components: The components; no two have a name or an interface in common.

    Attributes:
        components: As given.
        commands: All command interfaces, by name.
        states: All state interfaces, by name.
    """

    def __init__(self, components: Sequence[HardwareComponent]) -> None:
        self.components = tuple(components)
        self.commands: dict[str, CommandInterface] = {}
        self.states: dict[str, StateInterface] = {}
        self._hardware: dict[str, HardwareComponent] = {}
        for component in components:
            if sum(other.name == component.name for other in components) > 1:
                raise SwitchError(f"two hardware components are named {component.name}; rename one")
            for name in (*component.commands, *component.states):
                other = self._hardware.setdefault(name, component)
                if other is not component:
                    raise SwitchError(f"{name} belongs to {other.name} and to {component.name}")
            self.commands |= component.commands
            self.states |= component.states

    def component(self, interface: str) -> HardwareComponent:
        """Return the component that an existing interface belongs to."""
        return self._hardware[interface]

    def uses(self, controller: AnyController, component: HardwareComponent) -> bool:
        """Return whether ``controller`` uses any interface of ``component``."""
        names = (*controller.command_interfaces, *controller.state_interfaces)
        return any(self._hardware.get(name) is component for name in names)

    def commands_of(self, controller: AnyController, component: HardwareComponent) -> list[str]:
        """Return the command interfaces of ``component`` that ``controller`` needs."""
        return [
            name for name in controller.command_interfaces if self._hardware.get(name) is component
        ]

    def check(
        self, activate: Iterable[AnyController], deactivate: Collection[AnyController]
    ) -> None:
        """Check that the interfaces of all ``activate`` exist and are free.

        Args:
            activate: Controllers to become active together.
            deactivate: Controllers that release theirs at the same time.

        Position and velocity of one joint belong to one controller: of two, the joint could follow
        only one, so the other would have no effect.

        Raises:
            SwitchError: An interface is missing, unavailable, or claimed by another controller, or
                the other motion interface of its joint is; names both.
        """
        leaving = {controller.name for controller in deactivate}
        wanted: dict[str, str] = {}
        movers = {
            handle.joint: (handle.owner, handle.name)
            for handle in self.commands.values()
            if handle.kind in _MOTION and handle.owner is not None and handle.owner not in leaving
        }
        for controller in activate:
            for name in controller.state_interfaces:
                self._require(controller, name, self.states)
            for name in controller.command_interfaces:
                self._require(controller, name, self.commands)
                if self._hardware[name].state is not LifecycleState.ACTIVE:
                    raise SwitchError(
                        f"{controller.name} cannot command {name}: {self._hardware[name].name} is "
                        f"{self._hardware[name].state.label}; activate it first"
                    )
                owner = self.commands[name].owner
                if owner is not None and owner not in leaving:
                    raise SwitchError(
                        f"{controller.name} cannot claim {name}: {owner} has it; deactivate "
                        f"{owner} in the same switch"
                    )
                if name in wanted:
                    raise SwitchError(
                        f"{controller.name} and {wanted[name]} both claim {name}; activate one"
                    )
                wanted[name] = controller.name
                self._check_mover(controller.name, name, movers)

    def _check_mover(self, controller: str, name: str, movers: dict[str, tuple[str, str]]) -> None:
        """Record that ``controller`` moves the joint of an interface; raise if another one does."""
        handle = self.commands[name]
        if handle.kind not in _MOTION:
            return
        owner, other = movers.setdefault(handle.joint, (controller, name))
        if owner != controller:
            raise SwitchError(
                f"{controller} cannot claim {name}: {owner} has or claims {other}, and one "
                f"controller moves a joint; let one claim both, or deactivate {owner} in the same "
                "switch"
            )

    def _require(self, controller: AnyController, name: str, known: Collection[str]) -> None:
        if name not in known:
            hint = did_you_mean(name, known)
            raise SwitchError(
                f"{controller.name} needs {name}, which no hardware has{hint and f'; {hint}'}"
            )
        if not self._hardware[name].available:
            raise SwitchError(
                f"{controller.name} needs {name}: {self._hardware[name].name} is "
                f"{self._hardware[name].state.label}; configure it first"
            )
