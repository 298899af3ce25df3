"""The controller manager: controllers' lifecycles, activation, and the cycle."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from time import perf_counter

from bioscara.arguments import number, shown, text
from bioscara.control.controllers.controller import WARNINGS, AnyController
from bioscara.control.limits.limiter import Limiter
from bioscara.control.manager.claims import Claims
from bioscara.control.manager.execution import Execution, Failure
from bioscara.control.manager.listing import (
    ComponentEntry,
    ControllerEntry,
    Interfaces,
    describe_component,
    describe_controller,
    describe_interfaces,
)
from bioscara.control.manager.registry import ControllerRegistry
from bioscara.control.manager.statistics import READ, UPDATE, WRITE, ManagerStatistics
from bioscara.control.manager.switch_request import Strictness, Switch, plan, unknown
from bioscara.control.manager.switching import ControllerSwitcher, SwitchFailure
from bioscara.control.manager.update_rate import require_rate
from bioscara.errors import ConfigurationError, InvalidArgumentError, SwitchError
from bioscara.hardware import HardwareComponent, LifecycleState

# A member of an enumeration takes longer to look up than to compare.
_ACTIVE = LifecycleState.ACTIVE


class ControllerManager:
    """Owns the controllers of some hardware and runs them.

    Not thread-safe: the thread that runs the cycle also switches.

    Args:
        components: The hardware, in the order in which it is read and written.
        limiter: Bounds every command before it is written.
        rate: Cycles per second [Hz].
        warnings: Shared with the limiter's stages; by default an own one.

    Attributes:
        claims: The interfaces and their owners.
        limiter: As given.
        rate: As given.
        lock: Reason why nothing may be activated; empty when activation is allowed.
        switch_time: Duration of the last switch [s].
        statistics: Of the cycles.
        warnings: Messages about controllers and switches that were no reason to refuse them; the
            latest.

    Raises:
        ConfigurationError: The rate is no whole number within 20 .. 10000 Hz.
        SwitchError: Two components have a name or an interface in common.
    """

    def __init__(
        self,
        components: Sequence[HardwareComponent],
        limiter: Limiter,
        rate: int,
        warnings: deque[str] | None = None,
    ) -> None:
        rate = require_rate(rate)
        self.claims = Claims(components)
        self.limiter, self.rate = limiter, rate
        self._between_cycles: list[Failure] = []
        self.warnings = deque[str](maxlen=WARNINGS) if warnings is None else warnings
        self._registry = ControllerRegistry(rate, self.warnings)
        controllers = self._registry.controllers
        self._switcher = ControllerSwitcher(self.claims, limiter, rate, controllers, self.warnings)
        self.statistics = ManagerStatistics(component.name for component in components)
        self._execution = Execution(controllers, self._switcher, self.statistics)
        self.lock = ""
        self.switch_time = 0.0

    @property
    def components(self) -> tuple[HardwareComponent, ...]:
        """The hardware."""
        return self.claims.components

    @property
    def controllers(self) -> tuple[AnyController, ...]:
        """All loaded controllers, in the order in which they were loaded and are updated."""
        return tuple(self._registry.controllers.values())

    @property
    def driving(self) -> tuple[AnyController, ...]:
        """The active controllers that command a position or a velocity."""
        return self._switcher.driving

    @property
    def activity(self) -> int:
        """A count that grows when a controller or component is added, removed or changes state."""
        hardware = sum(component.transitions for component in self.components)
        return self._registry.changes + self._switcher.switched + hardware

    @property
    def failures(self) -> Sequence[Failure]:
        """Failures in the last cycle and between it and the one before, in order."""
        return self._execution.failures

    def controller(self, name: str) -> AnyController:
        """Return the loaded controller of that name.

        Raises:
            SwitchError: There is none.
        """
        return self._registry.get(name)

    def list_controllers(self) -> list[ControllerEntry]:
        """Return a description of each loaded controller, in the order of updates."""
        return [describe_controller(controller, self.rate) for controller in self.controllers]

    def list_hardware_components(self) -> list[ComponentEntry]:
        """Return a description of each component."""
        return [describe_component(component, self.rate) for component in self.components]

    def list_hardware_interfaces(self) -> Interfaces:
        """Return all interfaces of all hardware."""
        return describe_interfaces(self.components)

    def load(
        self, name: str, kind: str, values: Mapping[str, object] | None = None
    ) -> AnyController:
        """Create a controller; it is then UNCONFIGURED.

        Args:
            name: Its name, unique here.
            kind: Its type, as in ROS, for example
                ``"forward_command_controller/ForwardCommandController"``.
            values: Its parameters.

        Raises:
            SwitchError: The name is taken or the type unknown.
            ConfigurationError: A parameter cannot be used.
        """
        controller = self.make(name, kind, values)
        self.add(controller)
        return controller

    def make(
        self, name: str, kind: str, values: Mapping[str, object] | None = None
    ) -> AnyController:
        """Make a controller for :meth:`add`, in any thread: its parameters take time to check.

        Raises:
            SwitchError: The type is unknown.
            ConfigurationError: A parameter cannot be used.
        """
        values = {} if values is None else values
        if not isinstance(values, Mapping):
            raise ConfigurationError(f"the parameters are {shown(values)}; give a mapping")
        return self._registry.make(name, kind, values)

    def add(self, controller: AnyController) -> None:
        """Load a controller that :meth:`make` has made; it is UNCONFIGURED.

        Raises:
            SwitchError: Its name is taken.
        """
        self._registry.add(controller)

    def configure(self, name: str) -> None:
        """Make a controller INACTIVE; an inactive one is cleaned up first.

        Raises:
            SwitchError: There is none of that name, it is active, or it names an interface twice.
            ConfigurationError: Its parameters cannot be used together.
        """
        self._registry.configure(name)

    def cleanup(self, name: str) -> None:
        """Make an inactive controller UNCONFIGURED again.

        Raises:
            SwitchError: There is none of that name, it is active, or an active one falls back on
                it.
        """
        self._registry.cleanup(name)

    def unload(self, name: str) -> None:
        """Remove a controller.

        Raises:
            SwitchError: As :meth:`cleanup`.
        """
        self._registry.unload(name)

    def switch(
        self,
        time: float,
        activate: Sequence[str] = (),
        deactivate: Sequence[str] = (),
        strictness: Strictness = Strictness.STRICT,
    ) -> Switch:
        """Change which controllers are active.

        Args:
            time: Now [s].
            activate: Names of controllers to activate.
            deactivate: Names of controllers to deactivate, before the others are activated.
            strictness: Handling of entries that cannot be switched.

        Returns:
            The switch that was carried out.

        Raises:
            SwitchError: It was refused and nothing changed; or a controller could not be
                activated: then STRICT deactivates those activated with it, BEST_EFFORT keeps
                them.
            ModeSwitchError: The hardware refused the command modes; nothing changed.
        """
        time = number("the time of a switch", time)
        switch = plan(self._registry.controllers, activate, deactivate, strictness)
        for controller in switch.activate:
            if self.lock and controller.command_interfaces:
                raise SwitchError(f"{controller.name} cannot be activated: {self.lock}")
        self._carry_out(switch, time)
        return switch

    def take_over(self, name: str, leaving: Sequence[str], time: float) -> None:
        """Replace controllers by another one at any speed, also while locked.

        Args:
            name: The one that is activated.
            leaving: Those that are deactivated.
            time: Now [s].

        Raises:
            SwitchError, ModeSwitchError: As :meth:`switch`.
        """
        self._carry_out(plan(self._registry.controllers, (name,), leaving, Strictness.STRICT), time)

    def cycle(self, time: float, period: float) -> None:
        """Read, update, limit, write: once.

        Components and controllers that fail are switched off in this cycle and reported in
        ``failures``; nothing is raised for them.

        Args:
            time: Begin of the cycle [s].
            period: Time since the last cycle [s].

        Raises:
            InvalidArgumentError: The period is not above zero; nothing happened.
        """
        time, period = number("the time of a cycle", time), number("the period", period)
        if not period > 0.0:
            raise InvalidArgumentError(f"a cycle takes time: its period cannot be {period:g} s")
        self._execution.failures, self._between_cycles = self._between_cycles, []
        self.statistics.begin()
        timed = self.statistics.timed
        timed(READ, self.read, time, period)
        timed(UPDATE, self.update, time, period)
        timed(WRITE, self.write, time, period)

    def read(self, time: float, period: float) -> None:
        """Read the states of all available components; arguments as :meth:`cycle`."""
        for component in self.claims.components:
            if component.available:
                self._execution.read(component, time, period)
            else:
                component.problems.clear()

    def update(self, time: float, period: float) -> None:
        """Update the controllers that are due, and bound their commands; as :meth:`cycle`."""
        self._execution.update(time, period)
        self.limiter.apply(period, self._switcher.driving)

    def write(self, time: float, period: float) -> None:
        """Write the commands of all active components; arguments as :meth:`cycle`."""
        for component in self.claims.components:
            if component.state is _ACTIVE:
                self._execution.write(component, time, period)

    def set_hardware_state(self, name: str, state: LifecycleState, time: float) -> LifecycleState:
        """Bring a component to a state; before a lower state its controllers are deactivated.

        Raises:
            SwitchError: There is no such component.
            BioscaraError: A transition failed; the component stays in the last state reached.
        """
        known = {component.name: component for component in self.components}
        if text("the name of a component", name) not in known:
            raise SwitchError(unknown(name, known, "hardware component"))
        component = known[name]
        if state < component.state or state is LifecycleState.FINALIZED:
            # An INACTIVE component is still read.
            self.release(component, time, including_readers=state is not LifecycleState.INACTIVE)
        return component.set_state(state)

    def release(
        self, component: HardwareComponent, time: float, *, including_readers: bool = False
    ) -> None:
        """Deactivate the controllers of a component that is brought to a lower state next.

        Args:
            component: The component.
            time: Now [s].
            including_readers: Whether controllers that only read it are deactivated too.
        """
        problems: list[SwitchFailure] = []
        self._switcher.release(component, time, problems, including_readers=including_readers)
        self._report_later(problems, time)

    def shutdown(self, time: float) -> list[Exception]:
        """Shut all controllers, then all hardware down; return the exceptions."""
        leaving = tuple(controller for controller, _ in self._switcher.active)
        changes = self._switcher.changes((), leaving)
        problems = self._switcher.carry_out(Switch((), leaving), changes, time)
        causes = [problem.cause for problem in problems]
        self._registry.finalize()
        for component in self.components:
            try:
                component.shutdown()
            except Exception as error:  # noqa: BLE001  the others must be shut down too
                causes.append(error)
        return causes

    def _carry_out(self, switch: Switch, time: float) -> None:
        start = perf_counter()
        for controller in switch.activate:
            for fallback in self._registry.check_fallbacks(controller):
                self.claims.check((fallback,), self.controllers)
        changes = self._switcher.prepare(switch)
        problems = self._switcher.carry_out(switch, changes, time)
        self.switch_time = perf_counter() - start
        leaving = {controller.name for controller in switch.deactivate}
        hardware = {component.name for component in self.components}
        # A failed activation is reported to the caller alone.
        self._report_later([each for each in problems if each.source in leaving | hardware], time)
        for source, cause in problems:
            if source not in leaving:
                raise SwitchError(
                    f"Failed switching controllers.... {source}: {cause}. {switch.lists()}"
                ) from cause

    def _report_later(self, problems: Sequence[SwitchFailure], time: float) -> None:
        """Report problems that occur between cycles among the failures of the next cycle."""
        self._between_cycles += [Failure(time, source, cause) for source, cause in problems]
