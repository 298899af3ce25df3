"""The controller manager: controllers' lives, who is active, and the cycle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from math import isfinite
from time import perf_counter
from typing import Any, NamedTuple

from bioscara.control.claims import Claims
from bioscara.control.controller import AnyController
from bioscara.control.limiting import Limiter
from bioscara.control.registry import TYPES
from bioscara.control.schedule import Schedule
from bioscara.control.switching import Strictness, Switch, plan, unknown
from bioscara.errors import BioscaraError, ControllerError, SwitchError
from bioscara.hardware import HardwareComponent, State


class Failure(NamedTuple):
    """Something that broke in a cycle, and what was switched off because of it.

    Attributes:
        time: When [s].
        source: Name of the component or controller that failed.
        cause: What it raised.
        deactivated: Controllers that were switched off.
        activated: Fallback controllers that took over.
    """

    time: float
    source: str
    cause: BaseException
    deactivated: tuple[str, ...]
    activated: tuple[str, ...]


class ControllerManager:
    """Owns the controllers of some hardware and runs them.

    Not for several threads: whoever runs the cycle also switches.

    Args:
        components: The hardware, in the order in which it is read and written.
        limiter: Bounds every command before it is written.
        rate: Cycles per second [Hz].

    Attributes:
        claims: The interfaces and their owners.
        limiter: As given.
        rate: As given.
        failures: What broke in the last cycle.
        lock: Why nothing may be activated; empty when it may.
        timing: What reading, updating and writing took in the last cycle [s].
    """

    def __init__(
        self, components: Sequence[HardwareComponent], limiter: Limiter, rate: int
    ) -> None:
        self.claims = Claims(components)
        self.limiter, self.rate = limiter, rate
        self.failures: list[Failure] = []
        self._controllers: dict[str, AnyController] = {}
        self._active: list[tuple[AnyController, Schedule]] = []
        self._moving: set[str] = set()
        self.lock = ""
        self.timing = (0.0, 0.0, 0.0)

    @property
    def components(self) -> tuple[HardwareComponent, ...]:
        """The hardware."""
        return self.claims.components

    @property
    def controllers(self) -> tuple[AnyController, ...]:
        """All loaded controllers, in the order in which they were loaded."""
        return tuple(self._controllers.values())

    def controller(self, name: str) -> AnyController:
        """Return the loaded controller of that name.

        Raises:
            SwitchError: There is none.
        """
        if name not in self._controllers:
            raise SwitchError(unknown(name, self._controllers))
        return self._controllers[name]

    def load(self, name: str, kind: str, values: Mapping[str, Any] | None = None) -> AnyController:
        """Make a controller; it is then UNCONFIGURED.

        Args:
            name: Its name, unique here.
            kind: Its type, as in ROS, for example
                ``"forward_command_controller/ForwardCommandController"``.
            values: Its parameters.

        Raises:
            SwitchError: The name is taken or the type unknown.
            ConfigurationError: A parameter cannot be used.
        """
        if name in self._controllers:
            raise SwitchError(f"a controller named {name} is loaded already")
        if kind not in TYPES:
            raise SwitchError(unknown(kind, TYPES, "controller type"))
        made = TYPES[kind]
        parameters = made.PARAMETERS.read(name, values or {})
        if name in parameters.fallback_controllers:
            raise SwitchError(f"{name} cannot be its own fallback")
        self._controllers[name] = made(name, parameters)
        return self._controllers[name]

    def configure(self, name: str) -> None:
        """Make a controller INACTIVE; an inactive one is cleaned up first.

        Raises:
            SwitchError: There is none of that name, or it is active.
            ConfigurationError: Its parameters cannot be used together.
        """
        controller = self.controller(name)
        if controller.state is State.INACTIVE:
            self.cleanup(name)
        if controller.state is not State.UNCONFIGURED:
            raise SwitchError(f"{name} is {controller.state.label}: it cannot be configured")
        controller.on_configure()
        names = (controller.command_interfaces, controller.state_interfaces)
        for kinds in names:
            twice = [each for each in kinds if kinds.count(each) > 1]
            if twice:
                controller.on_cleanup()
                raise SwitchError(f"{name} names {twice[0]} twice")
        controller.state = State.INACTIVE

    def cleanup(self, name: str) -> None:
        """Make an inactive controller UNCONFIGURED again.

        Raises:
            SwitchError: There is none of that name, or it is active.
        """
        controller = self.controller(name)
        if controller.state is State.UNCONFIGURED:
            return
        if controller.state is not State.INACTIVE:
            raise SwitchError(f"{name} is {controller.state.label}: deactivate it first")
        controller.on_cleanup()
        controller.state = State.UNCONFIGURED

    def unload(self, name: str) -> None:
        """Forget a controller.

        Raises:
            SwitchError: There is none of that name, or it is active.
        """
        self.cleanup(name)
        self._controllers.pop(name).state = State.FINALIZED

    def switch(
        self,
        time: float,
        activate: Sequence[str] = (),
        deactivate: Sequence[str] = (),
        strictness: Strictness = Strictness.STRICT,
    ) -> Switch:
        """Change which controllers are active: all that was asked for, or nothing.

        Args:
            time: Now [s].
            activate: Names of controllers to activate.
            deactivate: Names of controllers to deactivate, before the others are activated.
            strictness: What becomes of entries that cannot be switched.

        Returns:
            What was switched.

        Raises:
            SwitchError: It was refused and nothing changed; or a controller could not be
                activated, and those activated with it were deactivated again.
            ModeSwitchError: The hardware refused the command modes; nothing changed.
        """
        switch = plan(self._controllers, activate, deactivate, strictness)
        if self.lock and any(controller.command_interfaces for controller in switch.activate):
            raise SwitchError(f"{switch.activate[0].name} cannot be activated: {self.lock}")
        self._carry_out(switch, time, strictness)
        return switch

    def take_over(self, name: str, leaving: Sequence[str], time: float) -> None:
        """Let one controller take the place of others at any speed, also while locked.

        Args:
            name: The one that is activated.
            leaving: Those that are deactivated.
            time: Now [s].

        Raises:
            SwitchError, ModeSwitchError: As :meth:`switch`.
        """
        switch = plan(self._controllers, (name,), leaving, Strictness.STRICT)
        self._carry_out(switch, time, Strictness.STRICT)

    def _carry_out(self, switch: Switch, time: float, strictness: Strictness) -> None:
        self.claims.check(switch.activate, switch.deactivate)
        for controller in switch.activate:
            self._check_fallbacks(controller)
        modes = self._modes(switch)
        for component, start, stop in modes:
            component.prepare_command_mode_switch(start, stop)
        self._moving = self._commanded()
        for controller in switch.deactivate:
            self._deactivate(controller, time)
        for component, start, stop in modes:
            component.perform_command_mode_switch(start, stop)
        self._activate_all(switch.activate, time, strictness)

    def cycle(self, time: float, period: float) -> None:
        """Read, update, limit, write: once.

        What breaks is switched off in this cycle and told of in ``failures``; nothing is raised
        for it.

        Args:
            time: Begin of the cycle [s].
            period: Time since the last cycle [s].
        """
        self.failures.clear()
        start = perf_counter()
        for component in self.components:
            if component.available:
                self._attempt(component, component.read, time, period)
            else:
                component.problems.clear()
        measured = perf_counter()
        for controller, schedule in tuple(self._active):
            elapsed = schedule.due(period)
            if elapsed:
                self._update(controller, time, elapsed)
        self.limiter.apply(period)
        updated = perf_counter()
        for component in self.components:
            if component.state is State.ACTIVE:
                self._attempt(component, component.write, time, period)
        self.timing = (measured - start, updated - measured, perf_counter() - updated)

    def set_hardware_state(self, name: str, state: State, time: float) -> State:
        """Walk a component to a state; on its way down its controllers are deactivated first.

        Raises:
            SwitchError: There is no such component.
            BioscaraError: A transition failed; the component is where it got to.
        """
        known = {component.name: component for component in self.components}
        if name not in known:
            raise SwitchError(unknown(name, known, "hardware component"))
        component = known[name]
        if state < component.state or state is State.FINALIZED:
            self._release(component, time, inactive_too=state is not State.INACTIVE)
        return component.set_state(state)

    def shutdown(self, time: float) -> list[BioscaraError]:
        """Deactivate all controllers, then shut all hardware down; returns what went wrong."""
        problems: list[BioscaraError] = []
        for controller, _ in tuple(self._active):
            self._deactivate(controller, time)
        for component in self.components:
            try:
                component.shutdown()
            except BioscaraError as error:
                problems.append(error)
        return problems

    def _modes(self, switch: Switch) -> list[tuple[HardwareComponent, list[str], list[str]]]:
        """Return for each component which command interfaces change hands."""
        modes = []
        for component in self.components:
            start = self._commands_in(switch.activate, component)
            stop = self._commands_in(switch.deactivate, component)
            if start or stop:
                modes.append((component, start, stop))
        return modes

    def _commands_in(
        self, controllers: Sequence[AnyController], component: HardwareComponent
    ) -> list[str]:
        return [
            name
            for controller in controllers
            for name in self.claims.commands_of(controller, component)
        ]

    def _check_fallbacks(self, controller: AnyController) -> None:
        """Raise unless each fallback could take over, should ``controller`` fail."""
        for name in controller.parameters.fallback_controllers:
            fallback = self._controllers.get(name)
            if fallback is None:
                raise SwitchError(
                    f"{controller.name} cannot be activated: fallback "
                    + unknown(name, self._controllers)
                )
            if fallback.state not in (State.INACTIVE, State.ACTIVE):
                raise SwitchError(
                    f"{controller.name} cannot be activated: its fallback {name} is "
                    f"{fallback.state.label}; configure it first"
                )
            if controller.name in self._chain(name):
                raise SwitchError(
                    f"{controller.name} cannot be activated: its fallbacks lead back to itself"
                )

    def _chain(self, name: str) -> set[str]:
        """Return all fallbacks of a controller, and theirs."""
        found: set[str] = set()
        waiting = [name]
        while waiting:
            controller = self._controllers.get(waiting.pop())
            for each in controller.parameters.fallback_controllers if controller else ():
                if each not in found:
                    found.add(each)
                    waiting.append(each)
        return found

    def _activate_all(
        self, controllers: Sequence[AnyController], time: float, strictness: Strictness
    ) -> None:
        done: list[AnyController] = []
        for controller in controllers:
            try:
                self._activate(controller, time)
            except BioscaraError as error:
                if strictness is Strictness.STRICT:
                    failed = (controller, *done)
                    for other in done:
                        self._deactivate(other, time)
                    self._return_modes(failed)
                    raise SwitchError(f"{controller.name} was not activated: {error}") from error
                self._return_modes((controller,))
            else:
                done.append(controller)

    def _activate(self, controller: AnyController, time: float) -> None:
        schedule = Schedule(self.rate, controller.parameters.update_rate)
        controller.nominal_period = 1.0 / schedule.rate
        controller.bind(self.claims.commands, self.claims.states)
        joints = {handle.joint for handle in controller.command_handles}
        self.limiter.begin(joints - self._moving)
        self.limiter.resume(joints & self._moving)
        try:
            controller.on_activate(time)
        except BaseException:
            controller.unbind()
            raise
        for handle in controller.command_handles:
            handle.owner = controller.name
        controller.state = State.ACTIVE
        self._active.append((controller, schedule))

    def _deactivate(self, controller: AnyController, time: float) -> None:
        controller.on_deactivate(time)
        for handle in controller.command_handles:
            handle.owner = None
        controller.unbind()
        controller.state = State.INACTIVE
        self._active = [entry for entry in self._active if entry[0] is not controller]

    def _commanded(self) -> set[str]:
        return {handle.joint for handle in self.claims.commands.values() if handle.owner}

    def _return_modes(self, controllers: Sequence[AnyController]) -> None:
        """Let go of command modes that were taken for controllers that never became active."""
        for component in self.components:
            stop = self._commands_in(controllers, component)
            if stop and component.state is State.ACTIVE:
                component.perform_command_mode_switch((), stop)

    def _update(self, controller: AnyController, time: float, period: float) -> None:
        handles = controller.command_handles
        before = [handle.value for handle in handles]
        try:
            controller.update(time, period)
            for handle in handles:
                if not isfinite(handle.value):
                    raise ControllerError(
                        f"{controller.name} commands {handle.value} to {handle.name}",
                        controller.name,
                    )
        except Exception as error:  # noqa: BLE001  a controller may raise anything at all
            for handle, value in zip(handles, before, strict=True):
                handle.value = value
            self._replace(controller, time, error)

    def _replace(self, controller: AnyController, time: float, cause: Exception) -> None:
        """Switch a controller that failed off, and its fallbacks on."""
        fallbacks = [
            self._controllers[name]
            for name in controller.parameters.fallback_controllers
            if self._controllers[name].state is State.INACTIVE
        ]
        wanted = {name for fallback in fallbacks for name in fallback.command_interfaces}
        leaving = [
            other
            for other, _ in self._active
            if other is controller or wanted.intersection(other.command_interfaces)
        ]
        switch = Switch(tuple(fallbacks), tuple(leaving))
        try:
            modes = self._modes(switch)
            for component, start, stop in modes:
                component.prepare_command_mode_switch(start, stop)
        except BioscaraError:
            switch, modes = Switch((), (controller,)), self._modes(Switch((), (controller,)))
        self._moving = self._commanded()
        for other in switch.deactivate:
            self._deactivate(other, time)
        for component, start, stop in modes:
            self._attempt(component, component.perform_command_mode_switch, start, stop)
        self._activate_all(switch.activate, time, Strictness.BEST_EFFORT)
        self.failures.append(
            Failure(
                time,
                controller.name,
                cause,
                tuple(other.name for other in switch.deactivate),
                tuple(other.name for other in switch.activate if other.state is State.ACTIVE),
            )
        )

    def _attempt(self, component: HardwareComponent, step: Any, *arguments: Any) -> None:
        """Run one step of a component; if it fails, so do all controllers that use it."""
        try:
            step(*arguments)
        except Exception as error:  # noqa: BLE001  whatever broke, the arm is brought to rest
            time = float(arguments[0]) if arguments and isinstance(arguments[0], float) else 0.0
            leaving = self._release(component, time, inactive_too=True)
            with suppress(BioscaraError):
                component.fail()
            self.failures.append(Failure(time, component.name, error, leaving, ()))

    def _release(
        self, component: HardwareComponent, time: float, *, inactive_too: bool
    ) -> tuple[str, ...]:
        """Deactivate the controllers that command a component, or that use it at all."""
        leaving = [
            controller
            for controller, _ in self._active
            if self.claims.commands_of(controller, component)
            or (inactive_too and self.claims.uses(controller, component))
        ]
        names = []
        for controller in leaving:
            stop = self.claims.commands_of(controller, component)
            self._deactivate(controller, time)
            names.append(controller.name)
            if stop:
                with suppress(BioscaraError):
                    component.perform_command_mode_switch((), stop)
        return tuple(names)
