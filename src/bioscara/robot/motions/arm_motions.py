"""Homing, trajectories and jogging of an arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from bioscara.arguments import flag, number, shown
from bioscara.control.controllers.goals import GoalStatus
from bioscara.errors import HomingError, InvalidArgumentError, TrajectoryError
from bioscara.planning import Trajectory
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from bioscara.planning.motions.tool_speed import COMMANDED_SPEED, UNPLANNED_SHARE
from bioscara.report import Phase
from bioscara.robot.connection.arm_session import ArmSession
from bioscara.robot.connection.pacing import PacedClock
from bioscara.robot.connection.stack import HOMING, JOG, TRAJECTORY
from bioscara.robot.motions.cycle_recorder import Cancelled, Observe, ignore, never
from bioscara.robot.motions.execution import SETTLING, MotionExecution
from bioscara.robot.motions.homing_order import joints_to_home
from bioscara.robot.planner import Plan, Planner

Velocity = JointVelocity | ToolVelocity
"""Commanded velocity of a jog."""
START_TOLERANCE = {"rad": math.radians(1.0), "m": 2e-3}
"""Largest offset of the arm from a trajectory's start; a ramp leads from there to the start."""
_AT_START = 1e-4
"""Offset [rad or m] up to which the arm counts as being at the start of a trajectory."""


class ArmMotions:
    """Moves the arm; each method is part of a call that has exclusive use of it.

    Args:
        session: ArmSession of the arm.
        planner: Plans motions from the arm's current position.
        pace_homing: Whether simulated homing is held back to real time.
        pace_motion: Whether simulated motion is held back to real time.
    """

    def __init__(
        self, session: ArmSession, planner: Planner, *, pace_homing: bool, pace_motion: bool
    ) -> None:
        self._session, self._planner = session, planner
        self._pace_homing = flag("pace_homing", pace_homing)
        self._pace_motion = flag("pace_motion", pace_motion)
        self._names = tuple(joint.name for joint in session.parameters.joints)
        self._speed = 1.0

    @property
    def speed(self) -> float:
        """Share of the planned or jog speed, 0 to 1; any thread may change it."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        speed = number("speed", speed)
        if not 0.0 <= speed <= 1.0:
            raise InvalidArgumentError(f"speed {speed} is outside 0 .. 1")
        self._speed = speed

    def home(
        self,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        timeout: float | None = None,
    ) -> None:
        """Home the joints that are not homed, and those that must be homed again before them."""
        stack, clock = self._session.stack, self._session.clock
        self._pace(self._pace_homing)
        execution = MotionExecution(self._session, observe, cancelled, timeout)
        self._session.enable()
        directions, notes = joints_to_home(stack.arm.axes)
        if not directions:
            return
        stack.supervisor.warnings.extend(notes)
        stack.use(HOMING, clock.now())
        goal = execution.pursue(lambda: stack.homing.send_goal(directions), Phase.HOMING)
        if goal.status is not GoalStatus.SUCCEEDED:
            raise HomingError(goal.text)
        stack.manager.switch(clock.now(), (), (HOMING,))

    def execute(
        self,
        plan: Plan,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        timeout: float | None = None,
    ) -> None:
        """Execute a plan that was made earlier, after another check."""
        if not isinstance(plan, Plan) or not isinstance(plan.trajectory, Trajectory):
            raise InvalidArgumentError(
                f"execute() takes a Plan, not a {type(plan).__name__}; follow() takes a Trajectory"
            )
        checked = self._checked(plan.trajectory, planned=True)
        self._follow(checked, observe, cancelled, timeout)

    def execute_at_once(
        self,
        plan: Plan,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        timeout: float | None = None,
    ) -> None:
        """Execute a plan that was made in the same call, for which nothing can have changed."""
        self._session.stack.supervisor.warnings.extend(plan.notes)
        self._follow(plan.trajectory, observe, cancelled, timeout)

    def follow(
        self,
        trajectory: Trajectory,
        observe: Observe = ignore,
        cancelled: Cancelled = never,
        *,
        approach: bool = False,
        timeout: float | None = None,
    ) -> None:
        """Check and follow a trajectory."""
        if not isinstance(trajectory, Trajectory):
            raise InvalidArgumentError(
                f"follow() takes a Trajectory, not a {type(trajectory).__name__}; execute() takes "
                "a Plan"
            )
        flag("approach", approach)
        checked = self._checked(trajectory)
        ramp = self._planner.joints(self._start_of(trajectory)).trajectory if approach else None
        self._follow(checked, observe, cancelled, timeout, ramp)

    def jog(
        self,
        velocities: Callable[[], Velocity | None],
        observe: Observe = ignore,
        timeout: float | None = None,
    ) -> None:
        """Move by streamed velocities until the stream ends and the arm is at rest."""
        if not callable(velocities):
            raise InvalidArgumentError(
                f"jog() is given {shown(velocities)}; give a function that returns the velocity, "
                "or None to end"
            )
        self._planner.here()
        self.prepare()
        stack, clock = self._session.stack, self._session.clock
        guards = stack.manager.limiter.joints
        # Checks the start: a failing switch would report less, after others were deactivated.
        self._planner.jog([guards[name].here for name in self._names])
        stack.jog.prepare = self._planner.jog
        stack.use(JOG, clock.now())
        ended, since = False, math.inf

        def done() -> bool:
            nonlocal ended, since
            now, velocity = clock.now(), None if ended else velocities()
            ended = velocity is None
            if velocity is not None:
                stack.jog.command(velocity, now, self._speed)
            since = min(since, now) if ended and stack.jog.at_rest else math.inf
            return now - since >= SETTLING

        MotionExecution(self._session, observe, timeout=timeout).run(done, Phase.JOG)

    def prepare(self) -> None:
        """Enable the arm, set the speed limit of its tool, and run one control cycle."""
        self._pace(self._pace_motion)
        self._session.enable()
        stack, windows = self._session.stack, self._planner.windows
        cap = stack.tool_speed
        cap.limit = math.inf if self._planner.full_speed else COMMANDED_SPEED
        cap.speed_of = self._planner.kinematics.tool_speed
        stack.smoothing.windows = windows
        cap.share = UNPLANNED_SHARE
        cap.soon = (sum(windows) / 2.0, sum(windows))
        stack.cycle()

    def _pace(self, paced: bool) -> None:
        if isinstance(self._session.clock, PacedClock):
            self._session.clock.paced = paced

    def _checked(self, trajectory: Trajectory, *, planned: bool = False) -> Trajectory:
        """Return a trajectory checked against the current tool, speed limit and scene."""
        start = self._start_of(trajectory)
        checked = self._planner.trajectory(trajectory, start, planned=planned)
        self._session.stack.supervisor.warnings.extend(checked.notes)
        return checked.trajectory

    def _follow(
        self,
        trajectory: Trajectory,
        observe: Observe,
        cancelled: Cancelled,
        timeout: float | None,
        ramp: Trajectory | None = None,
    ) -> None:
        """Follow a checked trajectory after a ramp to its start."""
        if ramp is None:
            ramp = self._ramp_to(trajectory)
        self.prepare()
        self._session.stack.use(TRAJECTORY, self._session.clock.now())
        execution = MotionExecution(self._session, observe, cancelled, timeout)
        if ramp is not None:
            execution.follow(ramp, Phase.APPROACH, self._current_speed, ramp.duration)
        execution.follow(trajectory, Phase.TRAJECTORY, self._current_speed)

    def _current_speed(self) -> float:
        return self._speed

    def _start_of(self, trajectory: Trajectory) -> list[float]:
        """Return all joint positions at the start of a trajectory of some or all joints."""
        here = dict(zip(self._names, self._planner.here(), strict=True))
        named = zip(trajectory.joint_names, trajectory.positions[0].tolist(), strict=True)
        return [*(here | dict(named)).values()]

    def _ramp_to(self, trajectory: Trajectory) -> Trajectory | None:
        """Return a ramp from the arm to a start nearby; None if the arm is there."""
        here, start = self._planner.here(), self._start_of(trajectory)
        self._require_near(here, start)
        if max(abs(a - b) for a, b in zip(here, start, strict=True)) <= _AT_START:
            return None
        return self._planner.joints(start).trajectory

    def _require_near(self, here: Sequence[float], start: Sequence[float]) -> None:
        for joint, current, first in zip(self._session.parameters.joints, here, start, strict=True):
            limit = START_TOLERANCE[joint.unit]
            if abs(first - current) > limit:
                raise TrajectoryError(
                    f"{joint.name} is at {current:.4f} {joint.unit} and the trajectory starts at "
                    f"{first:.4f}: more than {limit:.4f} {joint.unit} apart; move_joints() there "
                    "first, or follow(..., approach=True)"
                )
