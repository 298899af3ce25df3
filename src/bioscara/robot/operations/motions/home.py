"""Homing of the joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from bioscara.arguments import items, shown
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.homing_controller import HomingController, HomingGoal
from bioscara.drivers.joint.homing import check_current, check_sensitivity
from bioscara.errors import HomingError, InvalidArgumentError, LifecycleError
from bioscara.model.parameters import JOINTS
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.connection.stack import HOMING
from bioscara.robot.operations.execution import MotionExecution
from bioscara.robot.operations.motions.homing_order import directions_of, joints_to_home
from bioscara.robot.operations.operation import Cycles, OnCycle, Operation
from bioscara.spelling import did_you_mean

PerJoint = int | Mapping[str, int] | None
"""A number for all joints, or by the names of joints; None for the configured ones."""


def per_joint(what: str, given: PerJoint, check: Callable[[str, int], int]) -> dict[str, int]:
    """Return the number of each joint that one is given for.

    Args:
        what: Name of the number in errors.
        given: One number for all joints, or by the names of joints.
        check: Checks the number of a joint.

    Raises:
        LimitError, InvalidArgumentError: There is no such joint, or a number cannot be used.
    """
    if given is None:
        return {}
    values = given if isinstance(given, Mapping) else dict.fromkeys(JOINTS, given)
    for name in values:
        if name not in JOINTS:
            hint = did_you_mean(str(name), JOINTS, f"there are {', '.join(JOINTS)}")
            raise InvalidArgumentError(f"{what}: there is no joint {shown(name)}; {hint}")
    return {name: check(name, value) for name, value in values.items()}


def chosen(joints: Sequence[str] | None) -> tuple[str, ...] | None:
    """Return the names of the joints to home; None for those that are not homed.

    Raises:
        InvalidArgumentError: There is no such joint, or none is given.
    """
    if joints is None:
        return None
    names = items("the joints to home", joints, 'give ["j2"]')
    for name in names:
        if not isinstance(name, str) or name not in JOINTS:
            given, listed = name if isinstance(name, str) else "", ", ".join(JOINTS)
            hint = did_you_mean(given, JOINTS, f"there are {listed}")
            raise InvalidArgumentError(f"there is no joint {shown(name)} to home; {hint}")
    if not names:
        raise InvalidArgumentError(
            "home() is given no joints; leave them out for those that are not homed"
        )
    return names


class Home(Operation[None]):
    """Homes the joints that are not homed, and homed ones that must be homed again before them.

    With ``joints`` it homes these, also where they are homed, and no others: it is refused where
    another one would have to be homed before.

    Args:
        joints: Names of the joints; None for those that are not homed.
        sensitivity: Position error that counts as a touch, 1 to 255 [microsteps of the motor]: one
            for all joints, or by the names of joints; None for the configured ones.
        current: Drive current, 1 to 100 [%]; likewise.
        timeout: Longest duration [s]; None for no limit except each joint's own.
        on_cycle: Receives the record of each cycle.

    Raises:
        LimitError, InvalidArgumentError: A value is outside its limits or not whole, or there is no
            such joint.
    """

    _needs_confirmed_scene = True

    def __init__(
        self,
        *,
        joints: Sequence[str] | None = None,
        sensitivity: PerJoint = None,
        current: PerJoint = None,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
    ) -> None:
        super().__init__("home()", timeout=timeout, on_cycle=on_cycle)
        self._joints = chosen(joints)
        self._sensitivity = per_joint("sensitivity", sensitivity, check_sensitivity)
        self._current = per_joint("current", current, check_current)
        self._goal: HomingGoal | None = None
        self._ranges: dict[str, float] = {}
        self._progress = 0.0

    @property
    def progress(self) -> float:
        """Share that is done, 0 to 1; it never decreases.

        All joints count the same, as the firmware may choose the speed. Of the one that moves, the
        share of its range counts that it has travelled.
        """
        if self.done and self.error is None:
            return 1.0
        self._count()
        return self._progress

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Home the joints in the order of the parameters."""
        stack, clock = arm.stack, arm.session.clock
        arm.pace(homing=True)
        execution = MotionExecution(arm, self)
        self.claim.require_not_stopped()
        if arm.paused:
            arm.warn(f"{self.name} begins paused: it moves after {arm.resumption}", *self.caller)
            yield from execution.run(lambda: not arm.paused, Phase.HOMING)
        yield from arm.session.enabling(self.claim.require_not_stopped)
        directions, notes = self._directions(arm)
        if not directions:
            return
        if (load := arm.workspace.load) is not None:
            raise LifecycleError(
                f"home(): the tool carries {load.name}, and the path of homing is clear only for "
                "an empty gripper; take it off and detach() it, or hold it and gripper.release() it"
            )
        for note in notes:
            arm.warn(note, *self.caller)
        stack.use(HOMING, clock.now())
        axes = [axis for axis in stack.hardware.axes if axis.name in directions]
        for axis in axes:
            limits = axis.joint.parameters
            self._ranges[axis.name] = limits.upper - limits.lower
            axis.homing.sensitivity = self._sensitivity.get(axis.name)
            axis.homing.current = self._current.get(axis.name)
        goal = yield from execution.pursue(
            lambda: self._send(stack.homing, directions), Phase.HOMING, before_cycle=self._count
        )
        if goal.status is not GoalStatus.SUCCEEDED:
            raise HomingError(goal.text)
        stack.manager.switch(clock.now(), (), (HOMING,))

    def _send(self, controller: HomingController, directions: Mapping[str, float]) -> HomingGoal:
        self._goal = controller.send_goal(directions)
        return self._goal

    def _count(self) -> None:
        """Note how much is done; when a joint backs off from its end stop, that stays."""
        if (goal := self._goal) is None:
            return
        done, now = float(len(goal.done_joints)), goal.progress
        if now is not None and now.joint not in goal.done_joints:
            done += min(now.travel / self._ranges[now.joint], 1.0)
        self._progress = max(self._progress, done / len(goal.joints))

    def _directions(self, arm: Arm) -> tuple[dict[str, float], list[str]]:
        """Return the joints to home with their directions, and the reasons."""
        axes = arm.stack.hardware.axes
        if self._joints is None:
            return joints_to_home(axes)
        order = arm.stack.homing.parameters.joints
        return directions_of(axes, order, self._joints), []
