"""Point-to-point motions: their durations, against ruckig."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, replace

from benchmarks.measure import Row
from benchmarks.peers import Ruckig, random_problem
from bioscara.planning import point_to_point
from bioscara.planning.motions.double_s import Bounds, least_duration

GOAL = (-0.26026, 0.0179, 0.53642, -0.69014)
"""Of planned_time_optimal.yaml, from zero."""
PILZ = 1.8802
"""Duration of the Pilz planner's motion to the same goal [s], tests/data/planned_pilz_ptp.yaml."""
PROBLEMS = 10_000


@dataclass(frozen=True, slots=True)
class _Limit:
    """Limits that the file was planned with: J1's bind."""

    name: str
    max_velocity: float
    max_acceleration: float
    lower: float = -3.0
    upper: float = 3.0
    unit: str = "rad"
    smoothness: float = 0.025
    """Time in which the acceleration rises [s]."""

    @property
    def max_jerk(self) -> float:
        return self.max_acceleration / self.smoothness if self.smoothness else math.inf


FIELD = (
    _Limit("j1", 0.5, 2.0),
    _Limit("j2", 1.0, 2.0),
    _Limit("j3", 5.0, 14.0),
    _Limit("j4", 5.0, 14.0),
)
ROUGH = tuple(replace(limit, smoothness=0.0) for limit in FIELD)
"""The same without a limit of the jerk."""


def _ratio(count: int) -> float:
    """Return the largest ratio of our duration to ruckig's, over problems of ``count`` joints."""
    rng = random.Random(count)
    worst = 0.0
    for _ in range(PROBLEMS):
        start, goal, bounds = random_problem(rng, count)
        ways = [there - here for here, there in zip(start, goal, strict=True)]
        ours = max(least_duration(way, bound) for way, bound in zip(ways, bounds, strict=True))
        worst = max(worst, ours / Ruckig(start, goal, bounds).duration())
    return worst


def _durations() -> list[Row]:
    bounds = [Bounds(limit.max_velocity, limit.max_acceleration, limit.max_jerk) for limit in FIELD]
    peer = Ruckig((0.0,) * 4, GOAL, bounds).duration()
    names = [limit.name for limit in FIELD]
    rows = []
    for what, limits, most, against in (
        ("without jerk limit", ROUGH, 0.7706, f"Pilz, same goal: {PILZ} s"),
        ("jerk-limited", FIELD, 0.7956, f"Pilz: {PILZ} s; ruckig: {peer:.4f} s"),
    ):
        own = point_to_point(names, (0.0,) * 4, GOAL, limits).duration
        rows.append(
            Row(
                f"move of planned_time_optimal.yaml, {what}",
                f"{own:.4f} s ({own / PILZ:.2f} times Pilz)",
                against,
                f"at most {most} s",
                own <= most,
            )
        )
    return rows


def rows() -> list[Row]:
    """Measure durations."""
    result = _durations()
    for count in (1, 4):
        worst = _ratio(count)
        result.append(
            Row(
                f"{PROBLEMS} random moves from rest to rest, "
                + ("one joint" if count == 1 else f"{count} joints together"),
                f"at most {worst:.9f} of ruckig's duration",
                "ruckig, same limits",
                "at most 1.001",
                worst <= 1.001,
            )
        )
    return result
