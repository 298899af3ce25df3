"""Trajectories from files that a person gives to the page."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from bioscara.api.messages import TrajectoryValue, WorkspaceState
from bioscara.api.values import trajectory_value, workspace_of
from bioscara.errors import TrajectoryError, ZoneError
from bioscara.model import ArmParameters
from bioscara.planning import Trajectory, check, fit as stretch
from bioscara.planning.files.trajectory_file import read_content
from bioscara.planning.trajectory.extrema import joint_extrema
from bioscara.printing import printable
from bioscara.robot.operations.motions.follow_trajectory import checked
from bioscara.robot.planner import Planner
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
        notes: Parts that the reader left out, and unusual properties.
        peaks: Its extremes, one for each of its joints.
        problem: Why the arm cannot execute it as it is, or null: a limit with joint, time and
            value.
        planned: The motion that the arm makes of it from where it is: of all joints, slowed down
            and averaged. Null if its path is not free, or the arm is not homed.
    """

    trajectory: TrajectoryValue
    points: int
    duration: float
    stretched: float
    notes: tuple[str, ...]
    peaks: tuple[Peak, ...]
    problem: str | None
    planned: TrajectoryValue | None


def checked_trajectory(
    name: str,
    data: bytes,
    parameters: ArmParameters,
    workspace: WorkspaceState | None = None,
    joints: Sequence[float | None] = (),
    *,
    fit: bool,
) -> CheckedTrajectory:
    """Read a trajectory and compare it with the limits of the arm.

    Args:
        name: Name of the file; one that ends with ``.csv`` is CSV, another one YAML.
        data: Its content.
        parameters: Parameters of the arm.
        workspace: Its tool, scene and load; None to plan nothing.
        joints: j1 to j4 [rad, m, rad, rad]; None where a position is unknown.
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
    planned = None
    here = [joint for joint in joints if joint is not None]
    if problem is None and workspace is not None and len(here) == len(parameters.joints):
        planner = Planner(workspace_of(parameters, workspace), lambda: here)
        try:
            plan = checked(trajectory, planner)
        except (TrajectoryError, ZoneError) as error:
            notes += (str(error),)
        else:
            planned, notes = trajectory_value(plan.trajectory), (*notes, *plan.notes)
    return CheckedTrajectory(
        trajectory_value(trajectory),
        len(trajectory.times),
        trajectory.duration,
        factor,
        tuple(dict.fromkeys(notes)),
        _peaks(trajectory, parameters),
        problem,
        planned,
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
