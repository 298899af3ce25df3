"""Runs controllers and hardware, and switches off in the same cycle each one that fails."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import isfinite
from time import perf_counter
from typing import NamedTuple

from bioscara.control.controllers.controller import AnyController
from bioscara.control.manager.switch_request import Switch
from bioscara.control.manager.switching import ControllerSwitcher, Problem
from bioscara.errors import BioscaraError, ControllerError
from bioscara.hardware import HardwareComponent, State


class Failure(NamedTuple):
    """A failure, and the controllers that were switched off because of it.

    Attributes:
        time: When [s].
        source: Name of the component or controller that failed.
        cause: The exception.
        deactivated: Controllers that were switched off.
        activated: Fallback controllers that took over.
    """

    time: float
    source: str
    cause: Exception
    deactivated: tuple[str, ...] = ()
    activated: tuple[str, ...] = ()


class Execution:
    """Updates controllers and exchanges with hardware; their exceptions are not passed on.

    Args:
        controllers: All that are loaded, by name.
        switcher: Knows the active controllers.

    Attributes:
        failures: The failures, in order; emptied by the caller that runs the cycle.
    """

    def __init__(
        self, controllers: Mapping[str, AnyController], switcher: ControllerSwitcher
    ) -> None:
        self._controllers, self._switcher = controllers, switcher
        self.failures: list[Failure] = []

    def update_all(self, time: float, period: float) -> None:
        """Update all controllers that are due, then the ones that replaced them in this cycle.

        The replacements command in this cycle too.

        Args:
            time: Begin of the cycle [s].
            period: Time since the last cycle [s].
        """
        updated: set[str] = set()
        while waiting := [each for each in self._switcher.active if each[0].name not in updated]:
            for controller, schedule in waiting:
                updated.add(controller.name)
                if controller.state is State.ACTIVE:
                    elapsed = schedule.due(period)
                    if elapsed:
                        self._update(controller, time, elapsed)

    def _update(self, controller: AnyController, time: float, period: float) -> None:
        handles = controller.command_handles
        before = [handle.value for handle in handles]
        start = perf_counter()
        try:
            controller.update(time, period)
            controller.statistics.execution_time.add(perf_counter() - start)
            controller.statistics.periodicity.add(1.0 / period)
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
        """Switch a failed controller off, and its fallbacks on."""
        fallbacks = [
            fallback
            for fallback in map(self._controllers.get, controller.parameters.fallback_controllers)
            if fallback is not None and fallback.state is State.INACTIVE
        ]
        wanted = {name for fallback in fallbacks for name in fallback.command_interfaces}
        leaving = [
            other
            for other, _ in self._switcher.active
            if other is controller or wanted.intersection(other.command_interfaces)
        ]
        switch = Switch(tuple(fallbacks), tuple(leaving))
        problems: list[Problem] = []
        try:
            changes = self._switcher.prepare(switch)
        except BioscaraError as error:
            error.__cause__ = cause
            problems += [Problem(fallback.name, error) for fallback in fallbacks]
            switch = Switch((), (controller,))
            changes = self._switcher.changes((), switch.deactivate)
        problems += self._switcher.carry_out(switch, changes, time)
        self.failures.append(
            Failure(
                time,
                controller.name,
                cause,
                tuple(other.name for other in switch.deactivate),
                tuple(other.name for other in switch.activate if other.state is State.ACTIVE),
            )
        )
        self.failures += [Failure(time, *problem) for problem in problems]

    def exchange(
        self,
        component: HardwareComponent,
        step: Callable[[float, float], None],
        time: float,
        period: float,
    ) -> None:
        """Read or write a component; if it fails, so do all controllers that use it.

        Args:
            component: The component.
            step: Its ``read`` or ``write``.
            time: Begin of the cycle [s].
            period: Time since the last cycle [s].
        """
        try:
            step(time, period)
        except Exception as error:  # noqa: BLE001  after any failure the arm is brought to rest
            problems: list[Problem] = []
            leaving = self._switcher.give_up(component, time, problems)
            self.failures.append(Failure(time, component.name, error, leaving))
            self.failures += [Failure(time, *problem) for problem in problems]
