"""The curve that the joints follow, and the trajectory's own time on it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.arguments import number
from bioscara.control.controllers.joint_trajectory.braking import Braked, deceleration, standstill
from bioscara.control.controllers.joint_trajectory.goal_conversion import Request
from bioscara.control.controllers.joint_trajectory.interpolation import (
    Course,
    CurveState,
    Interpolator,
)
from bioscara.control.controllers.joint_trajectory.splicing import Spliced
from bioscara.control.controllers.joint_trajectory.stream import Stream
from bioscara.control.controllers.joint_trajectory.trajectory_parameters import (
    JointTrajectoryParameters,
)
from bioscara.errors import GoalRejectedError, LimitError
from bioscara.planning import Sample

_SCALING_RATE = 1.0
"""Rate at which the speed scaling changes [1/s]: a step of it would be a step of velocity."""


class TrajectorySampler:
    """Samples one course at a time; after it was stopped or has ended it holds.

    Args:
        parameters: Of the controller.
        period: Time from cycle to cycle [s].
        positions: The positions held at first [rad or m].
        time: Now [s].

    Attributes:
        course: The followed or held course.
        time: Time on the course [s].
        holding: Whether it follows no trajectory.
        waiting: The request to follow next, or None.
        scaling: Current share of the planned speed.
        commanded_pace: Time on the course per time at the last command.
        share: Share of the chosen scaling to change to.
        collision_checked: Whether the trajectory that it follows, or followed before it held, is
            known to be clear.
        speed: Share of the speed that was asked for, on the followed trajectory.
    """

    def __init__(
        self,
        parameters: JointTrajectoryParameters,
        period: float,
        positions: Sequence[float],
        time: float,
    ) -> None:
        self._desired_start = parameters.interpolate_from_desired_state
        self._period, self._now = period, time
        self.scaling = self._wanted_scaling = parameters.speed_scaling.initial_scaling_factor
        self.share, self.collision_checked, self.speed = 1.0, True, 1.0
        self._rate = 0.0
        self.change(parameters)
        self.waiting: Request | None = None
        self._pausing: Braked | None = None
        self._pausing_since = time
        self.course: Course
        self.time: float
        self._commanded_at: tuple[Course, float]
        self._commanded_time: float
        self.hold(positions, time)

    def change(self, parameters: JointTrajectoryParameters) -> None:
        """Take those parameters that may change; a ramp that has begun ends as it began."""
        self._splices = parameters.allow_trajectory_replacement
        self._decelerations = parameters.decelerations
        self._least = parameters.constraints.least_time_on_cancel

    @property
    def pace(self) -> float:
        """Time on the course per time; holding is not scaled."""
        return 1.0 if self.holding else self.scaling

    @property
    def at_rest(self) -> bool:
        """Whether it holds, and a ramp to rest has ended."""
        return self.holding and self.waiting is None and self.time >= self.course.duration

    @property
    def smooth(self) -> bool:
        """Whether its course, or that before it held, needs no averaging."""
        return self.collision_checked or isinstance(self.course, Stream)

    def time_on_course(self, time: float) -> float:
        """Return the time on the course that belongs to a time of the arm [s]."""
        return self.time + time - self._now

    @property
    def wanted(self) -> float:
        """Scaling to change to; 0 for a pause."""
        return self._wanted_scaling * self.share

    @property
    def paused(self) -> bool:
        """Whether it rests on a trajectory that a scaling above 0 continues."""
        return not (self.holding or self.wanted or self.scaling)

    def scale(self, factor: float) -> None:
        """Choose the share of the planned speed; in motion it changes gradually.

        0 brings the joints to rest as :meth:`brake` does, but on their path in any case; where
        there are no decelerations for that, it changes as any other share.

        Args:
            factor: 0 pauses; above 1 is faster than planned.

        Raises:
            GoalRejectedError: It is negative or not finite; the factor stays.
        """
        factor = number("speed scaling", factor, error=GoalRejectedError)
        if factor < 0.0:
            raise GoalRejectedError(f"speed scaling {factor:g} must not be negative")
        self._wanted_scaling = factor

    def advance(self, time: float, period: float, measured: Sample) -> CurveState:
        """Advance to a time, and return the desired state of the joints.

        Args:
            time: Now [s].
            period: Time since the last cycle [s].
            measured: Measured state of the joints.
        """
        # At rest the factor may step: the velocity does not, and motion starts with the new factor.
        at_rest = self.holding or self.time > self.course.duration
        in_motion = self.scaling and not at_rest and self._pausing is None
        if in_motion and not self.wanted and isinstance(self.course, Stream):
            # Its path from here on is not known: points that come later begin another one.
            self.brake()
        elif in_motion and not self.wanted and self._decelerations:
            self._pausing_since = self._commanded_time
            self._pausing, self._rate = self._braked(), 0.0
        if self._pausing is None:
            self._scale(self.wanted, math.inf if at_rest else period)
            self.time += (time - self._now) * self.pace
        else:
            self.time, self.scaling, _ = self._pausing.along(time - self._pausing_since)
            if not self.scaling:
                self._pausing = None
        self._now = time
        # A ramp to a pause ends on the course that it began on; the next one begins at rest.
        if self.waiting is not None and self._pausing is None:
            self._take(self.waiting, measured)
        return self.course.sample(self.time)

    def _scale(self, wanted: float, period: float) -> None:
        """Change to a scaling over a period [s]; smoothly if stops have a least duration."""
        left, least = wanted - self.scaling, self._least
        if not left and not self._rate:
            return  # as in most cycles
        if not least or math.isinf(period):
            change = _SCALING_RATE * period
            self.scaling += min(max(left, -change), change)
            self._rate = 0.0
            return
        bend = _SCALING_RATE / least
        rate = math.copysign(min(_SCALING_RATE, math.sqrt(2.0 * bend * abs(left))), left)
        self._rate += min(max(rate - self._rate, -bend * period), bend * period)
        change = self._rate * period
        if abs(left) <= max(abs(change), bend * period * period):
            change = left
        self.scaling += change

    def ahead(self) -> Sample:
        """Return the desired state one cycle from now, which is commanded now."""
        pace, course = self.pace, self.course
        at = self.time + self._period * pace
        if self._pausing is not None:
            at, pace, _ = self._pausing.along(self._now + self._period - self._pausing_since)
        values, _ = course.sample(at)
        self._commanded, self.commanded_pace = values, pace
        self._commanded_at = course, at
        self._commanded_time = self._now + self._period
        return values

    def follow(self, stream: Stream) -> None:
        """Follow a stream that begins at the last command."""
        self.course, self.time, self.speed = stream, self._now - self._commanded_time, 1.0
        self.holding, self.waiting, self._pausing = False, None, None
        self.collision_checked = False

    def hold(self, positions: Sequence[float], time: float) -> None:
        """Stay at ``positions`` [rad or m] from ``time`` [s] on."""
        self.course, self.speed = standstill(positions), 1.0
        self.holding, self.waiting, self._pausing = True, None, None
        self.time, self._now = 0.0, time
        self._commanded, self.commanded_pace = self.course.sample(0.0).values, 1.0
        self._commanded_at = self.course, 0.0
        self._commanded_time = time

    def rest(self, positions: Sequence[float]) -> None:
        """Stay at ``positions`` [rad or m] from now on."""
        self.hold(positions, self._now)

    def stop(self, positions: Sequence[float], time: float) -> None:
        """Come to rest: on a ramp where the parameters or a stream have one, else at positions.

        Args:
            positions: Of the joints, as measured [rad or m].
            time: Now [s].
        """
        if self._decelerations or isinstance(self.course, Stream):
            self.brake()
        else:
            self.hold(positions, time)

    def brake(self) -> None:
        """Come to rest from the last command, at the decelerations of the parameters.

        A stream ends at those of its joints. A collision-checked course stays on its path, and so
        does one that is on the ramp to a pause; else each joint comes to rest on its own.
        """
        course, since = self._commanded_at[0], self._commanded_time
        stop: Course
        if isinstance(self.course, Stream):
            self.course.stop()
            self.holding, self.waiting, self._pausing = True, None, None
            return
        if self._pausing is not None:
            stop, since = self._pausing, self._pausing_since
        elif self.collision_checked and course is self.course and isinstance(course, Interpolator):
            stop = self._braked()
        else:
            pace = self.commanded_pace
            speeds = tuple([velocity * pace for velocity in self._commanded.velocities])
            stop = deceleration(self._commanded._replace(velocities=speeds), self._decelerations)
        # The state is changed last: a call that is interrupted before can be repeated.
        self.course, self.time = stop, self._now - since
        self.holding, self.waiting, self._pausing = True, None, None

    def _braked(self) -> Braked:
        """Return the ramp to rest on the course from the last command."""
        course, at = self._commanded_at
        # Unchecked commands are averaged after the controller: the ramp need not be rounded here.
        least = self._least if self.collision_checked else 0.0
        return Braked(course, at, self.commanded_pace, self._decelerations, self._period, least)

    def query(self, time: float, controller: str) -> Sample:
        """Return the desired state of the joints at ``time`` [s].

        Raises:
            LimitError: The trajectory does not reach there.
        """
        at, course = self.time + (time - self._now) * self.pace, self.course
        if not course.begins <= at <= course.duration:
            what = f"time in the trajectory of {controller}"
            raise LimitError(what, at, course.begins, course.duration, "s")
        return course.sample(at).values

    def _take(self, request: Request, measured: Sample) -> None:
        """Begin the waiting request, unless the running trajectory is kept up to its start."""
        course, stamp, missing, collision_checked, speed = request
        running = self.course
        begin = self._now - stamp if stamp else 0.0
        bridge = self._splices and not self.holding and running.continuable
        if bridge and begin <= -self._period / 2.0:
            return
        if bridge:
            state = running.sample(self.time).values
        else:
            state = self._commanded if self._desired_start else measured
        course.begin(state, begin, bridge=bridge)
        self.course = course
        if bridge and missing and isinstance(running, Interpolator | Spliced):
            self.course = Spliced(course, missing, running, self.time - begin)
        # If it begins in motion, the path to its first point was not planned.
        self.collision_checked = collision_checked and not bridge
        self.time, self.waiting, self.holding, self.speed = begin, None, False, speed
