"""Random states of joints, and ruckig as the oracle of the fastest motion between them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from bioscara.planning.profiles.segments import Bounds, MotionState


def ruckig_duration(
    starts: Sequence[MotionState], goals: Sequence[MotionState], limits: Sequence[Bounds]
) -> float:
    """Return the duration that ruckig finds [s]; its waypoints stay unset: they go to a server."""
    ruckig = pytest.importorskip("ruckig")
    planner, task = ruckig.Ruckig(len(starts)), ruckig.InputParameter(len(starts))
    for prefix, given_states in (("current", starts), ("target", goals)):
        for field in MotionState._fields:
            setattr(task, f"{prefix}_{field}", [getattr(state, field) for state in given_states])
    for field in Bounds._fields:
        setattr(task, f"max_{field}", [getattr(limit, field) for limit in limits])
    result = ruckig.Trajectory(len(starts))
    assert planner.calculate(task, result) in {ruckig.Result.Working, ruckig.Result.Finished}
    return float(result.duration)


def random_state(rng: np.random.Generator, limits: Bounds, position: float) -> MotionState:
    """Return a state at a position that can be left without exceeding the limits."""
    most, hardest, jerk = limits
    acceleration = rng.uniform(-1, 1) * min(hardest, math.sqrt(1.99 * jerk * most))
    room = most - acceleration**2 / (2.0 * jerk)
    return MotionState(position, rng.uniform(-room, room), acceleration)
