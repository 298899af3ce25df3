"""Homes joints: one at a time by a trigger, or all in their order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import Field

from bioscara.control.controller import Controller
from bioscara.control.joint_trajectory.messages import Status
from bioscara.control.parameters import Parameters
from bioscara.errors import ConfigurationError, GoalRejectedError
from bioscara.hardware import HOME, State


class HomingParameters(Parameters):
    """Parameters of the homing controller.

    Attributes:
        joints: Names of the joints, in the order in which they are homed.
        timeout: Longest time that one joint may take [s].
    """

    joints: tuple[str, ...]
    timeout: Annotated[float, Field(gt=0.0)] = 300.0


class HomingGoal:
    """A sequence of joints to home.

    Args:
        joints: The joints, in the order in which they are homed.

    Attributes:
        joints: As given.
        done_joints: Those that are homed by now.
        current: The one that is homing; None before and after.
        status: How far it got.
        text: Why it ended early.
    """

    def __init__(self, joints: Sequence[str]) -> None:
        self.joints = tuple(joints)
        self.done_joints: list[str] = []
        self.current: str | None = None
        self.status = Status.EXECUTING
        self.text = ""

    @property
    def done(self) -> bool:
        """Whether it ended."""
        return self.status is not Status.EXECUTING

    def end(self, status: Status, text: str = "") -> None:
        """End it; called by the controller."""
        self.status, self.text, self.current = status, text, None


class HomingController(Controller[HomingParameters]):
    """Commands ``home``: the sign is the direction, 0 stops; the hardware resets it at the end.

    Attributes:
        goal: The sequence that runs or ended last; None before the first.
    """

    TYPE = "single_trigger_controller/SingleTriggerController"
    PARAMETERS = HomingParameters

    def __init__(self, name: str, parameters: HomingParameters) -> None:
        super().__init__(name, parameters)
        self.goal: HomingGoal | None = None
        self._triggers: dict[str, float] = {}
        self._directions: dict[str, float] = {}
        self._since = math.nan

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """Home of each joint."""
        return tuple(f"{joint}/{HOME}" for joint in self.parameters.joints)

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        """Home of each joint."""
        return self.command_interfaces

    def on_configure(self) -> None:
        """Check that there is a joint."""
        if not self.parameters.joints:
            raise ConfigurationError(f"{self.name}: parameter joints names none")

    def on_deactivate(self, time: float) -> None:
        """Stop whatever is homing."""
        self._triggers.clear()
        for handle in self.command_handles:
            handle.value = 0.0
        if self.goal is not None and not self.goal.done:
            self.goal.end(Status.ABORTED, "the homing controller was deactivated")

    def trigger(self, joint: str, command: float) -> None:
        """Command one joint, as the topic of the original does.

        Args:
            joint: Name of the joint.
            command: Its sign is the direction; 0 stops.

        Raises:
            GoalRejectedError: The controller is not active, there is no such joint, the command
                is not finite, or a sequence runs.
        """
        self._require_ready((joint,))
        if not math.isfinite(command):
            raise GoalRejectedError(f"{joint}: home command {command} is not a finite number")
        if self.goal is not None and not self.goal.done and command:
            raise GoalRejectedError(f"{joint}: a homing sequence runs; cancel it first")
        self._triggers[joint] = command

    def send_goal(self, directions: Mapping[str, float]) -> HomingGoal:
        """Home several joints one after the other, in the order of the parameters.

        Args:
            directions: By joint, a number whose sign is the direction of its homing.

        Raises:
            GoalRejectedError: As :meth:`trigger`, or a direction is 0.
        """
        self._require_ready(tuple(directions))
        for joint, direction in directions.items():
            if not math.isfinite(direction) or direction == 0.0:
                raise GoalRejectedError(f"{joint}: homing direction {direction} has no sign")
        if self.goal is not None and not self.goal.done:
            raise GoalRejectedError("a homing sequence runs already; cancel it first")
        chosen = [joint for joint in self.parameters.joints if joint in directions]
        self._directions = dict(directions)
        self.goal = HomingGoal(chosen)
        return self.goal

    def cancel(self) -> None:
        """Stop the joint that is homing and end the sequence."""
        if self.goal is not None and not self.goal.done:
            if self.goal.current is not None:
                self._triggers[self.goal.current] = 0.0
            self.goal.end(Status.CANCELED, "homing was cancelled")

    def update(self, time: float, period: float) -> None:
        """Pass triggers on and go through the sequence."""
        for joint, command in self._triggers.items():
            self.command_handles[self.parameters.joints.index(joint)].value = command
        self._triggers.clear()
        goal = self.goal
        if goal is None or goal.done:
            return
        if goal.current is None:
            self._next(goal, time)
            return
        index = self.parameters.joints.index(goal.current)
        handle, homed = self.command_handles[index], self.state_handles[index].value > 0.0
        if handle.value:
            if time - self._since > self.parameters.timeout:
                handle.value = 0.0
                goal.end(
                    Status.ABORTED,
                    f"{goal.joints[len(goal.done_joints)]}: not homed within "
                    f"{self.parameters.timeout:g} s; look whether it moves freely",
                )
        elif homed:
            goal.done_joints.append(goal.current)
            self._next(goal, time)
        else:
            goal.end(Status.ABORTED, f"{goal.current}: homing ended without a home")

    def _next(self, goal: HomingGoal, time: float) -> None:
        if len(goal.done_joints) == len(goal.joints):
            goal.end(Status.SUCCEEDED)
            return
        joint = goal.joints[len(goal.done_joints)]
        goal.current, self._since = joint, time
        self.command_handles[self.parameters.joints.index(joint)].value = self._directions[joint]

    def _require_ready(self, joints: Sequence[str]) -> None:
        if self.state is not State.ACTIVE:
            raise GoalRejectedError(f"{self.name} is {self.state.label}: activate it first")
        for joint in joints:
            if joint not in self.parameters.joints:
                raise GoalRejectedError(
                    f"{joint} is not a joint of {self.name}; it has "
                    f"{', '.join(self.parameters.joints)}"
                )
