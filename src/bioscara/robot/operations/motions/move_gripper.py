"""Motion of the gripper's jaws."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from contextlib import suppress

from bioscara.arguments import number
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.gripper_messages import (
    GripperGoal,
    GripperGoalHandle,
    GripperResult,
)
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import (
    GoalRejectedError,
    GripperError,
    LifecycleError,
    MotionCancelledError,
    MotionTimeoutError,
    NotHomedError,
)
from bioscara.planning import Trajectory
from bioscara.report import Phase
from bioscara.robot.arm import Arm, Begun
from bioscara.robot.operations.arbiter import GRIPPER, Device
from bioscara.robot.operations.fault_handling import keep_evidence
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory, start_of
from bioscara.robot.operations.motions.home import Home
from bioscara.robot.operations.operation import Cycle, Cycles, OnCycle, Operation
from bioscara.robot.operations.power import drive
from bioscara.robot.planner import Planner
from bioscara.robot.workspace.workspace import Workspace


class MoveGripper(Operation[GripperResult]):
    """Moves the jaws to a width, and lasts until they had the time to reach it.

    Args:
        width: Width between the jaws [m].
        name: Name for messages.
        timeout: Longest duration [s]; None for no limit.
        on_cycle: Receives the record of each cycle.
    """

    devices = GRIPPER
    _needs_confirmed_scene = True

    def __init__(
        self,
        width: float,
        *,
        name: str = "gripper.move()",
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
    ) -> None:
        super().__init__(name, timeout=timeout, on_cycle=on_cycle)
        self._width = number("the width", width, error=GoalRejectedError)
        self._checked: FollowTrajectory | None = None
        self._announced = False

    def prepare(self, arm: Arm) -> None:
        """Check that the jaws hold nothing, and stay clear along the motion that the arm makes."""
        if (load := arm.workspace.load) is not None:
            raise LifecycleError(
                f"{self.name}: the jaws hold {load.name}; gripper.release() opens them, and "
                "detach() declares that they are empty"
            )
        arm.stack.gripper.check(GripperGoal((self._width,)))
        before = arm.workspace
        # Before the motions are checked: one that begins later is planned for the travel.
        self._announced = True
        arm.jaws.announce(self._width)
        self._checked = motion = _arm_motion(arm, self)
        if motion is None:
            check_standing(arm, before, self._width)
            return
        if motion.plan is None:
            raise motion.claim.refuse(self.name)
        check_along(arm, motion.paths, before)
        # Here, as the disk may take longer than a cycle of the arm's motion.
        arm.session.gripper.keep(self._width)

    def cycles(self, arm: Arm) -> Cycles[GripperResult]:
        """Send the goal and wait for its end."""
        self.claim.require_not_stopped()
        yield from self._ready(arm)
        arm.jaws.begin_travel(self._width)
        self._announced = False
        try:
            goal = yield from self._pursue(arm)
        finally:
            if _moving(arm, self):
                # The cycles of the arm do not wait for the disk.
                threading.Thread(target=store_width, args=(arm,), name="gripper-width").start()
            else:
                store_width(arm)
        if goal.status is not GoalStatus.SUCCEEDED or goal.result is None:
            raise GripperError(f"the gripper did not reach {self._width:g} m: {goal.text}")
        arm.jaws.end_travel()
        return goal.result

    def _end(self, error: BaseException | None) -> None:
        # Before the gripper is free for another operation, which announces its own width.
        if self._announced and self._arm is not None:
            self._arm.jaws.withdraw()
        super()._end(error)

    def _ready(self, arm: Arm) -> Cycles[None]:
        """Drive the servo, check the travel where the arm stands, and store the width."""
        yield from drive(arm, self)
        if not _moving(arm, self):
            # The arm may have been pushed since the last cycle.
            arm.restart_loop(self)
            yield None
        motion = _arm_motion(arm, self)
        if motion is not None and motion is self._checked:
            return
        # One that began since is planned for the travel, but tolerates too little clearance at its
        # start; and a servo that was not driven had the jaws anywhere.
        before = arm.workspace.with_widths(*arm.jaws.present())
        check_standing(arm, before, self._width, motion)
        yield from self._store(arm)

    def _store(self, arm: Arm) -> Cycles[None]:
        """Store the width; the cycles of a motion of the arm do not wait for the disk."""
        if not _moving(arm, self):
            arm.session.gripper.keep(self._width)
            arm.restart_loop(self)
            return
        errors: list[GripperError] = []

        def store() -> None:
            try:
                arm.session.gripper.keep(self._width)
            except GripperError as error:
                errors.append(error)

        storing = threading.Thread(target=store, name="gripper-width")
        storing.start()
        while storing.is_alive():
            yield None
        if errors:
            raise errors[0]
        self.claim.require_not_stopped()
        arm.stack.supervisor.require_clear()

    def _pursue(self, arm: Arm) -> Cycles[GripperGoalHandle]:
        """Send the goal and run cycles until it is done; the jaws rest at the end."""
        stack, clock = arm.stack, arm.session.clock
        deadline = clock.now() + self.timeout
        try:
            goal = stack.gripper.send_goal(GripperGoal((self._width,)))
            while not goal.done:
                if self.claim.stopped:
                    raise MotionCancelledError("interrupted while moving the jaws")
                if clock.now() >= deadline:
                    raise MotionTimeoutError(
                        f"not done within {self.timeout:g} s; the jaws stay where they are"
                    )
                yield Cycle(Phase.SETTLING)
                if stack.supervisor.state is not FaultState.CLEAR:
                    raise stack.supervisor.faults[0].error()
        except GeneratorExit:
            raise
        except BaseException:
            yield from self._come_to_rest(arm)
            raise
        return goal

    def _come_to_rest(self, arm: Arm) -> Cycles[None]:
        supervisor = arm.stack.supervisor
        arm.stack.gripper.cancel()
        yield Cycle(Phase.STOPPING)
        while supervisor.state is FaultState.STOPPING:
            yield Cycle(Phase.STOPPING)
        if supervisor.faults:
            keep_evidence(arm)


def _moving(arm: Arm, operation: Operation[GripperResult]) -> list[Begun]:
    """Return the operation that moves the arm, or is about to, as a list of one or none."""
    others = [each for each in arm.operations if each is not operation and not each.done]
    return [each for each in others if Device.ARM in each.devices]


def _arm_motion(arm: Arm, operation: Operation[GripperResult]) -> FollowTrajectory | None:
    """Return the motion that the arm plans or makes; None if it rests or is homed.

    Homing is clear at every width of the jaws.

    Raises:
        BusyError: The arm jogs, or does something else.
    """
    for other in _moving(arm, operation):
        if isinstance(other, FollowTrajectory):
            return other
        if not isinstance(other, Home):
            raise other.claim.refuse(operation.name)
    return None


def check_along(arm: Arm, paths: Iterable[Trajectory], before: Workspace) -> None:
    """Check an announced travel of the jaws along motions that the arm makes.

    Args:
        arm: The arm.
        paths: The motions.
        before: The workspace without the travel.

    Raises:
        ZoneError: The clearance of a jaw would be too small.
    """
    planner = Planner(arm.workspace, arm.positions)
    kinematics, scene = planner.kinematics, planner.workspace.surroundings
    for path in paths:
        # The check of a path tolerates too little clearance at its start: there the jaws are
        # checked separately.
        start = start_of(path, planner)
        scene.check_standing(kinematics, start, before.surroundings)
        scene.check(kinematics, path, start)


def check_standing(
    arm: Arm, before: Workspace, width: float, motion: FollowTrajectory | None = None
) -> None:
    """Check the travel of the jaws where the arm stands, or where its motion begins.

    The position of an arm that is not homed is unknown: then nothing is checked.

    Raises:
        ZoneError: The clearance of a jaw would be too small.
    """
    with suppress(NotHomedError):
        planner = Planner(before, arm.positions)
        if motion is not None and motion.plan is not None:
            start = start_of(motion.paths[0], planner)
            planner = Planner(before, lambda: start)
        planner.check_width(width)


def store_width(arm: Arm) -> None:
    """Store the width at which the jaws rest."""
    try:
        arm.session.gripper.keep()
    except GripperError as error:
        # It matters only after a power loss, so it stops nothing.
        arm.warn(str(error))
