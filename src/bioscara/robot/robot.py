"""The arm as one object: homing and motion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from bioscara.arguments import flag, shown
from bioscara.control.controllers.goals import GoalStatus
from bioscara.errors import (
    HomingError,
    InvalidArgumentError,
    TrajectoryError,
)
from bioscara.planning import Trajectory
from bioscara.planning.motions.tool_speed import COMMANDED_SPEED, UNPLANNED_SHARE
from bioscara.report import Phase
from bioscara.robot.call_arbiter import exclusive
from bioscara.robot.connection import Connection
from bioscara.robot.homing_rules import joints_to_home
from bioscara.robot.planner import Plan
from bioscara.robot.pose_motions import PoseMotions, Velocity
from bioscara.robot.records import Cancelled, Observe, ignore, never
from bioscara.robot.running import SETTLING
from bioscara.robot.stack import HOMING, JOG, TRAJECTORY

START_TOLERANCE = {"rad": math.radians(1.0), "m": 2e-3}
"""Largest offset of the arm from a trajectory's start; a ramp leads from there to the start."""


_AT_START = 1e-4
"""Offset [rad or m] up to which the arm counts as being at the start of a trajectory."""


class Robot(Connection, PoseMotions):
    """A Bioscara arm.

    Used as a context manager: entering opens the bus and connects to the joints, and nothing moves;
    leaving always stops and disables all joints; joints for which that failed are reported by a
    HardwareError, or by notes on the exception that is being raised. Every method returns when the
    activity that it started has ended. One call at a time uses the arm: during that call any thread
    may read ``state``, ``pose`` and ``faults``, change ``speed``, and call :meth:`stop` and
    :meth:`shutdown`; everything else raises BusyError, also in the callbacks of the call itself.

    Created by :meth:`simulated` or :meth:`connect`.
    """

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
        stack = self._running()
        self._pace(self._pace_homing)
        motion = self._motion(observe, cancelled, timeout)
        self._engage()
        directions, notes = joints_to_home(stack.arm.axes)
        if not directions:
            return
        stack.supervisor.warnings.extend(notes)
        stack.use(HOMING, self.clock.now())
        goal = motion.pursue(lambda: stack.homing.send_goal(directions), Phase.HOMING)
        if goal.status is not GoalStatus.SUCCEEDED:
            raise HomingError(goal.text)
        stack.manager.switch(self.clock.now(), (), (HOMING,))

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
        self._carry_out(self.plan.joints(positions, speed), observe, cancelled, timeout)

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
        if not isinstance(plan, Plan) or not isinstance(plan.trajectory, Trajectory):
            raise InvalidArgumentError(
                f"execute() takes a Plan, not a {type(plan).__name__}; follow() takes a Trajectory"
            )
        self._follow(self._checked(plan.trajectory, planned=True), observe, cancelled, timeout)

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
        if not isinstance(trajectory, Trajectory):
            raise InvalidArgumentError(
                f"follow() takes a Trajectory, not a {type(trajectory).__name__}; execute() takes "
                "a Plan"
            )
        flag("approach", approach)
        checked = self._checked(trajectory)
        lead = self.plan.joints(self._start_of(trajectory)).trajectory if approach else None
        self._follow(checked, observe, cancelled, timeout, lead)

    @exclusive("jog()")
    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        observe: Observe = ignore,
        *,
        timeout: float | None = None,
    ) -> None:
        """As in :class:`~bioscara.robot.pose_motions.PoseMotions`."""
        if not callable(velocities):
            raise InvalidArgumentError(
                f"jog() is given {shown(velocities)}; give a function that returns the velocity, "
                "or None to end"
            )
        self.plan.here()
        self._ready()
        stack = self._running()
        guards = stack.manager.limiter.joints
        # Checks the start: a failing switch would report less, after others were deactivated.
        self.plan.jog([guards[name].here for name in self._names])
        stack.jog.prepare = self.plan.jog
        stack.use(JOG, self.clock.now())
        ended, since = False, math.inf

        def done() -> bool:
            nonlocal ended, since
            now, velocity = self.clock.now(), None if ended else velocities()
            ended = velocity is None
            if velocity is not None:
                stack.jog.command(velocity, now, self._speed)
            since = min(since, now) if ended and stack.jog.at_rest else math.inf
            return now - since >= SETTLING

        self._motion(observe, never, timeout).run(done, Phase.JOG)

    def _carry_out(
        self,
        plan: Plan,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        timeout: float | None = None,
    ) -> None:
        self._running().supervisor.warnings.extend(plan.notes)
        self._follow(plan.trajectory, observe, cancelled, timeout)

    def _checked(self, trajectory: Trajectory, *, planned: bool = False) -> Trajectory:
        """Return a trajectory checked against the current tool, speed limit and scene."""
        elsewhere = self._start_of(trajectory)
        checked = self.plan.trajectory(trajectory, elsewhere, planned=planned)
        self._running().supervisor.warnings.extend(checked.notes)
        return checked.trajectory

    def _ready(self) -> None:
        """Engage the arm and run one control cycle; nothing moves."""
        self._pace(self._pace_motion)
        self._engage()
        cap = self._running().tool_speed
        cap.limit = math.inf if self.full_speed else COMMANDED_SPEED
        cap.speed_of = self.plan.kinematics.tool_speed
        windows = self.plan.windows
        self._running().smoothing.windows = windows
        cap.share = UNPLANNED_SHARE
        cap.soon = (sum(windows) / 2.0, sum(windows))
        self._cycle()

    def _follow(
        self,
        trajectory: Trajectory,
        observe: Observe,
        cancelled: Cancelled,
        timeout: float | None,
        lead: Trajectory | None = None,
    ) -> None:
        """Follow a checked trajectory after a motion to its start."""
        if lead is None:
            lead = self._joining(trajectory)
        self._ready()
        self._running().use(TRAJECTORY, self.clock.now())
        motion = self._motion(observe, cancelled, timeout)
        if lead is not None:
            motion.follow(lead, Phase.APPROACH, lead.duration)
        motion.follow(trajectory, Phase.TRAJECTORY)

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(joint.name for joint in self.parameters.joints)

    def _start_of(self, trajectory: Trajectory) -> list[float]:
        """Return all joint positions at the start of a trajectory of some or all joints."""
        begin = dict(zip(self._names, self.plan.here(), strict=True))
        named = zip(trajectory.joint_names, trajectory.positions[0].tolist(), strict=True)
        return [*(begin | dict(named)).values()]

    def _joining(self, trajectory: Trajectory) -> Trajectory | None:
        """Return a trajectory from the arm to a start nearby; None if the arm is there."""
        here, begin = self.plan.here(), self._start_of(trajectory)
        self._require_near(here, begin)
        if max(abs(a - b) for a, b in zip(here, begin, strict=True)) <= _AT_START:
            return None
        return self.plan.joints(begin).trajectory

    def _require_near(self, here: Sequence[float], start: Sequence[float]) -> None:
        for joint, where, there in zip(self.parameters.joints, here, start, strict=True):
            limit = START_TOLERANCE[joint.unit]
            if abs(there - where) > limit:
                raise TrajectoryError(
                    f"{joint.name} is at {where:.4f} {joint.unit} and the trajectory starts at "
                    f"{there:.4f}: more than {limit:.4f} {joint.unit} apart; move_joints() there "
                    "first, or follow(..., approach=True)"
                )
