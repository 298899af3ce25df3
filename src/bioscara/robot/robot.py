"""A whole arm as one object: the public interface of the package."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from bioscara.arguments import shown
from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.control.controllers.joint_state_broadcaster import JointStates
from bioscara.control.faults.kinds import ArmFault
from bioscara.drivers import Gripper, Joint
from bioscara.errors import InvalidArgumentError, MotionCancelledError
from bioscara.kinematics import Pose, Scara
from bioscara.model import ArmParameters, load_parameters
from bioscara.planning import Trajectory
from bioscara.planning.motions.waypoints import Waypoint
from bioscara.robot.connection.arm_session import FAULTS, ArmSession
from bioscara.robot.connection.call_arbiter import exclusive
from bioscara.robot.connection.devices import devices_on, real_gripper, simulated_devices
from bioscara.robot.connection.fault_recovery import FaultRecovery
from bioscara.robot.connection.state_reader import StateReader
from bioscara.robot.motions.arm_motions import ArmMotions, Velocity
from bioscara.robot.motions.cycle_recorder import Cancelled, Observe, ignore, never
from bioscara.robot.motions.gripper import JawWidths, RobotGripper
from bioscara.robot.planner import Plan, Planner


class Robot:
    """A Bioscara arm.

    Used as a context manager: entering opens the bus and connects to the joints, and nothing moves;
    leaving always stops and disables all joints; joints for which that failed are reported by a
    HardwareError, or by notes on the exception that is being raised. Every method returns when the
    activity that it started has ended. One call at a time uses the arm: during that call any thread
    may read ``state``, ``pose`` and ``faults``, change ``speed``, and call :meth:`stop` and
    :meth:`shutdown`; everything else raises BusyError, also in the callbacks of the call itself.

    The motions to poses plan first, check limits and zones, and only then move; ``warnings`` have
    the notes on the plan for the user. ``plan`` plans the same motions without moving:
    ``robot.plan.linear(pose)`` and so on. Poses are of the tool in the base.

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
        full_speed: False keeps the tool at or below 250 mm/s, even if more is commanded.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.

    Attributes:
        bus: The bus of the joints.
        clock: Clock of the arm.
        parameters: Parameters of the arm.
        description: Which arm on which bus, in words.
        plan: Plans motions from the arm's current position, without moving.
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
        evidence: Path = FAULTS,
        full_speed: bool = False,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> None:
        parameters = _require_parameters(parameters)
        self.bus, self.clock = bus, clock
        self.parameters, self.description = parameters, description
        driver = gripper or real_gripper(parameters, clock)
        self._servo = servo
        self._session = ArmSession(bus, clock, parameters, driver, rate=rate, evidence=evidence)
        self._arbiter = self._session.arbiter
        self._state = StateReader(self._session)
        self._recovery = FaultRecovery(self._session)
        jaws = JawWidths(self._session.gripper, parameters.gripper)
        self.plan = Planner(parameters, self._state.positions, self._arbiter, jaws.range)
        self.plan.full_speed = full_speed
        self.gripper = RobotGripper(self._session, jaws, self.plan.check_width)
        self._motions = ArmMotions(
            self._session, self.plan, pace_homing=pace_homing, pace_motion=pace_motion
        )

    @classmethod
    def simulated(
        cls,
        parameters: ArmParameters | None = None,
        *,
        v1: bool | Collection[str] = False,
        seed: int = 0,
        evidence: Path = FAULTS,
        full_speed: bool = False,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> Self:
        """Return an arm that is simulated in this process: firmware, physics and clock.

        Args:
            parameters: Parameters of the arm; the committed ones by default.
            v1: Whether its joints have their original firmware, as on existing arms; or the names
                of the joints that have it.
            seed: Seed of all random values in the simulation.
            evidence: Folder for the flight records of faults.
            full_speed: False keeps the tool at or below 250 mm/s.
            pace_homing: Whether homing takes as long as on the arm.
            pace_motion: Whether motion takes as long as on the arm.
        """
        parameters = load_parameters() if parameters is None else _require_parameters(parameters)
        devices = simulated_devices(parameters, v1=v1, seed=seed)
        return cls(
            **devices._asdict(),
            parameters=parameters,
            evidence=evidence,
            full_speed=full_speed,
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
        evidence: Path = FAULTS,
        full_speed: bool = False,
    ) -> Self:
        """Return the arm on the bus of this name.

        Args:
            name: ``linux:1``, ``linux:/dev/i2c-1``, or ``sim:/path.sock`` for an arm that
                ``bioscara simulate`` runs.
            parameters: Parameters of the arm; the committed ones by default.
            rate: Control cycles per second [Hz]; None for the rate that suits the joints.
            evidence: Folder for the flight records of faults.
            full_speed: False keeps the tool at or below 250 mm/s.

        Raises:
            InvalidArgumentError: There is no bus of that name.
        """
        parameters = load_parameters() if parameters is None else _require_parameters(parameters)
        devices = devices_on(name, parameters)
        return cls(
            **devices._asdict(),
            parameters=parameters,
            rate=rate,
            evidence=evidence,
            full_speed=full_speed,
        )

    def __enter__(self) -> Self:
        try:
            self._connect()
        except MotionCancelledError:
            # Stopped once connected: the with statement is not entered and would not call __exit__.
            self.__exit__(None, None, None)
            raise
        return self

    @exclusive("connecting")
    def _connect(self) -> None:
        self._session.connect(self.plan.surroundings)

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._session.leave(self.shutdown, exc)

    def stop(self) -> None:
        """Stop the call that is using the arm, from any thread; returns at once.

        That call raises MotionCancelledError once the arm is at rest. If no call is using the
        arm, nothing happens: a later call is not affected.
        """
        self._arbiter.stop()

    @exclusive("shutdown()", last=True)
    def shutdown(self) -> list[str]:
        """Stop and disable all joints; does nothing if that is done already.

        A call that uses the arm, with the callback it may be in, is first stopped and awaited.

        Returns:
            A sentence for each joint that could not be stopped or disabled.

        Raises:
            BusyError: Called from a callback of the call that it would have to wait for.
        """
        return self._session.shutdown()

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The drivers of the joints."""
        return self._session.arm.joints

    @property
    def state(self) -> JointStates:
        """Joint states: of the last cycle of the running call, else read now.

        Raises:
            BusyError: The running call has not read the joints yet.
            FaultedError: The joints were released because of a fault, and are not recovered.
            BioscaraError: They were released without a fault: ``enable()`` them.
        """
        return self._state.read()

    @property
    def pose(self) -> Pose:
        """Pose of the tool in the base; as old as ``state``.

        Raises:
            NotHomedError: The position of a joint is unknown.
            BusyError: As ``state``.
        """
        positions = self._state.positions("the pose of the tool is unknown")
        return self.plan.kinematics.forward(positions)

    @property
    def kinematics(self) -> Scara:
        """Kinematics of the arm with its tool."""
        return self.plan.kinematics

    @property
    def period(self) -> float:
        """Time between two setpoints [s]."""
        return self._session.stack.loop.period

    @property
    def speed(self) -> float:
        """Share of the planned or jog speed, 0 to 1; any thread may change it.

        0 pauses: the arm comes to rest on its path as soon as after a stop, and a share above 0
        continues the motion.
        """
        return self._motions.speed

    @speed.setter
    def speed(self, speed: float) -> None:
        self._motions.speed = speed

    @property
    def full_speed(self) -> bool:
        """Whether the tool may be faster than 250 mm/s; cannot be changed while a call runs."""
        return self.plan.full_speed

    @full_speed.setter
    @exclusive("setting full_speed")
    def full_speed(self, full_speed: bool) -> None:
        self.plan.full_speed = full_speed

    @exclusive("enable()")
    def enable(self) -> None:
        """Enable all joints at their positions; nothing moves.

        Raises:
            FaultedError: A fault is latched, here or in a joint.
            BusyError: Another call is using the arm.
            BioscaraError: A joint was not enabled; all are released, and the error is latched as a
                fault.
        """
        self._session.enable()

    @exclusive("disable()")
    def disable(self) -> None:
        """Bring all joints to rest and disable them; they stay homed.

        Raises:
            BusyError: Another call is using the arm; :meth:`stop` ends it.
            HardwareError: A joint could not be stopped or disabled; call it again.
        """
        self._session.disable()

    @property
    def faults(self) -> tuple[ArmFault, ...]:
        """Faults that are not recovered from, first cause first.

        Includes faults that joints had latched before this robot was connected.
        """
        return self._recovery.faults

    @property
    def warnings(self) -> tuple[str, ...]:
        """The latest warnings: events that stopped nothing, such as a computer that is too slow."""
        return self._recovery.warnings

    @exclusive("acknowledge()")
    def acknowledge(self) -> tuple[ArmFault, ...]:
        """Acknowledge the faults once the arm is at rest and write their evidence; nothing moves.

        Raises:
            FaultedError: There is no fault.
            OSError: The evidence cannot be written.
            BusyError: Another call is using the arm.
        """
        return self._recovery.acknowledge()

    @exclusive("recover()")
    def recover(self) -> None:
        """Clear acknowledged faults; nothing moves, and :meth:`enable` is the next step.

        Raises:
            FaultedError: The faults are not acknowledged, or another one has occurred since.
            BusyError: Another call is using the arm.
            BioscaraError: A joint does not answer.
        """
        self._recovery.recover()

    @exclusive("home()")
    def home(
        self,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        *,
        timeout: float | None = None,
    ) -> None:
        """Home the joints that are not homed, in the order of the parameters.

        A homed joint is homed again where the hand could otherwise hit the arm: the lift before the
        wrist, lift and wrist before the elbow; ``warnings`` say so. The positions of joints that
        are not homed are unknown: the elbow must be open, and the gripper empty.

        Args:
            observe: Receives a record of all joints each cycle.
            cancelled: Called each cycle; True ends the homing.
            timeout: Longest duration [s]; None for no limit except each joint's own.

        Raises:
            MotionCancelledError: It was stopped; the arm is at rest.
            HomingError: A joint found no reliable home position; or the elbow is known to be
                folded and the wrist is not homed, and nothing moved.
            BusyError: Another call is using the arm.
            BioscaraError: As the drivers.
        """
        self._motions.home(observe, cancelled, timeout)

    @exclusive("move_joints()")
    def move_joints(
        self,
        positions: Sequence[float],
        speed: float = 1.0,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        *,
        timeout: float | None = None,
    ) -> None:
        """Move all joints to given positions; they start and end together.

        Args:
            positions: One position for each joint [rad or m].
            speed: Share of the speed limits to use, 0.001 to 1.
            observe: Receives a record of all joints each cycle.
            cancelled: Called each cycle; True ends the motion.
            timeout: Longest duration [s]; None for no limit.

        Raises:
            TrajectoryError: A position is outside its limits or not finite; nothing moved.
            BioscaraError: As :meth:`follow`.
        """
        plan = self.plan.joints(positions, speed)
        self._motions.execute_at_once(plan, observe, cancelled, timeout)

    @exclusive("move_to()")
    def move_to(self, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose by the closest joint solution.

        Args:
            pose: Goal pose of the tool.
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            UnreachableError: The arm cannot reach the pose; nothing moved.
            ZoneError: The path is not free; nothing moved.
            BioscaraError: As :meth:`follow`.
        """
        self._motions.execute_at_once(self.plan.to(pose, speed))

    @exclusive("move_linear()")
    def move_linear(self, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose along a line; arguments and errors as :meth:`move_to`."""
        self._motions.execute_at_once(self.plan.linear(pose, speed))

    @exclusive("move_circular()")
    def move_circular(self, via: Pose, pose: Pose, speed: float = 1.0) -> None:
        """Move to a pose along an arc through ``via``; otherwise as :meth:`move_to`."""
        self._motions.execute_at_once(self.plan.circular(via, pose, speed))

    @exclusive("move_named()")
    def move_named(self, name: str, speed: float = 1.0) -> None:
        """Move to a pose of the teach table; otherwise as :meth:`move_to`.

        Args:
            name: Name of the pose.
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            InvalidArgumentError: No pose has that name, or it was taught with another tool.
        """
        self._motions.execute_at_once(self.plan.named(name, speed))

    @exclusive("unfold()")
    def unfold(self, speed: float = 1.0) -> None:
        """Open the elbow alone, j3 to 0, so that an arm left folded up by homing can move freely.

        Args:
            speed: Share of the speed limits to use, 0.001 to 1.

        Raises:
            NotHomedError: The position of a joint is unknown.
            ZoneError: The path is not free; nothing moved.
        """
        self._motions.execute_at_once(self.plan.unfold(speed))

    @exclusive("move_sequence()")
    def move_sequence(self, waypoints: Sequence[Waypoint]) -> None:
        """Move along waypoints with rounded corners; errors as :meth:`move_to`."""
        self._motions.execute_at_once(self.plan.sequence(waypoints))

    @exclusive("execute()")
    def execute(
        self,
        plan: Plan,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        *,
        timeout: float | None = None,
    ) -> None:
        """Execute a plan; arguments and errors as :meth:`follow`.

        Tool, speed limit or scene may have changed since planning: the plan is checked against the
        current ones, and slowed down where the tool would be too fast; ``warnings`` then say so.
        """
        self._motions.execute(plan, observe, cancelled, timeout)

    @exclusive("follow()")
    def follow(
        self,
        trajectory: Trajectory,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        *,
        approach: bool = False,
        timeout: float | None = None,
    ) -> None:
        """Follow a trajectory.

        If it ends early, all joints that can still be reached ramp down together within their
        acceleration limits before the exception is raised.

        Args:
            trajectory: Trajectory of some or all joints; the others hold.
            observe: Receives a record of all joints each cycle.
            cancelled: Called each cycle; True ends the motion.
            approach: Whether to move to its start on a planned ramp from any position of the arm.
            timeout: Longest total duration [s]; None for no limit.

        Raises:
            TrajectoryError: It exceeds a limit, or starts too far from the arm's current position;
                nothing moved.
            MotionCancelledError: It was stopped; the arm is at rest.
            NotHomedError: The position of a joint is unknown.
            FaultedError: A fault is latched.
            BusyError: Another call is using the arm.
            GoalAbortedError: It was not followed to its end.
            BioscaraError: The error that stopped the arm.
        """
        self._motions.follow(trajectory, observe, cancelled, approach=approach, timeout=timeout)

    @exclusive("jog()")
    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        observe: Observe = ignore,
        *,
        timeout: float | None = None,
    ) -> None:
        """Move by streamed velocities until the stream ends; the arm is then at rest.

        Joint limits, the tool's speed limit and zones are respected, with enough distance to stop
        before them. Commanded velocities are scaled by ``speed``. If the source does not answer
        within 0.15 s, the arm comes to rest.

        Args:
            velocities: Called each cycle: returns a velocity of the joints or of the tool, the
                previous one as long as it holds, or None to end.
            observe: Receives a record of all joints each cycle.
            timeout: Longest duration [s]; None for no limit.

        Raises:
            InvalidArgumentError: A velocity is not finite or too large; the arm is at rest.
            TrajectoryError: A joint was pushed beyond a limit; nothing moved.
            ZoneError: The arm's clearance is too small; nothing moved.
            BioscaraError: As :meth:`follow`.
        """
        self._motions.jog(velocities, observe, timeout)


def _require_parameters(parameters: ArmParameters) -> ArmParameters:
    if not isinstance(parameters, ArmParameters):
        raise InvalidArgumentError(
            f"the parameters are {shown(parameters)}; give what load_parameters() returns"
        )
    return parameters
