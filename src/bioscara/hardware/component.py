"""Base class of hardware components: a lifecycle around ``read`` and ``write``.

Its states are also those of controllers.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import IntEnum

from bioscara.errors import BioscaraError, LifecycleError, ModeSwitchError
from bioscara.hardware.interfaces import CommandInterface, StateInterface
from bioscara.model import JointParameters
from bioscara.spelling import did_you_mean


class LifecycleState(IntEnum):
    """Lifecycle state of a component or controller; the numbers are those of lifecycle_msgs."""

    UNKNOWN = 0
    UNCONFIGURED = 1
    INACTIVE = 2
    ACTIVE = 3
    FINALIZED = 4

    @property
    def label(self) -> str:
        """The name used in ROS messages, in lower case."""
        return self.name.lower()


_AVAILABLE = (LifecycleState.INACTIVE, LifecycleState.ACTIVE)


class HardwareComponent(ABC):
    """A device with interfaces and a lifecycle, as in ros2_control.

    A subclass implements the ``on_`` hooks, :meth:`read` and :meth:`write`. A hook that raises a
    :class:`~bioscara.errors.BioscaraError` in ``on_configure`` or ``on_activate`` leaves the
    component in its previous state, after the subclass undid its partial changes; one that raises
    in ``on_deactivate`` or ``on_cleanup`` sends it through :meth:`fail`.

    Args:
        name: Name of the component.
        kind: ``"system"``, ``"actuator"`` or ``"sensor"``.

    Attributes:
        name: As given.
        kind: As given.
        state: Its lifecycle state.
        transitions: Number of changes of that state.
        states: Its state interfaces, by name.
        commands: Its command interfaces, by name.
        problems: Errors of single joints in the last ``read`` or ``write``, while the component as
            a whole continues; the reaction to them is not decided here.
        bus_time: Duration of the exchanges of the last cycle [s]; 0 without a bus.
    """

    def __init__(self, name: str, kind: str = "system") -> None:
        self.name, self.kind = name, kind
        self.state = LifecycleState.UNCONFIGURED
        self.transitions = 0
        self.states: dict[str, StateInterface] = {}
        self.commands: dict[str, CommandInterface] = {}
        self.problems: list[BioscaraError] = []
        self.bus_time = 0.0

    @property
    @abstractmethod
    def limits(self) -> Mapping[str, JointParameters]:
        """Limits of its joints, by joint name; empty where commands are bounded otherwise."""

    @property
    def available(self) -> bool:
        """Whether its interfaces can be used."""
        return self.state in _AVAILABLE

    def configure(self) -> None:
        """Go from UNCONFIGURED to INACTIVE.

        Raises:
            LifecycleError: It is in another state.
            BioscaraError: It could not; it is still UNCONFIGURED.
        """
        self._require("configure", LifecycleState.UNCONFIGURED)
        self._reach(self.on_configure)
        self._enter(LifecycleState.INACTIVE)

    def activate(self) -> None:
        """Go from INACTIVE to ACTIVE; commands are then NaN or the measured values.

        Raises:
            LifecycleError: It is in another state.
            BioscaraError: It could not; it is still INACTIVE.
        """
        self._require("activate", LifecycleState.INACTIVE)
        self._reach(self.on_activate)
        self._enter(LifecycleState.ACTIVE)

    def deactivate(self) -> None:
        """Go from ACTIVE to INACTIVE.

        Raises:
            LifecycleError: It is in another state.
            BioscaraError: Something could not be switched off; it went through :meth:`fail`.
        """
        self._require("deactivate", LifecycleState.ACTIVE)
        self._leave(self.on_deactivate)
        self._enter(LifecycleState.INACTIVE)

    def cleanup(self) -> None:
        """Go from INACTIVE to UNCONFIGURED.

        Raises:
            LifecycleError: It is in another state.
            BioscaraError: It went through :meth:`fail`.
        """
        self._require("clean up", LifecycleState.INACTIVE)
        self._leave(self.on_cleanup)
        self._forget()
        self._enter(LifecycleState.UNCONFIGURED)

    def shutdown(self) -> None:
        """Go from any state to FINALIZED, which it never leaves.

        Raises:
            BioscaraError: Something could not be switched off; it is FINALIZED all the same.
        """
        if self.state is LifecycleState.FINALIZED:
            return
        before = self.state
        self._enter(LifecycleState.FINALIZED)
        self._forget()
        self.on_shutdown(before)

    def fail(self) -> None:
        """Give up after an error: UNCONFIGURED if everything could be released, else FINALIZED.

        Raises:
            BioscaraError: Something could not be released; it is FINALIZED.
        """
        before = self.state
        try:
            self.on_error(before)
        except BaseException:
            self._enter(LifecycleState.FINALIZED)
            raise
        finally:
            self._forget()
        self._enter(LifecycleState.UNCONFIGURED)

    def set_state(self, target: LifecycleState) -> LifecycleState:
        """Go to ``target``, over several transitions if necessary, and return the state.

        Raises:
            LifecycleError: ``target`` cannot be reached, for example out of FINALIZED.
            BioscaraError: A transition failed; the component stays in the state reached.
        """
        if target not in (
            LifecycleState.UNCONFIGURED,
            LifecycleState.INACTIVE,
            LifecycleState.ACTIVE,
            LifecycleState.FINALIZED,
        ):
            raise LifecycleError(f"{self.name}: no component can be {target.label}", self.name)
        if target is LifecycleState.FINALIZED:
            self.shutdown()
            return self.state
        if self.state is LifecycleState.FINALIZED:
            raise LifecycleError(
                f"{self.name} is finalized: it cannot become {target.label}; create it again",
                self.name,
            )
        up = {LifecycleState.UNCONFIGURED: self.configure, LifecycleState.INACTIVE: self.activate}
        down = {LifecycleState.ACTIVE: self.deactivate, LifecycleState.INACTIVE: self.cleanup}
        while self.state is not target:
            (up if self.state < target else down)[self.state]()
        return self.state

    @abstractmethod
    def on_configure(self) -> None:
        """Connect; nothing moves."""

    @abstractmethod
    def on_activate(self) -> None:
        """Enable; nothing moves."""

    @abstractmethod
    def on_deactivate(self) -> None:
        """Bring everything to rest and release it; every part is tried."""

    @abstractmethod
    def on_cleanup(self) -> None:
        """Disconnect."""

    @abstractmethod
    def on_shutdown(self, before: LifecycleState) -> None:
        """Release and disconnect, coming from ``before``; every part is tried."""

    @abstractmethod
    def on_error(self, before: LifecycleState) -> None:
        """Release and disconnect after an error in ``before``; every part is tried."""

    @abstractmethod
    def read(self, time: float, period: float) -> None:
        """Read the measurements into the state interfaces.

        Args:
            time: Present time [s].
            period: Time since the last cycle [s].

        Raises:
            BioscaraError: The component as a whole failed.
        """

    @abstractmethod
    def write(self, time: float, period: float) -> None:
        """Send the commands of the claimed interfaces; arguments and errors as :meth:`read`."""

    def prepare_command_mode_switch(
        self, start: Sequence[str], stop: Sequence[str]
    ) -> Sequence[str]:
        """Check a change of claims; changes nothing.

        Args:
            start: Names of command interfaces that will be claimed.
            stop: Names of command interfaces that will be released.

        Returns:
            Warnings about changes that are possible but may be unintended; none here.

        Raises:
            ModeSwitchError: It cannot be done now; the message states the reason.
        """
        return ()

    def perform_command_mode_switch(self, start: Sequence[str], stop: Sequence[str]) -> None:
        """Change the modes as prepared; arguments as above.

        Raises:
            BioscaraError: A joint did not take part; modes are as before.
        """

    def require_commands(self, names: Iterable[str]) -> None:
        """Raise unless all these are command interfaces of the component.

        Raises:
            ModeSwitchError: One is not; proposes another.
        """
        for name in names:
            if name not in self.commands:
                hint = did_you_mean(name, self.commands, f"it has {', '.join(self.commands)}")
                raise ModeSwitchError(
                    f"{self.name} has no command interface {name}; {hint}", self.name
                )

    def _enter(self, state: LifecycleState) -> None:
        self.state = state
        self.transitions += 1

    def _require(self, what: str, state: LifecycleState) -> None:
        if self.state is not state:
            raise LifecycleError(
                f"{self.name} is {self.state.label}: only an {state.label} component can {what}",
                self.name,
            )

    def _reach(self, hook: Callable[[], None]) -> None:
        try:
            hook()
        except BaseException:
            self._forget()
            raise

    def _leave(self, hook: Callable[[], None]) -> None:
        try:
            hook()
        except BaseException:
            self.fail()
            raise

    def _forget(self) -> None:
        """Invalidate all earlier measurements."""
        for state in self.states.values():
            state.forget()
