"""Assembly of the control stack between bus and robot: hardware, manager, controllers, loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from bioscara.clock import Clock
from bioscara.control.controllers.controller import WARNINGS, AnyController
from bioscara.control.controllers.gripper_action_controller import GripperActionController
from bioscara.control.controllers.hold_controller import HoldController
from bioscara.control.controllers.homing_controller import HomingController
from bioscara.control.controllers.jog_controller import JogController
from bioscara.control.controllers.joint_state_broadcaster import JointStateBroadcaster
from bioscara.control.controllers.joint_trajectory import JointTrajectoryController
from bioscara.control.faults.flight_recorder import FlightRecord
from bioscara.control.faults.following_error import allowed
from bioscara.control.faults.kinds import FaultKind
from bioscara.control.faults.supervisor import FaultState, Supervisor
from bioscara.control.limits.averaging import Smoothing
from bioscara.control.limits.collision_guard import CollisionGuard
from bioscara.control.limits.limiter import Limiter, joint_limiters
from bioscara.control.limits.tool_speed import ToolSpeedCap
from bioscara.control.loop.loop import Loop
from bioscara.control.loop.systemd import Watchdog
from bioscara.control.manager.manager import ControllerManager
from bioscara.errors import BioscaraError
from bioscara.hardware import POSITION, VELOCITY, ArmHardware, GripperHardware, LifecycleState, Mode
from bioscara.hardware.bus_budget import Capacity, highest_rate
from bioscara.model import ArmParameters, JointParameters
from bioscara.planning.motions.tool_speed import UNPLANNED_SHARE
from bioscara.robot.connection.pacing import PacedClock
from bioscara.robot.workspace.workspace import Workspace

C = TypeVar("C")

OWN = "arm."
"""Begin of the names of the arm's own controllers. A name in ROS has no dot, so that clients may
load controllers by the names that their programs expect."""
BROADCASTER, TRAJECTORY, HOMING, HOLD, GRIPPER, JOG = (
    f"{OWN}joint_state_broadcaster",
    f"{OWN}joint_trajectory_controller",
    f"{OWN}homing_controller",
    f"{OWN}hold_controller",
    f"{OWN}gripper_controller",
    f"{OWN}jog_controller",
)


class Stack:
    """The control stack of one arm, whose joints are already connected.

    Args:
        hardware: Hardware component of the joints, INACTIVE.
        gripper: Hardware component of the gripper.
        workspace: Parameters of the arm, its tool, scene and speed limit at first.
        clock: Clock of the arm.
        rate: Cycles per second [Hz]; None for the rate that suits the joints.
        evidence: Folder for the flight records of faults.

    Attributes:
        hardware: Hardware component of the joints.
        manager: Runs the controllers.
        supervisor: Stops the arm on faults.
        loop: Runs the manager.
        watchdog: Reports to systemd that the loop is alive; None if systemd does not expect it.
        broadcaster: Publishes the joint states.
        trajectory: Follows trajectories.
        homing: Homes joints.
        gripper: Moves the jaws.
        jog: Moves the joints by streamed velocities.
        tool_speed: Keeps the tool at or below a speed.
        collision_guard: Keeps the arm clear of its surroundings.
        smoothing: Averages unplanned setpoints.

    Raises:
        ConfigurationError: The rate is invalid, or the bus is too slow for it.
    """

    def __init__(
        self,
        hardware: ArmHardware,
        gripper: GripperHardware,
        workspace: Workspace,
        clock: Clock,
        rate: int | None,
        evidence: Path,
    ) -> None:
        self.hardware = hardware
        parameters = workspace.parameters
        version = min(joint.version for joint in hardware.joints)
        hardware.capacity = Capacity(hardware.joints, clock)
        tracked = [(joint, Mode.TRACK) for joint in hardware.joints]
        bus_time = hardware.capacity.cycle_time(tracked)
        usual = parameters.controllers.update_rate
        suited = usual.version_2 if version >= 2 else usual.version_1
        hertz = min(suited, highest_rate(bus_time)) if rate is None else rate
        hardware.capacity.rate = hertz
        bus_time = hardware.capacity.cycle_time(tracked, hardware.capacity.loads(tracked))
        record = FlightRecord(hardware.axes, hertz)
        warnings: deque[str] = deque(maxlen=WARNINGS)
        limited = joint_limiters((hardware, gripper))
        joints = [limited[axis.name] for axis in hardware.axes]
        arm_with_tool = workspace.kinematics
        self.tool_speed = ToolSpeedCap(joints, arm_with_tool.tool_speed, workspace.commanded_speed)
        self.smoothing = Smoothing(joints, hertz)
        self.collision_guard = CollisionGuard(
            joints, arm_with_tool, workspace.surroundings, self.smoothing, warnings
        )
        self.use_workspace(workspace)
        limiter = Limiter(limited, (self.tool_speed, self.collision_guard, self.smoothing))
        self.manager = ControllerManager((hardware, gripper), limiter, hertz, warnings)
        for name, kind, values in _controllers(parameters, version):
            self.manager.load(name, kind, values)
            self.manager.configure(name)
        self.broadcaster = self._get(BROADCASTER, JointStateBroadcaster)
        self.trajectory = self._get(TRAJECTORY, JointTrajectoryController)
        self.homing = self._get(HOMING, HomingController)
        self.gripper = self._get(GRIPPER, GripperActionController)
        self.jog = self._get(JOG, JogController)
        # Imported here: mcap takes 70 ms, which commands without an arm do not need; and not when
        # the first fault is written, as the loop would be late.
        from bioscara.robot.connection.evidence_folder import EvidenceFolder  # noqa: PLC0415

        write = EvidenceFolder(evidence).write
        self.supervisor = Supervisor(self.manager, hardware, HOLD, record, write)
        self.watchdog = Watchdog.from_environment()
        pace = clock if isinstance(clock, PacedClock) else None
        self.loop = Loop(
            self.manager, self.supervisor, record, clock, hertz, bus_time, self.watchdog, pace
        )

    @property
    def clients(self) -> tuple[AnyController, ...]:
        """The controllers that clients have loaded."""
        return tuple(each for each in self.manager.controllers if not each.name.startswith(OWN))

    def use_workspace(self, workspace: Workspace) -> None:
        """Bound every command by another tool, scene and speed limit, from the next cycle on."""
        cap, guard, windows = self.tool_speed, self.collision_guard, workspace.raw_windows
        cap.limit, cap.speed_of = workspace.commanded_speed, workspace.kinematics.tool_speed
        cap.share, cap.soon = UNPLANNED_SHARE, (sum(windows) / 2.0, sum(windows))
        self.smoothing.windows = windows
        guard.kinematics, guard.scene = workspace.kinematics, workspace.surroundings

    def use(self, name: str, time: float) -> None:
        """Make a controller the one that commands the joints, unless it is active already.

        Args:
            name: The controller.
            time: Now [s].

        Raises:
            FaultedError: A fault is latched, perhaps since the last cycle.
            SwitchError, ModeSwitchError: The switch is not possible; nothing changed.
        """
        self.supervisor.require_clear()
        if self.manager.controller(name).state is LifecycleState.ACTIVE:
            return
        leaving = [
            other.name
            for other in self.manager.controllers
            if other.state is LifecycleState.ACTIVE
            and other.command_interfaces
            and other.name != GRIPPER
        ]
        self.manager.switch(time, (name,), leaving)

    def broadcast(self, time: float) -> None:
        """Activate the broadcaster of the joint states, unless it is active.

        Args:
            time: Now [s].
        """
        if self.broadcaster.state is not LifecycleState.ACTIVE:
            self.manager.switch(time, (BROADCASTER,))

    def cycle(self) -> None:
        """Run one control cycle now."""
        self.loop.restart()
        self.loop.step()

    def latch(
        self, causes: Sequence[BioscaraError], time: float, kind: FaultKind | None = None
    ) -> None:
        """Latch errors found on an arm at rest as its faults: recovery is the same for all.

        Args:
            causes: The errors.
            time: Now [s].
            kind: Kind of the faults; by default derived from each cause.
        """
        for cause in causes:
            self.supervisor.fault(cause, self.hardware.name, time, kind)
        if causes:
            self.finish_stopping()

    def finish_stopping(self) -> None:
        """Run control cycles until a fault that is stopping the arm is latched."""
        self.loop.restart()
        while self.supervisor.state is FaultState.STOPPING:
            self.loop.step()

    def _get(self, name: str, kind: type[C]) -> C:
        controller = self.manager.controller(name)
        if not isinstance(controller, kind):
            raise TypeError(f"{name} is a {type(controller).__name__}")
        return controller


def _controllers(parameters: ArmParameters, version: int) -> list[tuple[str, str, dict[str, Any]]]:
    """Return name, type and parameters of each controller of an arm."""
    settings, jaws = parameters.controllers, parameters.gripper
    joints = tuple(joint.name for joint in parameters.joints)
    both = (POSITION, VELOCITY)
    commanded = both if version >= 2 else (POSITION,)
    spans = {joint.name: joint.upper - joint.lower for joint in parameters.joints}
    travel = settings.homing_controller.max_travel_share
    braking = settings.hold_controller.max_deceleration_share
    return [
        (BROADCASTER, JointStateBroadcaster.TYPE, {"joints": joints}),
        (
            GRIPPER,
            GripperActionController.TYPE,
            {
                "joint": "gripper",
                "limits": (jaws.lower, jaws.upper),
                "velocity_limit": jaws.max_velocity,
                **asdict(settings.gripper_controller),
            },
        ),
        (
            HOMING,
            HomingController.TYPE,
            {
                "joints": parameters.homing_order,
                "timeout": settings.homing_controller.timeout,
                "max_travel": tuple(travel * spans[name] for name in parameters.homing_order),
            },
        ),
        (JOG, JogController.TYPE, {"joints": joints, "command_interfaces": commanded}),
        (
            HOLD,
            HoldController.TYPE,
            {
                "joints": joints,
                "command_interfaces": commanded,
                "max_deceleration": tuple(
                    braking * joint.max_acceleration for joint in parameters.joints
                ),
            },
        ),
        (
            TRAJECTORY,
            JointTrajectoryController.TYPE,
            {
                "joints": joints,
                "command_interfaces": commanded,
                "state_interfaces": both,
                "fallback_controllers": (HOLD,),
                **_following(parameters, version),
            },
        ),
    ]


def _following(parameters: ArmParameters, version: int) -> dict[str, Any]:
    """Return the parameters of the trajectory controller, by its parameter names."""
    given = parameters.controllers.joint_trajectory_controller
    limits = given.constraints
    return {
        "allow_partial_joints_goal": given.allow_partial_joints_goal,
        "allow_nonzero_velocity_at_trajectory_end": given.allow_nonzero_velocity_at_trajectory_end,
        "constraints": {
            "stopped_velocity_tolerance": limits.stopped_velocity_tolerance,
            "stopped_time": 0.0,  # operations wait for rest themselves
            "goal_time": limits.goal_time,
            "decelerate_on_cancel": True,
            "least_time_on_cancel": parameters.stop_time,
            **{
                joint.name: {
                    # Lag that commands may have where the limiter bounds them.
                    "trajectory": tolerances.trajectory
                    or allowed(joint, version, joint.max_velocity) + _late(joint, parameters),
                    "goal": tolerances.goal,
                    "max_deceleration_on_cancel": limits.max_deceleration_on_cancel_share
                    * joint.max_acceleration,
                }
                for joint, tolerances in zip(parameters.joints, limits.joints, strict=True)
            },
        },
    }


def _late(joint: JointParameters, parameters: ArmParameters) -> float:
    """Return the lag of a joint that averaging of unplanned setpoints may cause [rad or m].

    The lag of joints with belts is within the allowed following error: the tool's speed bounds it.
    """
    if joint.belt_period:
        return 0.0
    return joint.max_velocity * sum(parameters.belt_periods[:2]) / 2.0
