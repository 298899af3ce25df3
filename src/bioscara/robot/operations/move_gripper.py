"""Motion of the gripper's jaws."""

from __future__ import annotations

from contextlib import suppress

from bioscara.arguments import number
from bioscara.control.controllers.goals import GoalStatus
from bioscara.control.controllers.gripper_messages import GripperGoal, GripperResult
from bioscara.control.faults.supervisor import FaultState
from bioscara.errors import (
    GoalRejectedError,
    GripperError,
    MotionCancelledError,
    MotionTimeoutError,
    NotHomedError,
)
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.operations.arbiter import GRIPPER, Device
from bioscara.robot.operations.follow_trajectory import FollowTrajectory, start_of
from bioscara.robot.operations.home import Home
from bioscara.robot.operations.operation import Cycle, Cycles, OnCycle, Operation
from bioscara.robot.operations.power import drive
from bioscara.robot.planner import Planner


class MoveGripper(Operation[GripperResult]):
    """Moves the jaws to a width, and lasts until they had the time to reach it.

    Args:
        width: Width between the jaws [m].
        timeout: Longest duration [s]; None for no limit.
        on_cycle: Receives the record of each cycle.
    """

    devices = GRIPPER

    def __init__(
        self, width: float, *, timeout: float | None = None, on_cycle: OnCycle | None = None
    ) -> None:
        super().__init__("gripper.move()", timeout=timeout, on_cycle=on_cycle)
        self._width = number("the width", width, error=GoalRejectedError)
        self._arm_motion: FollowTrajectory | None = None

    def prepare(self, arm: Arm) -> None:
        """Check that the jaws stay clear along the motion that the arm is making, if any."""
        self._arm_motion = _arm_motion(arm, self)
        if self._arm_motion is None or self._arm_motion.plan is None:
            return
        arm.stack.gripper.check(GripperGoal((self._width,)))
        before = arm.workspace.surroundings
        # First, so that a motion which is planned meanwhile already keeps clear of the travel.
        arm.jaws.begin_travel(self._width)
        try:
            planner = Planner(arm.workspace, arm.positions)
            kinematics, scene = planner.kinematics, planner.workspace.surroundings
            for path in self._arm_motion.paths:
                # At the start, the check of a path permits what the jaws do not cause.
                start = start_of(path, planner)
                scene.check_standing(kinematics, start, before)
                scene.check(kinematics, path, start)
        except BaseException:
            arm.jaws.refuse_travel()
            raise

    def cycles(self, arm: Arm) -> Cycles[GripperResult]:
        """Send the goal and wait for its end."""
        stack, clock, gripper = arm.stack, arm.session.clock, arm.session.gripper
        self.claim.require_not_stopped()
        yield from drive(arm)
        message = GripperGoal((self._width,))
        stack.gripper.check(message)
        if _arm_motion(arm, self) is None:
            # The arm may have been pushed since the last cycle.
            stack.loop.restart()
            yield None
        motion = _arm_motion(arm, self)
        if motion is None:
            with suppress(NotHomedError):
                Planner(arm.workspace, arm.positions).check_width(self._width)
        elif motion is not self._arm_motion:
            raise motion.claim.refuse(self.name)
        # Before the first cycle: the disk may take longer than one.
        gripper.keep(self._width)
        arm.jaws.begin_travel(self._width)
        deadline = clock.now() + self.timeout
        stack.loop.restart()
        try:
            goal = stack.gripper.send_goal(message)
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
        finally:
            try:
                gripper.keep()
            except GripperError as error:
                # The jaws are at rest at a known width: the error matters only after a power loss,
                # so it stops nothing.
                stack.supervisor.warnings.append(str(error))
        if goal.status is not GoalStatus.SUCCEEDED or goal.result is None:
            raise GripperError(f"the gripper did not reach {self._width:g} m: {goal.text}")
        arm.jaws.end_travel()
        return goal.result

    def _come_to_rest(self, arm: Arm) -> Cycles[None]:
        supervisor = arm.stack.supervisor
        arm.stack.gripper.cancel()
        yield Cycle(Phase.STOPPING)
        while supervisor.state is FaultState.STOPPING:
            yield Cycle(Phase.STOPPING)
        if supervisor.faults:
            # A full disk does not undo a stop; acknowledging writes the evidence again.
            with suppress(OSError):
                supervisor.keep_evidence()


def _arm_motion(arm: Arm, operation: Operation[GripperResult]) -> FollowTrajectory | None:
    """Return the planned motion that the arm is making; None if it rests or is homed.

    Homing is clear at every width of the jaws.

    Raises:
        BusyError: The arm moves in another way, or plans a motion.
    """
    for other in arm.operations:
        if Device.ARM not in other.devices or other.done or isinstance(other, Home):
            continue
        if not isinstance(other, FollowTrajectory) or other.plan is None:
            raise other.claim.refuse(operation.name)
        return other
    return None
