"""The curve that the joints follow, and the trajectory's own time on it."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bioscara.arguments import number
from bioscara.control.controllers.joint_trajectory.braking import Braked, deceleration, standstill
from bioscara.control.controllers.joint_trajectory.interpolation import Interpolator, Place
from bioscara.control.controllers.joint_trajectory.parameters import JointTrajectoryParameters
from bioscara.control.controllers.joint_trajectory.requests import Request
from bioscara.control.controllers.joint_trajectory.splicing import Spliced
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
        share: Share of the chosen scaling to change to.
        collision_checked: Whether the trajectory that it follows, or followed before it held, is
            known to be clear.
    """

    def __init__(
        self,
        parameters: JointTrajectoryParameters,
        period: float,
        positions: Sequence[float],
        time: float,
    ) -> None:
        self._desired_start = parameters.interpolate_from_desired_state
        self._splices = parameters.allow_trajectory_replacement
        self._period, self._now = period, time
        self.scaling = self._wanted_scaling = parameters.speed_scaling.initial_scaling_factor
        self.share, self.collision_checked = 1.0, True
        self._least, self._rate = parameters.constraints.least_time_on_cancel, 0.0
        self.waiting: Request | None = None
        self.hold(positions, time)

    @property
    def pace(self) -> float:
        """Time on the course per time; holding is not scaled."""
        return 1.0 if self.holding else self.scaling

    @property
    def at_rest(self) -> bool:
        """Whether it holds, and a ramp to rest has ended."""
        return self.holding and self.waiting is None and self.time >= self.course.duration

    def scale(self, factor: float) -> None:
        """Choose the share of the planned speed; in motion it changes gradually.

        Args:
            factor: 0 pauses; above 1 is faster than planned.

        Raises:
            GoalRejectedError: It is negative or not finite; the factor stays.
        """
        factor = number("speed scaling", factor, error=GoalRejectedError)
        if factor < 0.0:
            raise GoalRejectedError(f"speed scaling {factor:g} must not be negative")
        self._wanted_scaling = factor

    def advance(self, time: float, period: float, measured: Sample) -> Place:
        """Advance to a time, and return the desired state of the joints.

        Args:
            time: Now [s].
            period: Time since the last cycle [s].
            measured: Measured state of the joints.
        """
        # At rest the factor may step: the velocity does not, and motion starts with the new factor.
        at_rest = self.holding or self.time > self.course.duration
        self._scale(self._wanted_scaling * self.share, math.inf if at_rest else period)
        self.time += (time - self._now) * self.pace
        self._now = time
        if self.waiting is not None:
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
        values, _ = course.sample(at)
        self._commanded, self._commanded_pace = values, pace
        self._commanded_at = course, at
        self._commanded_time = self._now + self._period
        return values

    def hold(self, positions: Sequence[float], time: float) -> None:
        """Stay at ``positions`` [rad or m] from ``time`` [s] on."""
        self.course: Interpolator | Spliced | Braked = standstill(positions)
        self.holding, self.waiting = True, None
        self.time, self._now = 0.0, time
        self._commanded, self._commanded_pace = self.course.sample(0.0).values, 1.0
        self._commanded_at = self.course, 0.0
        self._commanded_time = time

    def rest(self, positions: Sequence[float]) -> None:
        """Stay at ``positions`` [rad or m] from now on."""
        self.hold(positions, self._now)

    def brake(self, limits: Sequence[float]) -> None:
        """Come to rest from the last command, at these decelerations [rad/s^2 or m/s^2].

        A collision-checked course stays on its path; else each joint comes to rest on its own.
        """
        pace, (course, at) = self._commanded_pace, self._commanded_at
        stop: Interpolator | Braked
        if self.collision_checked and course is self.course and isinstance(course, Interpolator):
            stop = Braked(course, at, pace, limits, self._period, self._least)
        else:
            speeds = tuple([velocity * pace for velocity in self._commanded.velocities])
            stop = deceleration(self._commanded._replace(velocities=speeds), limits)
        # The state is changed last: a call that is interrupted before can be repeated.
        self.course, self.time = stop, self._now - self._commanded_time
        self.holding, self.waiting = True, None

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
        course, stamp, missing, collision_checked = request
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
        if bridge and missing and not isinstance(running, Braked):
            self.course = Spliced(course, missing, running, self.time - begin)
        # If it begins in motion, the path to its first point was not planned.
        self.collision_checked = collision_checked and not bridge
        self.time, self.waiting, self.holding = begin, None, False
