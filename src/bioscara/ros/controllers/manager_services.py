"""The services of ``controller_manager_msgs``."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import msgspec
from controller_manager_msgs import srv

from bioscara.api import messages as m
from bioscara.control.manager.switch_request import Strictness
from bioscara.errors import BioscaraError, InvalidArgumentError, SwitchError
from bioscara.remote.remote_robot import RemoteRobot
from bioscara.ros import messages, requests
from bioscara.ros.bridge import SERVICES, Bridge
from bioscara.ros.controllers.loaded import LoadedControllers
from bioscara.ros.controllers.parameters import STRICTNESS, STRICTNESSES

_BASE_CLASS = "controller_interface::ControllerInterface"
_SWITCH_TIMEOUT = 1.0
"""Time for a switch that names none [s]."""


class ManagerServices:
    """Offers the services, of which one runs at a time.

    Args:
        bridge: The common parts of the node.
        loaded: The controllers.
        follow: Publishes the changes of a service, before that answers.
    """

    def __init__(
        self, bridge: Bridge, loaded: LoadedControllers, follow: Callable[[], object]
    ) -> None:
        self._bridge, self._loaded, self._follow = bridge, loaded, follow
        self._log = bridge.node.get_logger()
        offered: dict[str, tuple[Any, Callable[[Any, Any], Any]]] = {
            "list_controllers": (srv.ListControllers, self._list_controllers),
            "list_controller_types": (srv.ListControllerTypes, self._list_types),
            "list_hardware_components": (srv.ListHardwareComponents, self._list_components),
            "list_hardware_interfaces": (srv.ListHardwareInterfaces, self._list_interfaces),
            "load_controller": (srv.LoadController, self._named("load", loaded.load)),
            "configure_controller": (
                srv.ConfigureController,
                self._named("configure", loaded.configure),
            ),
            "cleanup_controller": (srv.CleanupController, self._named("cleanup", loaded.cleanup)),
            "unload_controller": (srv.UnloadController, self._named("unload", loaded.unload)),
            "switch_controller": (srv.SwitchController, self._switch),
            "reload_controller_libraries": (srv.ReloadControllerLibraries, self._reload),
            "set_hardware_component_state": (
                srv.SetHardwareComponentState,
                self._set_hardware_state,
            ),
        }
        for name, (kind, callback) in offered.items():
            bridge.node.create_service(
                kind, f"~/{name}", callback, qos_profile=SERVICES, callback_group=bridge.serial
            )

    def _attempt(self, what: str, call: Callable[[], str | None]) -> tuple[bool, str]:
        """Carry out a change of controllers or hardware; as :meth:`Bridge.attempt`."""
        answer = self._bridge.attempt(what, call)
        # Without an owner its loss is published, and one that is silent would not answer.
        if not self._bridge.owner.silence:
            with suppress(BioscaraError):
                self._follow()
        return answer

    def _listing(self) -> m.ControllerList:
        """Return the owner's list; without an answer the loaded controllers alone, logged."""
        try:
            return self._bridge.owner.controllers()
        except BioscaraError as error:
            self._log.error(f"the list is not the owner's: {error}")
            return self._loaded.unanswered()

    def _list_controllers(self, _: Any, response: Any) -> Any:
        response.controller = [
            messages.controller_state(each, self._bridge.description)
            for each in self._loaded.listing(self._listing()).controllers
        ]
        return response

    def _list_types(self, _: Any, response: Any) -> Any:
        response.types = list(self._listing().types)
        response.base_classes = [_BASE_CLASS] * len(response.types)
        return response

    def _list_components(self, _: Any, response: Any) -> Any:
        description = self._bridge.description
        response.component = [
            messages.component_state(value, name, description)
            for name, value in described(self._bridge, self._listing()).items()
        ]
        return response

    def _list_interfaces(self, _: Any, response: Any) -> Any:
        components, description = self._listing().components, self._bridge.description
        commands = [each for component in components for each in component.commands]
        states = [each for component in components for each in component.states]
        response.command_interfaces = sorted(
            messages.interfaces(commands, description), key=lambda each: each.name
        )
        response.state_interfaces = sorted(
            messages.interfaces(states, description), key=lambda each: each.name
        )
        return response

    def _named(self, what: str, call: Callable[[str], object]) -> Callable[[Any, Any], Any]:
        """Return the callback of a service that does something with one controller."""

        def callback(request: Any, response: Any) -> Any:
            def done() -> None:
                call(request.name)

            response.ok, _ = self._attempt(f"cannot {what} {request.name!r}", done)
            return response

        return callback

    def _switch(self, request: Any, response: Any) -> Any:
        asked = requests.seconds(request.timeout)
        timeout = asked if asked > 0.0 else _SWITCH_TIMEOUT
        done = threading.Event()
        answer: list[tuple[bool, str]] = []

        def switch() -> None:
            answer.append(self._attempt("cannot switch", lambda: self._switched(request)))
            done.set()

        threading.Thread(target=switch, name="bioscara-switch", daemon=True).start()
        if done.wait(timeout):
            response.ok, response.message = answer[0]
        else:
            response.ok = False
            response.message = (
                f"the owner of the arm has not switched within {timeout:g} s; list_controllers "
                "tells what became active"
            )
            self._bridge.refuse(response.message)
        return response

    def _switched(self, request: Any) -> str:
        strict = self._is_strict(request.strictness)
        activate = list(request.activate_controllers)
        deactivate = list(request.deactivate_controllers)

        def switch(robot: RemoteRobot) -> str:
            known = [self._known(names, strict=strict) for names in (activate, deactivate)]
            return robot.controllers.switch(*known, strict=strict)

        return self._bridge.owner.command(switch)

    def _known(self, names: list[str], *, strict: bool) -> list[str]:
        """Return the controllers that can be switched; the owner's own are not for clients of ROS.

        Raises:
            SwitchError: None of them is loaded, or strictly one is not or cannot be switched.
        """
        loaded = [name for name in names if name in self._loaded.names]
        if len(loaded) < len(names) and (strict or not loaded):
            missing = next(name for name in names if name not in loaded)
            others = ", ".join(self._loaded.names) or "none"
            raise SwitchError(f"no controller named {missing} is loaded; there are: {others}")
        unconfigured = [name for name in loaded if self._loaded.waits(name)]
        if unconfigured and strict:
            raise SwitchError(f"{unconfigured[0]} is unconfigured: configure it first")
        return [name for name in loaded if name not in unconfigured]

    def _is_strict(self, strictness: int) -> bool:
        """Return whether a switch is strict, by the number in the request.

        Raises:
            InvalidArgumentError: It is none.
        """
        if strictness == 0:
            given = self._bridge.parameter(STRICTNESS)
            chosen = STRICTNESSES[0] if given is None else given
            if chosen not in STRICTNESSES:
                raise InvalidArgumentError(
                    f"{STRICTNESS} is {chosen!r}; it is {' or '.join(STRICTNESSES)}"
                )
            return bool(chosen == "strict")
        if strictness in (3, 4):
            self._log.warning("strictness AUTO and FORCE_AUTO act as BEST_EFFORT")
        try:
            return Strictness(strictness) is Strictness.STRICT
        except ValueError:
            raise InvalidArgumentError(
                f"strictness {strictness} is none; it is 0, the default, 1 BEST_EFFORT, 2 STRICT"
            ) from None

    def _reload(self, request: Any, response: Any) -> Any:
        def reload() -> None:
            names = self._loaded.names
            if names and not request.force_kill:
                raise SwitchError(
                    f"{', '.join(names)} are loaded; unload them first, or set force_kill"
                )
            self._loaded.shut_down()

        response.ok, _ = self._attempt("cannot reload the libraries", reload)
        return response

    def _set_hardware_state(self, request: Any, response: Any) -> Any:
        def change() -> None:
            label = _label(request.target_state)
            component = self._component(request.name)
            reached = self._bridge.owner.command(
                lambda robot: robot.controllers.set_hardware_state(component, label)
            )
            response.state = messages.lifecycle_state(reached)

        response.ok, _ = self._attempt(f"cannot change {request.name!r}", change)
        if not response.ok:
            known = described(self._bridge, self._listing()).get(request.name)
            response.state = messages.lifecycle_state("unknown" if known is None else known.state)
        return response

    def _component(self, name: str) -> str:
        """Return the owner's name of a component.

        Raises:
            SwitchError: There is none of that name.
        """
        found = described(self._bridge, self._bridge.owner.controllers())
        if name not in found:
            raise SwitchError(
                f"no hardware component is named {name!r}; there are: {', '.join(found)}"
            )
        return found[name].name


def described(bridge: Bridge, listing: m.ControllerList) -> dict[str, m.ComponentValue]:
    """Return the owner's components that the description has, by their names there.

    Type and plugin are those of the description, too.
    """
    found = {}
    for value in listing.components:
        component = bridge.description.component_of(each.name for each in value.states)
        if component is not None:
            found[component.name] = msgspec.structs.replace(
                value, type=component.type, plugin=component.plugin
            )
    return found


def _label(state: Any) -> str:
    """Return the label of a requested state, by its number or else its label.

    Raises:
        InvalidArgumentError: There is no such state.
    """
    labels = {number: label for label, number in messages.NUMBERS.items() if number}
    if state.id:
        if state.id not in labels:
            raise InvalidArgumentError(
                f"there is no state {state.id}; there are "
                + ", ".join(f"{number} {label}" for number, label in labels.items())
            )
        return labels[state.id]
    if state.label not in labels.values():
        raise InvalidArgumentError(
            f"there is no state {state.label!r}; there are {', '.join(labels.values())}"
        )
    return str(state.label)
