"""Motion by the controllers that clients have loaded."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from concurrent.futures import Future

from bioscara.control.controllers.controller import AnyController
from bioscara.control.controllers.forward_command_controller import ForwardCommandController
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.gripper_messages import GripperGoalHandle
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.manager.switch_request import Strictness, Switch, plan
from bioscara.errors import BioscaraError, ModeSwitchError, MotionCancelledError
from bioscara.hardware import HOME, LifecycleState
from bioscara.report import Phase
from bioscara.robot.arm import Arm
from bioscara.robot.connection.stack import HOLD, OWN, Stack
from bioscara.robot.operations.arbiter import EVERYTHING
from bioscara.robot.operations.controllers.planned_goal import PlannedGoal
from bioscara.robot.operations.execution import MotionExecution
from bioscara.robot.operations.motions.move_gripper import store_width
from bioscara.robot.operations.operation import Cycles, Operation

NAME = "controllers"
"""Name of the operation in messages."""


class RunControllers(Operation[None]):
    """Runs while a client's controller with command interfaces is active, from the first switch on.

    Further switches, goals and commands are work between two cycles. When it is stopped, or a fault
    stops the arm, the goals of the controllers end ABORTED, the arm comes to rest, and the
    controllers are inactive, but loaded.

    Args:
        activate: Names of controllers to activate in its first switch.
        deactivate: Names of controllers to deactivate in it.
        strictness: Handling of those that cannot be switched.

    Attributes:
        switched: The first switch, once it was carried out; its error if it was refused.
        jaws: The controller that moves the jaws, and its goal, until they rest; else None.
        following: The last goal of a trajectory controller that was planned; None before.
    """

    devices = EVERYTHING
    pausable = _needs_confirmed_scene = True

    def __init__(
        self, activate: Sequence[str], deactivate: Sequence[str], strictness: Strictness
    ) -> None:
        super().__init__(NAME)
        self._first = activate, deactivate, strictness
        self._scalings: dict[str, float] = {}
        self.switched: Future[Switch] = Future()
        self.jaws: tuple[GripperActionController, GripperGoalHandle] | None = None
        self.following: PlannedGoal | None = None
        self.when_done(self._end_switch)

    def cycles(self, arm: Arm) -> Cycles[None]:
        """Switch, and run cycles until no controller of a client commands the arm any more."""
        stack, clock = arm.stack, arm.session.clock
        arm.pace(homing=False)
        execution = MotionExecution(arm, self)
        self.claim.require_not_stopped()
        stack.supervisor.require_clear()
        stack.use_workspace(arm.workspace)
        # The interfaces have the states of this cycle.
        yield None
        self.claim.require_not_stopped()
        try:
            self.switched.set_result(switch(stack, clock.now(), *self._first))
        except BioscaraError as error:
            self.switched.set_exception(error)
            # Those that could be activated stay so, unless the switch is strict.
            if not commanding(stack):
                raise

        def abort(error: BaseException) -> None:
            cancelled = isinstance(error, MotionCancelledError)
            reason = "by a stop, a cancel or the end of the lease" if cancelled else str(error)
            for controller in commanding(stack):
                controller.abort_goal(f"The controllers were stopped: {reason}")

        def done() -> bool:
            active = commanding(stack)
            self._apply_speed(arm, active)
            self._end_travel(arm)
            return not active

        try:
            yield from execution.run(done, Phase.CONTROLLERS, interrupted=abort)
        except GeneratorExit:
            raise
        except BaseException:
            leaving = [controller.name for controller in commanding(stack)]
            stack.manager.switch(clock.now(), (), leaving)
            self._end_travel(arm)
            raise
        since = clock.now()
        yield from execution.run(
            lambda: stack.supervisor.stopper.at_rest(clock.now(), since), Phase.CONTROLLERS
        )

    def switch(
        self, arm: Arm, activate: Sequence[str], deactivate: Sequence[str], strictness: Strictness
    ) -> Switch:
        """Switch further controllers; arguments and errors as of :func:`switch`."""
        switched = switch(arm.stack, arm.session.clock.now(), activate, deactivate, strictness)
        for controller in switched.deactivate:
            # Also of one that was activated again at once.
            self._scalings.pop(controller.name, None)
        return switched

    def set_scaling(self, controller: JointTrajectoryController, factor: float) -> None:
        """Choose the share of the planned speed of a controller, until it is deactivated.

        Raises:
            GoalRejectedError: It is negative or not finite, or the controller is not active.
        """
        controller.set_scaling(factor)
        self._scalings[controller.name] = factor

    def _apply_speed(self, arm: Arm, active: Sequence[AnyController]) -> None:
        share, names = arm.speed_of(self), {controller.name for controller in active}
        for name in self._scalings.keys() - names:
            del self._scalings[name]
        for controller in active:
            if isinstance(controller, JointTrajectoryController):
                initial = controller.parameters.speed_scaling.initial_scaling_factor
                controller.set_scaling(share * self._scalings.get(controller.name, initial))
            elif isinstance(controller, ForwardCommandController):
                controller.share = share

    def _end_travel(self, arm: Arm) -> None:
        """Store the width at which the jaws rest, once they do."""
        if self.jaws is None or not self.jaws[1].done:
            return
        controller, goal = self.jaws
        if goal.status is GoalStatus.SUCCEEDED and controller.state is LifecycleState.ACTIVE:
            # The tolerance of a client may be wider than that of the arm.
            tolerance = arm.stack.gripper.parameters.goal_tolerance
            if abs(controller.position - goal.goal.position[0]) > tolerance:
                return
            arm.jaws.end_travel()
            arm.stack.use_workspace(arm.workspace)
        self.jaws = None
        # The cycles do not wait for the disk.
        threading.Thread(target=store_width, args=(arm,), name="gripper-width").start()

    def _end_switch(self) -> None:
        if not self.switched.done():
            error = self.error or MotionCancelledError(f"{self.name} ended before their switch")
            self.switched.set_exception(error)


def commanding(stack: Stack) -> list[AnyController]:
    """Return the active controllers of clients that have command interfaces."""
    return [
        controller
        for controller in stack.clients
        if controller.state is LifecycleState.ACTIVE and controller.command_handles
    ]


def switch(
    stack: Stack,
    time: float,
    activate: Sequence[str],
    deactivate: Sequence[str],
    strictness: Strictness,
) -> Switch:
    """Switch controllers of clients; the arm's own release the joints that these claim.

    Joints that a controller moves until it is deactivated come to rest together, if no other one
    takes any of them.

    Args:
        stack: The control stack.
        time: Now [s].
        activate: Names of controllers to activate.
        deactivate: Names of controllers to deactivate.
        strictness: Handling of those that cannot be switched.

    Returns:
        The controllers of clients that were switched.

    Raises:
        SwitchError, ModeSwitchError: As of ``ControllerManager.switch``.
    """
    manager = stack.manager
    known = {controller.name: controller for controller in manager.controllers}
    resolved = plan(known, activate, deactivate, strictness)
    entering, leaving = ([each.name for each in group] for group in resolved[:2])
    wanted = _joints(resolved.activate)
    releasing = [
        controller.name
        for controller in manager.controllers
        if controller.name.startswith(OWN)
        and controller.state is LifecycleState.ACTIVE
        and wanted & _joints((controller,))
    ]
    staying = [each for each in commanding(stack) if each not in resolved.deactivate]
    own = {axis.name for axis in stack.hardware.axes}
    if _moves(stack, resolved.deactivate) and not own & (wanted | _joints(staying)):
        try:
            manager.switch(time, (*entering, HOLD), (*leaving, *releasing), strictness)
        except ModeSwitchError:
            # A joint that cannot be held, as it is not homed: each comes to rest on its own.
            pass
        else:
            return resolved
    manager.switch(time, entering, (*leaving, *releasing), strictness)
    return resolved


def _joints(controllers: Sequence[AnyController]) -> set[str]:
    """Return the joints that controllers command."""
    return {name.split("/")[0] for each in controllers for name in each.command_interfaces}


def _moves(stack: Stack, controllers: Sequence[AnyController]) -> bool:
    """Return whether joints of the arm are moved by controllers."""
    guards = stack.manager.limiter.joints
    return any(
        guards[axis.name].speed
        for controller in controllers
        for axis in stack.hardware.axes
        if axis.name in _joints((controller,))
        and not any(each.endswith(f"/{HOME}") for each in controller.command_interfaces)
    )
