"""Monitoring of a joint's following error."""

from __future__ import annotations

import math

from bioscara.control.limits.joint_limiter import JointLimiter
from bioscara.errors import FollowingError
from bioscara.hardware.axis import Axis
from bioscara.hardware.command_modes import Mode
from bioscara.model import JointParameters

FLOOR_SHARE = 0.005
"""Error that is always allowed, as a share of the joint's range: backlash, load, friction."""
LAG = 0.05
"""Error that is allowed for each unit of speed [s]: a few cycles."""
_MARGIN = 1.3
"""Factor by which a version 1 joint may exceed the error of its control law."""
_MEMORY = 2.0
"""Time constant with which an earlier speed still counts [s]: the error of a fast motion
outlasts it."""


def allowed(limits: JointParameters, version: int, speed: float) -> float:
    """Return the permitted following error of a joint [rad or m].

    Args:
        limits: Of the joint.
        version: Of the protocol that it speaks.
        speed: Highest of the last seconds [rad/s or m/s].
    """
    error = FLOOR_SHARE * (limits.upper - limits.lower) + LAG * speed
    if version == 1:
        # It approaches each setpoint as if to rest there, so it trails by its braking distance.
        error += _MARGIN * speed**2 / (2.0 * limits.max_acceleration)
    return error


class Following:
    """Compares one joint with its position commands; the limit scales with the speed.

    Args:
        axis: The joint.
        guard: Holds its last command.
    """

    __slots__ = ("_axis", "_guard", "_peak")

    def __init__(self, axis: Axis, guard: JointLimiter) -> None:
        self._axis, self._guard = axis, guard
        self._peak = 0.0

    def check(self, time: float, period: float) -> FollowingError | None:
        """Return the error that exceeds the limit, or None.

        Args:
            time: Begin of the cycle whose commands were just written [s].
            period: Time from cycle to cycle [s].
        """
        axis, guard = self._axis, self._guard
        if axis.halted is not None or axis.mode not in (Mode.TRACK, Mode.POSITION):
            self._peak = 0.0
            return None
        speed, measured = guard.speed, axis.position.value
        self._peak = max(abs(speed), self._peak * math.exp(-period / _MEMORY))
        # The last command is for one period after this cycle; the measurement is older.
        then = guard.reference - speed * (time + period - axis.position.stamp)
        error = abs(then - measured)
        limit = allowed(axis.joint.parameters, axis.joint.version, self._peak)
        # Not written as error > limit: an unknown position is no reason to complain here.
        if not error > limit:
            return None
        unit = axis.joint.parameters.unit
        return FollowingError(
            f"{axis.name}: it is {error:.4g} {unit} from where it was told to be; at its speed "
            f"{limit:.4g} {unit} is the limit",
            axis.name,
            error,
            limit,
        )
