"""Check whether an arm can execute a trajectory, on the curve between its points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from bioscara.errors import TrajectoryError
from bioscara.planning.limits import JointLimits
from bioscara.planning.trajectory.extrema import JointExtrema, joint_extrema
from bioscara.planning.trajectory.trajectory import Trajectory
from bioscara.spelling import did_you_mean

TOLERANCE = 1e-6
"""Share of a limit by which rounding may exceed it."""

_REST = 1e-9


def check(trajectory: Trajectory, limits: Sequence[JointLimits]) -> list[str]:
    """Make sure that every instant of a trajectory is within the limits.

    Args:
        trajectory: The trajectory to check.
        limits: Of all joints of the arm.

    Returns:
        Sentences on unusual but allowed properties.

    Raises:
        TrajectoryError: A joint is unknown, or a limit is exceeded; the message names joint,
            time, value and limit.
    """
    by_name = {limit.name: limit for limit in limits}
    for name in trajectory.joint_names:
        if name not in by_name:
            hint = did_you_mean(name, by_name)
            raise TrajectoryError(
                f"no joint {name!r}; the arm has {', '.join(by_name)}{hint and f'; {hint}'}"
            )
    excesses = [
        excess
        for name, ranges in zip(trajectory.joint_names, joint_extrema(trajectory), strict=True)
        for excess in _excesses(ranges, by_name[name])
    ]
    if excesses:
        worst = max(excesses, key=lambda excess: excess.ratio)
        others = len(excesses) - 1
        more = f" ({others} more limit{'s' if others > 1 else ''} exceeded)" if others else ""
        raise TrajectoryError(worst.text + more)
    return _unrest(trajectory, [by_name[name] for name in trajectory.joint_names])


class _Excess(NamedTuple):
    ratio: float
    text: str


def _excesses(ranges: JointExtrema, limit: JointLimits) -> Iterator[_Excess]:
    room = TOLERANCE * (limit.upper - limit.lower)
    for time, value in ranges.position:
        if not limit.lower - room <= value <= limit.upper + room:
            # Stretching in time does not help against this excess, so it is reported first.
            yield _Excess(
                math.inf,
                f"{limit.name} at {time:.3f} s: position {value:.6g} {limit.unit} is outside "
                f"{limit.lower:g} .. {limit.upper:g} {limit.unit}; plan another path",
            )
    quantities = (
        ("velocity", ranges.velocity, f"{limit.unit}/s", limit.max_velocity),
        ("acceleration", ranges.acceleration, f"{limit.unit}/s^2", limit.max_acceleration),
    )
    for quantity, values, unit, most in quantities:
        time, value = values.largest
        if not abs(value) <= most * (1.0 + TOLERANCE):
            yield _Excess(
                abs(value) / most,
                f"{limit.name} at {time:.3f} s: {quantity} {value:.4g} {unit} exceeds the limit "
                f"of {most:g} {unit}; fit(), or bioscara run --fit, stretches it in "
                "time until it fits",
            )


def _unrest(trajectory: Trajectory, limits: Sequence[JointLimits]) -> list[str]:
    if trajectory.velocities is None:
        if len(trajectory.times) == 1:
            return []
        return [
            "no velocities are given: lines join the points, and the velocity jumps at each point"
        ]
    notes = []
    for where, row in (("start", trajectory.velocities[0]), ("end", trajectory.velocities[-1])):
        moving = [
            f"{limit.name} {value:.4g} {limit.unit}/s"
            for limit, value in zip(limits, row, strict=True)
            if abs(value) > _REST
        ]
        if moving:
            notes.append(f"the trajectory's {where} is not at rest: {', '.join(moving)}")
    return notes
