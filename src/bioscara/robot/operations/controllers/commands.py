"""Goals that clients' controllers take only under conditions of the whole arm.

Called between two cycles while :class:`RunControllers` runs; a refused one moves nothing.
"""

from __future__ import annotations

from contextlib import suppress

from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.gripper_messages import GripperGoal, GripperGoalHandle
from bioscara.control.controllers.homing_controller import HomingController, HomingGoal
from bioscara.errors import GoalRejectedError, LifecycleError, NotHomedError
from bioscara.robot.arm import Arm
from bioscara.robot.operations.controllers.run_controllers import RunControllers
from bioscara.robot.operations.motions.homing_order import require_homing_of
from bioscara.robot.planner import Planner

_AT_REST = 1e-3
"""Share of its highest speed below which a joint counts as not moved."""


def trigger_homing(
    arm: Arm, run: RunControllers, controller: HomingController, joint: str, command: float
) -> HomingGoal | None:
    """Home one joint, or stop that, by the rules of the operation that homes all joints.

    Args:
        arm: The arm.
        run: The operation.
        controller: The controller.
        joint: The joint.
        command: Its sign is the direction; 0 stops.

    Returns:
        The goal; None for 0.

    Raises:
        GoalRejectedError: As of the controller; or another controller commands joints.
        LifecycleError: Motion is paused, or the tool carries a load.
        HomingError: The hand could meet the arm.
    """
    if not command:
        return controller.trigger(joint, command)
    controller.check_trigger(joint, command)
    name, stack = f"homing {joint}", arm.stack
    if not arm.speed_of(run):
        raise LifecycleError(f"{name}: motion is paused; resume() first")
    if (load := arm.workspace.load) is not None:
        raise LifecycleError(
            f"{name}: the tool carries {load.name}, and the path of homing is clear only for an "
            "empty gripper; detach() it"
        )
    for axis in stack.arm.axes:
        if owner := axis.position_command.owner or axis.velocity_command.owner:
            raise GoalRejectedError(f"{name}: {owner} commands {axis.name}; deactivate it first")
    require_homing_of(stack.arm.axes, stack.homing.parameters.joints, joint, command)
    for axis in stack.arm.axes:
        if axis.name == joint:
            # The configured ones, not those of an earlier homing.
            axis.homing.sensitivity = axis.homing.current = None
    return controller.trigger(joint, command)


def send_gripper_goal(
    arm: Arm, run: RunControllers, controller: GripperActionController, goal: GripperGoal
) -> GripperGoalHandle:
    """Move the jaws, if the whole stroke is clear where the arm rests.

    Args:
        arm: The arm.
        run: The operation.
        controller: The controller.
        goal: The goal.

    Raises:
        GoalRejectedError: As of the controller; or the arm moves.
        LifecycleError: The jaws hold a load.
        ZoneError: The clearance of a jaw would be too small.
        GripperError: The width cannot be stored against a loss of power.
    """
    goal, stack = controller.check(goal), arm.stack
    (width,) = goal.position
    if (load := arm.workspace.load) is not None:
        raise LifecycleError(f"the jaws hold {load.name}; detach() declares that they are empty")
    for joint in stack.manager.limiter.joints.values():
        if joint.commanded and abs(joint.speed) > _AT_REST * joint.max_velocity:
            raise GoalRejectedError(
                f"{controller.name}: {joint.name} moves, and the stroke of the jaws is checked "
                "where the arm rests; send the goal when it does"
            )
    with suppress(NotHomedError):
        Planner(arm.workspace, arm.positions).check_width(width)
    # The disk may take longer than a cycle, which harms nothing while the arm is at rest.
    arm.session.gripper.keep(width)
    arm.jaws.begin_travel(width)
    # Motion of the arm that begins from now on keeps clear of the whole stroke.
    stack.use_workspace(arm.workspace)
    stack.loop.restart()
    handle = controller.send_goal(goal)
    run.jaws = controller, handle
    return handle
