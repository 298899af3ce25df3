"""The base class of all controllers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Generic, TypeVar

from bioscara.control.controllers.parameter_types import Parameters
from bioscara.control.manager.statistics import UpdateStatistics
from bioscara.errors import ControllerError
from bioscara.hardware import CommandInterface, LifecycleState, StateInterface
from bioscara.model import JointParameters

WARNINGS = 100
"""How many warnings are kept: the latest."""

P = TypeVar("P", bound=Parameters)


def interfaces(joints: Sequence[str], kinds: Sequence[str]) -> tuple[str, ...]:
    """Return the names of these interfaces of these joints, one kind after the other."""
    return tuple(f"{joint}/{kind}" for kind in kinds for joint in joints)


class Controller(ABC, Generic[P]):
    """Turns measured states into commands, a cycle at a time.

    A subclass names its ``TYPE`` and its ``PARAMETERS``, declares the interfaces that it needs once
    it is configured, and implements :meth:`update`. The manager hands it the handles of those
    interfaces, in the order in which it named them, before ``on_activate``.

    Attributes:
        name: Name of the controller.
        parameters: Its checked parameters.
        state: Its lifecycle state; changed by the manager only.
        nominal_period: Nominal time from update to update [s]; set before ``on_activate``.
        commanded_speeds: Velocity at which each claimed joint was commanded when the controller
            was activated [rad/s or m/s], by joint; 0 for one that was at rest.
        limits: Those of the joints of the hardware that it commands, by joint; set before
            ``on_activate``.
        lag_of: Returns how far the setpoints of a joint lag behind its commands, as these are
            averaged [rad or m]; set before ``on_activate``.
        command_handles: The claimed command interfaces while it is active.
        state_handles: The state interfaces while it is active.
        statistics: Of its updates since it was activated last.
    """

    TYPE: ClassVar[str]
    PARAMETERS: ClassVar[type[Parameters]]

    def __init__(self, name: str, parameters: P) -> None:
        self.name, self.parameters = name, parameters
        self.state = LifecycleState.UNCONFIGURED
        self.nominal_period = 0.0
        self.commanded_speeds: dict[str, float] = {}
        self.limits: Mapping[str, JointParameters] = {}
        self.lag_of: Callable[[str], float] = lambda _: 0.0
        self.command_handles: tuple[CommandInterface, ...] = ()
        self.state_handles: tuple[StateInterface, ...] = ()
        self.statistics = UpdateStatistics()

    def __repr__(self) -> str:
        return f"<{self.TYPE} {self.name} {self.state.label}>"

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """Names of the command interfaces that it claims, valid once configured; here none."""
        return ()

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        """Names of the state interfaces that it reads, valid once configured; here none."""
        return ()

    @property
    def collision_checked(self) -> bool:
        """Whether its commands, begun from rest, are verified to keep the arm clear."""
        return False

    @property
    def smooth(self) -> bool:
        """Whether its commands, begun from rest, are too gentle for the belts to swing."""
        return self.collision_checked

    def on_collision_stop(self, reason: str, rest: Mapping[str, float]) -> None:
        """React to a stop of the arm because the commanded motion is not clear.

        Called on controllers that are not ``collision_checked``, once for each stop.

        Args:
            reason: Why, in words.
            rest: Where the joints come to rest, by name [rad or m].
        """

    def abort_goal(self, reason: str) -> None:
        """End its goal ABORTED, if it has one that runs; the caller brings the arm to rest then.

        Args:
            reason: Why, in words.
        """

    def on_configure(self) -> None:
        """Check that the parameters are consistent.

        Raises:
            ConfigurationError: They cannot be used.
        """

    def on_activate(self, time: float) -> None:
        """Prepare for updates; the handles are set and hold the measured values.

        Args:
            time: Now [s].

        Raises:
            BioscaraError: It cannot be activated now.
        """

    def on_deactivate(self, time: float) -> None:
        """Deactivate; the handles are still set.

        Args:
            time: Now [s].
        """

    def on_cleanup(self) -> None:
        """Discard the results of ``on_configure``."""

    @abstractmethod
    def update(self, time: float, period: float) -> None:
        """Write the command handles.

        Args:
            time: Begin of the cycle [s].
            period: Time since this controller's last update [s].

        Raises:
            BioscaraError: It cannot continue; the manager switches it off.
        """

    def bind(
        self,
        commands: Mapping[str, CommandInterface],
        states: Mapping[str, StateInterface],
    ) -> None:
        """Take the handles of the interfaces that it named.

        Raises:
            ControllerError: One does not exist.
        """
        missing = [name for name in self.command_interfaces if name not in commands]
        missing += [name for name in self.state_interfaces if name not in states]
        if missing:
            raise ControllerError(f"{self.name}: no interface {', '.join(missing)}", self.name)
        self.command_handles = tuple(commands[name] for name in self.command_interfaces)
        self.state_handles = tuple(states[name] for name in self.state_interfaces)

    def unbind(self) -> None:
        """Release the handles."""
        self.command_handles, self.state_handles = (), ()


AnyController = Controller[Any]
"""A controller with any parameters."""
