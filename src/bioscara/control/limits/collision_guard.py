"""Keeps the arm clear of zones, table and itself, independent of the source of the commands.

Planned motions and jogs have their path checked already and are not checked again. Any other
command must leave the arm in a state from which it can come to rest clear of everything; where it
does not, the arm comes to rest from the state before, on the path that was found clear then.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from bioscara.control.limits.averaging import Smoothing
from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.control.manager.manager import ControllerManager
from bioscara.errors import InvalidArgumentError, ZoneError
from bioscara.kinematics import Scara
from bioscara.planning.arrays import Array
from bioscara.planning.collision.scene import Scene
from bioscara.planning.collision.stop_guard import StopGuard
from bioscara.planning.collision.swept import COARSE

Values = tuple[float, ...]

_QUIET = 1.0
"""Time without braking after which braking for the same reason is reported again [s]."""


class Clearance:
    """Brakes all joints together before the arm comes too near to an obstacle.

    Motions that are verified clear are so from rest. Where one takes over from an unverified
    command in motion, it is checked until the arm rests.

    Args:
        guards: All joints of the arm, j1 to j4.
        manager: Knows the controllers that drive them.
        surroundings: Returns the arm with its tool, and the scene that it must keep clear of.
        smoothing: Averages the sent commands after this stage.

    Attributes:
        interventions: In how many cycles it braked.
    """

    def __init__(
        self,
        guards: Sequence[JointLimiter],
        manager: ControllerManager,
        surroundings: Callable[[], tuple[Scara, Scene]],
        smoothing: Smoothing | None = None,
    ) -> None:
        self._guards, self._manager = tuple(guards), manager
        self._surroundings, self._smoothing = surroundings, smoothing
        self._room: StopGuard | None = None
        self._stop: _Stop | None = None
        self._watching = self._leading = False
        self._before: tuple[Values, Values] = ((), ())
        self._left: list[float | None] = []
        self._path: _Path | None = None
        self._spare = 0.0
        self._told, self._since = "", math.inf
        self.interventions = 0

    def foresee(self, period: float) -> None:
        """Remember the state before the cycle, if it has to be checked.

        Args:
            period: Time since the last cycle [s].
        """
        for controller in self._manager.driving:
            if not controller.collision_checked:
                self._watching = True
                break
        if self._watching:
            self._before = self._state()
            if self._stop is not None and self._commanded() != self._left:
                # Joints were released in between: the stop that was begun does not apply any more.
                self._stop = None
            if self._leading and self._stop is None:
                self._lead(period)

    def apply(self, period: float) -> None:
        """Brake where necessary; to be called after all other bounds.

        Args:
            period: Time since the last cycle [s].
        """
        if not self._watching:
            return
        self._since += period
        if self._stop is None:
            reason = self._objection(period)
            if reason:
                self._path = None
                self._stop, self._leading = _Stop(self._guards, *self._before), True
                self._tell(reason, self._stop.rest)
            elif self._smoothing is not None and self._smoothing.waits:
                self._stop = _Stop(self._guards, *self._before)
        if self._stop is not None:
            self.interventions += 1
            self._since = 0.0
            ended = self._stop.go_on(period)
            self._left = self._commanded()
            if ended:
                self._stop = None
        elif all(each.collision_checked for each in self._manager.driving) and not any(
            self._state()[1]
        ):
            # Verified motions move the arm from now on, and may leave it anywhere.
            self._watching = self._leading = False
            self._room = self._path = None

    def _state(self) -> tuple[Values, Values]:
        """Return commanded positions and velocities; other joints as measured, at rest."""
        here, speeds = zip(*[guard.state for guard in self._guards], strict=True)
        return here, speeds

    def _commanded(self) -> list[float | None]:
        """Return the commanded position of each joint, None for those without a command."""
        return [guard.reference if guard.commanded else None for guard in self._guards]

    def _objection(self, period: float) -> str:
        """Return why the arm may not continue to the commanded state; empty if it may."""
        before, (here, speeds) = self._before[0], self._state()
        if here == before and not any(speeds):
            return ""
        arm, scene = self._surroundings()
        room, guards, smoothing = self._room, self._guards, self._smoothing
        if room is None or room.arm is not arm or room.scene is not scene:
            room = self._room = StopGuard(arm, scene)
            self._path = None
        duration = _braking(guards, speeds)
        half = duration / 2.0
        reactions, together = (0.0,) * len(guards), True
        for guard in guards:
            if not guard.stops_inside(half):
                reactions = tuple([guard.reaction(period) for guard in guards])
                together = self._inside(half, reactions) and _at_once(reactions, speeds)
                break
        averaged = smoothing is not None and smoothing.averages
        path = _Path(here, speeds, duration, max(reactions), averaged, together)
        self._spare -= self._strays(path, period)
        self._path = path
        if self._spare > 0.0:
            return ""
        rest = self._rest(half, reactions)
        corners: Sequence[Sequence[float]] | Array = [before, here, rest]
        states = [here, rest]
        if smoothing is not None and smoothing.averages:
            # The sent commands lag behind the bounded ones and round their corners.
            corners = smoothing.way(speeds, duration, period, rest)
            states += smoothing.within()
        try:
            self._spare = room.check(corners, states, together=together)
        except ZoneError as error:
            return (
                f"{error.link} would come nearer to {error.zone} than the margin of "
                f"{1e3 * error.margin:g} mm"
            )
        except InvalidArgumentError:
            unknown = [guard.name for guard in self._guards if not math.isfinite(guard.here)]
            return f"the position of {', '.join(unknown)} is unknown; home it first"
        self._leading = self._leading and self._spare < COARSE
        return ""

    def _inside(self, half: float, reactions: Values) -> bool:
        """Return whether all joints come to rest where none has to stop before the others."""
        ends = [
            guard.after(half + more) for guard, more in zip(self._guards, reactions, strict=True)
        ]
        return self._rest(half, reactions) == ends

    def _rest(self, half: float, reactions: Values) -> list[float]:
        """Return where the joints come to rest [rad or m].

        Args:
            half: Half of the time that they brake [s].
            reactions: How long each continues before braking [s].
        """
        return [
            guard.within(guard.after(half + more))
            for guard, more in zip(self._guards, reactions, strict=True)
        ]

    def _strays(self, path: _Path, period: float) -> float:
        """Return how far any point of the arm may be from the path of the last cycle [m].

        Both paths are compared at the same times: braking from before this cycle, and after it. An
        average of them differs by no more than they do.
        """
        last, room = self._path, self._room
        if (
            last is None
            or room is None
            or self._before != (last.here, last.speeds)
            or last[4:] != path[4:]
        ):
            return math.inf
        longer = abs(path.duration - last.duration) / 2.0 + abs(path.reaction - last.reaction)
        later = period + max(path.duration, last.duration) / 2.0 + path.reaction
        far = 0.0
        for reach, before, here, slow, speed in zip(
            room.reach, last.here, path.here, last.speeds, path.speeds, strict=True
        ):
            jump = abs(here - before - speed * period)
            own = abs(slow) * (period + longer) + abs(speed - slow) * later
            far += reach * (jump + own)
        return far

    def _lead(self, period: float) -> None:
        """Lead the joints to the request together: a request to move away does so at once.

        Each alone, the fast joints would begin, and might turn towards the obstacle to leave.
        """
        guards = self._guards
        gaps, speeds = [guard.gap for guard in guards], self._before[1]
        time = max(period, *map(_arrival, guards, gaps))
        changes = [
            gap / time + guard.asked_velocity - speed
            for guard, gap, speed in zip(guards, gaps, speeds, strict=True)
        ]
        share = 1.0 / max(
            1.0,
            *(
                abs(change) / (guard.acceleration * period)
                for guard, change in zip(guards, changes, strict=True)
            ),
        )
        for guard, change, speed in zip(guards, changes, speeds, strict=True):
            guard.ask(speed + share * change, period)

    def _tell(self, reason: str, rest: Mapping[str, float]) -> None:
        """Report why the arm is braked to the driving controllers and, if new, as a warning."""
        hindered = [each for each in self._manager.driving if not each.collision_checked]
        if not hindered:
            return
        text = f"{', '.join(each.name for each in hindered)} was stopped: {reason}"
        if text != self._told or self._since > _QUIET:
            self._manager.warnings.append(text)
        self._told = text
        for controller in hindered:
            controller.on_hindered(text, rest)


class _Path(NamedTuple):
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
        guards: The joints.
        places: Their positions [rad or m].
        speeds: Their velocities [rad/s or m/s].

    Attributes:
        rest: Where they come to rest, by name [rad or m].
    """

    def __init__(
        self, guards: Sequence[JointLimiter], places: Sequence[float], speeds: Sequence[float]
    ) -> None:
        self._duration, self._elapsed = _braking(guards, speeds), 0.0
        self.rest: dict[str, float] = {}
        self._ramps = []
        for guard, place, speed in zip(guards, places, speeds, strict=True):
            self.rest[guard.name] = rest = guard.within(place + speed * self._duration / 2.0)
            duration = 2.0 * (rest - place) / speed if speed else 0.0
            self._ramps.append((guard, place, speed, duration))

    def go_on(self, period: float) -> bool:
        """Command one more cycle; return whether it is the last: one in which the arm stands."""
        before, self._elapsed = self._elapsed, self._elapsed + period
        for guard, place, speed, duration in self._ramps:
            start, end = _ramp(before, duration), _ramp(self._elapsed, duration)
            left = max(1.0 - self._elapsed / duration, 0.0) if duration else 0.0
            guard.put(place + speed * end, speed * (end - start) / period, speed * left, period)
        return before >= self._duration


def _ramp(time: float, duration: float) -> float:
    """Return the time in which the initial speed would cover the displacement at ``time`` [s]."""
    at = min(time, duration)
    return at - at * at / (2.0 * duration) if duration else 0.0


def _at_once(reactions: Sequence[float], speeds: Sequence[float]) -> bool:
    """Return whether all joints that move begin to brake at the same time."""
    return len({each for each, speed in zip(reactions, speeds, strict=True) if speed}) <= 1


def _braking(guards: Sequence[JointLimiter], speeds: Sequence[float]) -> float:
    """Return how long the joints take to come to rest together [s]."""
    return max(
        [abs(speed) / guard.acceleration for guard, speed in zip(guards, speeds, strict=True)]
    )


def _arrival(guard: JointLimiter, gap: float) -> float:
    """Return the shortest time in which a joint can cover a displacement [s]."""
    return max(abs(gap) / guard.fastest, math.sqrt(2.0 * abs(gap) / guard.acceleration))
