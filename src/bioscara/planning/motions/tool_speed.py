"""Limit the tool's speed by stretching a trajectory in time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bioscara.errors import InvalidArgumentError, TrajectoryError
from bioscara.kinematics import Scara, batch
from bioscara.planning.arrays import Array, Index
from bioscara.planning.collision.swept import highest_rates
from bioscara.planning.limits import REDUCED_SPEED
from bioscara.planning.trajectory.retiming import stretched
from bioscara.planning.trajectory.trajectory import Trajectory

COMMANDED_SPEED = 0.86 * REDUCED_SPEED
"""Highest commanded speed that keeps the tool within that limit [m/s]. A load that reverses sticks
for a moment by dry friction, breaks away and swings, even if its motor moves gently: on the
simulated arm by up to 16 % of the tool's speed on planned paths."""
WRIST_SWING = 0.28
"""Rate by which the hand may turn faster than commanded [rad/s]. At about 0.25 rad/s the pitch of
the wrist motor's poles excites its belt: on the simulated arm by up to 0.27 rad/s."""
_LEAST_SHARE = 0.1
"""Least share of the commanded speed that is left for a load that reaches far."""
UNPLANNED_SHARE = 0.86
"""Share of that for jogs and raw commands: there joints reverse at any acceleration, and a load
swings by up to a quarter of the tool's speed."""
_STEP, _TURN, _LEAST = 1e-3, 0.01, 200
"""Sampling of a segment: time step [s]; for a long segment the sum of joint displacements per
sample [rad or m], with a least number of samples."""
_ROUNDING = 1.0 + 1e-5
"""Factor by which a speed found between samples may exceed the planned one."""
_AT_ONCE = 4096
"""Instants processed at once: their arrays fit the processor's cache."""


def highest_commanded(overhang: float) -> float:
    """Return the highest commanded speed that keeps the tool and its load within that limit [m/s].

    Args:
        overhang: Horizontal distance from the tool's point to the load's farthest point [m].
    """
    return max(COMMANDED_SPEED - WRIST_SWING * overhang, _LEAST_SHARE * COMMANDED_SPEED)


def peak_tool_speed(trajectory: Trajectory, kinematics: Scara, elsewhere: Sequence[float]) -> float:
    """Return the peak speed of the tool on a trajectory [m/s].

    Each segment is evaluated to 1e-5 of the speed, also when the arm waits for long in between.

    Args:
        trajectory: For some or all of the joints.
        kinematics: The arm with its tool.
        elsewhere: Positions of the joints that the trajectory does not name [rad, m, rad, rad].

    Raises:
        TrajectoryError: It names a joint that the arm does not have.
    """
    names = [limit.name for limit in kinematics.limits]
    unknown = [name for name in trajectory.joint_names if name not in names]
    if unknown:
        raise TrajectoryError(f"{unknown[0]} is not a joint of the arm; it has {', '.join(names)}")
    columns = [names.index(name) for name in trajectory.joint_names]
    durations = np.diff(trajectory.times)
    displacements = highest_rates(trajectory).sum(axis=1) * durations
    often = np.maximum(displacements / _TURN, _LEAST)
    counts = np.maximum(np.ceil(np.minimum(durations / _STEP, often)), 2.0).astype(np.intp) + 1
    ends = np.cumsum(counts)
    begins, steps = ends - counts, durations / (counts - 1)
    # By power, joint and segment: the arithmetic runs along contiguous rows.
    powers = np.ascontiguousarray(trajectory.coefficients.transpose(2, 1, 0))
    if not powers[4:].any():  # The cubics of planned motions.
        powers = powers[:4]
    derivatives = np.arange(1.0, len(powers))[:, None, None] * powers[1:]
    peak = 0.0
    for start in range(0, int(counts.sum()), _AT_ONCE):
        # Two more, so that any three consecutive samples are together in one block.
        sample = np.arange(start, min(start + _AT_ONCE + 2, ends[-1]))
        segment = np.searchsorted(ends, sample, side="right")
        time = (sample - begins[segment]) * steps[segment]
        joints = np.repeat(np.array(elsewhere, dtype=np.float64)[:, None], len(sample), axis=1)
        rates = np.zeros_like(joints)
        joints[columns] = _horner(powers.take(segment, axis=2), time)
        rates[columns] = _horner(derivatives.take(segment, axis=2), time)
        peak = max(peak, _peak(batch.tool_speeds(kinematics, joints.T, rates.T), segment))
    return peak


def _horner(powers: Array, time: Array) -> Array:
    """Return the values of polynomials, the powers of whose coefficients are the first axis."""
    value: Array = powers[-1].copy()
    for power in powers[-2::-1]:
        value *= time
        value += power
    return value


def _peak(speeds: Array, segment: Index) -> float:
    """Return the largest speed, also between the evenly spaced samples of a segment."""
    before, here, after = speeds[:-2], speeds[1:-1], speeds[2:]
    rise, bend = after - before, 2.0 * here - before - after
    # The maximum of the parabola through three samples, if it is between them.
    top = (segment[:-2] == segment[2:]) & (np.abs(rise) <= 2.0 * bend) & (bend > 0.0)
    summits = here[top] + rise[top] ** 2 / (8.0 * bend[top])
    return float(np.max(summits, initial=speeds.max()))


def reduced(
    trajectory: Trajectory,
    kinematics: Scara,
    elsewhere: Sequence[float],
    speed: float = REDUCED_SPEED,
) -> tuple[Trajectory, float]:
    """Stretch a trajectory in time so that the tool keeps to a speed.

    Args:
        trajectory: For some or all of the joints.
        kinematics: The arm with its tool.
        elsewhere: Positions of the joints that the trajectory does not name [rad, m, rad, rad].
        speed: Highest speed of the tool [m/s].

    Returns:
        The trajectory and the factor, 1.0 if it is slow enough already.

    Raises:
        InvalidArgumentError: The speed is not above zero.
        TrajectoryError: It names a joint that the arm does not have.
    """
    if not speed > 0.0:
        raise InvalidArgumentError(f"tool speed {speed} m/s must be above zero")
    peak = peak_tool_speed(trajectory, kinematics, elsewhere)
    if peak <= speed * _ROUNDING:
        return trajectory, 1.0
    return stretched(trajectory, peak / speed), peak / speed
