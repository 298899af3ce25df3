"""The interfaces of the controlled joints, read and written as a whole."""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import attrgetter

from bioscara.control.controllers.joint_trajectory.pid import Pid
from bioscara.hardware import POSITION, VELOCITY, CommandInterface, StateInterface
from bioscara.planning import Sample

_new = tuple.__new__
_value = attrgetter("value")
_SENT = 1e-5
"""Distance from its end at which a position counts as sent [rad or m]: averages leave a rest."""
_OLDEST = 0.1
"""Age up to which a measurement is compared with the past [s]; a watchdog acts long before."""


class Handles:
    """Measured states and commands of all joints, in the controller's order.

    Args:
        commands: Claimed command interfaces, kind after kind.
        states: State interfaces, kind after kind; positions first.
        count: Number of joints.

    Attributes:
        commands: As given.
    """

    __slots__ = (
        "_nothing", "_position_states", "_positions", "_velocities", "_velocity_states", "commands",
    )  # fmt: skip

    def __init__(
        self,
        commands: Sequence[CommandInterface],
        states: Sequence[StateInterface],
        count: int,
    ) -> None:
        self.commands = tuple(commands)
        self._positions = tuple(each for each in commands if each.kind == POSITION)
        self._velocities = tuple(each for each in commands if each.kind == VELOCITY)
        self._position_states, self._velocity_states = tuple(states[:count]), tuple(states[count:])
        self._nothing = (0.0,) * count

    def measured(self) -> Sample:
        """Return the measured state; velocities that are not measured are 0."""
        positions = tuple(map(_value, self._position_states))
        velocities = tuple(map(_value, self._velocity_states))
        # Sample(...) takes twice as long.
        return _new(Sample, (positions, velocities or self._nothing, self._nothing))

    def commanded(self) -> tuple[float, ...]:
        """Return the position commands, or measured positions where there is none [rad or m]."""
        measured = [state.value for state in self._position_states]
        for index, handle in enumerate(self._positions):
            if math.isfinite(handle.value):
                measured[index] = handle.value
        return tuple(measured)

    def stand_at(self, end: Sequence[float], tolerance: float) -> bool:
        """Whether the joints stand, and were sent nothing but where they are to rest.

        Args:
            end: Where that is [rad or m].
            tolerance: Speed that counts as none [rad/s or m/s]; 0 for any.
        """
        if any(
            abs(handle.value - there) > _SENT
            for handle, there in zip(self._positions, end, strict=False)
        ):
            return False
        sent = () if self._positions else self._velocities
        speeds = [each.value for each in (*self._velocity_states, *sent)]
        return not tolerance or all(abs(speed) <= tolerance for speed in speeds)

    def fully_commanded(self) -> bool:
        """Whether positions are commanded and every command is a number."""
        return bool(self._positions) and all(math.isfinite(each.value) for each in self.commands)

    def error(self, desired: Sample, actual: Sample, pace: float, time: float) -> Sample:
        """Return desired minus actual, each joint at the time at which it was measured.

        Args:
            desired: At ``time``; derivatives by the trajectory's time.
            actual: As measured.
            pace: Trajectory time per time.
            time: Now [s].
        """
        positions, velocities = [], []
        measured, rates, _ = actual
        for state, there, speed, change, here, going in zip(
            self._position_states, *desired, measured, rates, strict=True
        ):
            age = time - state.stamp
            age = (_OLDEST if age > _OLDEST else age) * pace if age > 0.0 else 0.0
            positions.append(there - age * (speed - 0.5 * age * change) - here)
            velocities.append((speed - age * change) * pace - going)
        return _new(Sample, (tuple(positions), tuple(velocities), self._nothing))

    def write(self, ahead: Sample, pace: float) -> None:
        """Command positions, and velocities where they are claimed too."""
        positions, velocities, _ = ahead
        for handle, value in zip(self._positions, positions, strict=True):
            handle.value = value
        for handle, value in zip(self._velocities, velocities, strict=False):
            handle.value = value * pace

    def write_velocities(
        self,
        ahead: Sample,
        error: Sample,
        lags: Sequence[float],
        pids: Sequence[Pid],
        pace: float,
        period: float,
    ) -> None:
        """Command velocities alone: feed-forward and PID.

        Distances that averaged commands still cover are no errors.
        """
        off = zip(error.positions, error.velocities, lags, strict=True)
        for handle, pid, speed, (away, rate, lag) in zip(
            self._velocities, pids, ahead.velocities, off, strict=True
        ):
            forward = pid.gains.ff_velocity_scale * speed * pace
            handle.value = forward + pid.update(away - lag, rate, period)

    def stop(self) -> None:
        """Command velocity 0; positions stay as they are."""
        for handle in self._velocities:
            handle.value = 0.0
