"""The joint trajectory controller."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Mapping, Sequence

from bioscara.arguments import number
from bioscara.control.controllers.controller import WARNINGS, Controller, interfaces
from bioscara.control.controllers.goal_handle import GoalStatus
from bioscara.control.controllers.joint_trajectory.goal_conversion import (
    PreparedGoal,
    PreparedTrajectory,
    Request,
    accept,
    points_of,
    prepare,
)
from bioscara.control.controllers.joint_trajectory.goal_messages import (
    ControllerState,
    ErrorCode,
    Feedback,
    Goal,
    GoalHandle,
    JointTrajectory,
    Point,
)
from bioscara.control.controllers.joint_trajectory.goal_validation import plain, plain_goal
from bioscara.control.controllers.joint_trajectory.interfaces import Handles
from bioscara.control.controllers.joint_trajectory.pid import Gains, Pid
from bioscara.control.controllers.joint_trajectory.sampler import TrajectorySampler
from bioscara.control.controllers.joint_trajectory.stream import (
    LONGEST,
    Stream,
    StreamedPoint,
)
from bioscara.control.controllers.joint_trajectory.tolerances import (
    ToleranceMonitor,
    choose,
    defaults,
)
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.control.controllers.joint_trajectory.upsampling import timed
from bioscara.errors import GoalRejectedError
from bioscara.hardware import VELOCITY
from bioscara.planning import Sample

_new = tuple.__new__


class JointTrajectoryController(Controller[JointTrajectoryParameters]):
    """Follows trajectories, one at a time, and holds when there is none.

    The command of a cycle is the trajectory one cycle ahead; errors compare the measured state with
    the trajectory at the time of the measurement. A new trajectory takes over from a running one
    without a jump of position or velocity, as far as its first point allows.

    Attributes:
        goal: The goal that runs or ended last; None before the first.
        feedback: State of the joints in the last cycle, also while it holds; None while it is
            inactive.
        warnings: Messages about conditions that did not stop it; the latest.
    """

    TYPE = "joint_trajectory_controller/JointTrajectoryController"
    PARAMETERS = JointTrajectoryParameters

    def __init__(self, name: str, parameters: JointTrajectoryParameters) -> None:
        super().__init__(name, parameters)
        self.goal: GoalHandle | None = None
        self.feedback: Feedback | None = None
        self.warnings: deque[str] = deque(maxlen=WARNINGS)
        self._sampler: TrajectorySampler | None = None
        self._share = 1.0
        # Whether a cancelled goal waits for the joints to stand, and for how long they have.
        self._cancelled, self._stood = False, 0.0
        # Times of the points of a goal that is followed on another course than through these [s].
        self._asked: list[float] = []

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """Each commanded kind of all joints, one kind after the other."""
        return interfaces(self.parameters.joints, self.parameters.command_interfaces)

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        """Each measured kind of all joints, one kind after the other."""
        return interfaces(self.parameters.joints, self.parameters.state_interfaces)

    @property
    def holding(self) -> bool:
        """Whether it follows no trajectory."""
        return self._sampler is None or (self._sampler.holding and self._sampler.waiting is None)

    @property
    def at_rest(self) -> bool:
        """Whether the joints are commanded to stand, or it commands nothing."""
        return self._sampler is None or self._sampler.at_rest

    @property
    def scaling(self) -> float:
        """Current share of the planned speed."""
        return self._active().scaling

    @property
    def paused(self) -> bool:
        """Whether it rests on a trajectory at a scaling of 0; a factor above 0 continues it."""
        return self._sampler is not None and self._sampler.paused

    @property
    def controller_state(self) -> ControllerState | None:
        """State of its last cycle; None while it is inactive."""
        feedback = self.feedback
        if feedback is None:
            return None
        measured = len(self.parameters.state_interfaces)
        return ControllerState(
            feedback.time,
            self.parameters.joints,
            feedback.trajectory_time,
            feedback.desired,
            _first(feedback.actual, measured),
            _first(feedback.error, measured),
            {handle.name: handle.value for handle in self._handles.commands},
            self.scaling * self._active().speed,
        )

    @property
    def collision_checked(self) -> bool:
        """Whether the goal that it follows, or followed before it held, was collision-checked.

        Where velocities alone are commanded the joints do not keep to a path closely enough.
        """
        return self._sampler is None or (
            self._sampler.collision_checked and not self._velocity_only
        )

    @property
    def smooth(self) -> bool:
        """Whether that goal is carried out as it was checked, which includes averaging."""
        return self._sampler is None or self._sampler.smooth

    def on_collision_stop(self, reason: str, rest: Mapping[str, float]) -> None:
        """Abort a running goal, and hold where the arm comes to rest."""
        sampler = self._active()
        if not self.holding:
            self._end_goal(GoalStatus.ABORTED, ErrorCode.PATH_TOLERANCE_VIOLATED, reason)
        sampler.rest([rest[joint] for joint in self.parameters.joints])

    def abort_goal(self, reason: str) -> None:
        """End a running goal with INVALID_GOAL, as a deactivation does; the motion goes on."""
        self._end_goal(GoalStatus.ABORTED, ErrorCode.INVALID_GOAL, reason)

    def on_configure(self) -> None:
        """Check that the parameters are consistent."""
        parameters = self.parameters
        parameters.check(self.name)
        kinds = parameters.command_interfaces
        self._velocity_only = kinds == (VELOCITY,)
        self._pids = [Pid(Gains()) for _ in parameters.joints]
        velocity = VELOCITY in kinds and VELOCITY in parameters.state_interfaces
        self._monitor = ToleranceMonitor(parameters.joints, velocity=velocity)
        self.change(parameters)

    def change(self, parameters: JointTrajectoryParameters) -> None:
        """Take other parameters, at any time after it was configured.

        A running goal keeps the tolerances that it was accepted with.

        Args:
            parameters: Its own, :meth:`JointTrajectoryParameters.changed`.
        """
        self.parameters = parameters
        joints, constraints = parameters.joints, parameters.constraints
        for joint, pid in zip(joints, self._pids, strict=True):
            pid.gains = parameters.gains.get(joint, Gains())
        self._defaults = defaults(joints, constraints)
        timeout = parameters.cmd_timeout
        if 0.0 < timeout <= constraints.goal_time:
            self.warnings.append(
                f"{self.name}: cmd_timeout {timeout:g} s is ignored: it must be longer than "
                f"goal_time {constraints.goal_time:g} s"
            )
            timeout = 0.0
        self._monitor.timeout, self._monitor.stopped_time = timeout, constraints.stopped_time
        if self._running is None:
            self._monitor.tolerances = self._defaults
        if self._sampler is not None:
            self._sampler.change(parameters)

    def on_activate(self, time: float) -> None:
        """Hold the last commands where they are known, else the measured positions."""
        parameters = self.parameters
        handles = Handles(self.command_handles, self.state_handles, len(parameters.joints))
        for pid in self._pids:
            pid.reset()
        last = parameters.set_last_command_interface_value_as_state_on_activation
        known = last and handles.fully_commanded()
        held = handles.commanded() if known else handles.measured().positions
        self._handles = handles
        self._sampler = TrajectorySampler(parameters, self.nominal_period, held, time)
        self._sampler.share = self._share

    def on_deactivate(self, time: float) -> None:
        """Abort a running goal; positions stay as commanded, velocities become 0."""
        self._end_goal(
            GoalStatus.ABORTED,
            ErrorCode.INVALID_GOAL,
            "Current goal cancelled during deactivate transition.",
        )
        self._sampler = self.feedback = None
        self._handles.stop()

    def set_scaling(self, factor: float) -> None:
        """Choose the share of the planned speed; in motion it changes gradually.

        0 pauses: the joints come to rest on their path, as fast as a cancel of a collision-checked
        goal stops them. The goal then stays active, but does not end for being reached or late;
        a factor above 0 continues it, once the joints have come to rest.

        Args:
            factor: 0 pauses; above 1 is faster than planned.

        Raises:
            GoalRejectedError: It is negative or not finite, or the controller is not active; the
                factor stays.
        """
        self._active().scale(factor)

    def slow_down(self, share: float) -> None:
        """Apply a share to the chosen speed, current or later, until another share is given.

        Args:
            share: 1 for the chosen speed itself.
        """
        self._share = number("speed share", share)
        if self._sampler is not None:
            self._sampler.share = self._share

    def prepare(self, goal: Goal, speed: float = 1.0) -> PreparedGoal:
        """Check the form of a goal, in any thread: with many points that takes some cycles.

        Args:
            goal: The goal.
            speed: Share of the speed that was asked for, which its trajectory has; reported only.

        Raises:
            GoalRejectedError: It cannot be followed.
        """
        goal = plain_goal(goal)
        trajectory = prepare(goal.trajectory, self.parameters)._replace(speed=speed)
        return PreparedGoal(goal, trajectory)

    @property
    def commanded(self) -> tuple[float, ...]:
        """Where the joints were sent to; where velocities alone are commanded, where they are."""
        self._active()
        return self._handles.commanded()

    def arranged(
        self, trajectory: PreparedTrajectory, positions: Sequence[float]
    ) -> Sequence[Point]:
        """Return the points of a trajectory with a value for each joint, in the controller's order.

        Args:
            trajectory: The trajectory.
            positions: Those of joints that it leaves out, and for integration [rad or m].

        Raises:
            GoalRejectedError: It ends in motion, which the parameters do not permit.
        """
        return points_of(trajectory, self.parameters, positions)

    def send_goal(self, goal: Goal | PreparedGoal, time: float) -> GoalHandle:
        """Accept a goal; a running one ends ABORTED.

        Args:
            goal: The goal to follow; prepared if the cycle that it is sent in must not be late.
            time: Now [s].

        Raises:
            GoalRejectedError: The controller is not active, or the goal breaks a rule; the running
                goal continues.
        """
        goal = goal if isinstance(goal, PreparedGoal) else self.prepare(goal)
        request = self._request(goal, time)
        self._active().waiting = request
        return self._replace(goal.goal, GoalStatus.EXECUTING)

    def accept_goal(self, goal: PreparedGoal, time: float) -> GoalHandle:
        """Accept a goal whose course is not known yet; come to rest, and wait for :meth:`begin`.

        Args:
            goal: The goal, prepared.
            time: Now [s].

        Raises:
            GoalRejectedError: As :meth:`send_goal`.
        """
        self._request(goal, time)
        sampler = self._active()
        if not self.holding:
            sampler.stop(self._handles.measured().positions, time)
        return self._replace(goal.goal, GoalStatus.ACCEPTED)

    def begin(self, handle: GoalHandle, course: PreparedGoal, time: float) -> None:
        """Begin an accepted goal on its course, at rest, unless it has ended or is cancelled.

        Args:
            handle: The goal.
            course: As it is to be carried out, from the commanded positions on, prepared.
            time: Now [s].

        Raises:
            GoalRejectedError: As :meth:`send_goal`.
        """
        if handle.status is not GoalStatus.ACCEPTED or self._cancelled:
            return
        self._active().waiting = self._request(course, time)
        self._asked = [point.time for point in handle.goal.trajectory.points]
        handle.status = GoalStatus.EXECUTING

    def refuse(self, handle: GoalHandle, reason: str) -> None:
        """End an accepted goal that cannot be begun; one that has ended is left alone."""
        if handle.status is GoalStatus.ACCEPTED:
            handle.end(GoalStatus.ABORTED, ErrorCode.INVALID_GOAL, reason)

    def _request(self, goal: PreparedGoal, time: float) -> Request:
        """Return the request of a goal; errors as :meth:`send_goal`."""
        self._active()
        time = number("the time", time, error=GoalRejectedError)
        request = accept(goal.trajectory, self.parameters, self._handles, self.limits, time)
        return request._replace(collision_checked=goal.goal.collision_checked)

    def _replace(self, goal: Goal, status: GoalStatus) -> GoalHandle:
        """End a running goal, as another one has been accepted; return that."""
        self._end_goal(
            GoalStatus.ABORTED,
            ErrorCode.INVALID_GOAL,
            "Current goal preempted by new incoming action.",
        )
        self._monitor.tolerances, warning = choose(goal, self.parameters.joints, self._defaults)
        if warning:
            self.warnings.append(f"{self.name}: {warning}")
        self._cancelled, self._asked = False, []
        self.goal = GoalHandle(goal, status)
        return self.goal

    def prepare_trajectory(
        self, trajectory: JointTrajectory, speed: float = 1.0
    ) -> PreparedTrajectory:
        """Check the form of a trajectory without a goal, otherwise as :meth:`prepare`."""
        trajectory, upsampling = plain(trajectory), self.parameters.positions_upsampling
        if upsampling.enable:
            trajectory = timed(trajectory, upsampling.policy_frequency)
        prepared = prepare(trajectory, self.parameters, smooth=upsampling.enable)
        return prepared._replace(speed=speed)

    def send_trajectory(
        self, trajectory: JointTrajectory | PreparedTrajectory, time: float
    ) -> None:
        """Accept a trajectory without a goal; a running goal is then evaluated on it.

        Args:
            trajectory: The trajectory to follow; prepared if the cycle must not be late.
            time: Now [s].

        Raises:
            GoalRejectedError: As :meth:`send_goal`.
        """
        sampler, parameters = self._active(), self.parameters
        if not isinstance(trajectory, PreparedTrajectory):
            trajectory = self.prepare_trajectory(trajectory)
        time = number("the time", time, error=GoalRejectedError)
        sampler.waiting = accept(trajectory, parameters, self._handles, self.limits, time)
        self._asked = []
        if self._running is None:
            self._monitor.tolerances = self._defaults

    def stream(self, time: float) -> Stream | None:
        """Return the stream that it follows, if that goes on at a time [s]."""
        sampler = self._active()
        course, going = sampler.course, not sampler.holding and sampler.waiting is None
        if going and isinstance(course, Stream) and time - course.arrived < LONGEST:
            return course
        return None

    def time_on_course(self, time: float) -> float:
        """Return the time on its course that belongs to a time of the arm [s]."""
        return self._active().time_on_course(time)

    def send_point(self, trajectory: PreparedTrajectory, point: StreamedPoint, time: float) -> None:
        """Accept a point of a stream; a running goal is then evaluated on that.

        Args:
            trajectory: As it was sent, prepared.
            point: The point, as it is followed.
            time: Now [s].

        Raises:
            GoalRejectedError: As :meth:`send_goal`.
        """
        sampler, parameters = self._active(), self.parameters
        accept(trajectory, parameters, self._handles, self.limits, time)
        stream = self.stream(time)
        if not sampler.wanted:
            return
        if stream is None:
            limits = [self.limits[name] for name in parameters.joints]
            stream = Stream(point.start, limits, point.windows, self.nominal_period)
            sampler.follow(stream)
        stream.add(sampler.time_on_course(point.time), point.positions, anew=point.anew)
        stream.arrived, self._asked = time, []
        if self._running is None:
            self._monitor.tolerances = self._defaults

    def cancel(self, time: float) -> None:
        """End the followed trajectory and come to rest; a running goal ends CANCELED then."""
        if not self.holding:
            self._active().stop(self._handles.measured().positions, time)
        self._cancelled, self._stood = self._running is not None, 0.0
        self._end_if_cancelled(0.0)

    def query_state(self, time: float) -> Sample:
        """Return the desired state of the joints at a time.

        Args:
            time: Within the followed trajectory [s, arm clock].

        Raises:
            GoalRejectedError: The controller is not active, or follows no trajectory.
            LimitError: The trajectory does not reach there.
        """
        sampler, time = self._active(), number("the time", time, error=GoalRejectedError)
        if sampler.holding:
            raise GoalRejectedError(f"{self.name} holds: there is no trajectory to ask about")
        return sampler.query(time, self.name)

    def update(self, time: float, period: float) -> None:
        """Command the trajectory one cycle ahead, and check its tolerances."""
        sampler, handles = self._active(), self._handles
        actual = handles.measured()
        desired, point = sampler.advance(time, period, actual)
        if self._asked:
            point = bisect_right(self._asked, sampler.time * sampler.speed)
        error = handles.error(desired, actual, sampler.pace, time)
        # Feedback(...) takes twice as long.
        feedback = _new(Feedback, (time, sampler.time, point, desired, actual, error))
        self.feedback = feedback
        if self.goal is not None and self.goal.status is GoalStatus.EXECUTING:
            self.goal.feedback = feedback
        if not sampler.holding:
            self._end_if_decided(sampler, error, time)
        elif self._cancelled:
            self._end_if_cancelled(period)
        ahead, pace = sampler.ahead(), sampler.commanded_pace
        if self._velocity_only:
            lags = tuple(map(self.lag_of, self.parameters.joints))
            handles.write_velocities(ahead, error, lags, self._pids, pace, period)
        else:
            handles.write(ahead, pace)

    def _end_if_decided(self, sampler: TrajectorySampler, error: Sample, time: float) -> None:
        """End the trajectory once it is reached or failed, and hold or come to rest."""
        overtime = sampler.time - sampler.course.duration
        # With a waiting request or a pause, path tolerances apply beyond the end too.
        if overtime < 0.0 or sampler.waiting is not None or not sampler.wanted:
            verdict = self._monitor.before_the_end(error, sampler.time)
        else:
            verdict = self._monitor.after_the_end(error, overtime, stopped=self._stopped(sampler))
        if verdict is None:
            return
        if verdict.status is GoalStatus.ABORTED and self._running is None:
            self.warnings.append(f"{self.name}: {verdict.text}")
        self._end_goal(*verdict)
        if verdict.status is GoalStatus.SUCCEEDED:
            sampler.hold(sampler.course.end, time)
        else:
            sampler.stop(self._handles.measured().positions, time)

    def _end_if_cancelled(self, period: float) -> None:
        """End a cancelled goal once the joints have stood for the time of the parameters."""
        still = self._active().at_rest and self._stopped(self._active())
        self._stood = self._stood + period if still else 0.0
        if self._cancelled and self._stood >= self.parameters.constraints.stopped_time:
            self._cancelled = False
            self._end_goal(GoalStatus.CANCELED)

    def _stopped(self, sampler: TrajectorySampler) -> bool:
        """Whether the joints stand at the end of the course, or the parameters do not ask."""
        constraints = self.parameters.constraints
        return not constraints.stopped_time or self._handles.stand_at(
            sampler.course.end, constraints.stopped_velocity_tolerance
        )

    @property
    def _running(self) -> GoalHandle | None:
        return None if self.goal is None or self.goal.done else self.goal

    def _active(self) -> TrajectorySampler:
        if self._sampler is None:
            raise GoalRejectedError(f"{self.name} is {self.state.label}: activate it first")
        return self._sampler

    def _end_goal(
        self, status: GoalStatus, code: ErrorCode = ErrorCode.SUCCESSFUL, text: str = ""
    ) -> None:
        running = self._running
        if running is not None:
            running.end(status, code, text)


def _first(values: Sample, count: int) -> Sample:
    """Return values with only the first ``count`` fields; the others are empty."""
    return Sample(*values[:count], *((),) * (3 - count))
