"""Laws: however the arm is moved, no link of its plant is ever inside another one.

The judge is :mod:`oracle.oracle`. The arm begins where homing leaves it, or anywhere; its jaws are
anywhere from closed to open; it is empty or holds a plate. A motion that is refused counts as one.
Of the planned motions and the jogs a share runs on the plant, the rest is judged by its plan: by
the commands, and with the margin that the plant needs around them, which is measured on that share.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest

from bioscara.errors import (
    BioscaraError,
    GoalRejectedError,
    GripperError,
    TrajectoryError,
    UnreachableError,
    ZoneError,
)
from bioscara.planning import Trajectory
from bioscara.planning.motions.jog import JointVelocity, ToolVelocity
from oracle.plant import (
    ARM,
    CENTER,
    LOWER,
    UPPER,
    WIDTHS,
    Array,
    Watched,
    clearance,
    random_pose,
    too_near,
)

pytestmark = pytest.mark.thorough

COUNT = int(os.environ.get("BIOSCARA_OWN_MOVES", "12"))
"""Number of moves, jogs and streams that are tried, each half of them from home."""
PLANT_SHARE = 20
"""One in this many planned motions and jogs runs on the plant; every stream does."""
BLOCK = 10
"""Number of successive motions with the same width and load."""
ROOM = 6e-3
"""Distance between links at which a random place begins [m]: more than the planner's margin."""
TRACKING = 3e-3
"""Largest loss of clearance of the plant against its plan [m]: measured by the plant's moves."""
REFUSALS = (ZoneError, TrajectoryError, UnreachableError)
PERIOD, JOG_PERIOD = 0.01, 0.02
"""Of the loop, and of the loop with joints of version 1 [s]."""


@pytest.fixture(scope="module")
def watched() -> Iterator[Watched]:
    made = Watched(seed=5)
    yield made
    made.close()


class Tally:
    """Counts the outcomes of motions, and keeps the collisions."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.counts: Counter[str] = Counter()
        self.collided: list[str] = []

    def judge(
        self, kind: str, number: int, rows: Array, *, carrying: bool, planned: bool = False
    ) -> None:
        self.counts[f"{kind}: moved"] += 1
        found = too_near(rows, carrying=carrying, room=TRACKING if planned else 0.0)
        if not found:
            return
        collided = bool(too_near(rows, carrying=carrying))
        self.counts[f"{kind}: {'collided' if collided else 'too near for the plant'}"] += 1
        self.collided.append(f"{kind} {number} of seed {self.seed}: {'; '.join(found)}")

    def end(self) -> None:
        print(dict(sorted(self.counts.items())))  # noqa: T201
        assert not self.collided, f"{len(self.collided)} collided, the first: " + "\n".join(
            self.collided[:5]
        )


def blocks(watched: Watched, rng: np.random.Generator, count: int) -> Iterator[int]:
    """Yield numbers, and give the arm another width, or a plate, every few of them."""
    for number in range(count):
        if number % BLOCK == 0:
            watched.robot.reduced_speed = not rng.random() < 0.5
            watched.equip(rng.uniform(*WIDTHS), carrying=bool(rng.random() < 0.25))
        yield number


def goal_near(start: Array, rng: np.random.Generator) -> Array:
    """Return a goal: near, far, unfolding all at once, wrist and elbow, or folded up."""
    kind, goal = rng.integers(5), start.copy()
    if kind == 0:
        goal += rng.normal(size=4) * (0.3, 0.05, 0.3, 1.0)
    elif kind == 1:
        goal = rng.uniform(LOWER, UPPER)
    elif kind == 2:
        goal += rng.normal(size=4) * (0.5, 0.05, 0.0, 1.5)
        goal[2] = rng.uniform(-0.5, 1.0) * start[2]
    elif kind == 3:
        goal[2] -= np.sign(start[2]) * rng.uniform(0.0, 0.8)
        goal[3] = rng.uniform(LOWER[3], UPPER[3])
    else:
        goal = rng.uniform(LOWER, UPPER)
        goal[2] = rng.choice((-1.0, 1.0)) * rng.uniform(2.2, UPPER[2])
    clipped: Array = np.clip(goal, LOWER, UPPER)
    return clipped


def poses(trajectory: Trajectory, width: float) -> Array:
    """Return the poses of a planned motion, as often as the plant is sampled."""
    times = np.append(np.arange(0.0, trajectory.duration, PERIOD), trajectory.duration)
    joints = trajectory.sample_many(times)[0]
    return np.column_stack((joints, np.full(len(joints), width)))


def start_of(watched: Watched, number: int, rng: np.random.Generator) -> tuple[str, Array]:
    """Return the start of a planned motion: at home, or at random."""
    if number % 2 == 0:
        return "from home", np.array(watched.home)
    pose = random_pose(rng, watched.width, carrying=watched.carrying, room=ROOM)
    return "from anywhere", pose


def test_planned_moves(watched: Watched) -> None:
    tally, rng = Tally(21), np.random.default_rng(21)
    for number in blocks(watched, rng, COUNT):
        kind, start = start_of(watched, number, rng)
        plan = watched.planner(start.tolist())
        try:
            trajectory = plan.move_joints(goal_near(start, rng).tolist()).trajectory
        except REFUSALS:
            tally.counts[f"{kind}: refused"] += 1
            continue
        rows = poses(trajectory, watched.width)
        tally.judge(kind, number, rows, carrying=watched.carrying, planned=True)
    tally.end()


def test_moves_of_the_plant(watched: Watched) -> None:
    tally, rng, off = Tally(22), np.random.default_rng(22), 0.0
    for number in blocks(watched, rng, max(COUNT // PLANT_SHARE, 2)):
        kind = lead_to_start(watched, number, rng)
        robot = watched.robot
        goal = goal_near(np.array(robot.state.positions), rng)
        try:
            plan = robot.plan.move_joints(goal.tolist())
        except REFUSALS:
            tally.counts[f"{kind}: refused"] += 1
            continue
        rows = run(watched, tally, kind, partial(robot.execute, plan, on_cycle=watched.look))
        tally.judge(kind, number, rows, carrying=watched.carrying)
        if np.abs(rows[-1, :4] - goal).max() > 0.02:
            continue  # A joint lost its reference.
        near, planned = (
            clearance(way, carrying=watched.carrying, within=0.03)
            for way in (rows, poses(plan.trajectory, watched.width))
        )
        off = max(off, planned - near)
    print(f"the plant came up to {1e3 * off:.1f} mm nearer than its plan")  # noqa: T201
    tally.end()
    assert off < TRACKING


def run(watched: Watched, tally: Tally, kind: str, motion: Callable[[], object]) -> Array:
    """Return the positions of the plant in a motion; after a fault continue with another robot.

    Driven to and fro, a joint may stall or fall behind; how it comes to rest then counts too.
    """
    try:
        motion()
    except BioscaraError:
        if not watched.robot.faults:
            raise
        tally.counts[f"{kind}: lost its way"] += 1
        rows = watched.seen()
        watched.renew()
        return rows
    return watched.seen()


def lead_to_start(watched: Watched, number: int, rng: np.random.Generator) -> str:
    """Bring the plant home, or anywhere."""
    watched.fold()
    if number % 2 == 0:
        return "from home"
    pose = random_pose(rng, watched.width, carrying=watched.carrying, room=ROOM)
    j1, j2, _, j4 = watched.home
    watched.lead([(j1, j2, 0.0, j4), (*pose[:2], 0.0, pose[3]), pose])
    return "from anywhere"


def test_the_jaws_of_the_plant(watched: Watched) -> None:
    """Opened or closed next to the column the jaws meet it too, with joints that stand still."""
    tally, rng = Tally(26), np.random.default_rng(26)
    for number in range(max(COUNT // PLANT_SHARE, 4)):
        watched.equip(rng.uniform(*WIDTHS), carrying=False)
        pose = random_pose(rng, watched.width, carrying=False, room=ROOM)
        pose[2] = np.copysign(max(abs(pose[2]), 1.8), pose[2])
        if too_near(np.array([[*pose, watched.width]])):
            continue
        j1, j2, _, j4 = watched.home
        watched.lead([(j1, j2, 0.0, j4), (*pose[:2], 0.0, pose[3]), pose])
        watched.look()
        try:
            watched.robot.gripper.move(rng.uniform(*WIDTHS))
        except (ZoneError, GripperError, GoalRejectedError):
            tally.counts["jaws: refused"] += 1
        tally.judge("jaws", number, watched.seen(), carrying=False)
    tally.end()


def velocities(
    start: Array, rng: np.random.Generator
) -> Callable[[], JointVelocity | ToolVelocity]:
    """Return a source of velocities: unfolding, the elbow before the wrist, or at random."""
    fastest = np.array([joint.max_velocity for joint in ARM.joints])
    kind, asked = rng.integers(4), 0
    out = -np.sign(start[2])
    steady = rng.uniform(-1.0, 1.0, 4) * (0.3, 0.01, 0.0, 2.0)
    steady[2] = out * rng.uniform(0.1, 0.8)
    first = int(rng.integers(5, 60))
    values: JointVelocity | ToolVelocity = JointVelocity()

    def ask() -> JointVelocity | ToolVelocity:
        nonlocal asked, values
        asked += 1
        if kind == 0:
            values = JointVelocity(*steady.tolist())
        elif kind == 1:
            elbow = asked <= first
            values = JointVelocity(j3=steady[2]) if elbow else JointVelocity(j4=steady[3])
        elif asked == 1 or rng.random() < 0.03:
            joints = rng.uniform(-1.0, 1.0, 4) * fastest * rng.uniform(0.05, 1.0)
            joints *= rng.random(4) < rng.choice((0.4, 1.0))
            tool = rng.uniform(-0.2, 0.2, 3)
            values = (
                JointVelocity(*joints.tolist())
                if rng.random() < 0.8
                else ToolVelocity(*tool.tolist())
            )
        return values

    return ask


def test_jogs(watched: Watched) -> None:
    tally, rng = Tally(23), np.random.default_rng(23)
    for number in blocks(watched, rng, COUNT):
        kind, start = start_of(watched, number, rng)
        try:
            jog = watched.planner(start.tolist()).jog(start.tolist())
        except REFUSALS:
            tally.counts[f"{kind}: refused"] += 1
            continue
        ask, rows = velocities(start, rng), [[*jog.positions, watched.width]]
        for cycle in range(100):
            jog.command(ask(), cycle * JOG_PERIOD)
            jog.step(cycle * JOG_PERIOD, JOG_PERIOD)
            rows.append([*jog.positions, watched.width])
        tally.judge(kind, number, np.array(rows), carrying=watched.carrying, planned=True)
    tally.end()


def test_jogs_of_the_plant(watched: Watched) -> None:
    tally, rng = Tally(24), np.random.default_rng(24)
    for number in blocks(watched, rng, max(COUNT // PLANT_SHARE, 2)):
        kind = lead_to_start(watched, number, rng)
        here = np.array(watched.robot.state.positions)
        ask, cycles = velocities(here, rng), iter(range(200))

        def velocity(ask=ask, cycles=cycles):  # type: ignore[no-untyped-def]
            return None if next(cycles, None) is None else ask()

        try:
            watched.robot.plan.jog(watched.robot.state.positions)
        except REFUSALS:
            tally.counts[f"{kind}: refused"] += 1
            continue
        jog = partial(watched.robot.jog, velocity, on_cycle=watched.look)
        tally.judge(kind, number, run(watched, tally, kind, jog), carrying=watched.carrying)
    tally.end()


def setpoints(start: Array, rng: np.random.Generator) -> Callable[[], list[float] | None]:
    """Return a source of positions for a second."""
    place, left = start, 100

    def ask() -> list[float] | None:
        nonlocal place, left
        if left % 25 == 0:
            some = rng.random(4) < rng.choice((0.3, 0.6, 1.0))
            place = np.where(some, goal_near(start, rng), place)
        left -= 1
        return None if left < 0 else place.tolist()

    return ask


def test_raw_streams(watched: Watched) -> None:
    tally, rng = Tally(25), np.random.default_rng(25)
    for number in blocks(watched, rng, COUNT // 2):
        # A stream from home, and others from wherever that ended.
        where = "from anywhere"
        if number % 5 == 0:
            where = "from home"
            watched.fold()
        begin = np.array(watched.robot.state.positions)
        ask = setpoints(begin, rng)
        rows = run(watched, tally, where, partial(watched.stream, ask))
        tally.judge(where, number, rows, carrying=watched.carrying)
    tally.end()


def test_the_named_detour_from_home_to_the_center_is_clear(watched: Watched) -> None:
    for width in np.linspace(*WIDTHS, 5):
        watched.fold()
        watched.equip(width, carrying=False)
        watched.rows.clear()
        for name in ("unfold", "center"):
            if name == "unfold":
                watched.robot.unfold(on_cycle=watched.look)
            else:
                watched.robot.move_named(name, on_cycle=watched.look)
        rows = watched.seen()
        assert rows[-1, :4] == pytest.approx(CENTER, abs=5e-3)
        assert too_near(rows) == []
