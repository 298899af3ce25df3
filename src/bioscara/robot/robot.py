"""The arm as one object."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from bioscara.bus import Bus
from bioscara.clock import Clock
from bioscara.control.faults import Fault
from bioscara.control.joint_state_broadcaster import JointStates
from bioscara.control.joint_trajectory import Status
from bioscara.control.supervisor import FaultState
from bioscara.drivers import Gripper, Joint
from bioscara.errors import (
    BioscaraError,
    HomingError,
    InvalidArgumentError,
    NotHomedError,
    NotInitializedError,
    TrajectoryError,
)
from bioscara.hardware import ArmHardware, GripperHardware, State
from bioscara.hardware.stopping import stop_and_disable
from bioscara.model import ArmParameters, load_parameters
from bioscara.planning import Trajectory, check, point_to_point
from bioscara.planning.tool_speed import REDUCED_SPEED, reduced
from bioscara.protocol import Flags
from bioscara.report import CycleRecord, Phase
from bioscara.robot.gripper import RobotGripper
from bioscara.robot.pacing import PacedClock
from bioscara.robot.records import Cancelled, Observe
from bioscara.robot.running import Motion
from bioscara.robot.stack import HOMING, TRAJECTORY, Stack
from bioscara.robot.wiring import kinematics_of, named, planning_limits, real_gripper, simulated

FAULTS = Path("faults")
"""Folder for the flight records of faults, unless another one is named."""
START_TOLERANCE = {"rad": math.radians(1.0), "m": 2e-3}
"""How far from its start a trajectory may find the arm: from there it is joined by a ramp."""


def _ignore(record: CycleRecord) -> None:
    pass


def _never() -> bool:
    return False


class Robot:
    """A Bioscara arm.

    Used as a context manager: entering opens the bus and greets the joints, and nothing moves;
    leaving stops and disables them all, whatever happened. Every method returns when what it
    started has ended; only :meth:`stop` may be called from another thread meanwhile.

    Args:
        bus: What the joints are on; closed in the end.
        clock: The arm's time.
        parameters: The arm as data.
        description: Which arm on which bus, in words.
        gripper: The driver of the gripper; None for the computer's own PWM output.
        servo: What is behind that driver in simulation; kept for as long as the robot is.
        rate: Control cycles per second [Hz]; None for what suits the joints.
        evidence: Folder for the flight records of faults.
        full_speed: False keeps the tool at or below 250 mm/s, whatever is asked for.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.

    Attributes:
        bus: What the joints are on.
        clock: The arm's time.
        parameters: The arm as data.
        description: Which arm on which bus, in words.
        kinematics: Of the arm with its tool.
        gripper: The gripper.
        full_speed: As given; may be changed while nothing moves.
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
        self.parameters, self.clock, self.description = parameters, clock, description
        self.bus = bus
        self._arm = ArmHardware("bioscara_arm", bus, clock, parameters.joints)
        self._jaws = GripperHardware(
            "bioscara_gripper", "gripper", gripper or real_gripper(parameters, clock), clock
        )
        self._servo = servo
        self.kinematics = kinematics_of(parameters)
        self._limits = planning_limits(parameters)
        self.gripper = RobotGripper(
            self._jaws, self._running, lambda: self._motion(_ignore, _never), clock.now
        )
        self._pace_homing, self._pace_motion = pace_homing, pace_motion
        self._rate, self._evidence = rate, evidence
        self.full_speed = full_speed
        self._stack: Stack | None = None
        self._stopping = threading.Event()
        self._begin = clock.now()

    @classmethod
    def simulated(
        cls,
        parameters: ArmParameters | None = None,
        *,
        v1: bool = False,
        seed: int = 0,
        evidence: Path = FAULTS,
        full_speed: bool = False,
        pace_homing: bool = False,
        pace_motion: bool = False,
    ) -> Self:
        """Return an arm that is simulated in this process: its firmware, its physics, its time.

        Args:
            parameters: The arm as data; the committed ones by default.
            v1: Whether its joints speak protocol version 1 only, as existing arms do.
            seed: Seed of everything random in it.
            evidence: Folder for the flight records of faults.
            full_speed: False keeps the tool at or below 250 mm/s.
            pace_homing: Whether homing takes as long as on the arm.
            pace_motion: Whether motion takes as long as on the arm.
        """
        parameters = parameters or load_parameters()
        wiring = simulated(parameters, v1=v1, seed=seed)
        return cls(
            wiring.bus,
            wiring.clock,
            parameters,
            wiring.description,
            gripper=wiring.gripper,
            servo=wiring.servo,
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
            parameters: The arm as data; the committed ones by default.
            rate: Control cycles per second [Hz]; None for what suits the joints.
            evidence: Folder for the flight records of faults.
            full_speed: False keeps the tool at or below 250 mm/s.

        Raises:
            InvalidArgumentError: No bus has such a name.
        """
        parameters = parameters or load_parameters()
        wiring = named(name, parameters)
        return cls(
            wiring.bus,
            wiring.clock,
            parameters,
            wiring.description,
            gripper=wiring.gripper,
            servo=wiring.servo,
            rate=rate,
            evidence=evidence,
            full_speed=full_speed,
        )

    def __enter__(self) -> Self:
        try:
            self._arm.configure()
            self._stack = Stack(
                self._arm,
                self._jaws,
                self.kinematics,
                self.clock,
                self.parameters,
                self._rate,
                self._evidence,
            )
            self._stack.broadcast(self.clock.now())
        except BaseException:
            self.bus.close()
            raise
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            self.shutdown()
        finally:
            self.bus.close()

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The drivers of the joints."""
        return self._arm.joints

    @property
    def state(self) -> JointStates:
        """What the joints are seen to do; asks them."""
        stack = self._running()
        states = stack.broadcaster.states
        # In a motion the last cycle is a moment ago; else nobody has asked the joints since.
        if states is None or self.clock.now() - states.time > 2.0 * stack.loop.period:
            self._cycle()
            states = stack.broadcaster.states
        if states is None:
            raise BioscaraError("the joint states are not told: the broadcaster is not active")
        return states

    @property
    def faults(self) -> tuple[Fault, ...]:
        """What stopped the arm and is not recovered from, first cause first."""
        return tuple(self._running().supervisor.faults)

    @property
    def period(self) -> float:
        """Time between two setpoints [s]."""
        return self._running().loop.period

    def enable(self) -> None:
        """Engage all joints where they stand; nothing moves.

        Raises:
            FaultedError: A fault is latched.
            BioscaraError: A joint did not engage; all are released.
        """
        stack = self._running()
        stack.supervisor.require_clear()
        if stack.arm.state is State.UNCONFIGURED:
            stack.arm.configure()
        if stack.arm.state is State.INACTIVE:
            stack.arm.activate()
            stack.loop.restart()
        stack.broadcast(self.clock.now())

    def disable(self) -> None:
        """Bring all joints to rest and release them; they stay homed."""
        stack = self._running()
        if stack.arm.state is State.ACTIVE:
            stack.manager.set_hardware_state(stack.arm.name, State.INACTIVE, self.clock.now())

    def home(
        self,
        observe: Observe = _ignore,
        cancelled: Cancelled = _never,
        *,
        timeout: float | None = None,
    ) -> None:
        """Home the joints that are not homed, in the order of the parameters.

        Args:
            observe: Takes a record of all joints each cycle.
            cancelled: Asked each cycle; True ends the homing.
            timeout: Longest time that it may take [s]; None for no bound but each joint's own.

        Raises:
            MotionCancelledError: It was asked to end; the arm is at rest.
            HomingError: A joint found no home that can be trusted.
            BioscaraError: As the drivers.
        """
        stack = self._running()
        self._pace(self._pace_homing)
        self._stopping.clear()
        self.enable()
        directions = {
            axis.name: axis.joint.parameters.homing.velocity
            for axis in stack.arm.axes
            if not axis.homed
        }
        if not directions:
            return
        stack.use(HOMING, self.clock.now())
        goal = stack.homing.send_goal(directions)
        self._motion(observe, cancelled, timeout).run(lambda: goal.done, Phase.HOMING)
        if goal.status is not Status.SUCCEEDED:
            raise HomingError(goal.text)
        stack.manager.switch(self.clock.now(), (), (HOMING,))

    def move_joints(
        self,
        positions: Sequence[float],
        speed: float = 1.0,
        observe: Observe = _ignore,
        cancelled: Cancelled = _never,
        *,
        timeout: float | None = None,
    ) -> None:
        """Move all joints to a place; they start and end together.

        Args:
            positions: One for each joint [rad or m].
            speed: Share of the speed limits to use, above 0 and at most 1.
            observe: Takes a record of all joints each cycle.
            cancelled: Asked each cycle; True ends the motion.
            timeout: Longest time that it may take [s]; None for no bound.

        Raises:
            TrajectoryError: A position is outside its limits or not finite; nothing moved.
            BioscaraError: As :meth:`follow`.
        """
        if len(positions) != len(self.joints):
            raise TrajectoryError(f"{len(positions)} positions for {len(self.joints)} joints")
        self._prepare()
        names, here = self._names, self._here()
        motion = point_to_point(names, here, positions, self._limits, speed=speed)
        motion = self._slowed(motion, here)
        self._motion(observe, cancelled, timeout).follow(motion, Phase.TRAJECTORY)

    def follow(
        self,
        trajectory: Trajectory,
        observe: Observe = _ignore,
        cancelled: Cancelled = _never,
        *,
        approach: bool = False,
        timeout: float | None = None,
    ) -> None:
        """Follow a trajectory.

        If anything ends it early, all joints that can still be reached ramp down together within
        their acceleration limits before this raises.

        Args:
            trajectory: For some or all of the joints; the others hold.
            observe: Takes a record of all joints each cycle.
            cancelled: Asked each cycle; True ends the motion.
            approach: Whether to go to its start on a planned motion from wherever the arm is.
            timeout: Longest time that all of it may take [s]; None for no bound.

        Raises:
            TrajectoryError: It breaks a limit, or starts too far from where the arm is; nothing
                moved.
            MotionCancelledError: It was asked to end; the arm is at rest.
            NotHomedError: A joint does not know its position.
            FaultedError: A fault is latched.
            GoalAbortedError: It was not followed to its end.
            BioscaraError: What stopped the arm.
        """
        check(trajectory, self.parameters.joints)
        self._prepare()
        here = self._here()
        start = dict(zip(trajectory.joint_names, trajectory.positions[0].tolist(), strict=True))
        goal = [start.get(name, where) for name, where in zip(self._names, here, strict=True)]
        if not approach:
            self._require_near(here, goal)
        lead = self._slowed(point_to_point(self._names, here, goal, self._limits), here)
        trajectory = self._slowed(trajectory, goal)
        motion = self._motion(observe, cancelled, timeout)
        motion.follow(lead, Phase.APPROACH, lead.duration)
        motion.follow(trajectory, Phase.TRAJECTORY)

    def stop(self) -> None:
        """End whatever moves, from any thread: it raises MotionCancelledError once at rest."""
        self._stopping.set()

    def clear_faults(self) -> list[str]:
        """Acknowledge the faults that joints latched before; nothing moves.

        Returns:
            A sentence for each.
        """
        return self._arm.clear_faults()

    def acknowledge(self) -> tuple[Fault, ...]:
        """Take note of the faults once the arm stands: writes their evidence; nothing moves.

        Raises:
            FaultedError: There is none.
            OSError: The evidence cannot be written.
        """
        stack = self._running()
        stack.loop.restart()
        while stack.supervisor.state is FaultState.STOPPING:
            stack.loop.step()
        return tuple(stack.supervisor.acknowledge())

    def recover(self) -> None:
        """Clear acknowledged faults; nothing moves, and :meth:`enable` comes next.

        Raises:
            FaultedError: They are not acknowledged.
            BioscaraError: A joint does not answer.
        """
        stack, now = self._running(), self.clock.now()
        stack.supervisor.recover(now)
        stack.broadcast(now)

    def shutdown(self) -> list[str]:
        """Stop and disable all joints; does nothing when that is done already.

        Returns:
            A sentence for each joint that could not be stopped or disabled.
        """
        stack, self._stack = self._stack, None
        if stack is None:
            return []
        if stack.arm.state is State.ACTIVE or any(
            not axis.joint.session.flags & Flags.NOTENABLED for axis in stack.arm.axes
        ):
            return stop_and_disable(self.joints)
        return []

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(joint.name for joint in self.parameters.joints)

    def _running(self) -> Stack:
        if self._stack is None:
            raise NotInitializedError("the robot is not connected: use it in a with statement")
        return self._stack

    def _pace(self, paced: bool) -> None:
        if isinstance(self.clock, PacedClock):
            self.clock.paced = paced

    def _prepare(self) -> None:
        """Make the arm ready to follow a trajectory; nothing moves."""
        stack = self._running()
        self._pace(self._pace_motion)
        self._stopping.clear()
        self.enable()
        stack.tool_speed.limit = math.inf if self.full_speed else REDUCED_SPEED
        for axis in stack.arm.axes:
            if not axis.homed:
                raise NotHomedError(
                    f"{axis.name} is not homed: its position is unknown; home() first", axis.name
                )
        self._cycle()
        stack.use(TRAJECTORY, self.clock.now())

    def _here(self) -> list[float]:
        """Return where the joints are; at an end stop they may read a hair beyond the limit."""
        return [
            min(max(axis.position.value, axis.lower), axis.upper)
            for axis in self._running().arm.axes
        ]

    def _require_near(self, here: Sequence[float], start: Sequence[float]) -> None:
        for joint, where, there in zip(self.parameters.joints, here, start, strict=True):
            limit = START_TOLERANCE[joint.unit]
            if abs(there - where) > limit:
                raise TrajectoryError(
                    f"{joint.name} is at {where:.4f} {joint.unit} and the trajectory starts at "
                    f"{there:.4f}: more than {limit:.4f} {joint.unit} apart; move_joints() there "
                    "first, or follow(..., approach=True)"
                )

    def _slowed(self, trajectory: Trajectory, here: Sequence[float]) -> Trajectory:
        """Return the trajectory at the speed that the tool may have."""
        if self.full_speed:
            return trajectory
        return reduced(trajectory, self.kinematics, here)[0]

    def _motion(
        self, observe: Observe, cancelled: Cancelled, timeout: float | None = None
    ) -> Motion:
        if timeout is not None and not timeout > 0.0:
            raise InvalidArgumentError(f"timeout {timeout} s must be above zero")
        stack, clock = self._running(), self.clock
        return Motion(stack, clock, self._begin, observe, cancelled, self._stopping, timeout)

    def _cycle(self) -> None:
        stack = self._running()
        stack.loop.restart()
        stack.loop.step()
