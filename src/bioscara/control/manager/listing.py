"""Lists of a manager's controllers, components and interfaces, as in ros2_control."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from bioscara.control.controllers.controller import AnyController
from bioscara.control.manager.update_rate import Schedule
from bioscara.hardware import CommandInterface, HardwareComponent, LifecycleState
from bioscara.hardware.interfaces import Interface


class ControllerEntry(NamedTuple):
    """One controller.

    Attributes:
        name: Its name.
        state: Its lifecycle state.
        kind: Its type.
        update_rate: Updates per second [Hz].
        claimed_interfaces: Command interfaces that it has, while it is active.
        required_command_interfaces: Those that it needs; empty before it is configured.
        required_state_interfaces: Those that it reads; empty before it is configured.
    """

    name: str
    state: LifecycleState
    kind: str
    update_rate: float
    claimed_interfaces: tuple[str, ...]
    required_command_interfaces: tuple[str, ...]
    required_state_interfaces: tuple[str, ...]


class InterfaceEntry(NamedTuple):
    """One interface.

    Attributes:
        name: ``"<joint>/<kind>"``.
        data_type: Always ``"double"``.
        is_available: Whether it can be used.
        is_claimed: Whether a controller commands it; never true for a state interface.
    """

    name: str
    data_type: str
    is_available: bool
    is_claimed: bool


class ComponentEntry(NamedTuple):
    """One hardware component.

    Attributes:
        name: Its name.
        kind: ``"system"``, ``"actuator"`` or ``"sensor"``.
        plugin_name: The class behind it.
        state: Its lifecycle state.
        rw_rate: How often it is read and written [Hz].
        command_interfaces: Its command interfaces.
        state_interfaces: Its state interfaces.
    """

    name: str
    kind: str
    plugin_name: str
    state: LifecycleState
    rw_rate: int
    command_interfaces: tuple[InterfaceEntry, ...]
    state_interfaces: tuple[InterfaceEntry, ...]


class Interfaces(NamedTuple):
    """All interfaces of all hardware, sorted by name.

    Attributes:
        command_interfaces: All command interfaces.
        state_interfaces: All state interfaces.
    """

    command_interfaces: tuple[InterfaceEntry, ...]
    state_interfaces: tuple[InterfaceEntry, ...]


def describe_controller(controller: AnyController, rate: int) -> ControllerEntry:
    """Return the entry of a controller that is run at up to ``rate`` [Hz]."""
    configured = controller.state in (LifecycleState.INACTIVE, LifecycleState.ACTIVE)
    return ControllerEntry(
        controller.name,
        controller.state,
        controller.TYPE,
        Schedule(rate, controller.parameters.update_rate).rate,
        tuple(handle.name for handle in controller.command_handles),
        controller.command_interfaces if configured else (),
        controller.state_interfaces if configured else (),
    )


def describe_component(component: HardwareComponent, rate: int) -> ComponentEntry:
    """Return the entry of a component that is run at ``rate`` [Hz]."""
    kind, available = type(component), component.available
    return ComponentEntry(
        component.name,
        component.kind,
        f"{kind.__module__}.{kind.__qualname__}",
        component.state,
        rate,
        _entries(component.commands, available=available),
        _entries(component.states, available=available),
    )


def describe_interfaces(components: Iterable[HardwareComponent]) -> Interfaces:
    """Return all interfaces of some components."""
    commands: list[InterfaceEntry] = []
    states: list[InterfaceEntry] = []
    for component in components:
        commands += _entries(component.commands, available=component.available)
        states += _entries(component.states, available=component.available)
    return Interfaces(tuple(sorted(commands)), tuple(sorted(states)))


def _entries(interfaces: Mapping[str, Interface], *, available: bool) -> tuple[InterfaceEntry, ...]:
    return tuple(
        InterfaceEntry(
            name,
            "double",
            available,
            isinstance(interface, CommandInterface) and interface.owner is not None,
        )
        for name, interface in interfaces.items()
    )
