"""Planning times: each kind of motion next to a third-party planner that times the same."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import toppra

from benchmarks.measure import Row, at_most, duration, medians, timed
from benchmarks.peers import Ruckig, random_problem, toppra_duration
from benchmarks.startup import process
from bioscara.kinematics import Pose
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, point_to_point, sequence
from bioscara.planning.collision.scene import Box, Cylinder, Scene
from bioscara.planning.limits import FULL, MotionLimits, ToolLimits
from bioscara.planning.motions.cartesian import circular, linear
from bioscara.planning.motions.double_s import Bounds, least_duration, rest_to_rest
from bioscara.planning.motions.jog import ToolVelocity
from bioscara.planning.motions.waypoints import Waypoint, approach, retract
from bioscara.planning.paths.blending import rounded
from bioscara.planning.paths.inverse_kinematics import along
from bioscara.planning.paths.segments import Arc, Line, Path
from bioscara.robot import kinematics_of
from bioscara.robot.planner import Plan, Planner
from bioscara.robot.workspace.workspace import Workspace

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
_ROUGH = [MotionLimits.of(limit)._replace(max_jerk=math.inf) for limit in _JOINTS]
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
    return Ruckig(START, END, bounds)


def _single(start: float, goal: float, bounds: Bounds) -> object:
    way = goal - start
    return rest_to_rest(start, way, least_duration(way, bounds), bounds)


def _point_to_point() -> list[Row]:
    rows = []
    for kind, jerk_limited, most in (
        ("jerk-limited", True, 600),
        ("without jerk limit", False, 400),
    ):
        peer = _ruckig(jerk_limited=jerk_limited)
        own, alone = medians(
            lambda limits=_JOINTS if jerk_limited else _ROUGH: point_to_point(
                _NAMES, START, END, limits
            ),
            peer.plan,
            number=(1, 5),
        )
        what = f"PTP of four joints, {kind}, the trajectory included"
        rows.append(at_most(what, own, most, alone, "ruckig alone, compiled"))
    rng = random.Random(7)
    problems = [random_problem(rng, 1) for _ in range(501)]
    states, peers = iter(problems), iter([Ruckig(*problem) for problem in problems])
    single, alone = medians(
        lambda: _single(*(column[0] for column in next(states))),
        lambda: next(peers).plan(),
        rounds=len(problems),
    )
    what = "one joint from rest to rest"
    rows.append(at_most(what, single, 150, alone, "ruckig alone, compiled"))
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
        own, bounded, alone = medians(*functions, rounds=7 if pieces > 1000 else 31)
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
    planner = Planner(Workspace.of(_PARAMETERS), lambda: START)
    line, arc = Line(CORNERS[0], GOAL), Arc.through(CORNERS[0], VIA, GOAL)
    corners = rounded([Line(*ends) for ends in pairwise(CORNERS)], [BLEND] * 2).path
    down = Line(GOAL.compose(ABOVE), GOAL)
    ptp = _ruckig(jerk_limited=True)
    kinds: list[tuple[str, Callable[[], Plan], str, tuple[Path, ...]]] = [
        ("LIN", lambda: planner.move_linear(GOAL), "toppra alone", (line,)),
        ("CIRC", lambda: planner.move_circular(VIA, GOAL), "toppra alone", (arc,)),
        ("sequence", lambda: planner.move_sequence(AROUND), "toppra alone", (corners,)),
        (
            "approach and retract",
            lambda: planner.move_sequence(THERE_AND_BACK),
            "ruckig once and toppra twice",
            (down, down),
        ),
    ]

    def with_scene(scene: Scene, plan: Callable[[], Plan]) -> Plan:
        planner.workspace = planner.workspace.with_scene(scene)
        return plan()

    *own, peer = medians(
        *(
            lambda s=scene: with_scene(s, lambda: planner.move_joints(END))
            for scene in SCENES.values()
        ),
        _toppra(line, 200),
    )
    rows = [
        at_most(f"`Planner`, PTP, {around}", time, 2, peer, "toppra alone, for a line")
        for around, time in zip(SCENES, own, strict=True)
    ]
    for what, plan, whose, paths in kinds:
        planner.workspace = planner.workspace.with_scene(Scene())
        pieces = (len(plan().trajectory.times) - 1) // len(paths)
        peers = [_toppra(path, pieces) for path in paths]
        if len(paths) > 1:
            peers.append(ptp.plan)

        *own, peer = medians(
            *(lambda s=scene, p=plan: with_scene(s, p) for scene in SCENES.values()),
            lambda peers=peers: [peer() for peer in peers],
        )
        rows += [
            at_most(f"`Planner`, {what}, {around}", time, 4, peer, whose)
            for around, time in zip(SCENES, own, strict=True)
        ]
    return rows


def _jogged(scene: Scene, direction: float) -> tuple[list[float], list[float]]:
    """Return the cost of each step of a jog past the end of its path, and of a solution [s]."""
    planner = Planner(Workspace.of(_PARAMETERS), lambda: START)
    planner.workspace = planner.workspace.with_scene(scene)
    jog, costs, solutions = planner.jog(START), [], []
    for cycle in range(_CYCLES):
        now = cycle * _CYCLE
        jog.command(ToolVelocity(0.05 * direction, 0.1 * direction, 0.0, 0.2), now)
        costs.append(timed(lambda now=now: jog.step(now, _CYCLE)))
        solutions.append(timed(lambda: ARM.inverse(GOAL), 20))
    return costs, solutions


def _jog() -> list[Row]:
    rows = []
    for around, scene in {**SCENES, "a wall that holds it up": WALL}.items():
        costs: list[float] = []
        solutions: list[float] = []
        for direction in (1.0, -1.0):
            # All runs are the same: the differences are due to other programs.
            steps, solved = zip(*(_jogged(scene, direction) for _ in range(3)), strict=True)
            costs += map(min, zip(*steps, strict=True))
            solutions += map(min, zip(*solved, strict=True))
        median, p99 = np.percentile(costs, (50, 99)).tolist()
        solution = float(np.median(solutions))
        rows.append(
            Row(
                f"jog, a step, until past the end of the path, {around}",
                f"{duration(median)} median ({median / solution:.0f} times), "
                f"{duration(p99)} p99 ({p99 / solution:.0f} times)",
                f"inverse kinematics of one pose: {duration(solution)}",
                "median at most 400 times, p99 at most 2000 times",
                median <= 400 * solution and p99 <= 2000 * solution,
            )
        )
    return rows


def _cold() -> list[Row]:
    """Measure a user's first plan: a whole process."""
    target = [str(value) for value in GOAL]
    numpy, plan = medians(
        process("-c", "import numpy"),
        process("-m", "bioscara", "plan", "--pose", *target),
        rounds=9,
    )
    whose = "Python that imports numpy"
    return [at_most("`bioscara plan`, the whole process", plan, 4, numpy, whose)]


def rows() -> list[Row]:
    """Measure every kind of motion."""
    toppra.setup_logging("ERROR")
    return [*_point_to_point(), *_paths(), *_planned(), *_jog(), *_cold()]
