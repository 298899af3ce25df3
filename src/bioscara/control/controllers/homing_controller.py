"""Homes joints one after the other: any of them by a trigger, or several in their order."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from bioscara.arguments import number, shown
from bioscara.control.controllers.controller import Controller, interfaces
from bioscara.control.controllers.goal_handle import AcceptedGoal, GoalStatus
from bioscara.control.controllers.parameter_types import Parameters
from bioscara.errors import ConfigurationError, GoalRejectedError
from bioscara.hardware import HOME, VELOCITY, LifecycleState
from bioscara.hardware.interfaces import Quality
from bioscara.model.validation import Positive


class HomingSequenceParameters(Parameters):
    """Parameters of the homing controller.

    Attributes:
        joints: Names of the joints, in the order in which they are homed.
        timeout: Longest time that one joint may take [s].
        max_travel: Longest travel of each joint towards its end stop [rad or m], in the order of
            ``joints``; empty where only the joints themselves and the time bound it.
    """

    joints: tuple[str, ...]
    timeout: Positive = 300.0
    max_travel: tuple[Positive, ...] = ()

    @classmethod
    def arranged(cls, values: Mapping[Any, object]) -> Mapping[Any, object]:
        """Take the joints of a parameter file of ROS, which has them below their interfaces.

        Raises:
            ValueError: An interface is not that of homing, or the states are of other joints.
        """
        given = dict(values)
        named = [
            (what, _joints_of(what, given.pop(what)))
            for what in ("command_interfaces", "state_interfaces")
            if what in given
        ]
        for what, joints in named:
            known = given.setdefault("joints", joints)
            if not isinstance(known, list | tuple) or set(known) != set(joints):
                raise ValueError(f"{what} are of other joints than its commands")
        return given


def _joints_of(what: str, values: object) -> list[Any]:
    joints = values.get("joints") if isinstance(values, Mapping) else None
    if not isinstance(values, Mapping) or not isinstance(joints, Mapping) or len(values) != 1:
        raise ValueError(f"{what} is {shown(values)}; give joints: NAME: interfaces: [{HOME}]")
    for name, group in joints.items():
        if not isinstance(group, Mapping) or {**group} != {"interfaces": [HOME]}:
            raise ValueError(f"{what} of {shown(name)} are {shown(group)}, not [{HOME}]")
    return list(joints)


class HomingProgress(NamedTuple):
    """Progress of the joint that is homing.

    Attributes:
        joint: Its name.
        elapsed: Time since it was commanded to home [s].
        travel: Travel towards its end stop [rad or m]. The joint has no position yet, so this is
            its integrated velocity.
    """

    joint: str
    elapsed: float
    travel: float


class HomingGoal(AcceptedGoal):
    """Joints to home, one after the other; changed by the controller until it ends.

    Args:
        directions: By joint, a number whose sign is the direction; in the order of homing.

    Attributes:
        directions: As given.
        joints: Its joints.
        done_joints: Joints already homed.
        current: The one that is homing; None before and after.
        progress: Progress of that one, or of the last one; None before the first.
        status: Status of the whole goal.
        text: Why it ended early.
    """

    __slots__ = ("current", "directions", "done_joints", "joints", "progress", "status", "text")

    def __init__(self, directions: Mapping[str, float]) -> None:
        self.directions = dict(directions)
        self.joints = tuple(directions)
        self.done_joints: list[str] = []
        self.current: str | None = None
        self.progress: HomingProgress | None = None
        self.status = GoalStatus.EXECUTING
        self.text = ""

    def end(self, status: GoalStatus, text: str = "") -> None:
        """End it; called by the controller."""
        self.status, self.text, self.current = status, text, None


class HomingController(Controller[HomingSequenceParameters]):
    """Commands ``home``: the sign is the direction, 0 stops; the hardware resets it at the end.

    One joint homes at a time: while one is homing, the bus is not free for another.

    Attributes:
        goal: The goal that runs or ended last, a sequence or a single joint; None before the
            first.
    """

    TYPE = "single_trigger_controller/SingleTriggerController"
    PARAMETERS = HomingSequenceParameters

    def __init__(self, name: str, parameters: HomingSequenceParameters) -> None:
        super().__init__(name, parameters)
        self.goal: HomingGoal | None = None
        self._index = 0
        self._since = self._travel = 0.0
        self._stopping = False

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """Home of each joint."""
        return interfaces(self.parameters.joints, (HOME,))

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        """Home, then velocity of each joint."""
        return interfaces(self.parameters.joints, (HOME, VELOCITY))

    def on_configure(self) -> None:
        """Check that there is a joint, and a limit for each or for none."""
        joints, limits = self.parameters.joints, self.parameters.max_travel
        if not joints:
            raise ConfigurationError(f"{self.name}: parameter joints names none")
        if limits and len(limits) != len(joints):
            raise ConfigurationError(
                f"{self.name}: {len(limits)} max_travel for {len(joints)} joints; give one for "
                "each of them, or none"
            )

    def on_activate(self, time: float) -> None:
        """Start without homing a joint."""
        self._stopping = False

    def on_deactivate(self, time: float) -> None:
        """Stop the joint that is homing; the goal gives the reason, if the joint reported one."""
        seeking = self.goal is not None and self.goal.current is not None
        problem = self.command_handles[self._index].problem if seeking else None
        self._stop(GoalStatus.ABORTED, str(problem or "the homing controller was deactivated"))

    def abort_goal(self, reason: str) -> None:
        """End a running goal, and stop the joint that is homing."""
        self._stop(GoalStatus.ABORTED, reason)

    def trigger(self, joint: str, command: float) -> HomingGoal | None:
        """Command one joint, as the topic of the original controller does.

        Args:
            joint: Name of the joint.
            command: Its sign is the direction; 0 stops the joint, and with it the sequence that
                it is part of.

        Returns:
            The started goal; None for 0.

        Raises:
            GoalRejectedError: The controller is not active, there is no such joint, the command
                is not finite, or a joint is homing.
        """
        if self.check_trigger(joint, command):
            return self.send_goal({joint: command})
        if self.goal is not None and joint in self.goal.joints:
            self.cancel()
        return None

    def check_trigger(self, joint: str, command: float) -> float:
        """Return a command that :meth:`trigger` accepts while no joint is homing; errors likewise.

        Args:
            joint: Name of the joint.
            command: The command.
        """
        self._require_ready((joint,))
        return number(f"{joint}: home command", command, error=GoalRejectedError)

    def send_goal(self, directions: Mapping[str, float]) -> HomingGoal:
        """Home several joints one after the other, in the order of the parameters.

        Args:
            directions: By joint, a number whose sign is the direction of its homing.

        Raises:
            GoalRejectedError: The controller is not active, there is no such joint or none at
                all, a direction is 0 or not finite, or a joint is homing.
        """
        if not isinstance(directions, Mapping):
            raise GoalRejectedError(
                f"{self.name}: the goal is {shown(directions)}; give a direction for each joint"
            )
        self._require_ready(directions)
        if not directions:
            raise GoalRejectedError(f"{self.name}: the goal names no joint to home")
        directions = {
            joint: number(f"{joint}: home command", direction, error=GoalRejectedError)
            for joint, direction in directions.items()
        }
        for joint, direction in directions.items():
            if direction == 0.0:
                raise GoalRejectedError(
                    f"{joint}: home command {direction:g} has no direction; give a finite number "
                    "above or below 0"
                )
        if self.goal is not None and not self.goal.done:
            raise GoalRejectedError(
                f"{self.goal.current or self.goal.joints[0]} is homing; cancel that first"
            )
        order = self.parameters.joints
        self.goal = HomingGoal({name: directions[name] for name in order if name in directions})
        return self.goal

    def cancel(self) -> None:
        """Stop the joint that is homing and end the goal; nothing happens if there is none."""
        self._stop(GoalStatus.CANCELED, "homing was cancelled")

    def update(self, time: float, period: float) -> None:
        """Start the next joint, or monitor the one that is homing."""
        goal = self.goal
        if self._stopping:
            # The hardware detects a stop only if it stays for a cycle.
            self._stopping = False
        elif goal is None or goal.done:
            return
        elif goal.current is None:
            self._next(goal, time)
        else:
            self._monitor(goal, goal.current, time, period)

    def _next(self, goal: HomingGoal, time: float) -> None:
        if len(goal.done_joints) == len(goal.joints):
            goal.end(GoalStatus.SUCCEEDED)
            return
        joint = goal.joints[len(goal.done_joints)]
        self._index, self._since, self._travel = self.parameters.joints.index(joint), time, 0.0
        goal.current, goal.progress = joint, HomingProgress(joint, 0.0, 0.0)
        handle = self.command_handles[self._index]
        handle.problem, handle.value = None, math.copysign(1.0, goal.directions[joint])

    def _monitor(self, goal: HomingGoal, joint: str, time: float, period: float) -> None:
        handle, home = self.command_handles[self._index], self.state_handles[self._index]
        elapsed = time - self._since
        speed = self.state_handles[len(self.parameters.joints) + self._index].value
        if math.isfinite(speed):
            self._travel += math.copysign(1.0, goal.directions[joint]) * speed * period
        goal.progress = HomingProgress(joint, elapsed, self._travel)
        if handle.problem is not None:
            self._stop(GoalStatus.ABORTED, str(handle.problem))
        elif handle.value:
            self._enforce_bounds(joint, elapsed)
        elif home.quality is not Quality.FRESH:
            return  # The joint ended; its next answer carries the result.
        elif home.value > 0.0:
            goal.done_joints.append(joint)
            self._next(goal, time)
        else:
            self._stop(
                GoalStatus.ABORTED, f"{joint} was stopped before it was homed; home it again"
            )

    def _enforce_bounds(self, joint: str, elapsed: float) -> None:
        """Stop a joint that takes too long or travels too far."""
        parameters = self.parameters
        remedy = "it was stopped; check that it moves freely and has its end stop, then home it"
        if elapsed > parameters.timeout:
            self._stop(
                GoalStatus.ABORTED,
                f"{joint} was not homed within the timeout of {parameters.timeout:g} s; {remedy}",
            )
        elif parameters.max_travel and self._travel > parameters.max_travel[self._index]:
            self._stop(
                GoalStatus.ABORTED,
                f"{joint} went {self._travel:.4g} towards its end stop without touching it, "
                f"max_travel is {parameters.max_travel[self._index]:.4g}; {remedy}",
            )

    def _stop(self, status: GoalStatus, text: str) -> None:
        """Stop the joint that is homing, if one is, and end the goal."""
        goal = self.goal
        if goal is None or goal.done:
            return
        if goal.current is not None:
            self.command_handles[self._index].value = 0.0
            self._stopping = True
        goal.end(status, text)

    def _require_ready(self, joints: Iterable[str]) -> None:
        if self.state is not LifecycleState.ACTIVE:
            raise GoalRejectedError(f"{self.name} is {self.state.label}: activate it first")
        for joint in joints:
            if not isinstance(joint, str) or joint not in self.parameters.joints:
                name = shown(joint).strip("'")
                raise GoalRejectedError(
                    f"{name} is not a joint of {self.name}; it has "
                    f"{', '.join(self.parameters.joints)}"
                )
