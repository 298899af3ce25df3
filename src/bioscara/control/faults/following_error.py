"""Monitoring of a joint's following error."""

from __future__ import annotations

from math import exp

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
_TRACK, _POSITION = Mode.TRACK, Mode.POSITION


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


def fade(period: float) -> float:
    """Return the share of an earlier speed that still counts after a period [s]."""
    return exp(-period / _MEMORY)


class FollowingErrorMonitor:
    """Compares one joint with its position commands; the limit scales with the speed.

    Args:
        axis: The joint.
        limiter: Holds its last command.
    """

    __slots__ = ("_axis", "_floor", "_limiter", "_peak", "_position")

    def __init__(self, axis: Axis, limiter: JointLimiter) -> None:
        self._axis, self._limiter, self._position = axis, limiter, axis.position
        limits = axis.parameters
        self._floor = FLOOR_SHARE * (limits.upper - limits.lower)
        self._peak = 0.0

    def check(self, due: float, fading: float) -> FollowingError | None:
        """Return the error that exceeds the limit, or None.

        Args:
            due: Time at which the joint is to be where it was commanded last [s]: one period after
                the begin of that cycle.
            fading: Share of the earlier speeds that still counts, from :func:`fade`.
        """
        axis, limiter = self._axis, self._limiter
        mode = axis.mode
        if axis.halted is not None or (mode is not _TRACK and mode is not _POSITION):
            self._peak = 0.0
            return None
        speed, measured = limiter.speed, self._position
        peak, magnitude = self._peak * fading, abs(speed)
        self._peak = peak = magnitude if magnitude > peak else peak
        # The measurement is older than the command.
        then = limiter.reference - speed * (due - measured.stamp)
        error = abs(then - measured.value)
        if error <= self._floor + LAG * peak:
            return None
        limit = allowed(axis.parameters, axis.version, peak)
        # Not written as error > limit: an unknown position is no reason to complain here.
        if not error > limit:
            return None
        unit = axis.parameters.unit
        return FollowingError(
            f"{axis.name}: it is {error:.4g} {unit} from its commanded position; the limit "
            f"at its speed is {limit:.4g} {unit}",
            axis.name,
            error,
            limit,
        )
