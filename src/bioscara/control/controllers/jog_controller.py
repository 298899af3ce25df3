"""Moves the joints by streamed velocities."""

from __future__ import annotations

from typing import Literal

from bioscara.control.controllers.controller import Controller, interfaces
from bioscara.control.controllers.parameter_types import Parameters
from bioscara.errors import ConfigurationError, GoalRejectedError
from bioscara.hardware import POSITION, VELOCITY, LifecycleState
from bioscara.planning.motions.jog import JogGenerator, JointVelocity, ToolVelocity

_SAME = 2e-3
"""Offset [rad or m] up to which a jog begins at the commanded positions: the end stops yield."""


class JogParameters(Parameters):
    """Parameters of the jog controller.

    Attributes:
        joints: Names of the four joints.
        command_interfaces: ``("position",)``, or ``("position", "velocity")``.
    """

    joints: tuple[str, ...]
    command_interfaces: tuple[Literal["position", "velocity"], ...] = ("position",)


class JogController(Controller[JogParameters]):
    """Commands the output of a :class:`~bioscara.planning.motions.jog.JogGenerator` for velocities.

    Attributes:
        jog: The jog at rest that begins with the next activation, or the running one; made by code
            that knows the arm's shape and surroundings.
    """

    TYPE = "bioscara_controllers/JogController"
    PARAMETERS = JogParameters
    jog: JogGenerator | None = None

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """Each commanded kind of all joints, one kind after the other."""
        return interfaces(self.parameters.joints, self.parameters.command_interfaces)

    @property
    def collision_checked(self) -> bool:
        """True: a jog always has room to come to rest."""
        return True

    def on_configure(self) -> None:
        """Check that the parameters are consistent."""
        parameters = self.parameters
        if len(parameters.joints) != len(JointVelocity._fields):
            raise ConfigurationError(f"{self.name}: joints must name all four joints of the arm")
        if parameters.command_interfaces not in ((POSITION,), (POSITION, VELOCITY)):
            raise ConfigurationError(
                f"{self.name}: command_interfaces {list(parameters.command_interfaces)}: it is "
                "position, or position and velocity"
            )

    def on_activate(self, time: float) -> None:
        """Begin the jog at the commanded joint positions.

        Raises:
            GoalRejectedError: There is none, or it begins elsewhere.
        """
        if self.jog is None:
            raise GoalRejectedError(f"{self.name}: there is no jog to begin; set one first")
        for handle, position in zip(self.command_handles, self.jog.positions, strict=False):
            if abs(handle.value - position) > _SAME:
                raise GoalRejectedError(
                    f"{self.name}: {handle.name} is {handle.value:.6g}, and the jog begins at "
                    f"{position:.6g}; prepare one that begins there"
                )

    @property
    def at_rest(self) -> bool:
        """Whether the joints are commanded to stand."""
        return self.jog is None or not any(self.jog.velocities)

    def command(
        self, velocity: JointVelocity | ToolVelocity, time: float, share: float = 1.0
    ) -> None:
        """Request a velocity; it expires 0.15 s later.

        Args:
            velocity: Of the joints or of the tool.
            time: Now [s].
            share: Of the velocity, 0 to 1.

        Raises:
            GoalRejectedError: The controller is not active.
            InvalidArgumentError: A value is not finite, or too large.
        """
        if self.jog is None or self.state is not LifecycleState.ACTIVE:
            raise GoalRejectedError(f"{self.name} is {self.state.label}: activate it first")
        self.jog.command(velocity, time, share)

    def cancel(self, time: float) -> None:
        """Come to rest on the path that was found clear."""
        if self.jog is not None:
            self.jog.command(JointVelocity(), time)

    def update(self, time: float, period: float) -> None:
        """Command the joint positions of one cycle from now."""
        if self.jog is None:
            raise GoalRejectedError(f"{self.name} was never activated")
        positions, velocities = self.jog.step(time, period)
        for handle, value in zip(self.command_handles, (*positions, *velocities), strict=False):
            handle.value = value
