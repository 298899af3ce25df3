"""Every public method of a robot, for an arm of this process and for one that another one owns."""

from __future__ import annotations

import asyncio
import math
from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import Any, ClassVar, NamedTuple, Self

from bioscara.arguments import flag, number, shown
from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.control.faults.kinds import ArmFault
from bioscara.control.faults.stop import STANDING
from bioscara.control.faults.warning import ArmWarning
from bioscara.errors import InvalidArgumentError
from bioscara.kinematics import Joints, Pose, Scara
from bioscara.kinematics.pose import wrapped
from bioscara.model import ArmParameters
from bioscara.notebook import table
from bioscara.planning import Trajectory
from bioscara.planning.collision.scene import Scene
from bioscara.planning.motions.jog_limitation import JogLimitation
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot import tasks
from bioscara.robot.operations.motions.home import PerJoint
from bioscara.robot.operations.motions.jog import Velocity
from bioscara.robot.operations.operation import OnCycle
from bioscara.robot.operations.running import Running
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.robot_gripper import RobotGripper
from bioscara.robot.simulated_world import SimulatedWorld
from bioscara.robot.stops import Call, Stops
from bioscara.robot.tasks.task import Conditions
from bioscara.robot.workspace.frames import Frame
from bioscara.robot.workspace.load import Load
from bioscara.robot.workspace.poses import NamedPose, TeachTable
from bioscara.robot.workspace.tools import Tool
from bioscara.robot.workspace.workspace import Workspace
from bioscara.spelling import unknown_attribute


class ArmMethods(ABC):
    """An arm, of this process (:class:`bioscara.Robot`) or of an owner (``RemoteRobot``).

    A ``with`` statement, or ``async with``, opens and closes it.

    Every motion takes the same keyword arguments:

    - ``velocity_scaling``, ``acceleration_scaling``: shares of the limits to plan with, 0.001 to 1.
    - ``timeout``: longest duration [s]; the arm is then brought to rest, and MotionTimeoutError is
      raised.
    - ``on_cycle``: receives a record of all joints at the end of each cycle; must return at once.
    - ``wait``: True returns at the end of the motion. False returns at its begin, and a thread
      carries it out.

    and returns its handle: ``status``, ``progress``, ``pause()``, ``resume()``, ``cancel()`` and
    ``result()``; ``await`` waits for its end. The gripper may move while the arm moves. All other
    calls that use the arm then raise BusyError, also in the callbacks of the motion; but any
    thread may read ``state``, ``pose`` and ``faults``, change ``speed_override``, and call
    :meth:`pause`, :meth:`resume`, :meth:`stop` and :meth:`close`.

    The motions to poses plan first, check limits and zones, and only then move; ``warnings`` have
    the notes on the plan for the user. ``plan`` plans the same motions without moving:
    ``robot.plan.move_linear(pose)``. A pose is that of the tool in the base, or in a work frame
    whose name is given as ``frame``; or the name of a taught one.

    Attributes:
        gripper: The gripper.
    """

    _own: ClassVar[frozenset[str]] = frozenset({"gripper"})
    """Attributes that are neither methods nor properties."""

    gripper: RobotGripper

    def __setattr__(self, name: str, value: object) -> None:
        # A misspelt name, such as robot.secne, would otherwise be accepted without an effect.
        known = [key for key in dir(type(self)) if not key.startswith("_")]
        if not (name in known or name in self._own or name.startswith("_")):
            raise unknown_attribute(self, name)
        object.__setattr__(self, name, value)

    # Parts that an arm of this process and that of an owner do in different ways.

    @abstractmethod
    def do(
        self,
        task: tasks.ArmTask,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[Any]:
        """Carry out a task, as the method of its name does.

        Args:
            task: What to do, of ``bioscara.robot.tasks``.
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.

        Raises:
            BioscaraError: As the method of its name.
        """

    @abstractmethod
    def _follow(
        self,
        trajectory: object,
        conditions: Conditions,
        *,
        approach: bool,
        planned: bool,
        wait: bool,
    ) -> Running[None]:
        """Follow a trajectory; ``planned`` if that is one of this software."""

    @abstractmethod
    def _positions(self, reason: str = "its position is unknown; home() first") -> Joints:
        """Return the joint positions; raise NotHomedError with the reason if one is unknown."""

    @abstractmethod
    def _jaws(self) -> tuple[float, tuple[float, float]]:
        """Return the commanded width of the jaws, and those that they may have [m]."""

    @abstractmethod
    def open(self) -> Self:
        """Connect; nothing moves. Return the robot.

        Raises:
            LifecycleError: It is open already, or was closed.
            OwnerLostError: No owner of that name runs, also after the time to wait for it.
            BioscaraError: A joint cannot be used; the bus is closed again.
        """

    @abstractmethod
    def close(self) -> None:
        """Stop the motions of this program and disconnect; may be called again.

        An arm of this process is disabled; that of an owner stays as it is.

        Raises:
            HardwareError: A joint could not be stopped or disabled.
            BusyError: Called from a callback of a motion.
        """

    @property
    @abstractmethod
    def is_open(self) -> bool:
        """Whether it is connected: :meth:`open` was called, and not :meth:`close` since."""

    def _close(self, error: BaseException | None) -> None:  # noqa: ARG002  see Robot
        """Close at the end of a ``with`` statement, which an error may have ended."""
        self.close()

    def __enter__(self) -> Self:
        return self if self.is_open else self.open()

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._close(exc)

    async def __aenter__(self) -> Self:
        # In the thread of the loop: only the main thread can release the arm on signals.
        return self.__enter__()

    async def __aexit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        # Not in the thread of the loop: a motion comes to rest first.
        await asyncio.shield(asyncio.to_thread(self._close, exc))

    @abstractmethod
    def shutdown(self) -> list[str]:
        """Stop the motions of this program; does nothing if that is done already.

        The joints of an arm of this process are disabled; those of an owner stay as it has them.

        Returns:
            A sentence for each joint that could not be stopped or disabled.

        Raises:
            BusyError: Called from a callback of the motion that it would have to wait for.
        """

    @abstractmethod
    def watch(self, *, priority: int | None = None, real_time_factor: float = 1.0) -> None:
        """Run the control loop in a thread of its own from now on, also while nothing moves.

        Faults of a standing arm are then noticed, and systemd is notified. The simulated arm then
        moves in real time. An owner does that for its arm in any case.

        Args:
            priority: Real-time priority of the thread, 1 to 99; None for none.
            real_time_factor: Factor by which an arm simulated in this process is faster than real
                time.

        Raises:
            NotInitializedError: The robot is not connected.
            InvalidArgumentError: The factor or the priority is not possible.
            NotSupportedError: They are those of an owner.
            RealtimeError: The system does not permit the priority.
        """

    @abstractmethod
    def stop(self) -> None:
        """Stop all motion on its path and end a pause, from any thread; returns at once.

        Each call that was moving, planning or resting raises MotionCancelledError once the arm is
        at rest. A later call is not affected; several are one call within :meth:`one_call`. At an
        owner it stops the motions of all programs, and needs no lease.
        """

    @abstractmethod
    def cancel(self) -> None:
        """Stop as :meth:`stop` does, but at an owner only where this program commands the arm."""

    @property
    @abstractmethod
    def _stops(self) -> Stops:
        """The stops that this program has heard of."""

    @contextmanager
    def one_call(self) -> Iterator[Call]:
        """Let the calls of this thread, within a block of code, be one call for :meth:`stop`.

        After a stop since the begin of the block nothing moves any more within it: each call raises
        MotionCancelledError. Yields the call; ``stopped`` is whether there was a stop.
        """
        with self._stops.one_call() as call:
            yield call

    @abstractmethod
    def pause(self) -> None:
        """Bring all motion to rest on its path, as fast as :meth:`stop`, until :meth:`resume`.

        A motion begun during a pause waits for it; ``warnings`` say so. Homing that has begun
        and the jaws are not paused: :meth:`stop` ends them. At an owner it needs no lease; each
        program that pauses has to resume, and a pause stays when its program ends. The program
        with the lease lifts all pauses.
        """

    @abstractmethod
    def resume(self) -> None:
        """Lift the pause of this program; motion continues unless others have paused, too.

        At an owner it lifts all pauses if this program commands the arm, and does nothing if the
        arm is not paused. It needs no lease; where others alone have paused and no program
        commands the arm, it takes the lease.

        Raises:
            LeaseError: Others have paused, and another program commands the arm; names those who
                can resume.
        """

    @abstractmethod
    def simulate_fault(self, fault: str, joint: str = "", value: float | None = None) -> None:
        """Let a simulated arm fail, also while it moves; from any thread, and in callbacks.

        The next cycles meet the fault: a motion then raises. At an owner it needs no lease.

        Args:
            fault: Name of the fault; docs/simulation.md has the names. ``clear`` ends all.
            joint: The joint; empty for faults of the whole arm.
            value: Whether it is on, 1 or 0; the position of an obstacle [rad or m]; the torque
                [N m] or, on ``j2``, the force [N] of a push; docs/simulation.md has the others.
                None for the one that begins it, where it is a switch.

        Raises:
            NotSupportedError: The arm is real, or simulated by another process than its owner.
            InvalidArgumentError: There is no such fault or joint, or the value is not possible.
        """

    # Questions.

    @property
    @abstractmethod
    def simulation(self) -> SimulatedWorld:
        """The world around a simulated arm, which has bodies if it was made with a world.

        Raises:
            NotSupportedError: The arm is of this process, and has no world.
        """

    @property
    @abstractmethod
    def parameters(self) -> ArmParameters:
        """Parameters of the arm."""

    @property
    @abstractmethod
    def description(self) -> str:
        """Which arm on which bus, in words."""

    @property
    @abstractmethod
    def paused_by(self) -> tuple[str, ...]:
        """Names of the programs that paused all motion; motion continues when none is left."""

    @property
    @abstractmethod
    def firmware(self) -> tuple[str, ...]:
        """Protocol and firmware versions of each joint, in words."""

    @property
    @abstractmethod
    def flags(self) -> tuple[int, ...]:
        """Flags that each joint reported last, see :class:`bioscara.protocol.Flags`."""

    @property
    @abstractmethod
    def state(self) -> JointStates:
        """Joint states: of the last cycle while the control loop runs, else read now.

        Raises:
            BusyError: A motion begins and has not read the joints yet.
            FaultedError: The joints were released because of a fault, and are not recovered.
            BioscaraError: They were released without a fault: ``enable()`` them.
        """

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
        while self.is_open:
            yield await asyncio.to_thread(lambda: self.state)
            await asyncio.sleep(period)

    @property
    @abstractmethod
    def pose(self) -> Pose:
        """Pose of the tool in the base, yaw above -pi and up to pi; as old as ``state``.

        Raises:
            NotHomedError: The position of a joint is unknown.
            BusyError: As ``state``.
        """

    @property
    def is_homed(self) -> bool:
        """Whether all joints are homed; errors as ``state``."""
        return not any(map(math.isnan, self.state.positions))

    @property
    @abstractmethod
    def is_enabled(self) -> bool:
        """Whether the motors of the joints are energised."""

    @property
    @abstractmethod
    def is_moving(self) -> bool:
        """Whether an operation uses the arm or the gripper, of any program."""

    @property
    def is_at_rest(self) -> bool:
        """Whether the arm stands still, and stays so until a call, :meth:`resume` or a fault.

        All joints stand by their measured velocities, and no motion is under way unless a pause
        holds it. Errors as ``state``.
        """
        # First: a motion that begins in between is then seen.
        states = self.state
        standing = all(
            abs(velocity) < STANDING * joint.max_velocity
            for joint, velocity in zip(self.parameters.joints, states.velocities, strict=True)
        )
        return standing and (not self.is_moving or self._held)

    @property
    @abstractmethod
    def _held(self) -> bool:
        """Whether a pause holds all motion that is under way."""

    @property
    @abstractmethod
    def jog_limitation(self) -> JogLimitation | None:
        """Why the running jog does not fully follow its velocity; None if it does or none runs."""

    @property
    @abstractmethod
    def period(self) -> float:
        """Time between two setpoints [s]."""

    @property
    @abstractmethod
    def bus_share(self) -> float:
        """Share of each control cycle that the exchanges take on the bus, 0 to 1.

        Above 0.8 a late computer has little time to make up for; a lower ``rate`` leaves more.
        """

    @property
    @abstractmethod
    def faults(self) -> tuple[ArmFault, ...]:
        """Faults that are not recovered from, first cause first.

        Includes faults that joints had latched before this robot was connected.
        """

    @property
    @abstractmethod
    def warnings(self) -> tuple[ArmWarning, ...]:
        """What stopped nothing and a person should see: the latest hundred, the newest last.

        Each is a text that begins with its call, and has the ``time`` [s] on the arm's clock, as
        ``state.time``. How a plan differs from the request is in ``notes`` of plan and motion.
        """

    @property
    @abstractmethod
    def workspace(self) -> Workspace:
        """Tool, scene, load, named poses and speed limit, as they are now."""

    @property
    def kinematics(self) -> Scara:
        """Kinematics of the arm with its tool."""
        return self.workspace.kinematics

    @property
    def plan(self) -> Planner:
        """Plans motions in the present workspace from where the arm is, without moving it.

        The plans are made in this program.
        """
        return Planner(self.workspace, self._positions)

    # Settings.

    @property
    @abstractmethod
    def speed_override(self) -> float:
        """Share of the planned or jog speed, 0 to 1; any thread may change it.

        0 pauses: the arm comes to rest on its path as soon as after a stop, and a share above 0
        continues the motion.
        """

    @speed_override.setter
    @abstractmethod
    def speed_override(self, share: float) -> None: ...

    @property
    def reduced_speed(self) -> bool:
        """Whether the tool keeps to 250 mm/s; cannot be changed while the arm moves."""
        return self.workspace.reduced_speed

    @reduced_speed.setter
    def reduced_speed(self, reduced_speed: bool) -> None:
        self.do(tasks.SetReducedSpeed(reduced=reduced_speed))

    @property
    def scene(self) -> Scene:
        """Surroundings to keep clear of; cannot be changed while the arm moves."""
        return self.workspace.scene

    @scene.setter
    def scene(self, scene: Scene) -> None:
        if not isinstance(scene, Scene):
            raise InvalidArgumentError(f"the scene is {shown(scene)}; give Scene(...)")
        self._set_scene(scene)

    @abstractmethod
    def _set_scene(self, scene: Scene) -> None: ...

    @property
    def table(self) -> TeachTable:
        """The tools, poses and frames that have names; cannot be changed while the arm moves."""
        return self.workspace.table

    @table.setter
    def table(self, table: TeachTable) -> None:
        if not isinstance(table, TeachTable):
            raise InvalidArgumentError(f"the table is {shown(table)}; give a TeachTable")
        self._set_table(table)

    @abstractmethod
    def _set_table(self, table: TeachTable) -> None: ...

    def teach(self, name: str, *, overwrite: bool = False) -> NamedPose:
        """Name the present position of the arm: :meth:`move_named` returns to it.

        The joint positions are taught, with the pose of the tool. The pose is in ``table`` from
        then on; ``save_table(path, robot.table)`` writes a file. An owner saves its own.

        Args:
            name: Letters, digits, ``_`` and ``-``, with single spaces between; begins with a
                letter.
            overwrite: Whether it replaces a taught pose of that name.

        Returns:
            The named pose.

        Raises:
            InvalidArgumentError: There is a pose of this name, or it cannot be a name.
            NotHomedError: The position of a joint is unknown.
            BusyError: The arm moves.
            ConflictError: Another program has changed the poses at the same time.
        """
        table = self.table
        joints = self._positions("its position cannot be taught; home() first")
        pose = self.kinematics.forward(joints)
        taught = NamedPose(name, joints, pose._replace(yaw=wrapped(pose.yaw)), self.tool.name)
        if not flag("overwrite", overwrite) and any(each.name == name for each in table.poses):
            raise InvalidArgumentError(
                f"there is a pose {name} already; teach another name, or teach({name!r}, "
                "overwrite=True)"
            )
        self.table = table.with_pose(taught, overwrite=overwrite)
        return taught

    @property
    def tool(self) -> Tool:
        """The mounted tool; set to another one of ``table``, or its name, once that is mounted."""
        return self.workspace.tool

    @tool.setter
    def tool(self, tool: str | Tool) -> None:
        self.do(tasks.SetTool(name=self.workspace.with_tool(tool).tool.name))

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
        return self.workspace.load

    # The tasks of the arm.

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
        self.do(tasks.Attach(load=load))

    def detach(self) -> None:
        """Declare that the tool carries nothing; nothing moves.

        Raises:
            LifecycleError: No load is attached.
            BusyError: The arm or the jaws move.
        """
        self.do(tasks.Detach())

    def confirm_scene(self) -> None:
        """Declare that scene, tool and load are as the arm has them; nothing moves.

        Those of the last run of an owner that was started again are not confirmed: until then
        the arm only jogs. Does nothing for others.

        Raises:
            BusyError: The arm or the jaws move.
        """
        self.do(tasks.ConfirmScene())

    def enable(self) -> None:
        """Enable all joints at their positions; nothing moves.

        Raises:
            FaultedError: A fault is latched, here or in a joint.
            BusyError: The arm moves.
            BioscaraError: A joint was not enabled; all are released, and the error is latched as a
                fault.
        """
        self.do(tasks.Enable())

    def disable(self) -> None:
        """Bring all joints to rest and disable them; they stay homed.

        Raises:
            BusyError: The arm moves; :meth:`stop` ends that.
            HardwareError: A joint could not be stopped or disabled; call it again.
        """
        self.do(tasks.Disable())

    def acknowledge(self) -> tuple[ArmFault, ...]:
        """Acknowledge the faults once the arm is at rest and write their evidence; nothing moves.

        Raises:
            FaultedError: There is no fault.
            OSError: The evidence cannot be written.
            BusyError: The arm moves.
        """
        self.do(tasks.Acknowledge())
        return self.faults

    def recover(self) -> None:
        """Clear acknowledged faults; nothing moves, and :meth:`enable` is the next step.

        Raises:
            FaultedError: The faults are not acknowledged, or another one has occurred since.
            BusyError: The arm moves.
            BioscaraError: A joint does not answer.
        """
        self.do(tasks.Recover())

    def home(
        self,
        joints: Sequence[str] | None = None,
        *,
        sensitivity: PerJoint = None,
        current: PerJoint = None,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
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
        task = tasks.Home(joints, sensitivity, current)  # type: ignore[arg-type]  # checked there
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def move_joints(
        self,
        positions: Sequence[float],
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
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
        task = tasks.MoveJoints(
            positions=positions,  # type: ignore[arg-type]  # checked there
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
        )
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def move_to(
        self,
        pose: Pose | str,
        *,
        frame: str | None = None,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Move to a pose by the closest joint solution.

        Args:
            pose: Goal pose of the tool, or its name in ``table``.
            frame: Name of the work frame that the pose is given in; None for the base.
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
        task = tasks.MoveTo(
            pose=pose,
            frame=frame,
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
        )
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def move_linear(
        self,
        pose: Pose | str,
        *,
        frame: str | None = None,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Move to a pose along a line; arguments and errors as :meth:`move_to`."""
        task = tasks.MoveLinear(
            pose=pose,
            frame=frame,
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
        )
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

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
    ) -> Running[None]:
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
        task = tasks.MoveRelative(
            x=x,
            y=y,
            z=z,
            yaw=yaw,
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
        )
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def move_circular(
        self,
        via: Pose | str,
        pose: Pose | str,
        *,
        frame: str | None = None,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Move to a pose along an arc through ``via``; otherwise as :meth:`move_to`."""
        task = tasks.MoveCircular(
            via=via,
            pose=pose,
            frame=frame,
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
        )
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def move_named(
        self,
        name: str,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Move to a pose of ``table`` by its name; otherwise as :meth:`move_to`.

        If it was taught with joint positions, these are the goal.

        Raises:
            InvalidArgumentError: No pose has that name, or it was taught with another tool.
        """
        task = tasks.MoveNamed(
            name=name,
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
        )
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def rest(
        self,
        seconds: float,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Rest for a time of the arm's clock, which :meth:`stop` ends; nothing moves.

        The control loop runs: the time of a simulated arm passes, and a fault is raised. It uses
        neither the arm nor the gripper, also of an arm that is disabled.

        Args:
            seconds: The time, up to an hour [s]; what passes in a pause does not count.
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.

        Raises:
            LimitError: The time is below zero or longer.
            MotionCancelledError: It was stopped.
            FaultedError: A fault is latched.
            BioscaraError: The fault that stopped the arm.
        """
        return self.do(tasks.Wait(seconds), timeout=timeout, on_cycle=on_cycle, wait=wait)

    def unfold(
        self,
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Open the elbow alone, j3 to 0, so that an arm left folded up by homing can move freely.

        Arguments as :meth:`move_to`.

        Raises:
            NotHomedError: The position of a joint is unknown.
            ZoneError: The path is not free; nothing moved.
        """
        task = tasks.Unfold(
            velocity_scaling=velocity_scaling, acceleration_scaling=acceleration_scaling
        )
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def move_sequence(
        self,
        waypoints: Sequence[Waypoint],
        *,
        velocity_scaling: float = 1.0,
        acceleration_scaling: float = 1.0,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Move along waypoints with rounded corners; otherwise as :meth:`move_to`."""
        task = tasks.MoveSequence(
            waypoints=waypoints,  # type: ignore[arg-type]  # checked there
            velocity_scaling=velocity_scaling,
            acceleration_scaling=acceleration_scaling,
        )
        return self.do(task, timeout=timeout, on_cycle=on_cycle, wait=wait)

    def execute(
        self,
        plan: Plan | Trajectory,
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Execute a plan, or follow a trajectory; keyword arguments and errors as :meth:`follow`.

        Tool, speed limit or scene may have changed since planning: the plan is checked against the
        current ones, and slowed down where the tool would be too fast; ``warnings`` then say so.
        """
        if not isinstance(plan, Plan | Trajectory):
            raise InvalidArgumentError(
                f"execute() takes a Plan or a Trajectory, not {shown(plan)}; robot.plan makes plans"
            )
        planned = isinstance(plan, Plan)
        trajectory = plan.trajectory if isinstance(plan, Plan) else plan
        conditions = Conditions(timeout, on_cycle)
        return self._follow(trajectory, conditions, approach=False, planned=planned, wait=wait)

    def follow(
        self,
        trajectory: Trajectory,
        *,
        approach: bool = False,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
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
        conditions = Conditions(timeout, on_cycle)
        return self._follow(trajectory, conditions, approach=approach, planned=False, wait=wait)

    @abstractmethod
    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        *,
        timeout: float | None = None,
        on_cycle: OnCycle | None = None,
        wait: bool = True,
    ) -> Running[None]:
        """Move by streamed velocities until the stream ends; the arm is then at rest.

        Joint limits, the tool's speed limit and zones are respected, with enough distance to stop
        before them; ``limitation`` of the handle says what slows the arm down or holds it.
        Commanded velocities are scaled by ``speed_override``. If the source does not answer within
        0.15 s, the arm comes to rest.

        Args:
            velocities: Called each cycle, or 50 times per second for an owner: returns a velocity
                of the joints or of the tool, the previous one as long as it holds, or None to end.
            timeout: Longest duration [s]; None for no limit.
            on_cycle: Receives a record of all joints each cycle.
            wait: Whether to return at the end.

        Raises:
            InvalidArgumentError: A velocity is not finite or too large; the arm is at rest.
            TrajectoryError: A joint was pushed beyond a limit; nothing moved.
            ZoneError: The arm's clearance is too small; nothing moved.
            BioscaraError: As :meth:`follow`.
        """

    @abstractmethod
    def _glance(self) -> Glance:
        """Return what a person sees at a glance, without using a bus."""

    def __repr__(self) -> str:
        glance = self._glance()
        return f"<{type(self).__name__} {glance.name}, {glance.condition}>"

    def _repr_html_(self) -> str:
        glance = self._glance()
        rows = [(type(self).__name__, glance.name), ("state", glance.condition)]
        if glance.warnings:
            rows.append(("warnings", str(glance.warnings)))
        shown = table(rows)
        return shown if glance.states is None else shown + glance.states._repr_html_()


class Glance(NamedTuple):
    """What a person sees of an arm at a glance.

    Attributes:
        name: Which arm.
        condition: Whether it can move, and where its tool is.
        states: The joints; None if they are not known.
        warnings: Number of the warnings.
    """

    name: str
    condition: str
    states: JointStates | None = None
    warnings: int = 0


def condition(
    fault: ArmFault | None, calls: Sequence[str], pose: Pose | None, *, enabled: bool
) -> str:
    """Return whether an arm can move, and the pose of its tool, as a person reads it.

    Args:
        fault: The first fault, or None.
        calls: Names of the calls that use the arm.
        pose: Pose of the tool; None if it is not homed.
        enabled: Whether the motors are energised.
    """
    if fault is not None:
        return f"stopped by a fault: {fault}"
    if calls:
        return f"busy: {', '.join(calls)}"
    power = "enabled" if enabled else "disabled"
    if pose is None:
        return f"{power}, not homed"
    x, y, z, yaw = pose
    return f"{power}, homed, at x={x:z.3f} y={y:z.3f} z={z:z.3f} m, yaw={yaw:z.2f} rad"
