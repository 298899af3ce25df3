"""Carrying out a switch: activation, and the handover of interfaces between controllers."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from contextlib import suppress
from typing import NamedTuple

from bioscara.control.controllers.controller import AnyController
from bioscara.control.limits.limiter import Limiter
from bioscara.control.manager.claims import Claims
from bioscara.control.manager.statistics import UpdateStatistics
from bioscara.control.manager.switch_request import Strictness, Switch
from bioscara.control.manager.update_rate import Schedule
from bioscara.errors import BioscaraError, ModeSwitchError, SwitchError
from bioscara.hardware import POSITION, VELOCITY, HardwareComponent, LifecycleState
from bioscara.model import JointParameters


class InterfaceChange(NamedTuple):
    """Command interfaces of one component that change hands.

    Attributes:
        component: The component.
        start: Names of the interfaces that are claimed.
        stop: Names of the interfaces that are released.
    """

    component: HardwareComponent
    start: list[str]
    stop: list[str]


class SwitchFailure(NamedTuple):
    """An exception raised while controllers changed.

    Attributes:
        source: Name of the controller or component.
        cause: The exception.
    """

    source: str
    cause: Exception


class ControllerSwitcher:
    """Changes which controllers are active.

    Args:
        claims: The interfaces and their owners.
        limiter: Is notified of the joints that another controller takes over.
        rate: Cycles per second [Hz].
        controllers: All that are loaded, by name, in the order in which they are updated.
        warnings: Takes the remarks of the hardware on switches that it does not refuse.

    Attributes:
        active: The active controllers with their schedules, in that order.
        driving: Those of them that command a position or a velocity.
        switched: How often a controller became active or ceased to be.
    """

    def __init__(
        self,
        claims: Claims,
        limiter: Limiter,
        rate: int,
        controllers: Mapping[str, AnyController],
        warnings: MutableSequence[str],
    ) -> None:
        self._claims, self._limiter, self._rate = claims, limiter, rate
        self._controllers, self._warnings = controllers, warnings
        self.switched = 0
        self.active: list[tuple[AnyController, Schedule]] = []
        self.driving: tuple[AnyController, ...] = ()

    def changes(
        self, activate: Sequence[AnyController], deactivate: Sequence[AnyController]
    ) -> list[InterfaceChange]:
        """Return which command interfaces change hands, component by component.

        Args:
            activate: Controllers that claim theirs.
            deactivate: Controllers that release theirs.
        """
        changes = []
        for component in self._claims.components:
            start, stop = (
                [name for each in group for name in self._claims.commands_of(each, component)]
                for group in (activate, deactivate)
            )
            if start or stop:
                changes.append(InterfaceChange(component, start, stop))
        return changes

    def prepare(self, switch: Switch) -> list[InterfaceChange]:
        """Check claims and hardware before a switch; this has no effect except warnings.

        Raises:
            SwitchError: An interface is missing or claimed by another controller.
            ModeSwitchError: The hardware refuses the command modes.
        """
        self._claims.check(switch.activate, switch.deactivate)
        changes = self.changes(switch.activate, switch.deactivate)
        warnings: list[str] = []
        for component, start, stop in changes:
            try:
                warnings += component.prepare_command_mode_switch(start, stop)
            except ModeSwitchError as error:
                raise ModeSwitchError(
                    f"prepare command mode switch was rejected: {error}", component.name
                ) from error
        self._warnings.extend(warnings)
        return changes

    def carry_out(
        self, switch: Switch, changes: Sequence[InterfaceChange], time: float
    ) -> list[SwitchFailure]:
        """Deactivate, change modes, activate; as prepared.

        A controller whose deactivation raises is deactivated all the same. When modes cannot be
        changed they are unknown: that component is given up. When STRICT, a controller that cannot
        be activated causes those activated with it to be deactivated.

        Args:
            switch: The controllers that change.
            changes: The result of :meth:`prepare` for it.
            time: Now [s].

        Returns:
            The problems, in order.
        """
        moving = self._limiter.moving()
        problems: list[SwitchFailure] = []
        for controller in switch.deactivate:
            self._deactivate(controller, time, problems)
        for component, start, stop in changes:
            try:
                component.perform_command_mode_switch(start, stop)
            except Exception as error:  # noqa: BLE001  after any error the modes are unknown
                problems.append(SwitchFailure(component.name, error))
                self.give_up(component, time, problems)
        self._activate_all(switch, time, moving, problems)
        return problems

    def give_up(
        self, component: HardwareComponent, time: float, problems: list[SwitchFailure]
    ) -> tuple[str, ...]:
        """Deactivate all controllers that use a component and fail it; return their names."""
        leaving = self.release(component, time, problems, including_readers=True)
        try:
            component.fail()
        except Exception as error:  # noqa: BLE001  it is finalized, and the cause is kept
            problems.append(SwitchFailure(component.name, error))
        return leaving

    def release(
        self,
        component: HardwareComponent,
        time: float,
        problems: list[SwitchFailure],
        *,
        including_readers: bool,
    ) -> tuple[str, ...]:
        """Deactivate the controllers that command a component; return their names.

        Args:
            component: The component.
            time: Now [s].
            problems: Takes the problems that occur.
            including_readers: Whether controllers that only read it are deactivated too.
        """
        leaving = [
            controller
            for controller, _ in self.active
            if self._claims.commands_of(controller, component)
            or (including_readers and self._claims.uses(controller, component))
        ]
        for controller in leaving:
            self._deactivate(controller, time, problems)
        for other, start, stop in self.changes((), leaving):
            # The caller takes the component down next, which stops all its joints.
            with suppress(BioscaraError):
                other.perform_command_mode_switch(start, stop)
        return tuple(controller.name for controller in leaving)

    def _activate_all(
        self, switch: Switch, time: float, moving: set[str], problems: list[SwitchFailure]
    ) -> None:
        done: list[AnyController] = []
        for controller in switch.activate:
            try:
                self._activate(controller, time, moving)
            except Exception as error:  # noqa: BLE001  a controller may raise anything at all
                problems.append(SwitchFailure(controller.name, error))
                failed = [controller]
                if switch.strictness is Strictness.STRICT:
                    failed = list(switch.activate)
                    for other in done:
                        self._deactivate(other, time, problems)
                self._return_modes(failed, time, problems)
                if switch.strictness is Strictness.STRICT:
                    return
            else:
                done.append(controller)

    def _activate(self, controller: AnyController, time: float, moving: set[str]) -> None:
        limits: dict[str, JointParameters] = {}
        for name in controller.command_interfaces:
            component = self._claims.component(name)
            if component.state is not LifecycleState.ACTIVE:
                raise SwitchError(f"{component.name} is {component.state.label}")
            limits.update(component.limits)
        schedule = Schedule(self._rate, controller.parameters.update_rate)
        controller.limits, controller.lag_of = limits, self._limiter.lag_of
        controller.nominal_period = 1.0 / schedule.rate
        controller.statistics = UpdateStatistics()
        controller.bind(self._claims.commands, self._claims.states)
        joints = {handle.joint for handle in controller.command_handles}
        self._limiter.begin(joints, moving)
        controller.commanded_speeds = self._limiter.speeds(joints & moving)
        try:
            controller.on_activate(time)
        except BaseException:
            controller.unbind()
            raise
        for handle in controller.command_handles:
            handle.owner = controller.name
        controller.state = LifecycleState.ACTIVE
        self.switched += 1
        schedules = {each.name: (each, when) for each, when in self.active}
        schedules[controller.name] = (controller, schedule)
        self._set_active([schedules[name] for name in self._controllers if name in schedules])

    def _deactivate(
        self, controller: AnyController, time: float, problems: list[SwitchFailure]
    ) -> None:
        try:
            controller.on_deactivate(time)
        except Exception as error:  # noqa: BLE001  a controller may raise anything at all
            problems.append(SwitchFailure(controller.name, error))
        for handle in controller.command_handles:
            handle.owner = None
        controller.unbind()
        controller.state = LifecycleState.INACTIVE
        self.switched += 1
        self._set_active([entry for entry in self.active if entry[0] is not controller])

    def _set_active(self, active: list[tuple[AnyController, Schedule]]) -> None:
        self.active = active
        self.driving = tuple(
            controller
            for controller, _ in active
            if any(handle.kind in (POSITION, VELOCITY) for handle in controller.command_handles)
        )

    def _return_modes(
        self, controllers: Sequence[AnyController], time: float, problems: list[SwitchFailure]
    ) -> None:
        """Release command modes that were taken for controllers that are not active."""
        for component, start, stop in self.changes((), controllers):
            if component.state is LifecycleState.ACTIVE:
                try:
                    component.perform_command_mode_switch(start, stop)
                except Exception as error:  # noqa: BLE001  as in carry_out
                    problems.append(SwitchFailure(component.name, error))
                    self.give_up(component, time, problems)
