"""The controllers that clients load into an owner."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol, TypeVar

from bioscara.api import messages as m
from bioscara.arguments import function, items, shown
from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory import Goal, JointTrajectory, Point
from bioscara.errors import InvalidArgumentError
from bioscara.planning import Sample

R = TypeVar("R", bound=m.Result)
T = TypeVar("T")

_PART = 500
"""Number of points of a trajectory in one message: of six joints these are 120 kB."""


class Commanding(Protocol):
    """Sends commands to the owner, with the lease where they need one."""

    def __call__(self, command: m.AnyCommand, kind: type[R]) -> R:
        """Send a command and return its result, which is of a kind."""


class RemoteControllers:
    """Controllers of ros2_control at an owner; ``RemoteRobot.controllers``.

    The arm's own controllers have names that begin with ``arm.``: they are listed, and cannot be
    changed. Others are loaded, configured and switched as by ros2_control. The first switch that
    activates one with command interfaces begins an operation ``controllers``, in which the arm
    obeys them and no other motion is admitted. It ends when none of them is active any more. A
    stop, a fault, and the end of the lease bring the arm to rest, end the goals ABORTED and leave
    the controllers inactive.

    All methods raise LeaseError where another program commands the arm, and OwnerLostError.

    Args:
        command: Sends commands with the lease.
        ask: Sends queries.
        subscribe: Subscribes to the samples, with the least time between two of them [s].
    """

    def __init__(
        self, command: Commanding, ask: Commanding, subscribe: Callable[[float], object]
    ) -> None:
        self._command, self._ask, self._subscribe = command, ask, subscribe
        self._receive: Callable[[m.ControllersSample], object] = lambda _: None

    def load(self, name: str, kind: str, parameters: Mapping[str, Any] | None = None) -> None:
        """Create a controller; it is unconfigured then, and nothing moves.

        Args:
            name: Its name: letters, digits and underscores.
            kind: Its type, as in ROS.
            parameters: As in its section of a parameter file of ROS.

        Raises:
            SwitchError: The name is taken or cannot be used, the type is unknown, or too many are
                loaded.
            ConfigurationError: A parameter cannot be used.
        """
        given = _mapping({} if parameters is None else parameters)
        command = m.LoadController(name=name, type=kind, parameters=given)
        self._command(command, m.Done)

    def configure(self, name: str) -> None:
        """Make a controller inactive; an inactive one is cleaned up first.

        Raises:
            SwitchError: There is none of that name, it is active, or it is the arm's own.
            ConfigurationError: Its parameters cannot be used together.
        """
        self._command(m.ConfigureController(name), m.Done)

    def cleanup(self, name: str) -> None:
        """Make an inactive controller unconfigured.

        Raises:
            SwitchError: There is none of that name, it is active, or it is the arm's own.
        """
        self._command(m.CleanupController(name), m.Done)

    def unload(self, name: str) -> None:
        """Remove a controller.

        Raises:
            SwitchError: There is none of that name, it is active, or it is the arm's own.
        """
        self._command(m.UnloadController(name), m.Done)

    def switch(
        self,
        activate: Sequence[str] = (),
        deactivate: Sequence[str] = (),
        *,
        strict: bool = True,
    ) -> str:
        """Change which controllers are active, and return the answer of ros2_control.

        Args:
            activate: Names of controllers to activate.
            deactivate: Names of controllers to deactivate, before the others are activated.
            strict: Whether one that cannot be switched refuses all.

        Raises:
            SwitchError: It was refused, or a controller could not be activated.
            ModeSwitchError: The hardware refused the command modes; nothing changed.
            BusyError: Another operation uses the arm or the gripper.
        """
        names = [
            items("the names of controllers", each, "give a list")
            for each in (activate, deactivate)
        ]
        return self._command(m.SwitchControllers(names[0], names[1], strict), m.Switched).text

    def set_hardware_state(self, component: str, state: str) -> str:
        """Bring a hardware component to a state, and return the state that it has reached.

        Args:
            component: ``bioscara_arm`` or ``bioscara_gripper_128``.
            state: ``unconfigured``, ``inactive``, ``active`` or ``finalized``. Active energises the
                motors and moves nothing.

        Raises:
            SwitchError: There is no such component.
            InvalidArgumentError: There is no such state.
            FaultedError: It cannot become active, as a fault is latched.
            BusyError: Another operation uses it.
            BioscaraError: A transition failed.
        """
        command = m.SetHardwareState(component, state)
        return self._command(command, m.HardwareState).state

    def list(self) -> m.ControllerList:
        """Return all controllers, also the arm's own, and all hardware components."""
        return self._ask(m.ListControllers(), m.ControllerList)

    def introspection(self, thresholds: Mapping[str, float] | None = None) -> m.Introspection:
        """Return the values, statistics and diagnostics of the controller manager.

        Args:
            thresholds: By which the diagnostics are rated, where they differ from the defaults;
                their names are those of ros2_control behind ``diagnostics.threshold.``, in Hz and
                us.

        Raises:
            InvalidArgumentError: There is none of a name, or a value is not above zero.
        """
        given = _mapping({} if thresholds is None else thresholds)
        return self._ask(m.GetIntrospection(given), m.Introspection)

    def follow(self, name: str, goal: Goal) -> int:
        """Send a goal to a trajectory controller, and return its number.

        A goal that runs ends ABORTED. A goal of all joints without a stamp brings the arm to rest,
        is planned from there for the limits and checked for collisions as a whole, and followed
        then, or ABORTED with the reason. Others are checked while they are followed. The goal's
        ``collision_checked`` is ignored.

        Raises:
            GoalRejectedError: The controller is not active, follows no trajectories, or cannot
                follow this one.
        """
        trajectory = _checked("the goal", goal, Goal).trajectory
        upload, rest = self._upload(trajectory)
        command = m.FollowGoal(controller=name, goal=replace(goal, trajectory=rest), upload=upload)
        return self._command(command, m.ControllerGoal).goal

    def stream(self, name: str, trajectory: JointTrajectory) -> None:
        """Replace the trajectory of a trajectory controller; errors as :meth:`follow`.

        A goal that runs is evaluated on the new trajectory.
        """
        upload, rest = self._upload(trajectory)
        self._command(m.StreamTrajectory(controller=name, trajectory=rest, upload=upload), m.Done)

    def move_gripper(self, name: str, goal: GripperGoal) -> int:
        """Send a goal to a gripper controller, and return its number.

        A goal that runs ends CANCELED.

        Raises:
            GoalRejectedError: The controller is not active, moves no gripper, the goal is outside
                the limits, or the jaws would not be clear.
        """
        command = m.SendGripperGoal(name, _checked("the goal", goal, GripperGoal))
        return self._command(command, m.ControllerGoal).goal

    def trigger(self, name: str, joint: str, command: float) -> None:
        """Home one joint by a homing controller, or stop that.

        Args:
            name: The controller.
            joint: The joint.
            command: Its sign is the direction, which is that of the joint's end stop; 0 stops.

        Raises:
            GoalRejectedError: The controller is not active, or homes no joints; a joint is homing.
            HomingError: The hand could meet the arm: another joint has to be homed first.
        """
        self._command(m.TriggerHoming(name, joint, command), m.Done)

    def command(self, name: str, values: Sequence[float]) -> None:
        """Set the command of a forward command controller.

        Args:
            name: The controller.
            values: One for each of its joints [rad, m, rad/s or m/s].

        Raises:
            GoalRejectedError: The controller is not active, or forwards no commands.
            InvalidArgumentError: There is not one value for each joint, or one is not finite.
        """
        given = items("the values", values, "give one for each joint")
        self._command(m.CommandController(name, given), m.Done)

    def cancel(self, name: str, goal: int) -> None:
        """Cancel a goal of a controller; it ends CANCELED. Does nothing if it has ended.

        Raises:
            InvalidArgumentError: The controller has had no such goal.
        """
        self._command(m.CancelControllerGoal(name, goal), m.Done)

    def set_scaling(self, name: str, factor: float) -> None:
        """Choose the share of the planned speed of a trajectory controller.

        Args:
            name: The controller.
            factor: The share; 0 pauses. The arm's own speed override applies too.

        Raises:
            GoalRejectedError: The controller is not active, or the factor is below 0.
        """
        self._command(m.SetControllerScaling(name, factor), m.Done)

    def set_parameters(self, name: str, parameters: Mapping[str, object]) -> None:
        """Change parameters of a trajectory controller that may change while it is configured.

        Args:
            name: The controller.
            parameters: By the names of ros2_controllers, each as a whole: ``gains`` are those of
                all joints, and ``constraints`` all of them.

        Raises:
            ConfigurationError: One may not change, or has a value that cannot be used.
        """
        self._command(m.SetControllerParameters(name, _mapping(parameters)), m.Done)

    def query(self, name: str, time: float) -> Sample:
        """Return the desired state of a trajectory controller at a time.

        Args:
            name: The controller.
            time: Within its trajectory [s, arm clock].

        Raises:
            GoalRejectedError: The controller is not active, or follows no trajectory.
            LimitError: The trajectory does not reach there.
        """
        return self._ask(m.QueryController(name, time), m.DesiredState).state

    def subscribe(
        self, receive: Callable[[m.ControllersSample], object], period: float = 0.0
    ) -> None:
        """Receive samples of the controllers; a slow program gets the latest, never a queue.

        Args:
            receive: Called in the thread of the connection: it must return at once, and make no
                requests. It replaces the one before.
            period: Least time between two samples [s].
        """
        function("receive", receive)
        self._receive = receive
        self._subscribe(period)

    def receive(self, sample: m.ControllersSample) -> None:
        """Take a sample; called in the thread of the connection."""
        self._receive(sample)

    def _upload(self, trajectory: object) -> tuple[int, JointTrajectory]:
        """Upload all parts except the last one of a trajectory; return the upload and that part."""
        given = _checked("the trajectory", trajectory, JointTrajectory)
        points: Sequence[Point] = items("the points", given.points)
        upload = 0
        while len(points) > _PART:
            part = m.AddGoalPoints(points=tuple(points[:_PART]), upload=upload)
            upload = self._command(part, m.PointsAdded).upload
            points = points[_PART:]
        return upload, replace(given, points=tuple(points))


def _mapping(parameters: object) -> dict[str, Any]:
    if not isinstance(parameters, Mapping):
        raise InvalidArgumentError(f"the parameters are {shown(parameters)}; give a mapping")
    return dict(parameters)


def _checked(what: str, value: object, kind: type[T]) -> T:
    if not isinstance(value, kind):
        raise InvalidArgumentError(f"{what} is {shown(value)}; give a {kind.__name__}")
    return value
