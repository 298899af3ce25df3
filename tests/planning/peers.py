"""Ruckig as the oracle of the fastest motion from rest to rest."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pytest

from bioscara.planning.motions.double_s import Bounds


def ruckig_duration(
    start: Iterable[float], goal: Iterable[float], limits: Sequence[Bounds]
) -> float:
    """Return the duration that ruckig finds [s]; its waypoints stay unset: they go to a server."""
    ruckig = pytest.importorskip("ruckig")
    planner, task = ruckig.Ruckig(len(limits)), ruckig.InputParameter(len(limits))
    task.current_position, task.target_position = list(start), list(goal)
    for field in Bounds._fields:
        setattr(task, f"max_{field}", [getattr(limit, field) for limit in limits])
    result = ruckig.Trajectory(len(limits))
    assert planner.calculate(task, result) in {ruckig.Result.Working, ruckig.Result.Finished}
    return float(result.duration)
