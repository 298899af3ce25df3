"""Planning times: each kind of motion next to a third-party planner that times the same."""

from __future__ import annotations

import math
import random
import statistics
import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import toppra

from benchmarks.measure import Row, timings
from benchmarks.peers import Ruckig, random_problem, toppra_duration
from bioscara.kinematics import Pose
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, point_to_point, sequence
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from bioscara.planning.limits import FULL, ToolLimits
from bioscara.planning.motions.cartesian import circular, linear
from bioscara.planning.motions.jog import ToolVelocity
from bioscara.planning.motions.waypoints import Waypoint, approach, retract
from bioscara.planning.paths.blending import rounded
from bioscara.planning.paths.inverse_kinematics import along
from bioscara.planning.paths.segments import Arc, Line, Path
from bioscara.planning.profiles.double_s import fastest
from bioscara.planning.profiles.segments import Bounds, MotionState
from bioscara.robot import kinematics_of
from bioscara.robot.planner import Plan, Planner

BLEND = 0.01
CORNERS = [Pose(x, y, 0.2) for x, y in ((0.5, -0.2), (0.5, 0.2), (0.4, 0.2), (0.4, -0.2))]
"""Of examples/rectangle.py."""
WELLS = [
    Pose(0.32 + 0.024 * abs(well % 16 - 7.5), 0.016 * (well // 8) - 0.2, 0.2) for well in range(201)
]
"""Rows of eight, there and back: 200 paths of 16 or 24 mm from the first of the corners."""
VIA, GOAL = Pose(0.52, 0.0, 0.22), Pose(0.4, 0.2, 0.25)
ABOVE = Pose(0.0, 0.0, 0.05)
TABLE = Scene(
    (
        Box("reader", (0.3, 0.35, 0.0), (0.5, 0.55, 0.15)),
        Cylinder("waste", 0.55, -0.35, 0.06, 0.0, 0.1),
        Box("cell", (-0.8, -0.8, -0.1), (0.8, 0.8, 0.9), keep_in=True),
    ),
    table_height=0.0,
)
WALL = Scene((*TABLE.zones, Box("wall", (0.53, -0.5, 0.0), (0.7, 0.5, 0.5))), table_height=0.0)
SCENES = {"nothing but the arm around": Scene(), "a table and 3 zones around": TABLE}
_PARAMETERS = load_parameters()
_JOINTS = _PARAMETERS.joints
_NAMES = [joint.name for joint in _JOINTS]
ARM = kinematics_of(_PARAMETERS)
START = ARM.solve(CORNERS[0], [joint.home_position for joint in _JOINTS])
END = ARM.solve(GOAL, START)
AROUND = [Waypoint(pose, blend=BLEND) for pose in CORNERS[1:-1]] + [Waypoint(CORNERS[-1])]
ALONG = [Waypoint(pose, blend=BLEND / 2.0) for pose in WELLS[1:-1]] + [Waypoint(WELLS[-1])]
THERE_AND_BACK = [*approach(GOAL, ABOVE), retract(GOAL, ABOVE)]
_POINTS_PER_PIECE = 20
"""Points given to toppra between two breaks of a path; its spline keeps to the path."""
_CYCLE, _CYCLES = 0.01, 400


def _least(*functions: Callable[[], object], rounds: int = 31) -> list[float]:
    """Return the duration of each function's call least disturbed by other programs [s].

    They take turns, so that a busy machine slows all of them.
    """
    turns = [[timings(function, 1)[0] for function in functions] for _ in range(rounds)]
    return [min(column) for column in zip(*turns, strict=True)]


def _toppra(path: Path, pieces: int) -> Callable[[], float]:
    """Return a function that times the joints along a path and returns the duration [s]."""
    edges = (0.0, *path.breaks, path.length)
    way = np.unique(np.linspace(edges[:-1], edges[1:], _POINTS_PER_PIECE + 1))
    joints = along(ARM, path.sample(way), START).joints
    return lambda: toppra_duration(way, joints, _JOINTS, pieces)


def _ruckig(*, jerk_limited: bool) -> Ruckig:
    bounds = [
        Bounds(j.max_velocity, j.max_acceleration, j.max_jerk if jerk_limited else math.inf)
        for j in _JOINTS
    ]
    return Ruckig([MotionState(p) for p in START], [MotionState(p) for p in END], bounds)


def _point_to_point() -> list[Row]:
    rows = []
    for what, jerk_limited in (("jerk-limited", True), ("without jerk limit", False)):
        peer = _ruckig(jerk_limited=jerk_limited)
        own, alone = _least(
            lambda limited=jerk_limited: point_to_point(
                _NAMES, START, END, _JOINTS, jerk_limited=limited
            ),
            peer.plan,
        )
        rows.append(
            Row(
                f"PTP of four joints, {what}, the trajectory included",
                f"{1e6 * own:.0f} us",
                f"ruckig alone, compiled: {1e6 * alone:.1f} us",
                "at most 2 ms",
                own <= 2e-3,
            )
        )
    rng = random.Random(7)
    problems = [random_problem(rng, 1) for _ in range(501)]
    states, peers = iter(problems), iter([Ruckig(*problem) for problem in problems])
    single = statistics.median(
        timings(lambda: fastest(*(column[0] for column in next(states))), len(problems))
    )
    alone = statistics.median(timings(lambda: next(peers).plan(), len(problems)))
    rows.append(
        Row(
            "one joint from a random state of motion to another",
            f"{1e6 * single:.0f} us",
            f"ruckig alone, compiled: {1e6 * alone:.1f} us",
            "at most 0.5 ms",
            single <= 5e-4,
        )
    )
    return rows


def _paths() -> list[Row]:
    corners = [Line(*ends) for ends in pairwise(CORNERS)]
    kinds: list[tuple[str, Path, Callable[[ToolLimits | None], Trajectory]]] = [
        (
            "LIN of 0.42 m",
            Line(CORNERS[0], GOAL),
            lambda tool: linear(ARM, START, GOAL, _JOINTS, tool),
        ),
        (
            "CIRC of 0.47 m",
            Arc.through(CORNERS[0], VIA, GOAL),
            lambda tool: circular(ARM, START, VIA, GOAL, _JOINTS, tool),
        ),
        (
            "sequence: rectangle of four poses, 10 mm blends",
            rounded(corners, [BLEND] * 2).path,
            lambda tool: sequence(ARM, START, AROUND, _JOINTS, tool).trajectory,
        ),
        (
            "sequence: 200 poses in rows, 5 mm blends",
            rounded([Line(*ends) for ends in pairwise(WELLS)], [BLEND / 2.0] * 199).path,
            lambda tool: sequence(ARM, START, ALONG, _JOINTS, tool).trajectory,
        ),
    ]
    rows = []
    for what, path, plan in kinds:
        free, pieces = plan(FULL), len(plan(FULL).times) - 1
        peer = _toppra(path, pieces)
        functions = [lambda p=plan: p(FULL), lambda p=plan: p(None), peer]
        own, bounded, alone = _least(*functions, rounds=7 if pieces > 1000 else 31)
        theirs = f"{pieces} pieces: {1e3 * alone:.1f} ms"
        rows += [
            Row(
                f"{what}, at the joints' limits, {free.duration:.3f} s",
                f"{1e3 * own:.1f} ms ({own / alone:.2f} times)",
                f"toppra alone on the same joints, {theirs}, {peer():.3f} s",
                "at most 3 times",
                own <= 3.0 * alone,
            ),
            Row(
                "the same at the limits of joints and tool",
                f"{1e3 * bounded:.1f} ms ({bounded / alone:.2f} times)",
                f"toppra as before, which knows no tool: {1e3 * alone:.1f} ms",
                "at most 4 times",
                bounded <= 4.0 * alone,
            ),
        ]
    return rows


def _planned() -> list[Row]:
    """Measure the user's waiting time: planned at reduced speed and checked against the scene."""
    planner = Planner(_PARAMETERS, lambda: START)
    line, arc = Line(CORNERS[0], GOAL), Arc.through(CORNERS[0], VIA, GOAL)
    corners = rounded([Line(*ends) for ends in pairwise(CORNERS)], [BLEND] * 2).path
    down = Line(GOAL.compose(ABOVE), GOAL)
    ptp = _ruckig(jerk_limited=True)
    kinds: list[tuple[str, Callable[[], Plan], str, tuple[Path, ...], float]] = [
        ("PTP", lambda: planner.joints(END), "ruckig alone", (), 10e-3),
        ("LIN", lambda: planner.linear(GOAL), "toppra alone", (line,), 20e-3),
        ("CIRC", lambda: planner.circular(VIA, GOAL), "toppra alone", (arc,), 20e-3),
        ("sequence", lambda: planner.sequence(AROUND), "toppra alone", (corners,), 40e-3),
        (
            "approach and retract",
            lambda: planner.sequence(THERE_AND_BACK),
            "ruckig once and toppra twice",
            (down, down),
            40e-3,
        ),
    ]
    rows = []
    for what, plan, whose, paths, most in kinds:
        planner.scene = Scene()
        pieces = (len(plan().trajectory.times) - 1) // max(len(paths), 1)
        peers = [_toppra(path, pieces) for path in paths] or [ptp.plan]
        if len(paths) > 1:
            peers.append(ptp.plan)

        def with_scene(scene: Scene, plan: Callable[[], Plan] = plan) -> Plan:
            planner.scene = scene
            return plan()

        *own, alone = _least(
            *(lambda scene=scene: with_scene(scene) for scene in SCENES.values()),
            lambda peers=peers: [peer() for peer in peers],
        )
        rows += [
            Row(
                f"`Planner`, {what}, {around}",
                f"{1e3 * seconds:.1f} ms",
                f"{whose}: {1e3 * alone:.2f} ms",
                f"at most {1e3 * most:.0f} ms",
                seconds <= most,
            )
            for around, seconds in zip(SCENES, own, strict=True)
        ]
    return rows


def _jogged(scene: Scene, direction: float) -> list[float]:
    """Return the cost [s] of each step of a jog that continues past the end of its path."""
    planner = Planner(_PARAMETERS, lambda: START)
    planner.scene = scene
    jog, costs = planner.jog(START), []
    for cycle in range(_CYCLES):
        now = cycle * _CYCLE
        jog.command(ToolVelocity(0.05 * direction, 0.1 * direction, 0.0, 0.2), now)
        costs += timings(lambda now=now: jog.step(now, _CYCLE), 1)
    return costs


def _jog() -> list[Row]:
    rows = []
    for around, scene in {**SCENES, "a wall that holds it up": WALL}.items():
        costs: list[float] = []
        for direction in (1.0, -1.0):
            # All runs are the same: the differences are due to other programs.
            runs = [_jogged(scene, direction) for _ in range(3)]
            costs += map(min, zip(*runs, strict=True))
        median, p99 = np.percentile(costs, (50, 99))
        rows.append(
            Row(
                f"jog, a step, until past the end of the way, {around}",
                f"{1e3 * median:.2f} ms median, {1e3 * p99:.2f} ms p99",
                f"a cycle at 100 Hz: {1e3 * _CYCLE:.0f} ms",
                "median at most a tenth of it, p99 at most half",
                bool(median <= _CYCLE / 10.0 and p99 <= _CYCLE / 2.0),
            )
        )
    return rows


def _cold() -> list[Row]:
    """Measure a user's first plan: a whole process."""

    def process(*arguments: str) -> Callable[[], object]:
        return lambda: subprocess.run(
            [sys.executable, *arguments], check=True, stdout=subprocess.DEVNULL
        )

    target = [str(value) for value in GOAL]
    numpy, plan = _least(
        process("-c", "import numpy"),
        process("-m", "bioscara", "plan", "--pose", *target),
        rounds=9,
    )
    return [
        Row(
            "`bioscara plan`, the whole process",
            f"{1e3 * plan:.0f} ms ({plan / numpy:.1f} times)",
            f"Python that imports numpy: {1e3 * numpy:.0f} ms",
            "at most 4 times",
            plan <= 4.0 * numpy,
        )
    ]


def rows() -> list[Row]:
    """Measure every kind of motion."""
    toppra.setup_logging("ERROR")
    return [*_point_to_point(), *_paths(), *_planned(), *_jog(), *_cold()]
