"""Runs controllers and hardware, and switches off in the same cycle each one that fails."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from time import perf_counter
from typing import NamedTuple

from bioscara.control.controllers.controller import AnyController
from bioscara.control.manager.statistics import ManagerStatistics
from bioscara.control.manager.switch_request import Switch
from bioscara.control.manager.switching import ControllerSwitcher, SwitchFailure
from bioscara.control.manager.update_rate import Schedule
from bioscara.errors import BioscaraError, ControllerError
from bioscara.hardware import HardwareComponent, LifecycleState

# A member of an enumeration takes longer to look up than to compare.
_ACTIVE = LifecycleState.ACTIVE


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


def _require_finite(controller: AnyController) -> None:
    for handle in controller.command_handles:
        if not isfinite(handle.value):
            raise ControllerError(
                f"{controller.name} commands {handle.value} to {handle.name}", controller.name
            )


class Execution:
    """Updates controllers and exchanges with hardware; their exceptions are not passed on.

    Args:
        controllers: All that are loaded, by name.
        switcher: Knows the active controllers.
        statistics: Takes the durations of reading and writing.

    Attributes:
        failures: The failures, in order; emptied by the caller that runs the cycle.
    """

    def __init__(
        self,
        controllers: Mapping[str, AnyController],
        switcher: ControllerSwitcher,
        statistics: ManagerStatistics,
    ) -> None:
        self._controllers, self._switcher = controllers, switcher
        self._statistics = statistics
        self.failures: list[Failure] = []

    def read(self, component: HardwareComponent, time: float, period: float) -> None:
        """Read a component; if it fails, so do all controllers that use it.

        Args:
            component: The component.
            time: Begin of the cycle [s].
            period: Time since the last cycle [s].
        """
        try:
            start = perf_counter()
            component.read(time, period)
            self._statistics.read[component.name].add(perf_counter() - start)
        except Exception as error:  # noqa: BLE001  after any failure the arm is brought to rest
            self._give_up(component, time, error)

    def write(self, component: HardwareComponent, time: float, period: float) -> None:
        """Write a component; arguments and failures as :meth:`read`."""
        try:
            start = perf_counter()
            component.write(time, period)
            self._statistics.write[component.name].add(perf_counter() - start)
        except Exception as error:  # noqa: BLE001  after any failure the arm is brought to rest
            self._give_up(component, time, error)

    def update(self, time: float, period: float) -> None:
        """Update all controllers that are due, then the ones that replaced them in this cycle.

        The replacements command in this cycle too.

        Args:
            time: Begin of the cycle [s].
            period: Time since the last cycle [s].
        """
        active = self._switcher.active
        for controller, schedule in active:
            self._update_if_due(controller, schedule, time, period)
        if self._switcher.active is active:
            return
        updated = {controller.name for controller, _ in active}
        while added := [each for each in self._switcher.active if each[0].name not in updated]:
            for controller, schedule in added:
                updated.add(controller.name)
                self._update_if_due(controller, schedule, time, period)

    def _update_if_due(
        self, controller: AnyController, schedule: Schedule, time: float, period: float
    ) -> None:
        if controller.state is not _ACTIVE:
            return
        elapsed = schedule.due(period)
        if not elapsed:
            return
        handles = controller.command_handles
        before = [handle.value for handle in handles]
        try:
            statistics = controller.statistics
            statistics.begin(self._statistics.since)
            controller.update(time, elapsed)
            statistics.end()
            # The sum is not finite if one of them is not; it takes half the time of the checks.
            if handles and not isfinite(sum([handle.value for handle in handles])):
                _require_finite(controller)
        except Exception as error:  # noqa: BLE001  a controller may raise anything at all
            for handle, value in zip(handles, before, strict=True):
                handle.value = value
            self._replace(controller, time, error)

    def _replace(self, controller: AnyController, time: float, cause: Exception) -> None:
        """Switch a failed controller off, and its fallbacks on."""
        fallbacks = [
            fallback
            for fallback in map(self._controllers.get, controller.parameters.fallback_controllers)
            if fallback is not None and fallback.state is LifecycleState.INACTIVE
        ]
        wanted = {name for fallback in fallbacks for name in fallback.command_interfaces}
        leaving = [
            other
            for other, _ in self._switcher.active
            if other is controller or wanted.intersection(other.command_interfaces)
        ]
        switch = Switch(tuple(fallbacks), tuple(leaving))
        problems: list[SwitchFailure] = []
        try:
            changes = self._switcher.prepare(switch)
        except BioscaraError as error:
            error.__cause__ = cause
            problems += [SwitchFailure(fallback.name, error) for fallback in fallbacks]
            switch = Switch((), (controller,))
            changes = self._switcher.changes((), switch.deactivate)
        problems += self._switcher.carry_out(switch, changes, time)
        self.failures.append(
            Failure(
                time,
                controller.name,
                cause,
                tuple(other.name for other in switch.deactivate),
                tuple(
                    other.name for other in switch.activate if other.state is LifecycleState.ACTIVE
                ),
            )
        )
        self.failures += [Failure(time, *problem) for problem in problems]

    def _give_up(self, component: HardwareComponent, time: float, cause: Exception) -> None:
        problems: list[SwitchFailure] = []
        leaving = self._switcher.give_up(component, time, problems)
        self.failures.append(Failure(time, component.name, cause, leaving))
        self.failures += [Failure(time, *problem) for problem in problems]
