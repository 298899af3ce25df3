"""Point-to-point motions: how long they take, and how long planning them does, against ruckig."""

from __future__ import annotations

import random
import statistics
from collections.abc import Sequence
from dataclasses import dataclass

import ruckig

from benchmarks.measure import Row, seconds, timings
from bioscara.model import load_parameters
from bioscara.planning import point_to_point
from bioscara.planning.double_s import durations, fastest, lasting
from bioscara.planning.profile import Bounds, State

GOAL = (-0.26026, 0.0179, 0.53642, -0.69014)
"""Of planned_time_optimal.yaml, from zero."""
PILZ = 1.8802
"""Duration of the Pilz planner's motion to the same goal [s], tests/data/planned_pilz_ptp.yaml."""
PROBLEMS = 10_000
JOINTS = load_parameters().joints


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


class _Peer:
    """Ruckig for one problem; its waypoints, which it would send away, are never set."""

    def __init__(
        self, starts: Sequence[State], goals: Sequence[State], bounds: Sequence[Bounds]
    ) -> None:
        count = len(starts)
        self._planner, self._task = ruckig.Ruckig(count), ruckig.InputParameter(count)
        self._result = ruckig.Trajectory(count)
        for prefix, states in (("current", starts), ("target", goals)):
            for field in State._fields:
                setattr(self._task, f"{prefix}_{field}", [getattr(s, field) for s in states])
        for field in Bounds._fields:
            setattr(self._task, f"max_{field}", [getattr(bound, field) for bound in bounds])

    def plan(self) -> None:
        self._planner.calculate(self._task, self._result)

    def duration(self) -> float:
        self.plan()
        return float(self._result.duration)


def _state(rng: random.Random, bounds: Bounds) -> State:
    """Return a random state that a joint can have come to and can leave."""
    velocity, acceleration, jerk = bounds
    a = rng.uniform(-1.0, 1.0) * min(acceleration, (1.99 * jerk * velocity) ** 0.5)
    room = velocity - a * a / (2.0 * jerk)
    return State(rng.uniform(-3.0, 3.0) * rng.choice((0.01, 0.1, 1.0)), rng.uniform(-room, room), a)


def _problem(rng: random.Random, count: int) -> tuple[list[State], list[State], list[Bounds]]:
    bounds = [
        Bounds(rng.uniform(0.1, 5.0), rng.uniform(0.2, 30.0), rng.uniform(1.0, 1000.0))
        for _ in range(count)
    ]
    return [_state(rng, b) for b in bounds], [_state(rng, b) for b in bounds], bounds


def _least(starts: Sequence[State], goals: Sequence[State], bounds: Sequence[Bounds]) -> float:
    """Return the least duration that all joints can take."""
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
    """Return our longest duration in ruckig's, over random problems of ``count`` joints."""
    rng = random.Random(count)
    worst = 0.0
    for _ in range(PROBLEMS):
        problem = _problem(rng, count)
        ours = fastest(*(column[0] for column in problem)).duration if count == 1 else None
        worst = max(worst, (ours or _least(*problem)) / _Peer(*problem).duration())
    return worst


def _durations() -> list[Row]:
    rest, bounds = (
        [State(0.0)] * 4,
        [Bounds(limit.max_velocity, limit.max_acceleration, limit.max_jerk) for limit in FIELD],
    )
    peer = _Peer(rest, [State(p) for p in GOAL], bounds).duration()
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


def _planning() -> list[Row]:
    rng = random.Random(7)
    names = [joint.name for joint in JOINTS]
    start = [0.5 * (joint.lower + joint.upper) for joint in JOINTS]
    goal = [p + rng.uniform(0.05, 0.4) * (j.upper - p) for p, j in zip(start, JOINTS, strict=True)]
    own = seconds(lambda: point_to_point(names, start, goal, JOINTS), 51, 4)
    bounds = [Bounds(j.max_velocity, j.max_acceleration, j.max_jerk) for j in JOINTS]
    peer = _Peer([State(p) for p in start], [State(p) for p in goal], bounds)
    theirs = seconds(peer.plan, 51, 50)
    problems = [_problem(rng, 1) for _ in range(501)]
    states = iter(problems)
    single = statistics.median(
        timings(lambda: fastest(*(column[0] for column in next(states))), 501, 1)
    )
    peers = iter([_Peer(*problem) for problem in problems])
    alone = statistics.median(timings(lambda: next(peers).plan(), 501, 1))
    return [
        Row(
            "planning four joints from rest to rest, the trajectory included",
            f"{1e6 * own:.0f} us",
            f"ruckig alone, compiled: {1e6 * theirs:.1f} us",
            "at most 5 ms",
            own <= 5e-3,
        ),
        Row(
            "planning one joint from a random state to another",
            f"{1e6 * single:.0f} us",
            f"ruckig alone, compiled: {1e6 * alone:.1f} us",
            "at most 0.5 ms",
            single <= 5e-4,
        ),
    ]


def rows() -> list[Row]:
    """Measure durations and planning times."""
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
    return result + _planning()
