"""Trajectories from files that a person gives to the page."""

from __future__ import annotations

import msgspec

from bioscara.api.messages import TrajectoryValue
from bioscara.api.values import trajectory_value
from bioscara.errors import TrajectoryError
from bioscara.model import ArmParameters
from bioscara.planning import Trajectory, check
from bioscara.planning import fit as stretch
from bioscara.planning.files.trajectory_file import read_content
from bioscara.planning.trajectory.extrema import joint_extrema
from bioscara.printing import printable
from bioscara.spelling import did_you_mean

SIZE_MAX = 8 << 20
"""Largest file [byte]."""
_NAME_MAX = 100
"""Characters of a file's name that messages have."""


class Peak(msgspec.Struct, frozen=True):
    """The extremes of a joint on a trajectory, and its limits.

    Attributes:
        joint: Its name.
        velocity: Highest speed [rad/s or m/s].
        velocity_limit: Its limit.
        acceleration: Highest acceleration [rad/s^2 or m/s^2].
        acceleration_limit: Its limit.
    """

    joint: str
    velocity: float
    velocity_limit: float
    acceleration: float
    acceleration_limit: float


class CheckedTrajectory(msgspec.Struct, frozen=True):
    """A trajectory that was read from a file, and whether the arm can execute it.

    Attributes:
        trajectory: The trajectory.
        points: Number of its points.
        duration: [s].
        stretched: Factor by which it was stretched in time to fit the limits; 1 if it was not.
        notes: What the reader left out, and unusual properties.
        peaks: Its extremes, one for each of its joints.
        problem: Why the arm cannot execute it as it is, or null: a limit with joint, time and
            value. Zones are checked when it is planned or executed.
    """

    trajectory: TrajectoryValue
    points: int
    duration: float
    stretched: float
    notes: tuple[str, ...]
    peaks: tuple[Peak, ...]
    problem: str | None


def checked_trajectory(
    name: str, data: bytes, parameters: ArmParameters, *, fit: bool
) -> CheckedTrajectory:
    """Read a trajectory and compare it with the limits of the arm.

    Args:
        name: Name of the file; one that ends with ``.csv`` is CSV, another one YAML.
        data: Its content.
        parameters: Parameters of the arm.
        fit: Whether to stretch it in time by the least factor that meets every limit.

    Raises:
        TrajectoryError: The file holds no trajectory, or one of another arm; or it is to be
            fitted, and a position is outside the limits.
    """
    suffix = ".csv" if name.lower().endswith(".csv") else ""
    shown = printable(name.removesuffix(suffix))[:_NAME_MAX] + suffix
    trajectory, notes = read_content(shown, data)
    limits = {joint.name: joint for joint in parameters.joints}
    for joint in trajectory.joint_names:
        if joint not in limits:
            hint = did_you_mean(joint, limits)
            known = f"the arm has {', '.join(limits)}{hint and f'; {hint}'}"
            raise TrajectoryError(f"{shown}: no joint {joint!r}; {known}")
    factor, problem = 1.0, None
    if fit:
        trajectory, factor = stretch(trajectory, parameters.joints)
    try:
        notes += tuple(check(trajectory, parameters.joints))
    except TrajectoryError as error:
        problem = str(error)
    return CheckedTrajectory(
        trajectory_value(trajectory),
        len(trajectory.times),
        trajectory.duration,
        factor,
        notes,
        _peaks(trajectory, parameters),
        problem,
    )


def _peaks(trajectory: Trajectory, parameters: ArmParameters) -> tuple[Peak, ...]:
    limits = {joint.name: joint for joint in parameters.joints}
    return tuple(
        Peak(
            name,
            abs(extrema.velocity.largest.value),
            limits[name].max_velocity,
            abs(extrema.acceleration.largest.value),
            limits[name].max_acceleration,
        )
        for name, extrema in zip(trajectory.joint_names, joint_extrema(trajectory), strict=True)
    )
