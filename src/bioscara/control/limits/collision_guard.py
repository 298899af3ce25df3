"""Keeps the arm clear of zones, table and itself, independent of the source of the commands.

Planned motions and jogs have their path checked already and are not checked again. Any other
command must leave the arm in a state from which it can come to rest clear of everything; where it
does not, the arm comes to rest from the state before, on the path that was found clear then.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, MutableSequence, Sequence
from typing import ClassVar, NamedTuple

from bioscara.control.braking import braking_duration, braking_way, ramp
from bioscara.control.limits.averaging import Smoothing
from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.control.limits.limiter import CommandSource, Property
from bioscara.errors import InvalidArgumentError, ZoneError
from bioscara.kinematics import Scara
from bioscara.planning.arrays import Array
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.stop_guard import StopGuard
from bioscara.planning.collision.swept import COARSE

Values = tuple[float, ...]

_QUIET = 1.0
"""Time without braking after which braking for the same reason is reported again [s]."""


class CollisionGuard:
    """Brakes all joints together before the arm comes too near to an obstacle.

    Motions that are verified clear are so from rest. Where one takes over from an unverified
    command in motion, it is checked until the arm rests.

    Args:
        joints: All joints of the arm, j1 to j4.
        kinematics: The arm with its tool.
        scene: Scene that it must keep clear of.
        smoothing: Averages the sent commands after this stage.
        warnings: Takes a message when a source of commands is stopped.

    Attributes:
        kinematics: As given; may be changed at rest.
        scene: As given; may be changed at rest.
        interventions: In how many cycles it braked.
    """

    CONCERNS: ClassVar[Property] = "collision_checked"

    def __init__(
        self,
        joints: Sequence[JointLimiter],
        kinematics: Scara,
        scene: Scene,
        smoothing: Smoothing,
        warnings: MutableSequence[str],
    ) -> None:
        self._joints, self.kinematics, self.scene = tuple(joints), kinematics, scene
        self._smoothing, self._warnings = smoothing, warnings
        self._stop_guard: StopGuard | None = None
        self._stop: _Stop | None = None
        self._checking = self._starting_together = False
        self._before: tuple[Values, Values] = ((), ())
        self._stop_commands: list[tuple[float, bool] | None] = []
        self._path: _StoppingPath | None = None
        self._spare = 0.0
        self._last_warning, self._since_stop = "", math.inf
        self.interventions = 0

    def prepare(self, period: float, unchecked: Sequence[CommandSource]) -> None:
        """Remember the state before the cycle, if it has to be checked.

        Args:
            period: Time since the last cycle [s].
            unchecked: Sources whose commands are checked here.
        """
        if unchecked:
            self._checking = True
        if self._checking:
            self._before = self._state()
            if self._stop is not None and self._commanded() != self._stop_commands:
                # Joints were released in between, or their positions are commanded instead of their
                # velocities, with which they do not stay on the path of the stop that was begun.
                self._stop = None
            if self._starting_together and self._stop is None:
                self._start_together(period)

    def apply(self, period: float, unchecked: Sequence[CommandSource]) -> None:
        """Brake where necessary; to be called after all other bounds.

        Args:
            period: Time since the last cycle [s].
            unchecked: Sources whose commands are checked here.
        """
        if not self._checking:
            return
        self._since_stop += period
        if self._stop is None:
            reason = self._refusal(period)
            if reason:
                self._path = None
                self._stop, self._starting_together = self._stop_from_before(period), True
                self._report(reason, self._stop.rest, unchecked)
            elif self._smoothing.awaits_rest:
                self._stop = self._stop_from_before(period)
        if self._stop is not None:
            self.interventions += 1
            self._since_stop = 0.0
            ended = self._stop.step(period)
            self._stop_commands = self._commanded()
            if ended:
                self._stop = None
        elif not unchecked and not any(self._state()[1]):
            # Verified motions move the arm from now on, and may leave it anywhere.
            self._checking = self._starting_together = False
            self._stop_guard = self._path = None

    def _stop_from_before(self, period: float) -> _Stop:
        return _Stop(self._joints, *self._before, period)

    def _state(self) -> tuple[Values, Values]:
        """Return commanded positions and velocities; other joints as measured, at rest."""
        here, speeds = zip(*[joint.state for joint in self._joints], strict=True)
        return here, speeds

    def _commanded(self) -> list[tuple[float, bool] | None]:
        """Return position and kind of each joint's command, None for those without one."""
        return [
            (joint.reference, joint.velocity_alone) if joint.commanded else None
            for joint in self._joints
        ]

    def _refusal(self, period: float) -> str:
        """Return why the arm may not continue to the commanded state; empty if it may."""
        before, (here, speeds) = self._before[0], self._state()
        if here == before and not any(speeds):
            return ""
        kinematics, scene = self.kinematics, self.scene
        checker, joints, smoothing = self._stop_guard, self._joints, self._smoothing
        if checker is None or checker.kinematics is not kinematics or checker.scene is not scene:
            checker = self._stop_guard = StopGuard(kinematics, scene)
            self._path = None
        duration = _braking_time(joints, speeds)
        way = braking_way(duration, period)
        reactions, together = (0.0,) * len(joints), True
        for joint in joints:
            if not joint.stops_inside(way):
                reactions = tuple([each.reaction(period) for each in joints])
                together = self._inside(way, reactions) and _at_once(reactions, speeds)
                break
        averaged = smoothing.active
        path = _StoppingPath(here, speeds, duration, max(reactions), averaged, together)
        self._spare -= self._deviation(path, period)
        self._path = path
        if self._spare > 0.0:
            return ""
        rest = self._rest(way, reactions)
        corners: Sequence[Sequence[float]] | Array = [before, here, rest]
        states = [here, rest]
        if averaged:
            # The sent commands lag behind the bounded ones and round their corners.
            corners = smoothing.stopping_path(speeds, duration, period, rest)
            states += smoothing.recent_bounds()
        try:
            self._spare = checker.check(corners, states, together=together)
        except ZoneError as error:
            return (
                f"{error.link} would come nearer to {error.zone} than the margin of "
                f"{1e3 * error.margin:g} mm"
            )
        except InvalidArgumentError:
            unknown = [joint.name for joint in joints if not math.isfinite(joint.here)]
            return f"the position of {', '.join(unknown)} is unknown; home it first"
        self._starting_together = self._starting_together and self._spare < COARSE
        return ""

    def _inside(self, way: float, reactions: Values) -> bool:
        """Return whether all joints come to rest where none has to stop before the others."""
        ends = [
            joint.after(way + more) for joint, more in zip(self._joints, reactions, strict=True)
        ]
        return self._rest(way, reactions) == ends

    def _rest(self, way: float, reactions: Values) -> list[float]:
        """Return where the joints come to rest [rad or m].

        Args:
            way: Time in which their velocities would cover their braking distances [s].
            reactions: How long each continues before braking [s].
        """
        return [
            joint.within(joint.after(way + more))
            for joint, more in zip(self._joints, reactions, strict=True)
        ]

    def _deviation(self, path: _StoppingPath, period: float) -> float:
        """Return how far any point of the arm may be from the path of the last cycle [m].

        Both paths are compared at the same times: braking from before this cycle, and after it. An
        average of them differs by no more than they do.
        """
        last, checker = self._path, self._stop_guard
        if (
            last is None
            or checker is None
            or self._before != (last.here, last.speeds)
            or last[4:] != path[4:]
        ):
            return math.inf
        longer = abs(path.duration - last.duration) / 2.0 + abs(path.reaction - last.reaction)
        later = period + max(path.duration, last.duration) / 2.0 + path.reaction
        far = 0.0
        for reach, before, here, slow, speed in zip(
            checker.reach, last.here, path.here, last.speeds, path.speeds, strict=True
        ):
            jump = abs(here - before - speed * period)
            own = abs(slow) * (period + longer) + abs(speed - slow) * later
            far += reach * (jump + own)
        return far

    def _start_together(self, period: float) -> None:
        """Start all joints together towards the requested positions, in a straight line.

        Each alone, the fast joints would begin, and might turn towards the obstacle to leave.
        """
        joints = self._joints
        gaps, speeds = [joint.displacement for joint in joints], self._before[1]
        time = max(period, *map(_arrival, joints, gaps))
        changes = [
            gap / time + joint.requested_velocity - speed
            for joint, gap, speed in zip(joints, gaps, speeds, strict=True)
        ]
        share = 1.0 / max(
            1.0,
            *(
                abs(change) / (joint.max_acceleration * period)
                for joint, change in zip(joints, changes, strict=True)
            ),
        )
        for joint, change, speed in zip(joints, changes, speeds, strict=True):
            joint.request(speed + share * change, period)

    def _report(
        self, reason: str, rest: Mapping[str, float], unchecked: Sequence[CommandSource]
    ) -> None:
        """Report a stop to the sources of the commands and, if it is new, as a warning."""
        if not unchecked:
            return
        text = f"{', '.join(each.name for each in unchecked)} was stopped: {reason}"
        if text != self._last_warning or self._since_stop > _QUIET:
            self._warnings.append(text)
        self._last_warning = text
        for source in unchecked:
            source.on_collision_stop(text, rest)


class _StoppingPath(NamedTuple):
    """Motion in which the arm would come to rest from a state.

    Attributes:
        here: Positions of the joints [rad or m].
        speeds: Their velocities [rad/s or m/s].
        duration: How long they brake [s].
        reaction: How long they continue before braking, at most [s].
        averaged: Whether an average of this is sent.
        together: Whether they brake together.
    """

    here: Values
    speeds: Values
    duration: float
    reaction: float
    averaged: bool
    together: bool


class _Stop:
    """Stop of all joints together from a state; joints that would pass a limit stop sooner.

    Args:
        joints: The joints.
        positions: Their positions [rad or m].
        speeds: Their mean velocities in the cycle before [rad/s or m/s].
        period: Of that cycle [s].

    Attributes:
        rest: Where they come to rest, by name [rad or m].
    """

    def __init__(
        self,
        joints: Sequence[JointLimiter],
        positions: Sequence[float],
        speeds: Sequence[float],
        period: float,
    ) -> None:
        self._duration, self._begin = _braking_time(joints, speeds), 0.5 * period
        self._elapsed = self._begin
        self.rest: dict[str, float] = {}
        self._ramps = []
        for joint, position, speed in zip(joints, positions, speeds, strict=True):
            way = braking_way(self._duration, period)
            self.rest[joint.name] = rest = joint.within(position + speed * way)
            own = max((rest - position) / speed, 0.0) if speed else 0.0
            duration = braking_duration(own, period) if speed else 0.0
            self._ramps.append((joint, position, speed, duration))

    def step(self, period: float) -> bool:
        """Command one more cycle; return whether it is the last: one in which the arm stands."""
        before, self._elapsed = self._elapsed, self._elapsed + period
        for joint, position, speed, duration in self._ramps:
            first = ramp(self._begin, duration)
            start, end = ramp(before, duration) - first, ramp(self._elapsed, duration) - first
            left = max(1.0 - self._elapsed / duration, 0.0) if duration else 0.0
            mean = speed * (end - start) / period
            joint.replace_command(position + speed * end, mean, speed * left, period)
        return before >= self._duration


def _at_once(reactions: Sequence[float], speeds: Sequence[float]) -> bool:
    """Return whether all joints that move begin to brake at the same time."""
    return len({each for each, speed in zip(reactions, speeds, strict=True) if speed}) <= 1


def _braking_time(joints: Sequence[JointLimiter], speeds: Sequence[float]) -> float:
    """Return how long the joints take to come to rest together [s]."""
    return max(
        [abs(speed) / joint.max_acceleration for joint, speed in zip(joints, speeds, strict=True)]
    )


def _arrival(joint: JointLimiter, gap: float) -> float:
    """Return the shortest time in which a joint can cover a displacement [s]."""
    return max(abs(gap) / joint.max_velocity, math.sqrt(2.0 * abs(gap) / joint.max_acceleration))
