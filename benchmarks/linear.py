"""A line of the tool at the joints' limits: its duration against a dense phase plane."""

from __future__ import annotations

import math

import numpy as np
import toppra

from benchmarks.measure import Row, at_most, medians
from benchmarks.peers import toppra_duration
from bioscara.kinematics import Geometry, Pose, Scara, batch
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, check
from bioscara.planning.collision.scene import Scene
from bioscara.planning.limits import ToolLimits
from bioscara.planning.motions.cartesian import linear

START, GOAL = Pose(0.45, -0.20, 0.25), Pose(0.35, 0.30, 0.28)
FREE = ToolLimits(math.inf, math.inf, math.inf, math.inf)
_PARAMETERS = load_parameters()
_LENGTHS = _PARAMETERS.geometry
_LIMITS = _PARAMETERS.joints
ARM = Scara(Geometry(_LENGTHS.upper_arm, _LENGTHS.forearm, _LENGTHS.height), _LIMITS)
# The elbow's side for which the reference of 1.698 s was computed.
FROM = ARM.inverse(START)[1]
_WAYPOINTS, _PEER_PIECES, _DENSE_PIECES = 51, 100, 5000


def _peer(waypoints: int, pieces: int) -> float:
    """Return the duration of the line as toppra plans it [s]."""
    way = np.linspace(0.0, 1.0, waypoints)
    poses = np.array(START) + way[:, None] * (np.array(GOAL) - np.array(START))
    return toppra_duration(way, batch.inverse(ARM, poses)[:, 1], _LIMITS, pieces)


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


def _planned_and_checked() -> Trajectory:
    """Return the line, within every limit and clear of the arm itself."""
    line = linear(ARM, FROM, GOAL, _LIMITS, FREE)
    check(line, _LIMITS)
    Scene().check(ARM, line)
    return line


def rows() -> list[Row]:
    """Measure the line of 0.511 m."""
    toppra.setup_logging("ERROR")
    line = _planned_and_checked()
    coarse, dense = _peer(_WAYPOINTS, _PEER_PIECES), _peer(401, _DENSE_PIECES)
    excess = _excess(line)
    took, alone = medians(_planned_and_checked, lambda: _peer(_WAYPOINTS, _PEER_PIECES))
    return [
        at_most(
            "a line of 0.511 m at the joints' limits, planned and checked",
            took,
            3,
            alone,
            f"toppra, {_PEER_PIECES} pieces, not checked",
        ),
        Row(
            "its duration",
            f"{line.duration:.4f} s",
            f"dense phase plane, {_DENSE_PIECES} pieces: {dense:.4f} s "
            f"({line.duration / dense:.4f} times); toppra, {_PEER_PIECES} pieces: {coarse:.4f} s",
            "at most 1.01 times",
            line.duration <= 1.01 * dense,
        ),
        Row(
            "largest excess over a joint's limit on it",
            f"{excess:.1e}",
            "the limit",
            "at most 1e-6",
            excess <= 1e-6,
        ),
    ]
