"""Everything between the bus and the robot, wired: hardware, manager, controllers, loop."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from bioscara.clock import Clock, MonotonicClock
from bioscara.control.flight_record import FlightRecord
from bioscara.control.following import allowed
from bioscara.control.gripper_action_controller import GripperActionController
from bioscara.control.hold_controller import HoldController
from bioscara.control.homing_controller import HomingController
from bioscara.control.jog_controller import JogController
from bioscara.control.joint_state_broadcaster import JointStateBroadcaster
from bioscara.control.joint_trajectory import JointTrajectoryController
from bioscara.control.limiting import Limiter
from bioscara.control.loop import Loop
from bioscara.control.manager import ControllerManager
from bioscara.control.realtime import sharpen_timers
from bioscara.control.schedule import require_rate
from bioscara.control.supervisor import Supervisor
from bioscara.control.tool_speed import ToolSpeedCap
from bioscara.control.watchdog import Watchdog
from bioscara.hardware import POSITION, VELOCITY, ArmHardware, GripperHardware, Mode, State
from bioscara.hardware.capacity import Capacity, highest_rate
from bioscara.kinematics import Scara
from bioscara.model import ArmParameters
from bioscara.planning.tool_speed import REDUCED_SPEED

C = TypeVar("C")

RATES = {1: 50, 2: 100}
"""Cycles per second, by protocol [Hz]: as the original driver, and as fits the bus at 100 kHz."""

_HOMING_SHARE = 1.15
"""Travel in homing, as a share of the joint's range, after which there is no end stop; a little
more than the joint itself allows (1.1), whose word says more."""

_ARRIVED = {"rad": 0.01, "m": 5e-4}
"""How near to its goal a joint has arrived, by its unit: on the simulated arm each was within
0.8 mrad or 0.1 mm after 0.3 s, and the wrist is off by 9 mrad where it slipped a step."""
_ARRIVAL_TIME = 2.0
"""How much later than planned all joints have to be there [s]. With version 1 they came 0.14 s
later; one that passes its goal in motion needs 1.2 s to come back, the column at its limits."""

BROADCASTER, TRAJECTORY, HOMING, HOLD, GRIPPER, JOG = (
    "joint_state_broadcaster",
    "joint_trajectory_controller",
    "homing_controller",
    "hold_controller",
    "gripper_controller",
    "jog_controller",
)


class Stack:
    """The control stack of one arm, whose joints have been greeted.

    Args:
        arm: The joints, INACTIVE.
        gripper: The gripper.
        kinematics: Of the arm with its tool, for the speed of the tool.
        clock: Their time.
        parameters: The arm as data.
        rate: Cycles per second [Hz]; None for what suits the joints.
        evidence: Folder for the flight records of faults.

    Attributes:
        arm: As given.
        manager: Runs the controllers.
        supervisor: Stops the arm on faults.
        loop: Runs the manager.
        watchdog: Tells systemd that the loop lives; None where it expects nothing.
        broadcaster: Tells the joints' states.
        trajectory: Follows trajectories.
        homing: Homes joints.
        gripper: Moves the jaws.
        jog: Moves the joints by streamed velocities.
        tool_speed: Keeps the tool at or below a speed.

    Raises:
        ConfigurationError: The rate makes no sense, or the bus cannot carry it.
    """

    def __init__(
        self,
        arm: ArmHardware,
        gripper: GripperHardware,
        kinematics: Scara,
        clock: Clock,
        parameters: ArmParameters,
        rate: int | None,
        evidence: Path,
    ) -> None:
        if rate is not None:
            require_rate(rate)
        self.arm = arm
        if isinstance(clock, MonotonicClock):
            sharpen_timers()
        version = min(joint.version for joint in arm.joints)
        arm.capacity = Capacity(arm.joints, clock)
        bus_time = arm.capacity.cycle_time((joint, Mode.TRACK) for joint in arm.joints)
        hertz = min(RATES[version], highest_rate(bus_time)) if rate is None else rate
        arm.capacity.rate = hertz
        record = FlightRecord(arm.axes, hertz)
        limiter = Limiter((arm, gripper))
        self.tool_speed = ToolSpeedCap(
            tuple(limiter.guards.values()), kinematics.tool_speed, REDUCED_SPEED
        )
        limiter.before, limiter.together = self.tool_speed.foresee, self.tool_speed.apply
        self.manager = ControllerManager((arm, gripper), limiter, hertz)
        for name, kind, values in _controllers(parameters, version):
            self.manager.load(name, kind, values)
            self.manager.configure(name)
        self.broadcaster = self._get(BROADCASTER, JointStateBroadcaster)
        self.trajectory = self._get(TRAJECTORY, JointTrajectoryController)
        self.homing = self._get(HOMING, HomingController)
        self.gripper = self._get(GRIPPER, GripperActionController)
        self.jog = self._get(JOG, JogController)
        self.supervisor = Supervisor(self.manager, arm, HOLD, record, evidence)
        self.watchdog = Watchdog.from_environment()
        self.loop = Loop(
            self.manager, self.supervisor, record, clock, hertz, bus_time, self.watchdog
        )

    def use(self, name: str, time: float) -> None:
        """Make one controller the one that commands the joints, if it is not so already.

        Args:
            name: The controller.
            time: Now [s].

        Raises:
            SwitchError, ModeSwitchError: It cannot be; nothing changed.
        """
        if self.manager.controller(name).state is State.ACTIVE:
            return
        leaving = [
            other.name
            for other in self.manager.controllers
            if other.state is State.ACTIVE and other.command_interfaces and other.name != GRIPPER
        ]
        self.manager.switch(time, (name,), leaving)

    def broadcast(self, time: float) -> None:
        """Let the joint states be told, if they are not.

        Args:
            time: Now [s].
        """
        if self.broadcaster.state is not State.ACTIVE:
            self.manager.switch(time, (BROADCASTER,))

    def _get(self, name: str, kind: type[C]) -> C:
        controller = self.manager.controller(name)
        if not isinstance(controller, kind):
            raise TypeError(f"{name} is a {type(controller).__name__}")
        return controller


def _controllers(parameters: ArmParameters, version: int) -> list[tuple[str, str, dict[str, Any]]]:
    """Return name, type and parameters of the controllers of an arm."""
    joints = tuple(joint.name for joint in parameters.joints)
    both = (POSITION, VELOCITY)
    commanded = both if version >= 2 else (POSITION,)
    spans = {joint.name: joint.upper - joint.lower for joint in parameters.joints}
    braking = tuple(joint.max_acceleration for joint in parameters.joints)
    return [
        (BROADCASTER, JointStateBroadcaster.TYPE, {"joints": joints}),
        (
            GRIPPER,
            GripperActionController.TYPE,
            {"joint": "gripper", "limits": (parameters.gripper.lower, parameters.gripper.upper)},
        ),
        (
            HOMING,
            HomingController.TYPE,
            {
                "joints": parameters.homing_order,
                "max_travel": tuple(
                    _HOMING_SHARE * spans[name] for name in parameters.homing_order
                ),
            },
        ),
        (JOG, JogController.TYPE, {"joints": joints, "command_interfaces": commanded}),
        (
            HOLD,
            HoldController.TYPE,
            {
                "joints": joints,
                "command_interfaces": commanded,
                "max_deceleration": braking,
            },
        ),
        (
            TRAJECTORY,
            JointTrajectoryController.TYPE,
            {
                "joints": joints,
                "command_interfaces": commanded,
                "state_interfaces": both,
                "allow_partial_joints_goal": True,
                "allow_nonzero_velocity_at_trajectory_end": True,
                "fallback_controllers": (HOLD,),
                "constraints": {
                    "stopped_velocity_tolerance": 0.0,
                    "decelerate_on_cancel": True,
                    "goal_time": _ARRIVAL_TIME,
                    **{
                        joint.name: {
                            # What commands may fall behind, where they are bounded on their way.
                            "trajectory": allowed(joint, version, joint.max_velocity),
                            "goal": _ARRIVED[joint.unit],
                            "max_deceleration_on_cancel": joint.max_acceleration,
                        }
                        for joint in parameters.joints
                    },
                },
            },
        ),
    ]
