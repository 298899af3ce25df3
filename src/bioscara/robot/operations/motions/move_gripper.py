"""Motion of the gripper's jaws."""

from __future__ import annotations

import threading
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
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import GRIPPER, Device
from bioscara.robot.operations.fault_handling import keep_evidence
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory, start_of
from bioscara.robot.operations.motions.home import Home
from bioscara.robot.operations.operation import Cycle, Cycles, OnCycle, Operation
from bioscara.robot.operations.power import drive
from bioscara.robot.planner import Planner


class MoveGripper(Operation[GripperResult]):
    """Moves the jaws to a width, and lasts until they had the time to reach it.

    Args:
        width: Width between the jaws [m].
        name: Name for messages.
        timeout: Longest duration [s]; None for no limit.
        on_cycle: Receives the record of each cycle.
    """

    devices = GRIPPER

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
        self._arm_motion: FollowTrajectory | None = None

    def prepare(self, arm: Arm) -> None:
        """Check that the jaws hold nothing, and stay clear along the motion that the arm makes."""
        if (load := arm.workspace.load) is not None:
            raise LifecycleError(
                f"{self.name}: the jaws hold {load.name}; gripper.release() opens them, and "
                "detach() declares that they are empty"
            )
        self._arm_motion = _arm_motion(arm, self)
        if self._arm_motion is None or self._arm_motion.plan is None:
            return
        arm.stack.gripper.check(GripperGoal((self._width,)))
        before = arm.workspace.surroundings
        # First, so that a motion planned from now on keeps clear of the travel.
        arm.jaws.begin_travel(self._width)
        try:
            planner = Planner(arm.workspace, arm.positions)
            kinematics, scene = planner.kinematics, planner.workspace.surroundings
            for path in self._arm_motion.paths:
                # The check of a path tolerates too little clearance at its start: there the jaws
                # are checked separately.
                start = start_of(path, planner)
                scene.check_standing(kinematics, start, before)
                scene.check(kinematics, path, start)
            # Here, as the disk may take longer than a cycle of the arm's motion.
            arm.session.gripper.keep(self._width)
        except BaseException:
            arm.jaws.refuse_travel()
            raise

    def cycles(self, arm: Arm) -> Cycles[GripperResult]:
        """Send the goal and wait for its end."""
        self.claim.require_not_stopped()
        motion = yield from self._ready(arm)
        arm.jaws.begin_travel(self._width)
        try:
            goal = yield from self._pursue(arm)
        finally:
            if motion is None:
                store_width(arm)
            else:
                # The arm moves, and its cycles do not wait for the disk.
                threading.Thread(target=store_width, args=(arm,), name="gripper-width").start()
        if goal.status is not GoalStatus.SUCCEEDED or goal.result is None:
            raise GripperError(f"the gripper did not reach {self._width:g} m: {goal.text}")
        arm.jaws.end_travel()
        return goal.result

    def _ready(self, arm: Arm) -> Cycles[FollowTrajectory | None]:
        """Drive the servo and check the travel; return the motion that the arm is making."""
        yield from drive(arm, self)
        arm.stack.gripper.check(GripperGoal((self._width,)))
        if _arm_motion(arm, self) is None:
            # The arm may have been pushed since the last cycle.
            arm.restart_loop(self)
            yield None
        motion = _arm_motion(arm, self)
        if motion is None:
            with suppress(NotHomedError):
                Planner(arm.workspace, arm.positions).check_width(self._width)
            # Before the first cycle: the disk may take longer than one.
            arm.session.gripper.keep(self._width)
        elif motion is not self._arm_motion:
            raise motion.claim.refuse(self.name)
        arm.restart_loop(self)
        return motion

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


def _arm_motion(arm: Arm, operation: Operation[GripperResult]) -> FollowTrajectory | None:
    """Return the planned motion that the arm is making; None if it rests or is homed.

    Homing is clear at every width of the jaws.

    Raises:
        BusyError: The arm moves in another way, or plans a motion.
    """
    for other in arm.operations:
        if other is operation or Device.ARM not in other.devices or other.done:
            continue
        if isinstance(other, Home):
            continue
        if not isinstance(other, FollowTrajectory) or other.plan is None:
            raise other.claim.refuse(operation.name)
        return other
    return None


def store_width(arm: Arm) -> None:
    """Store the width at which the jaws rest."""
    try:
        arm.session.gripper.keep()
    except GripperError as error:
        # It matters only after a power loss, so it stops nothing.
        arm.stack.supervisor.warnings.append(str(error))
