"""A whole arm as one object: the public interface of the package."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Callable, Collection, Sequence
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import Self

from bioscara.arguments import flag, number, shown
from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.control.faults.kinds import ArmFault
from bioscara.drivers import Gripper, Joint
from bioscara.errors import InvalidArgumentError, MotionCancelledError
from bioscara.hardware import LifecycleState
from bioscara.kinematics import Pose, Scara
from bioscara.kinematics.pose import wrapped
from bioscara.model import ArmParameters, load_parameters, own_parameters
from bioscara.planning import Trajectory
from bioscara.planning.collision.scene import Scene
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot.arm import Arm
from bioscara.robot.connection import exit_guard
from bioscara.robot.connection.arm_session import FAULTS, ArmSession
from bioscara.robot.connection.devices import devices_on, real_gripper, simulated_devices
from bioscara.robot.operations.change_workspace import ChangeWorkspace
from bioscara.robot.operations.fault_handling import Acknowledge, Recover
from bioscara.robot.operations.motions.follow_trajectory import FollowTrajectory, MakePlan, checked
from bioscara.robot.operations.motions.grasp import Attach
from bioscara.robot.operations.motions.home import Home, PerJoint
from bioscara.robot.operations.motions.jog import Jog, Velocity
from bioscara.robot.operations.operation import OnCycle, Operation
from bioscara.robot.operations.power import Disable, Enable
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.robot_gripper import RobotGripper
from bioscara.robot.simulated_faults import simulate_fault
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.poses import TeachTable
from bioscara.robot.workspace.tools import Tool
from bioscara.robot.workspace.workspace import Workspace
from bioscara.spelling import unknown_attribute

_OWN = frozenset({"bus", "clock", "parameters", "description", "gripper"})
"""Attributes of a robot that are neither methods nor properties."""


class Robot:
    """A Bioscara arm.

    :meth:`open` opens the bus and connects to the joints, and nothing moves; :meth:`close` always
    stops and disables all joints. A ``with`` statement does both; joints that could not be disabled
    are then reported by a HardwareError, or by notes on the exception that is being raised.
    SIGTERM, SIGHUP and the end of the program release the joints too, unless the program handles
    these signals itself.

    Every motion takes the same keyword arguments:

    - ``velocity_scaling``, ``acceleration_scaling``: shares of the limits to plan with, 0.001 to 1.
    - ``timeout``: longest duration [s]; the arm is then brought to rest, and MotionTimeoutError is
      raised.
    - ``on_cycle``: receives a record of all joints at the end of each cycle; must return at once.
    - ``wait``: True returns at the end of the motion. False returns at its begin, and a thread of
      the robot carries it out.

    and returns its operation: ``status``, ``progress``, ``pause()``, ``resume()``, ``cancel()`` and
    ``result()``; ``await`` waits for its end. The gripper may move while the arm moves. All other
    calls that use the arm then raise BusyError, also in the callbacks of the motion; but any
    thread may read ``state``, ``pose`` and ``faults``, change ``speed_override``, and call
    :meth:`pause`, :meth:`resume`, :meth:`stop` and :meth:`close`.

    The motions to poses plan first, check limits and zones, and only then move; ``warnings`` have
    the notes on the plan for the user. ``plan`` plans the same motions without moving:
    ``robot.plan.move_linear(pose)``. Poses are of the tool in the base.

    Created by :meth:`simulated` or :meth:`connect`.

    Args:
        bus: The bus of the joints; closed on leaving.
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        description: Which arm on which bus, in words.
        gripper: The driver of the gripper; None for the computer's own PWM output.
        servo: The simulated servo of that driver; referenced for the lifetime of the robot.
        rate: Control cycles per second [Hz]; None for the rate that suits the joints.
        evidence: Folder for the flight records of faults.
        reduced_speed: Whether the tool keeps to 250 mm/s, even if more is commanded.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.

    Attributes:
        bus: The bus of the joints.
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        description: Which arm on which bus, in words.
        gripper: The gripper.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        parameters: ArmParameters,
        description: str,
        *,
        gripper: Gripper | None = None,
        servo: object = None,
        rate: int | None = None,
        evidence: Path | str = FAULTS,
        reduced_speed: bool = True,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> None:
        parameters = _require_parameters(parameters)
        self.bus, self.clock = bus, clock
        self.parameters, self.description = parameters, description
        driver = gripper or real_gripper(parameters, clock)
        self._servo = servo
        session = ArmSession(bus, clock, parameters, driver, rate=rate, evidence=evidence)
        workspace = Workspace.of(parameters, reduced_speed=reduced_speed)
        self._arm = Arm(session, workspace, pace_homing=pace_homing, pace_motion=pace_motion)
        self.gripper = RobotGripper(self._arm)

    def __setattr__(self, name: str, value: object) -> None:
        # A misspelt name, such as robot.secne, would otherwise be accepted without an effect.
        known = [key for key in dir(type(self)) if not key.startswith("_")]
        if not (name in known or name in _OWN or name.startswith("_")):
            raise unknown_attribute(self, name)
        object.__setattr__(self, name, value)

    @classmethod
    def simulated(
        cls,
        parameters: ArmParameters | None = None,
        *,
        v1: bool | Collection[str] = False,
        seed: int = 0,
        homed: bool = False,
        controllers_fed: bool = False,
        rate: int | None = None,
        evidence: Path | str = FAULTS,
        reduced_speed: bool = True,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> Self:
        """Return an arm that is simulated in this process: firmware, physics and clock.

        Args:
            parameters: Parameters of the arm; the committed ones by default.
            v1: Whether its joints have their original firmware, as on existing arms; or the names
                of the joints that have it.
            seed: Seed of all random values in the simulation.
            homed: Whether an earlier program homed and released the joints, which stand where
                homing ends; they were just switched on otherwise.
            controllers_fed: Whether the joints' controllers get 5 V from elsewhere and stay on
                without the supply of the arm, as on no existing arm.
            rate: Control cycles per second [Hz]; None for the rate that suits the joints.
            evidence: Folder for the flight records of faults.
            reduced_speed: Whether the tool keeps to 250 mm/s.
            pace_homing: Whether homing takes as long as on the arm.
            pace_motion: Whether motion takes as long as on the arm.
        """
        parameters = load_parameters() if parameters is None else _require_parameters(parameters)
        devices = simulated_devices(
            parameters, v1=v1, seed=seed, homed=homed, controllers_fed=controllers_fed
        )
        return cls(
            **devices._asdict(),
            parameters=parameters,
            rate=rate,
            evidence=evidence,
            reduced_speed=reduced_speed,
            pace_homing=pace_homing,
            pace_motion=pace_motion,
        )

    @classmethod
    def connect(
        cls,
        name: str,
        parameters: ArmParameters | None = None,
        *,
        rate: int | None = None,
        evidence: Path | str = FAULTS,
        reduced_speed: bool = True,
        timeout: float = 0.0,
    ) -> Self:
        """Return the arm on the bus of this name, or the one that another process owns.

        Args:
            name: ``linux:1``, ``linux:/dev/i2c-1``, ``sim`` for :meth:`simulated`, or
                ``sim:/path.sock`` for an arm that ``bioscara simulate`` runs; or ``arm:NAME`` for
                one that ``bioscara serve`` owns, whose owner decides all the following. That is a
                ``bioscara.RemoteRobot``, with the interface of this class.
            parameters: Parameters of the arm; by default the committed ones, with the overlay that
                the environment variable ``BIOSCARA_PARAMETERS`` names, if any.
            rate: Control cycles per second [Hz]; None for the rate that suits the joints.
            evidence: Folder for the flight records of faults.
            reduced_speed: Whether the tool keeps to 250 mm/s.
            timeout: Longest time for which :meth:`open` waits until the owner of ``arm:NAME`` runs
                [s].

        Raises:
            InvalidArgumentError: There is no bus of that name, or an argument is the owner's.
            ConfigurationError: The overlay cannot be used.
        """
        if isinstance(name, str) and name.startswith("arm:"):
            if (parameters, rate, evidence, reduced_speed) != (None, None, FAULTS, True):
                raise InvalidArgumentError(
                    f"{name}: its owner has the parameters, the rate, the folder of evidence and "
                    "the speed limit; leave them out, and set robot.reduced_speed when connected"
                )
            # By name: clients are above robots, and most programs have none.
            remote_robot = import_module("bioscara.remote").RemoteRobot
            remote: Self = remote_robot(name.removeprefix("arm:"), timeout=timeout)
            return remote
        if number("timeout", timeout, infinite=True) != 0.0:
            raise InvalidArgumentError(
                f"timeout {timeout!r} is for an owner, arm:NAME; a bus is there or is not"
            )
        parameters = own_parameters() if parameters is None else _require_parameters(parameters)
        devices = devices_on(name, parameters)
        return cls(
            **devices._asdict(),
            parameters=parameters,
            rate=rate,
            evidence=evidence,
            reduced_speed=reduced_speed,
        )

    def open(self) -> Self:
        """Open the bus and connect to the joints; nothing moves. Return the robot.

        Raises:
            LifecycleError: It is open already, or was closed.
            BioscaraError: A joint cannot be used; the bus is closed again.
        """
        exit_guard.guard(self, self.stop)
        try:
            self._arm.connect()
        except MotionCancelledError:
            # Stopped once connected.
            self.close()
            raise
        except BaseException:
            exit_guard.forget(self)
            raise
        return self

    def close(self) -> None:
        """Stop all motion, disable all joints and close the bus; may be called again.

        Raises:
            HardwareError: A joint could not be stopped or disabled.
            BusyError: Called from a callback of a motion.
        """
        self._close(None)

    def _close(self, error: BaseException | None) -> None:
        try:
            with exit_guard.postponed():
                self._arm.close(error)
        finally:
            if not self._arm.session.connected:
                exit_guard.forget(self)

    def __enter__(self) -> Self:
        return self if self._arm.session.connected else self.open()

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._close(exc)

    def shutdown(self) -> list[str]:
        """Stop and disable all joints; does nothing if that is done already.

        A motion, with the callback it may be in, is first stopped and awaited.

        Returns:
            A sentence for each joint that could not be stopped or disabled.

        Raises:
            BusyError: Called from a callback of the motion that it would have to wait for.
        """
        return self._arm.shutdown()

    @property
    def arm(self) -> Arm:
        """The arm that runs the operations of this robot, for programs that have their own ones."""
        return self._arm

    def watch(self, *, priority: int | None = None, speed: float = 1.0) -> None:
        """Run the control loop in a thread of its own from now on, also while nothing moves.

        Faults of a standing arm are then noticed, and systemd is notified. The simulated arm then
        moves in real time.

        Args:
            priority: Real-time priority of the thread, 1 to 99; None for none.
            speed: Factor by which an arm simulated in this process is faster than real time.

        Raises:
            NotInitializedError: The robot is not connected.
            InvalidArgumentError: The speed or the priority is not possible.
            RealtimeError: The system does not permit the priority.
        """
        self._arm.watch(priority=priority, speed=speed)

    def stop(self) -> None:
        """Stop all motion on its path and end a pause, from any thread; returns at once.

        Each call that was moving raises MotionCancelledError once the arm is at rest. If nothing
        moves, nothing happens: a later motion is not affected.
        """
        self._arm.stop()

    def pause(self) -> None:
        """Bring all motion to rest on its path, as fast as :meth:`stop`, until :meth:`resume`.

        A motion begun during a pause waits for it; ``warnings`` say so. Homing that has begun
        and the jaws are not paused: :meth:`stop` ends them.
        """
        self._arm.pause()

    def resume(self) -> None:
        """Lift the pause of this program; motion continues unless its clients have paused, too."""
        self._arm.resume()

    def simulate_fault(self, fault: str, joint: str = "", value: float | None = None) -> None:
        """Let an arm fail that is simulated in this process, also while it moves.

        From any thread, and in callbacks. The next cycles meet the fault: a motion then raises.

        Args:
            fault: Name of the fault; docs/simulation.md has the names. ``clear`` ends all.
            joint: The joint; empty for faults of the whole arm.
            value: Whether it is on, 1 or 0; the position of an obstacle [rad or m]; the torque
                [N m] or, on ``j2``, the force [N] of a push; docs/simulation.md has the others.
                None for the one that begins it, where it is a switch.

        Raises:
            NotSupportedError: The arm is real, or simulated by another process.
            InvalidArgumentError: There is no such fault or joint, or the value is not possible.
        """
        simulate_fault(self._arm, fault, joint, value)

    @property
    def paused_by(self) -> tuple[str, ...]:
        """Names of the programs that paused all motion: of this one, and of clients if it serves.

        Motion continues when none is left.
        """
        return tuple(self._arm.pauses.values())

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The drivers of the joints."""
        return self._arm.session.arm.joints

    @property
    def firmware(self) -> tuple[str, ...]:
        """Protocol and firmware versions of each joint, in words."""
        return tuple(joint.firmware for joint in self.joints)

    @property
    def flags(self) -> tuple[int, ...]:
        """Flags that each joint reported last, see :class:`bioscara.protocol.Flags`."""
        return tuple(int(joint.session.flags) for joint in self.joints)

    @property
    def state(self) -> JointStates:
        """Joint states: of the last cycle while the arm moves or is watched, else read now.

        Raises:
            BusyError: A motion begins and has not read the joints yet.
            FaultedError: The joints were released because of a fault, and are not recovered.
            BioscaraError: They were released without a fault: ``enable()`` them.
        """
        return self._arm.states()

    async def states(self, period: float = 0.1) -> AsyncIterator[JointStates]:
        """Iterate over the joint states without blocking the event loop, until the robot is closed.

        Args:
            period: Time between two of them [s].

        Raises:
            InvalidArgumentError: The period is not above zero.
            BioscaraError: As ``state``.
        """
        if not (period := number("period", period)) > 0.0:
            raise InvalidArgumentError(f"period {period:g} s must be above zero")
        while self._arm.session.connected:
            yield await asyncio.to_thread(self._arm.states)
            await asyncio.sleep(period)

    @property
    def pose(self) -> Pose:
        """Pose of the tool in the base, yaw above -pi and up to pi; as old as ``state``.

        Raises:
            NotHomedError: The position of a joint is unknown.
            BusyError: As ``state``.
        """
        positions = self._arm.positions("the pose of the tool is unknown")
        pose = self.kinematics.forward(positions)
        return pose._replace(yaw=wrapped(pose.yaw))

    @property
    def is_homed(self) -> bool:
        """Whether all joints are homed; errors as ``state``."""
        return not any(map(math.isnan, self.state.positions))

    @property
    def is_enabled(self) -> bool:
        """Whether the motors of the joints are energised by this robot."""
        session = self._arm.session
        return session.connected and session.arm.state is LifecycleState.ACTIVE

    @property
    def is_moving(self) -> bool:
        """Whether an operation uses the arm or the gripper."""
        return bool(self._arm.arbiter.running)

    @property
    def jog_limitation(self) -> JogLimitation | None:
        """Why the running jog does not fully follow its velocity; None if it does or none runs."""
        return self._arm.limitation

    @property
    def kinematics(self) -> Scara:
        """Kinematics of the arm with its tool."""
        return self._arm.workspace.kinematics

    @property
    def period(self) -> float:
        """Time between two setpoints [s]."""
        return self._arm.stack.loop.period

    @property
    def bus_share(self) -> float:
        """Share of each control cycle that the exchanges take on the bus, 0 to 1.

        Above 0.8 a late computer has little time to make up for; a lower ``rate`` leaves more.
        """
        return self._arm.stack.loop.bus_share

    @property
    def plan(self) -> Planner:
        """Plans motions in the present workspace from where the arm is, without moving it."""
        return Planner(self._arm.workspace, self._arm.positions)

    @property
    def speed_override(self) -> float:
        """Share of the planned or jog speed, 0 to 1; any thread may change it.

        0 pauses: the arm comes to rest on its path as soon as after a stop, and a share above 0
        continues the motion.
        """
        return self._arm.speed_override

    @speed_override.setter
    def speed_override(self, share: float) -> None:
        self._arm.speed_override = share

    @property
    def reduced_speed(self) -> bool:
        """Whether the tool keeps to 250 mm/s; cannot be changed while the arm moves."""
        return self._arm.workspace.reduced_speed

    @reduced_speed.setter
    def reduced_speed(self, reduced_speed: bool) -> None:
        flag("reduced_speed", reduced_speed)
        self._change("reduced_speed", lambda space: space.with_reduced_speed(reduced_speed))

    @property
    def scene(self) -> Scene:
        """Surroundings to keep clear of; cannot be changed while the arm moves."""
        return self._arm.workspace.scene

    @scene.setter
    def scene(self, scene: Scene) -> None:
        self._change("scene", lambda space: space.with_scene(scene))

    @property
    def table(self) -> TeachTable:
        """The tools, poses and frames that have names; cannot be changed while the arm moves."""
        return self._arm.workspace.table

    @table.setter
    def table(self, table: TeachTable) -> None:
        self._change("table", lambda space: space.with_table(table))

    @property
    def tool(self) -> Tool:
        """The mounted tool; set to another one of ``table``, or its name, once that is mounted."""
        return self._arm.workspace.tool

    @tool.setter
    def tool(self, tool: str | Tool) -> None:
        self._change("tool", lambda space: space.with_tool(tool))

    @property
    def frames(self) -> tuple[Frame, ...]:
        """The work frames of ``table``."""
        return self.table.frames

    def frame(self, name: str) -> Frame:
        """Return the work frame of this name; its methods return poses in the base.

        Raises:
            InvalidArgumentError: There is none; the message proposes the nearest name.
        """
        return self.table.frame(name)

    @property
    def load(self) -> Load | None:
        """The carried load, or None."""
        return self._arm.workspace.load

    def attach(self, load: Load) -> None:
        """Declare that the tool carries a load; nothing moves.

        From then on motions, jogs and raw commands keep it clear of the scene and of the arm, and
        its fastest point at or below 250 mm/s, and the tool cannot be changed.

        Args:
            load: The load.

        Raises:
            InvalidArgumentError: It is no load, or may touch a zone that is not in the scene.
            LifecycleError: A load is attached already.
            ZoneError: It is too near to a body that it may not touch. The position of an arm that
                is not homed is unknown: then this is not checked.
            BusyError: The arm or the jaws move.
        """
        self._arm.execute(Attach(load))

    def detach(self) -> None:
        """Declare that the tool carries nothing; nothing moves.

        Raises:
            LifecycleError: No load is attached.
            BusyError: The arm or the jaws move.
        """
        self._arm.execute(ChangeWorkspace("detach()", Workspace.without_load))

    def confirm_scene(self) -> None:
        """Declare that scene, tool and load are as the arm has them; nothing moves.

        Those of the last run of an owner that was started again are not confirmed: until then
        the arm only jogs. Does nothing for others.

        Raises:
            BusyError: The arm or the jaws move.
        """
        self._arm.execute(ChangeWorkspace("confirm_scene()", Workspace.confirmed))

    def _change(self, what: str, change: Callable[[Workspace], Workspace]) -> None:
        self._arm.execute(ChangeWorkspace(f"setting {what}", change))

    def enable(self) -> None:
        """Enable all joints at their positions; nothing moves.

        Raises:
            FaultedError: A fault is latched, here or in a joint.
            BusyError: The arm moves.
            BioscaraError: A joint was not enabled; all are released, and the error is latched as a
                fault.
        """
        self._arm.execute(Enable())

    def disable(self) -> None:
        """Bring all joints to rest and disable them; they stay homed.

        Raises:
            BusyError: The arm moves; :meth:`stop` ends that.
            HardwareError: A joint could not be stopped or disabled; call it again.
        """
        self._arm.execute(Disable())

    @property
    def faults(self) -> tuple[ArmFault, ...]:
        """Faults that are not recovered from, first cause first.

        Includes faults that joints had latched before this robot was connected.
        """
        return tuple(self._arm.stack.supervisor.faults)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The latest warnings: events that stopped nothing, such as a computer that is too slow."""
        return tuple(self._arm.stack.supervisor.warnings)

    def acknowledge(self) -> tuple[ArmFault, ...]:
        """Acknowledge the faults once the arm is at rest and write their evidence; nothing moves.

        Raises:
            FaultedError: There is no fault.
            OSError: The evidence cannot be written.
            BusyError: The arm moves.
        """
        return self._arm.execute(Acknowledge())

    def recover(self) -> None:
        """Clear acknowledged faults; nothing moves, and :meth:`enable` is the next step.

        Raises:
            FaultedError: The faults are not acknowledged, or another one has occurred since.
            BusyError: The arm moves.
            BioscaraError: A joint does not answer.
        """
        self._arm.execute(Recover())

    def home(
        self,
        joints: Sequence[str] | None = None,
        *,
        sensitivity: PerJoint = None,
        current: PerJoint = None,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Home the joints that are not homed, in the order of the parameters.

        A homed joint is homed again where the hand could otherwise hit the arm: the lift before the
        wrist, lift and wrist before the elbow; ``warnings`` say so. The positions of joints that
        are not homed are unknown: the elbow must be open, and the gripper empty.

        Args:
            joints: Names of the joints to home, also where they are homed; no others are moved, and
                it is refused where another one has to be homed before. None for all that are not
                homed.
            sensitivity: Position error that counts as a touch of the end stop, 1 to 255
                [microsteps of the motor]; a smaller one is more sensitive. One number for all
                joints, or by the names of joints: ``{"j1": 20}``. For this homing only; joints
                without one have that of the parameters.
            current: Drive current while homing, 1 to 100 [% of the driver's full scale]; likewise.
            timeout: Longest duration [s]; None for no limit except each joint's own.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.

        Raises:
            LimitError, InvalidArgumentError: A sensitivity or current is outside its limits or not
                whole, or there is no such joint; nothing moved.
            MotionCancelledError: It was stopped; the arm is at rest.
            HomingError: A joint found no reliable home position; or nothing moved, as the elbow is
                known to be folded and the wrist would turn, or another joint has to be homed
                before those that are given.
            LifecycleError: A load is attached, and a joint is not homed; nothing moved.
            BusyError: The arm moves.
            BioscaraError: As the drivers.
        """
        return self._carry_out(
            Home(
                joints=joints,
                sensitivity=sensitivity,
                current=current,
                timeout=timeout,
                on_cycle=on_cycle,
            ),
            wait,
        )

    def move_joints(
        self,
        positions: Sequence[float],
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Move all joints to given positions; they start and end together.

        Args:
            positions: One position for each joint [rad or m].
            velocity_scaling: Share of the speed limits to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.

        Raises:
            TrajectoryError: A position is outside its limits or not finite; nothing moved.
            BioscaraError: As :meth:`follow`.
        """
        return self._move(
            "move_joints()",
            lambda planner: planner.move_joints(
                positions,
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            ),
            timeout,
            on_cycle,
            wait,
        )

    def move_to(
        self,
        pose: Pose,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Move to a pose by the closest joint solution.

        Args:
            pose: Goal pose of the tool.
            velocity_scaling: Share of the speed limits to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.

        Raises:
            UnreachableError: The arm cannot reach the pose; nothing moved.
            ZoneError: The path is not free; nothing moved.
            BioscaraError: As :meth:`follow`.
        """
        return self._move(
            "move_to()",
            lambda planner: planner.move_to(
                pose,
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            ),
            timeout,
            on_cycle,
            wait,
        )

    def move_linear(
        self,
        pose: Pose,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Move to a pose along a line; arguments and errors as :meth:`move_to`."""
        return self._move(
            "move_linear()",
            lambda planner: planner.move_linear(
                pose,
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            ),
            timeout,
            on_cycle,
            wait,
        )

    def move_relative(
        self,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        yaw: float = 0.0,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Move along a line by a displacement along the axes of the base.

        Errors as :meth:`move_to`.

        Args:
            x: [m].
            y: [m].
            z: [m].
            yaw: Rotation about the vertical [rad], by less than half a turn.
            velocity_scaling: Share of the speed limits to use, 0.001 to 1.
            acceleration_scaling: Share of the acceleration limits to use, 0.001 to 1.
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.
        """
        return self._move(
            "move_relative()",
            lambda planner: planner.move_relative(
                x,
                y,
                z,
                yaw,
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            ),
            timeout,
            on_cycle,
            wait,
        )

    def move_circular(
        self,
        via: Pose,
        pose: Pose,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Move to a pose along an arc through ``via``; otherwise as :meth:`move_to`."""
        return self._move(
            "move_circular()",
            lambda planner: planner.move_circular(
                via,
                pose,
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            ),
            timeout,
            on_cycle,
            wait,
        )

    def move_named(
        self,
        name: str,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Move to a pose of ``table`` by its name; otherwise as :meth:`move_to`.

        Raises:
            InvalidArgumentError: No pose has that name, or it was taught with another tool.
        """
        return self._move(
            "move_named()",
            lambda planner: planner.move_named(
                name,
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            ),
            timeout,
            on_cycle,
            wait,
        )

    def unfold(
        self,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Open the elbow alone, j3 to 0, so that an arm left folded up by homing can move freely.

        Arguments as :meth:`move_to`.

        Raises:
            NotHomedError: The position of a joint is unknown.
            ZoneError: The path is not free; nothing moved.
        """
        return self._move(
            "unfold()",
            lambda planner: planner.unfold(
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            ),
            timeout,
            on_cycle,
            wait,
        )

    def move_sequence(
        self,
        waypoints: Sequence[Waypoint],
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Move along waypoints with rounded corners; otherwise as :meth:`move_to`."""
        return self._move(
            "move_sequence()",
            lambda planner: planner.move_sequence(
                waypoints,
                velocity_scaling=velocity_scaling,
                acceleration_scaling=acceleration_scaling,
            ),
            timeout,
            on_cycle,
            wait,
        )

    def execute(
        self,
        plan: Plan | Trajectory,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Execute a plan, or follow a trajectory; keyword arguments and errors as :meth:`follow`.

        Tool, speed limit or scene may have changed since planning: the plan is checked against the
        current ones, and slowed down where the tool would be too fast; ``warnings`` then say so.
        """
        if isinstance(plan, Trajectory):
            return self.follow(plan, timeout=timeout, on_cycle=on_cycle, wait=wait)
        if not isinstance(plan, Plan):
            raise InvalidArgumentError(
                f"execute() takes a Plan or a Trajectory, not {shown(plan)}; robot.plan makes plans"
            )
        return self._move(
            "execute()",
            lambda planner: checked(plan.trajectory, planner, planned=True),
            timeout,
            on_cycle,
            wait,
        )

    def follow(
        self,
        trajectory: Trajectory,
        *,
        approach: bool = False,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Follow a trajectory.

        If it ends early, all joints that can still be reached ramp down together within their
        acceleration limits before the exception is raised.

        Args:
            trajectory: Trajectory of some or all joints; the others hold.
            approach: Whether to move to its start on a planned ramp from any position of the arm.
            timeout: Longest total duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.

        Raises:
            TrajectoryError: It exceeds a limit, or starts too far from the arm's current position;
                nothing moved.
            MotionCancelledError: It was stopped; the arm is at rest.
            NotHomedError: The position of a joint is unknown.
            FaultedError: A fault is latched.
            BusyError: The arm moves.
            GoalAbortedError: It was not followed to its end.
            BioscaraError: The error that stopped the arm.
        """
        operation = FollowTrajectory(
            "follow()",
            lambda planner: checked(trajectory, planner),
            approach=approach,
            timeout=timeout,
            on_cycle=on_cycle,
        )
        return self._carry_out(operation, wait)

    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Operation[None]:
        """Move by streamed velocities until the stream ends; the arm is then at rest.

        Joint limits, the tool's speed limit and zones are respected, with enough distance to stop
        before them; ``limitation`` of the operation says what slows the arm down or holds it.
        Commanded velocities are scaled by ``speed_override``. If the source does not answer within
        0.15 s, the arm comes to rest.

        Args:
            velocities: Called each cycle: returns a velocity of the joints or of the tool, the
                previous one as long as it holds, or None to end.
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.

        Raises:
            InvalidArgumentError: A velocity is not finite or too large; the arm is at rest.
            TrajectoryError: A joint was pushed beyond a limit; nothing moved.
            ZoneError: The arm's clearance is too small; nothing moved.
            BioscaraError: As :meth:`follow`.
        """
        return self._carry_out(Jog(velocities, timeout=timeout, on_cycle=on_cycle), wait)

    def _move(
        self,
        name: str,
        plan: MakePlan,
        timeout: float | None,
        on_cycle: OnCycle | None,
        wait: bool,
    ) -> Operation[None]:
        operation = FollowTrajectory(name, plan, timeout=timeout, on_cycle=on_cycle)
        return self._carry_out(operation, wait)

    def _carry_out(self, operation: Operation[None], wait: bool) -> Operation[None]:
        if flag("wait", wait):
            self._arm.execute(operation)
        else:
            self._arm.start(operation)
        return operation

    def __repr__(self) -> str:
        return f"<Robot {self.description}, {self._condition()}>"

    def _condition(self) -> str:
        """Return whether the robot can move, and the pose of its tool, without using the bus."""
        session = self._arm.session
        if not session.connected:
            return "closed"
        if self.faults:
            return f"stopped by a fault: {self.faults[0]}"
        if running := self._arm.arbiter.running:
            return f"busy: {', '.join(claim.name for claim in running)}"
        states = session.stack.broadcaster.states
        power = "enabled" if self.is_enabled else "disabled"
        if states is None or any(map(math.isnan, states.positions)):
            return f"{power}, not homed"
        x, y, z, yaw = self.kinematics.forward(states.positions)
        return f"{power}, homed, at x={x:z.3f} y={y:z.3f} z={z:z.3f} yaw={yaw:z.2f}"


def _require_parameters(parameters: ArmParameters) -> ArmParameters:
    if not isinstance(parameters, ArmParameters):
        raise InvalidArgumentError(
            f"the parameters are {shown(parameters)}; give what load_parameters() returns"
        )
    return parameters
