"""The joint trajectory controller."""

from __future__ import annotations

import math

from bioscara.control.controller import Controller
from bioscara.control.joint_trajectory.course import Course
from bioscara.control.joint_trajectory.messages import (
    ErrorCode,
    Feedback,
    Goal,
    GoalHandle,
    JointTrajectory,
    JointValues,
    Point,
    Status,
)
from bioscara.control.joint_trajectory.parameters import JointTrajectoryParameters
from bioscara.control.joint_trajectory.pid import Gains, Pid
from bioscara.control.joint_trajectory.tolerances import Tolerances, choose, defaults, violated
from bioscara.control.joint_trajectory.validation import validate
from bioscara.errors import ConfigurationError, GoalRejectedError
from bioscara.hardware import POSITION, VELOCITY, CommandInterface, State

_SCALING_RATE = 1.0
"""How fast the speed scaling changes [1/s]: a step of it would be a step of velocity."""


class JointTrajectoryController(Controller[JointTrajectoryParameters]):
    """Follows trajectories, one at a time, and holds when there is none.

    What is commanded in a cycle is the trajectory one cycle ahead; errors compare what was
    measured with the trajectory at the time of the measurement.

    Attributes:
        goal: The goal that runs or ended last; None before the first.
        feedback: Where the joints were in the last cycle; kept while holding too.
        scaling: Share of the planned speed that is gone at now.
        warnings: What was worth saying but stopped nothing.
    """

    TYPE = "joint_trajectory_controller/JointTrajectoryController"
    PARAMETERS = JointTrajectoryParameters

    def __init__(self, name: str, parameters: JointTrajectoryParameters) -> None:
        super().__init__(name, parameters)
        self.goal: GoalHandle | None = None
        self.feedback: Feedback | None = None
        self.warnings: list[str] = []
        self.scaling = self._wanted_scaling = parameters.initial_scaling_factor
        self._time = self._last = 0.0
        self._holding = True

    @property
    def command_interfaces(self) -> tuple[str, ...]:
        """Each commanded kind of all joints, one kind after the other."""
        parameters = self.parameters
        return tuple(
            f"{j}/{kind}" for kind in parameters.command_interfaces for j in parameters.joints
        )

    @property
    def state_interfaces(self) -> tuple[str, ...]:
        """Each measured kind of all joints, one kind after the other."""
        parameters = self.parameters
        return tuple(
            f"{j}/{kind}" for kind in parameters.state_interfaces for j in parameters.joints
        )

    @property
    def holding(self) -> bool:
        """Whether it follows nothing."""
        return self._holding

    def on_configure(self) -> None:
        """Check that the parameters fit one another."""
        parameters, kinds = self.parameters, self.parameters.command_interfaces
        joints = parameters.joints
        if not joints or len(set(joints)) != len(joints):
            raise ConfigurationError(
                f"{self.name}: parameter joints must name at least one joint, none of them twice; "
                f"it is {list(joints)}"
            )
        if kinds not in ((POSITION,), (VELOCITY,), (POSITION, VELOCITY)):
            raise ConfigurationError(
                f"{self.name}: command_interfaces {list(kinds)}: it is position, velocity, or "
                "position and velocity"
            )
        measured = parameters.state_interfaces
        if measured not in ((POSITION,), (POSITION, VELOCITY)):
            raise ConfigurationError(
                f"{self.name}: state_interfaces {list(measured)}: it is position, or position and "
                "velocity"
            )
        if kinds == (VELOCITY,) and measured != (POSITION, VELOCITY):
            raise ConfigurationError(
                f"{self.name}: to command velocity alone, position and velocity must be measured"
            )
        for what, named in (
            ("gains", parameters.gains),
            ("constraints", parameters.constraints.joints),
        ):
            for joint in named:
                if joint not in joints:
                    raise ConfigurationError(f"{self.name}: {what} for {joint}, which is no joint")
        self._defaults = defaults(joints, parameters.constraints)
        self._velocity_error = VELOCITY in measured and VELOCITY in kinds
        self._pids = [Pid(parameters.gains.get(joint, Gains())) for joint in joints]
        self._check_timeout()

    def on_activate(self, time: float) -> None:
        """Hold: the last commands where they are known, else what is measured."""
        count = len(self.parameters.joints)
        kinds = self.parameters.command_interfaces
        handles = self.command_handles
        self._positions: tuple[CommandInterface, ...] = handles[:count] if POSITION in kinds else ()
        self._velocities: tuple[CommandInterface, ...] = (
            handles[-count:] if VELOCITY in kinds else ()
        )
        for pid in self._pids:
            pid.reset()
        self._tolerances: Tolerances = self._defaults
        self.scaling = self._wanted_scaling = self.parameters.initial_scaling_factor
        self._hold(time, self._state_to_hold())

    def on_deactivate(self, time: float) -> None:
        """Abort a goal that runs; positions stay as commanded, velocities become 0."""
        if self.goal is not None and not self.goal.done:
            self.goal.end(
                Status.ABORTED,
                ErrorCode.INVALID_GOAL,
                "Current goal cancelled during deactivate transition.",
            )
        for handle in self._velocities:
            handle.value = 0.0

    def set_scaling(self, factor: float) -> None:
        """Choose the share of the planned speed; it is gone over to gradually.

        Args:
            factor: 0 pauses; above 1 is faster than planned.

        Raises:
            GoalRejectedError: It is negative or not finite.
        """
        if not (math.isfinite(factor) and factor >= 0.0):
            raise GoalRejectedError(f"speed scaling {factor} must be finite and not negative")
        self._wanted_scaling = factor

    def send_goal(self, goal: Goal, time: float) -> GoalHandle:
        """Take a goal; one that runs ends ABORTED.

        Args:
            goal: What to follow.
            time: Now [s].

        Raises:
            GoalRejectedError: The controller is not active, or the goal breaks a rule; what runs
                goes on.
        """
        if self.state is not State.ACTIVE:
            raise GoalRejectedError(f"{self.name} is {self.state.label}: activate it first")
        points = self._validate(goal.trajectory, time)
        if self.goal is not None and not self.goal.done:
            self.goal.end(
                Status.ABORTED,
                ErrorCode.INVALID_GOAL,
                "Current goal preempted by new incoming action.",
            )
        self._tolerances, warning = choose(goal, self.parameters.joints, self._defaults)
        if warning:
            self.warnings.append(warning)
        self.goal = GoalHandle(goal)
        self._start(points, goal.trajectory.stamp, time)
        return self.goal

    def send_trajectory(self, trajectory: JointTrajectory, time: float) -> None:
        """Take a trajectory without a goal; a goal that runs is then judged on it.

        Raises:
            GoalRejectedError: As :meth:`send_goal`.
        """
        if self.state is not State.ACTIVE:
            raise GoalRejectedError(f"{self.name} is {self.state.label}: activate it first")
        points = self._validate(trajectory, time)
        self._tolerances = self._tolerances if self._goal_runs() else self._defaults
        self._start(points, trajectory.stamp, time)

    def cancel(self, time: float) -> None:
        """End what is followed and come to rest; a goal that runs ends CANCELED."""
        if self._goal_runs() and self.goal is not None:
            self.goal.end(Status.CANCELED)
        self._stop(time)

    def update(self, time: float, period: float) -> None:
        """Command the trajectory one cycle ahead, and judge how it is followed."""
        self._advance(time, period)
        course = self._course
        if not course.begun:
            course.begin(self._begin_state(), self._time)
        here = course.sample(self._time)
        step = self.nominal_period * self.scaling
        ahead = course.sample(self._time + step).values
        actual = self._measured()
        error = self._error(here.values, actual, time)
        self.feedback = Feedback(time, self._time, here.point, here.values, actual, error)
        if self._goal_runs() and self.goal is not None:
            self.goal.feedback = self.feedback
        if not self._holding and not self._judge(error, time):
            return
        self._write(ahead, here.values, error, period)

    def _advance(self, time: float, period: float) -> None:
        change = _SCALING_RATE * period
        difference = self._wanted_scaling - self.scaling
        self.scaling += min(max(difference, -change), change)
        # Neither the wait for a stamp nor the clock's own pace is scaled.
        elapsed = time - self._last
        self._time += elapsed * (self.scaling if self._time >= 0.0 else 1.0)
        self._last = time

    def _judge(self, error: JointValues, time: float) -> bool:
        """Return whether to go on; if not, the arm is brought to rest and nothing is written."""
        overtime = self._time - self._course.duration
        joints, tolerances = self.parameters.joints, self._tolerances
        if overtime < 0.0:
            broken = violated(tolerances.path, error, velocity=self._velocity_error)
            if broken is None:
                return True
            joint, off, limit = broken
            self._abort(
                time,
                ErrorCode.PATH_TOLERANCE_VIOLATED,
                f"Aborted due to path tolerance violation: {joints[joint]} is {off:.4g} off at "
                f"{self._time:.3f} s, {limit:.4g} is allowed",
            )
            return False
        broken = violated(tolerances.goal, error, velocity=self._velocity_error)
        if broken is None:
            if self._goal_runs() and self.goal is not None:
                self.goal.end(Status.SUCCEEDED, text="Goal successfully reached!")
            self._hold(time, self._course.sample(self._time).values)
            return True
        if 0.0 < tolerances.goal_time < overtime:
            joint, off, limit = broken
            self._abort(
                time,
                ErrorCode.GOAL_TOLERANCE_VIOLATED,
                f"Aborted due to goal_time_tolerance exceeding by "
                f"{overtime - tolerances.goal_time:.3f} s: {joints[joint]} is {off:.4g} off, "
                f"{limit:.4g} is allowed",
            )
            return False
        timeout = self.parameters.cmd_timeout
        if timeout > tolerances.goal_time and overtime > timeout:
            self.warnings.append(f"{self.name}: given up {timeout:g} s after the trajectory's end")
            self._stop(time)
            return False
        return True

    def _abort(self, time: float, code: ErrorCode, text: str) -> None:
        if self._goal_runs() and self.goal is not None:
            self.goal.end(Status.ABORTED, code, text)
        else:
            self.warnings.append(text)
        self._stop(time)

    def _write(
        self, ahead: JointValues, here: JointValues, error: JointValues, period: float
    ) -> None:
        for handle, value in zip(self._positions, ahead.positions, strict=False):
            handle.value = value
        if not self._velocities:
            return
        scaling = self.scaling
        if self._positions:
            for handle, value in zip(self._velocities, ahead.velocities, strict=True):
                handle.value = value * scaling
            return
        for index, (handle, pid) in enumerate(zip(self._velocities, self._pids, strict=True)):
            feed_forward = pid.gains.ff_velocity_scale * ahead.velocities[index] * scaling
            handle.value = feed_forward + pid.update(
                error.positions[index], error.velocities[index], period
            )

    def _validate(self, trajectory: JointTrajectory, time: float) -> tuple[Point, ...]:
        commanded = [state.value for state in self.state_handles[: len(self.parameters.joints)]]
        for index, handle in enumerate(self._positions):
            if math.isfinite(handle.value):
                commanded[index] = handle.value
        return validate(trajectory, self.parameters, time, commanded)

    def _start(self, points: tuple[Point, ...], stamp: float, time: float) -> None:
        kind = self.parameters.interpolation_method
        points = self._spliced(points, stamp, time)
        self._course = Course(points, interpolate=kind == "splines")
        self._holding = False
        self._time = min(time - stamp, 0.0) if stamp > time else (time - stamp if stamp else 0.0)
        self._last = time

    def _spliced(self, points: tuple[Point, ...], stamp: float, time: float) -> tuple[Point, ...]:
        return points

    def _hold(self, time: float, state: JointValues) -> None:
        nothing = (0.0,) * len(state.positions)
        self._course = Course([Point(0.0, state.positions)])
        self._course.begin(JointValues(state.positions, nothing, nothing), 0.0)
        self._holding = True
        self._time, self._last = 0.0, time

    def _stop(self, time: float) -> None:
        """Come to rest: on a ramp where the parameters ask for one, else where the joints are."""
        constraints = self.parameters.constraints
        limits = [
            constraints.joints[joint].max_deceleration_on_cancel
            if joint in constraints.joints
            else 0.0
            for joint in self.parameters.joints
        ]
        if not (constraints.decelerate_on_cancel and all(limits)):
            self._hold(time, self._measured())
            return
        state = self._course.sample(self._time).values if self._course.begun else self._measured()
        self._course = _ramp(state, self.scaling, limits)
        self._holding = True
        self._time, self._last = 0.0, time

    def _goal_runs(self) -> bool:
        return self.goal is not None and not self.goal.done

    def _state_to_hold(self) -> JointValues:
        measured = self._measured()
        last = tuple(handle.value for handle in self._positions)
        if (
            self.parameters.set_last_command_interface_value_as_state_on_activation
            and last
            and all(map(math.isfinite, last))
        ):
            return measured._replace(positions=last)
        return measured

    def _begin_state(self) -> JointValues:
        if self.parameters.interpolate_from_desired_state and self.feedback is not None:
            return self.feedback.desired
        return self._measured()

    def _measured(self) -> JointValues:
        count = len(self.parameters.joints)
        values = [handle.value for handle in self.state_handles]
        nothing = (0.0,) * count
        return JointValues(tuple(values[:count]), tuple(values[count:]) or nothing, nothing)

    def _error(self, desired: JointValues, actual: JointValues, time: float) -> JointValues:
        """Return desired minus actual, each joint at the time at which it was measured."""
        positions, velocities = [], []
        scaling = self.scaling
        for index, handle in enumerate(self.state_handles[: len(desired.positions)]):
            velocity = desired.velocities[index] * scaling
            acceleration = desired.accelerations[index] * scaling * scaling
            age = min(max(time - handle.stamp, 0.0), 0.1)
            then = desired.positions[index] - age * (velocity - age * acceleration / 2.0)
            positions.append(then - actual.positions[index])
            velocities.append(velocity - age * acceleration - actual.velocities[index])
        return JointValues(tuple(positions), tuple(velocities), (0.0,) * len(positions))

    def _check_timeout(self) -> None:
        parameters = self.parameters
        if 0.0 < parameters.cmd_timeout <= parameters.constraints.goal_time:
            self.warnings.append(
                f"{self.name}: cmd_timeout {parameters.cmd_timeout:g} s is ignored: it must be "
                f"longer than goal_time {parameters.constraints.goal_time:g} s"
            )


def _ramp(state: JointValues, scaling: float, limits: list[float]) -> Course:
    """Return constant decelerations to rest, one for each joint."""
    speeds = [velocity * scaling for velocity in state.velocities]
    times = [abs(speed) / limit for speed, limit in zip(speeds, limits, strict=True)]
    points = []
    for time in sorted({0.0, *times}):
        positions, velocities = [], []
        for start, speed, end in zip(state.positions, speeds, times, strict=True):
            at = min(time, end)
            positions.append(start + speed * at - (speed * at * at / (2.0 * end) if end else 0.0))
            velocities.append(speed * (1.0 - at / end) if end else 0.0)
        points.append(Point(time, tuple(positions), tuple(velocities)))
    course = Course(points)
    course.begin(JointValues(state.positions, tuple(speeds), (0.0,) * len(speeds)), 0.0)
    return course
