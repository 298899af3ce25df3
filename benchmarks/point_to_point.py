"""Point-to-point motions: their durations, against ruckig."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.measure import Row
from benchmarks.peers import Ruckig, random_problem
from bioscara.planning import point_to_point
from bioscara.planning.profiles.double_s import durations, fastest, lasting
from bioscara.planning.profiles.segments import Bounds, MotionState

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

    @property
    def max_jerk(self) -> float:
        return self.max_acceleration / 0.025


FIELD = (
    _Limit("j1", 0.5, 2.0),
    _Limit("j2", 1.0, 2.0),
    _Limit("j3", 5.0, 14.0),
    _Limit("j4", 5.0, 14.0),
)


def _least(
    starts: Sequence[MotionState], goals: Sequence[MotionState], bounds: Sequence[Bounds]
) -> float:
    """Return the least duration that is feasible for all joints."""
    each = list(zip(starts, goals, bounds, strict=True))
    changes = [durations(*problem) for problem in each]
    least = max(times[0] for times in changes)
    for duration in (least, *sorted(t for times in changes for t in times if t > least)):
        if all(
            times[0] == duration or lasting(duration, *problem) is not None
            for problem, times in zip(each, changes, strict=True)
        ):
            return duration
    raise ArithmeticError("no common duration")


def _ratio(count: int) -> float:
    """Return the largest ratio of our duration to ruckig's, over problems of ``count`` joints."""
    rng = random.Random(count)
    worst = 0.0
    for _ in range(PROBLEMS):
        problem = random_problem(rng, count)
        ours = fastest(*(column[0] for column in problem)).duration if count == 1 else None
        worst = max(worst, (ours or _least(*problem)) / Ruckig(*problem).duration())
    return worst


def _durations() -> list[Row]:
    rest, bounds = (
        [MotionState(0.0)] * 4,
        [Bounds(limit.max_velocity, limit.max_acceleration, limit.max_jerk) for limit in FIELD],
    )
    peer = Ruckig(rest, [MotionState(p) for p in GOAL], bounds).duration()
    names = [limit.name for limit in FIELD]
    rows = []
    for what, jerk_limited, most, against in (
        ("without jerk limit", False, 0.7706, f"Pilz, same goal: {PILZ} s"),
        ("jerk-limited", True, 0.7956, f"Pilz: {PILZ} s; ruckig: {peer:.4f} s"),
    ):
        own = point_to_point(names, (0.0,) * 4, GOAL, FIELD, jerk_limited=jerk_limited).duration
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
                f"{PROBLEMS} random moves between states of motion, "
                + ("one joint" if count == 1 else f"{count} joints together"),
                f"at most {worst:.9f} of ruckig's duration",
                "ruckig, same limits",
                "at most 1.001",
                worst <= 1.001,
            )
        )
    return result
