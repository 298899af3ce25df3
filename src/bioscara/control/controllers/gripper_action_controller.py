"""Opens and closes a parallel gripper, one goal at a time."""

from __future__ import annotations

import math

from bioscara.arguments import numbers, shown
from bioscara.control.controllers.controller import Controller, interfaces
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.gripper_messages import (
    GripperFeedback,
    GripperGoal,
    GripperGoalHandle,
    GripperResult,
)
from bioscara.control.controllers.parameter_types import Parameters
from bioscara.errors import ConfigurationError, ControllerError, GoalRejectedError
from bioscara.hardware import POSITION, VELOCITY, LifecycleState
from bioscara.model.validation import Finite, Name, Positive

_ROUNDING = 1e-9
"""Difference of widths that comes from rounding [m]."""


class GripperActionParameters(Parameters):
    """Parameters; names and defaults of ros2_controllers but for the last two.

    Attributes:
        joint: Name of the joint.
        action_monitor_rate: How often results are reported [Hz].
        goal_tolerance: Distance from its goal within which the gripper has arrived [m].
        allow_stalling: Whether a gripper that is held up before its goal has succeeded.
        stall_velocity_threshold: Speed below which it counts as standing [m/s].
        stall_timeout: Time of standing after which it counts as held up [s].
        max_effort_interface: Name of the command interface of the effort; empty where none is.
        max_effort: Effort of goals that give none [N].
        max_velocity_interface: Name of the command interface of the speed; empty where none is.
        max_velocity: Speed of goals that give none [m/s].
        velocity_limit: Speed that the gripper cannot exceed [m/s]; the default is the one in the
            arm's description. A servo without a sensor reports its commanded position long before
            it can be there.
        limits: Lowest and highest position that a goal may have [m]; None where the hardware
            alone bounds it.
    """

    joint: Name
    action_monitor_rate: Positive = 20.0
    goal_tolerance: Positive = 0.01
    allow_stalling: bool = False
    stall_velocity_threshold: Positive = 0.001
    stall_timeout: Positive = 1.0
    max_effort_interface: str = ""
    max_effort: Positive = 10.0
    max_velocity_interface: str = ""
    max_velocity: Positive = 0.1
    velocity_limit: Positive = 1.0
    limits: tuple[Finite, Finite] | None = None


class GripperActionController(Controller[GripperActionParameters]):
    """Commands the width of the last goal, and holds it when there is none.

    Attributes:
        goal: The goal that runs or ended last; None before the first.
        position: Width of the gripper [m]: as measured, but changing no faster than
            ``velocity_limit`` allows.
    """

    TYPE = "parallel_gripper_action_controller/GripperActionController"
    PARAMETERS = GripperActionParameters

    def __init__(self, name: str, parameters: GripperActionParameters) -> None:
        super().__init__(name, parameters)
        self.goal: GripperGoalHandle | None = None
        self.position = math.nan
        self._command = math.nan
        self._extras: tuple[float, ...] = ()
        self._still = 0.0

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """Position, then those of speed and effort where they exist."""
        parameters = self.parameters
        extras = (parameters.max_velocity_interface, parameters.max_effort_interface)
        return (f"{parameters.joint}/{POSITION}", *filter(None, extras))

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        """Position and velocity."""
        return interfaces((self.parameters.joint,), (POSITION, VELOCITY))

    @property
    def collision_checked(self) -> bool:
        """True: the sender of a goal checks it, and the arm is kept clear of the whole stroke."""
        return True

    def on_configure(self) -> None:
        """Check that the lower limit is below the upper one."""
        limits = self.parameters.limits
        if limits is not None and not limits[0] < limits[1]:
            raise ConfigurationError(
                f"{self.name}: limits {limits[0]:g} .. {limits[1]:g} m: the first must be below "
                "the second"
            )

    def on_activate(self, time: float) -> None:
        """Hold the measured width."""
        measured = self.state_handles[0]
        if not math.isfinite(measured.value):
            raise ControllerError(
                f"{self.name}: {measured.name} is {measured.value}; activate the gripper first",
                self.name,
            )
        self.position = measured.value
        self._set_command(measured.value)
        self._extras = self._extras_of((), ())
        self._still = 0.0

    def on_deactivate(self, time: float) -> None:
        """End the goal; the servo stays at its last command."""
        self._end(GoalStatus.ABORTED, "the gripper controller was deactivated")

    def abort_goal(self, reason: str) -> None:
        """Hold the current width, and end the goal ABORTED."""
        self._stop(GoalStatus.ABORTED, reason)

    def send_goal(self, goal: GripperGoal) -> GripperGoalHandle:
        """Move the gripper; a goal that still runs is cancelled.

        Returns:
            The accepted goal.

        Raises:
            GoalRejectedError: The controller is not active, there is not exactly one position,
                a value is not finite or outside its limits. Nothing moves.
        """
        if self.state is not LifecycleState.ACTIVE:
            raise GoalRejectedError(f"{self.name} is {self.state.label}: activate it first")
        goal = self.check(goal)
        self._end(GoalStatus.CANCELED, "a newer goal took its place")
        self._set_command(goal.position[0])
        self._still = 0.0
        self._extras = self._extras_of(goal.velocity, goal.effort)
        self.goal = GripperGoalHandle(goal)
        return self.goal

    def cancel(self) -> None:
        """Hold the current width and end the goal; nothing happens if there is none."""
        self._stop(GoalStatus.CANCELED, "the goal was cancelled")

    def update(self, time: float, period: float) -> None:
        """Evaluate the position of the gripper, and command.

        A goal is not evaluated before its command was written; it ends if the hardware gave its
        command up.
        """
        measured, velocity = self.state_handles
        problem = self.command_handles[0].problem
        if problem is not None:
            self._end(GoalStatus.ABORTED, str(problem))
            self._set_command(measured.value)
        reach = self.parameters.velocity_limit * period
        moved = min(max(measured.value - self.position, -reach), reach)
        self.position += moved
        self.command_handles[0].value = self._command
        for handle, value in zip(self.command_handles[1:], self._extras, strict=True):
            handle.value = value
        goal = self.goal
        if goal is None or goal.done:
            return
        threshold = self.parameters.stall_velocity_threshold
        moving = abs(velocity.value) > threshold or abs(moved) > threshold * period
        self._still = 0.0 if moving else self._still + period
        written = goal.feedback is not None
        goal.feedback = GripperFeedback(time, self.position, velocity.value, measured.quality)
        if written:
            self._evaluate(travels=abs(measured.value - self.position) > _ROUNDING)

    def _stop(self, status: GoalStatus, text: str) -> None:
        if self.goal is not None and not self.goal.done:
            self._set_command(self.position)
            self._extras = self._extras_of((), ())
            self._end(status, text)

    def _set_command(self, width: float) -> None:
        self._command, self.command_handles[0].problem = width, None

    def _evaluate(self, *, travels: bool) -> None:
        """End the goal if it is reached or held up; ``travels`` while the jaws need more time."""
        parameters = self.parameters
        near = abs(self._command - self.position) < parameters.goal_tolerance
        if near and not travels:
            self._end(GoalStatus.SUCCEEDED, reached=True)
        elif self._still > parameters.stall_timeout:
            text = (
                f"{parameters.joint} does not move at {self.position:.4g} m, before its goal of "
                f"{self._command:.4g} m"
            )
            if parameters.allow_stalling:
                self._end(GoalStatus.SUCCEEDED, text, stalled=True)
            else:
                self._end(GoalStatus.ABORTED, f"{text}; check what blocks it", stalled=True)

    def _end(
        self, status: GoalStatus, text: str = "", *, reached: bool = False, stalled: bool = False
    ) -> None:
        goal = self.goal
        if goal is None or goal.done:
            return
        measured, velocity = self.state_handles
        goal.result = GripperResult(
            self.position, velocity.value, reached, stalled, measured.quality
        )
        goal.status, goal.text = status, text

    def check(self, goal: GripperGoal) -> GripperGoal:
        """Return a goal that :meth:`send_goal` would accept, in plain floats.

        Raises:
            GoalRejectedError: There is not exactly one position, or a value is not finite or
                outside its limits.
        """
        name = self.parameters.joint
        if not isinstance(goal, GripperGoal):
            raise GoalRejectedError(f"{name}: {shown(goal)} is not a GripperGoal")
        positions, velocities, efforts = (
            numbers(f"{name}: {what} of the goal", getattr(goal, what), error=GoalRejectedError)
            for what in ("position", "velocity", "effort")
        )
        goal = GripperGoal(positions, velocities, efforts)
        if len(goal.position) != 1:
            raise GoalRejectedError(
                f"{name}: {len(goal.position)} positions in the goal; give exactly one"
            )
        for what, values in (("velocity", goal.velocity), ("effort", goal.effort)):
            if len(values) > 1:
                raise GoalRejectedError(
                    f"{name}: {len(values)} values of {what} in the goal; give one or none"
                )
            if values and values[0] <= 0.0:
                raise GoalRejectedError(
                    f"{name}: highest {what} {values[0]:g} must be finite and above 0; leave it "
                    "out for the default"
                )
        position, limits = goal.position[0], self.parameters.limits
        if limits is not None and not limits[0] <= position <= limits[1]:
            raise GoalRejectedError(
                f"{name}: position {position:g} m is outside {limits[0]:g} .. {limits[1]:g} m; "
                "give a width between these, in metres"
            )
        return goal

    def _extras_of(
        self, velocity: tuple[float, ...], effort: tuple[float, ...]
    ) -> tuple[float, ...]:
        """Return the speed and effort of a goal, as far as there are interfaces for them."""
        parameters = self.parameters
        values: list[float] = []
        if parameters.max_velocity_interface:
            values += velocity or (parameters.max_velocity,)
        if parameters.max_effort_interface:
            values += effort or (parameters.max_effort,)
        return tuple(values)
