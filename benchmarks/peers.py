"""Third-party planners, for the same problems as ours."""

from __future__ import annotations

import random
from collections.abc import Sequence

import numpy as np
import ruckig
import toppra

from bioscara.planning.arrays import Array
from bioscara.planning.limits import JointLimits
from bioscara.planning.motions.double_s import Bounds


class Ruckig:
    """Ruckig from rest to rest; its waypoints, which it would send to a server, are never set."""

    def __init__(
        self, start: Sequence[float], goal: Sequence[float], bounds: Sequence[Bounds]
    ) -> None:
        count = len(start)
        self._planner, self._task = ruckig.Ruckig(count), ruckig.InputParameter(count)
        self._result = ruckig.Trajectory(count)
        self._task.current_position, self._task.target_position = list(start), list(goal)
        for field in Bounds._fields:
            setattr(self._task, f"max_{field}", [getattr(bound, field) for bound in bounds])

    def plan(self) -> None:
        """Plan; the result is kept inside."""
        self._planner.calculate(self._task, self._result)

    def duration(self) -> float:
        """Plan and return the duration [s]."""
        self.plan()
        return float(self._result.duration)


def toppra_duration(way: Array, joints: Array, limits: Sequence[JointLimits], pieces: int) -> float:
    """Return the time that toppra takes for joints along a path, planned anew [s].

    Args:
        way: Parameters of the path, shape (n,).
        joints: The joints there, shape (n, joints); toppra lays its spline through them.
        limits: Of these joints.
        pieces: Of its grid, all of one length.
    """
    constraints = [
        kind([[-getattr(limit, most), getattr(limit, most)] for limit in limits])
        for kind, most in (
            (toppra.constraint.JointVelocityConstraint, "max_velocity"),
            (toppra.constraint.JointAccelerationConstraint, "max_acceleration"),
        )
    ]
    instance = toppra.algorithm.TOPPRA(
        constraints,
        toppra.SplineInterpolator(way, joints),
        gridpoints=np.linspace(way[0], way[-1], pieces + 1),
        parametrizer="ParametrizeConstAccel",
    )
    return float(instance.compute_trajectory().duration)


def random_problem(rng: random.Random, count: int) -> tuple[list[float], list[float], list[Bounds]]:
    """Return starts, goals and limits of ``count`` joints, which are at rest at both ends."""
    bounds = [
        Bounds(rng.uniform(0.1, 5.0), rng.uniform(0.2, 30.0), rng.uniform(1.0, 1000.0))
        for _ in range(count)
    ]
    start, goal = (
        [rng.uniform(-3.0, 3.0) * rng.choice((0.01, 0.1, 1.0)) for _ in range(count)]
        for _ in range(2)
    )
    return start, goal, bounds
