"""Goals that clients' controllers take only under conditions of the whole arm.

Sent while :class:`RunControllers` runs; a refused one moves nothing.
"""

from __future__ import annotations

from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.gripper_messages import GripperGoal, GripperGoalHandle
from bioscara.control.controllers.homing_controller import HomingController, HomingGoal
from bioscara.errors import GoalRejectedError, LifecycleError
from bioscara.planning import Trajectory
from bioscara.robot.arm import Arm
from bioscara.robot.operations.controllers.planned_goal import moving_joint
from bioscara.robot.operations.controllers.run_controllers import RunControllers
from bioscara.robot.operations.motions.homing_order import require_homing_of
from bioscara.robot.operations.motions.move_gripper import check_along, check_standing
from bioscara.robot.runner import Runner


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
        raise LifecycleError(f"{name}: motion is paused; {arm.resumption} first")
    if (load := arm.workspace.load) is not None:
        raise LifecycleError(
            f"{name}: the tool carries {load.name}, and the path of homing is clear only for an "
            "empty gripper; detach() it"
        )
    for axis in stack.hardware.axes:
        if owner := axis.position_command.owner or axis.velocity_command.owner:
            raise GoalRejectedError(f"{name}: {owner} commands {axis.name}; deactivate it first")
    require_homing_of(stack.hardware.axes, stack.homing.parameters.joints, joint, command)
    for axis in stack.hardware.axes:
        if axis.name == joint:
            # The configured ones, not those of an earlier homing.
            axis.homing.sensitivity = axis.homing.current = None
    return controller.trigger(joint, command)


def send_gripper_goal(
    runner: Runner, run: RunControllers, controller: GripperActionController, goal: GripperGoal
) -> GripperGoalHandle:
    """Move the jaws, if the whole stroke is clear where the arm rests, or along its motion.

    Called in a thread of its own, one goal at a time.

    Args:
        runner: Runs the operations of the arm.
        run: The operation.
        controller: The controller.
        goal: The goal.

    Raises:
        GoalRejectedError: As of the controller; or the arm moves, and not on a planned course.
        LifecycleError: The jaws hold a load.
        ZoneError: The clearance of a jaw would be too small.
        GripperError: The width cannot be stored against a loss of power.
    """
    goal, arm = controller.check(goal), runner.arm
    (width,) = goal.position
    if (load := arm.workspace.load) is not None:
        raise LifecycleError(f"the jaws hold {load.name}; detach() declares that they are empty")
    name, before = f"a goal for {controller.name}", arm.workspace
    # Before the motion is checked: one that begins later is planned for the stroke.
    arm.jaws.announce(width)
    try:
        course = runner.between_cycles(name, lambda: _course(arm, run, controller))
        if course:
            check_along(arm, course, before)
        else:
            check_standing(arm, before, width)
        arm.session.gripper.keep(width)
        return runner.between_cycles(name, lambda: _send(arm, run, controller, goal))
    except BaseException:
        arm.jaws.withdraw()
        raise


def _send(
    arm: Arm, run: RunControllers, controller: GripperActionController, goal: GripperGoal
) -> GripperGoalHandle:
    """Send a checked goal, between two cycles."""
    _course(arm, run, controller)
    arm.stack.supervisor.require_clear()
    handle = controller.send_goal(goal)
    arm.jaws.begin_travel(goal.position[0])
    # Motion of the arm that begins from now on keeps clear of the whole stroke.
    arm.stack.use_workspace(arm.workspace)
    run.jaws = controller, handle
    return handle


def _course(
    arm: Arm, run: RunControllers, controller: GripperActionController
) -> tuple[Trajectory, ...]:
    """Return the planned course on which the arm moves; empty while it rests.

    Raises:
        GoalRejectedError: It moves otherwise.
    """
    name, following = moving_joint(arm), run.following
    if following is not None and not following.handle.done and following.course:
        return following.course
    if name is None:
        return ()
    raise GoalRejectedError(
        f"{controller.name}: {name} moves, and on no course that is known beforehand, so that the "
        "stroke of the jaws cannot be checked; send the goal when the arm rests"
    )
