"""A controller and a hardware component whose behaviour a test sets."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from bioscara.control.controllers.controller import Controller
from bioscara.control.controllers.parameter_types import Parameters
from bioscara.control.faults.supervisor import FaultState
from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.manager.manager import ControllerManager
from bioscara.control.manager.registry import TYPES
from bioscara.errors import HardwareError
from bioscara.hardware import (
    POSITION,
    CommandInterface,
    HardwareComponent,
    LifecycleState,
    StateInterface,
)
from bioscara.model import JointParameters
from control.control_stack import World


class WildParameters(Parameters):
    """Names of the interfaces that it claims."""

    commands: tuple[str, ...] = ()
    states: tuple[str, ...] = ()


class Wild(Controller[WildParameters]):
    """Runs hooks that a test sets; keeps the periods and goals that it receives."""

    TYPE = "test/Wild"
    PARAMETERS = WildParameters

    def __init__(self, name: str, parameters: WildParameters) -> None:
        super().__init__(name, parameters)
        self.hooks: dict[str, Callable[[], object]] = {}
        self.periods: list[float] = []

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        return self.parameters.commands

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        return self.parameters.states

    def on_configure(self) -> None:
        self._run("configure")

    def on_cleanup(self) -> None:
        self._run("cleanup")

    def on_activate(self, time: float) -> None:
        self._run("activate")

    def on_deactivate(self, time: float) -> None:
        self._run("deactivate")

    def update(self, time: float, period: float) -> None:
        self.periods.append(period)
        self._run("update")

    def _run(self, hook: str) -> None:
        if hook in self.hooks:
            self.hooks[hook]()


class Box(HardwareComponent):
    """One joint, ``g``, with a position and a ``switch``; raises in the steps that are named.

    ACTIVE from the beginning. Keeps the steps that it was asked for.
    """

    def __init__(self, *breaks: str) -> None:
        super().__init__("box", "actuator")
        self.breaks = set(breaks)
        self.error: type[Exception] = HardwareError
        self.steps: list[str] = []
        for kind in (POSITION, "switch"):
            self.states[f"g/{kind}"] = StateInterface("g", kind)
        self.commands[f"g/{POSITION}"] = CommandInterface("g", POSITION)
        self.commands[f"g/{POSITION}"].value = 0.0
        self.configure()
        self.activate()

    @property
    def limits(self) -> Mapping[str, JointParameters]:
        return {}

    def on_configure(self) -> None:
        self._step("configure")

    def on_activate(self) -> None:
        self._step("activate")

    def on_deactivate(self) -> None:
        self._step("deactivate")

    def on_cleanup(self) -> None:
        self._step("cleanup")

    def on_shutdown(self, before: LifecycleState) -> None:
        self._step("shutdown")

    def on_error(self, before: LifecycleState) -> None:
        self._step("error")

    def read(self, time: float, period: float) -> None:
        self._step("read")
        self.states[f"g/{POSITION}"].value = 0.25

    def write(self, time: float, period: float) -> None:
        self._step("write")

    def perform_command_mode_switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        self._step("perform")

    def _step(self, name: str) -> None:
        self.steps.append(name)
        if name in self.breaks:
            raise self.error(f"{name} failed")


def boxed(**controllers: dict[str, object]) -> tuple[ControllerManager, Box]:
    """Return a manager of a box alone, and these controllers, configured."""
    box = Box()
    manager = ControllerManager((box,), Limiter(joint_limiters((box,))), 100)
    for name, values in controllers.items():
        manager.load(name, Wild.TYPE, values)
        manager.configure(name)
    return manager, box


def release(world: World) -> None:
    """Clear the supervisor's faults and locks after an intended fault."""
    world.run(0.3)
    world.supervisor.faults.clear()
    world.supervisor.state = FaultState.CLEAR
    world.manager.lock = ""


def boom(text: str = "boom") -> Callable[[], object]:
    """Return a hook that raises."""

    def hook() -> object:
        raise ValueError(text)

    return hook


def wild(world: World, name: str, *commands: str, **values: object) -> Wild:
    """Load and configure a wild controller that claims ``commands``."""
    TYPES[Wild.TYPE] = Wild
    controller = world.load(name, Wild.TYPE, commands=commands, **values)
    assert isinstance(controller, Wild)
    return controller


TYPES[Wild.TYPE] = Wild
