"""A line of the tool: planning time against toppra, duration against a dense phase plane."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import toppra

from benchmarks.measure import Row, timings
from bioscara.kinematics import Geometry, Joints, Pose, Scara, batch
from bioscara.model import load_parameters
from bioscara.planning import Trajectory
from bioscara.planning.cartesian import circular, linear
from bioscara.planning.tool_limits import ToolLimits

START, VIA, GOAL = Pose(0.45, -0.20, 0.25), Pose(0.5, 0.05, 0.25), Pose(0.35, 0.30, 0.28)
FREE = ToolLimits(math.inf, math.inf, math.inf, math.inf)
_PARAMETERS = load_parameters()
_LENGTHS = _PARAMETERS.geometry
_LIMITS = _PARAMETERS.joints
ARM = Scara(Geometry(_LENGTHS.upper_arm, _LENGTHS.forearm, _LENGTHS.height), _LIMITS)
# The elbow's side for which the reference of 1.698 s was computed.
FROM = ARM.inverse(START)[1]
_WAYPOINTS, _PEER_PIECES, _DENSE_PIECES = 51, 100, 5000


def _peer(waypoints: int, pieces: int) -> Callable[[], float]:
    """Return a function that plans the line with toppra and returns its duration [s]."""
    velocities = [[-limit.max_velocity, limit.max_velocity] for limit in _LIMITS]
    accelerations = [[-limit.max_acceleration, limit.max_acceleration] for limit in _LIMITS]
    constraints = [
        toppra.constraint.JointVelocityConstraint(velocities),
        toppra.constraint.JointAccelerationConstraint(accelerations),
    ]

    def plan() -> float:
        way = np.linspace(0.0, 1.0, waypoints)
        poses = np.array(START) + way[:, None] * (np.array(GOAL) - np.array(START))
        spline = toppra.SplineInterpolator(way, batch.inverse(ARM, poses)[:, 1])
        instance = toppra.algorithm.TOPPRA(
            constraints,
            spline,
            gridpoints=np.linspace(0.0, 1.0, pieces + 1),
            parametrizer="ParametrizeConstAccel",
        )
        return float(instance.compute_trajectory().duration)

    return plan


def _least(function: Callable[[], object]) -> float:
    """Return the time of the call that other programs disturbed least [s]."""
    return min(timings(function, 31))


def _excess(trajectory: Trajectory) -> float:
    """Return by what share a joint exceeds a limit, on a grid of 1 ms; negative if none does."""
    _, velocities, accelerations = trajectory.sample_many(np.arange(0, trajectory.duration, 1e-3))
    ratios = [
        np.abs(values[:, joint]).max() / most
        for joint, limit in enumerate(_LIMITS)
        for values, most in (
            (velocities, limit.max_velocity),
            (accelerations, limit.max_acceleration),
        )
    ]
    return float(max(ratios)) - 1.0


def rows() -> list[Row]:
    """Measure the line of 0.511 m at the joints' limits, and an arc at the tool's."""
    toppra.setup_logging("ERROR")

    def plan(start: Joints = FROM) -> Trajectory:
        return linear(ARM, start, GOAL, _LIMITS, FREE)

    line = plan()
    own = _least(plan)
    coarse, dense = _peer(_WAYPOINTS, _PEER_PIECES), _peer(401, _DENSE_PIECES)
    peer, coarse_duration, reference = _least(coarse), coarse(), dense()
    arc = _least(lambda: circular(ARM, FROM, VIA, GOAL, _LIMITS))
    excess = _excess(line)
    return [
        Row(
            "line of 0.511 m at the joints' limits, planned and checked",
            f"{1e3 * own:.1f} ms",
            f"toppra alone, {_PEER_PIECES} pieces: {1e3 * peer:.1f} ms ({own / peer:.2f} times)",
            "at most 10 ms",
            own <= 10e-3,
        ),
        Row(
            "its duration",
            f"{line.duration:.4f} s",
            f"dense phase plane, {_DENSE_PIECES} pieces: {reference:.4f} s "
            f"({line.duration / reference:.4f} times); toppra, {_PEER_PIECES} pieces: "
            f"{coarse_duration:.4f} s",
            "at most 1.01 times",
            line.duration <= 1.01 * reference,
        ),
        Row(
            "largest excess over a joint's limit on it",
            f"{excess:.1e}",
            "the limit",
            "at most 1e-6",
            excess <= 1e-6,
        ),
        Row(
            "arc at the tool's limits, planned and checked",
            f"{1e3 * arc:.1f} ms",
            f"toppra on the line, without limits of the tool: {1e3 * peer:.1f} ms "
            f"({arc / peer:.2f} times)",
            "at most 5 times",
            arc <= 5.0 * peer,
        ),
    ]
