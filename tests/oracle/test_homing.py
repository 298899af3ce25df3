"""Homing folds the arm up: in which order, at which widths and from where that is free.

Each joint goes alone to its end stop, so the paths are known without the plant; some are confirmed
on it, with the compiled firmware. Before homing nothing is known of the arm. Result: from every
start with an elbow that is not folded the hand meets nothing. Of the others some lead a jaw into
the column while the wrist turns, for any order and width.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from bioscara import Robot
from bioscara.errors import HomingError
from bioscara.model import load_parameters
from bioscara.robot.operations.motions.homing_order import BEFORE, FOLDED
from bioscara.sim import FirmwareBus, SimulatedArm
from oracle.oracle import HAND, JAWS, Hit, Oracle
from oracle.plant import ELBOW, LOWER, NAMES, UPPER, Array, dense, too_near
from simulated import turn_by_hand

STARTS = int(os.environ.get("BIOSCARA_HOMING_STARTS", "30"))
"""Number of random starts from which homing is checked."""
ON_PLANT = max(STARTS // 40, 2)
"""From how many of them it runs on the plant, which takes seconds each."""
ARM = load_parameters()
ENDS = np.array([joint.home_position for joint in ARM.joints])
WIDTHS = (ARM.gripper.lower, ARM.gripper.upper)
JUDGE = Oracle(pairs=[(one, other) for one in ("base_link", "link_1") for other in HAND])
"""No other links can meet: test_oracle."""


def starts(rng: np.random.Generator, count: int) -> Array:
    """Return random places of joints and jaws at which the arm does not intersect, (count, 5)."""
    rows = rng.uniform([*LOWER, WIDTHS[0]], [*UPPER, WIDTHS[1]], (2 * count, 5))
    free: Array = rows[~JUDGE.colliding(rows[:, :4], rows[:, 4])][:count]
    return free


def hits(begin: Array, order: Sequence[str]) -> list[tuple[str, Hit]]:
    """Return each hit, with the moving joint, when joints go to their end stops in this order."""
    found, here = [], begin.copy()
    for name in order:
        joint = NAMES.index(name)
        there = here.copy()
        there[joint] = ENDS[joint]
        way = dense(np.array([here, there]))
        way = way[np.abs(way[:, 2]) > ELBOW]
        found += [(name, hit) for hit in JUDGE.hits(way[:, :4], way[:, 4])]
        here = there
    return found


def test_from_an_elbow_that_is_not_folded_homing_meets_nothing() -> None:
    rng = np.random.default_rng(11)
    folded = collided = 0
    nearest = np.pi
    for begin in starts(rng, STARTS):
        found = hits(begin, ARM.homing_order)
        folded += abs(begin[2]) > FOLDED
        if found:
            collided += 1
            nearest = min(nearest, abs(begin[2]))
            assert abs(begin[2]) > FOLDED
            # The column: the wrist turns next to it, where the elbow has led it. Where it ends in
            # touch the elbow begins in touch.
            assert found[0][0] == "j4"
            assert {name for name, _ in found} <= {"j4", "j3"}
            assert {hit.links for _, hit in found} <= {("link_1", jaw) for jaw in JAWS}
    told = f"{collided} of {STARTS} collide, j3 from {nearest:.3f} rad on; {folded} begin folded"
    print(told)  # noqa: T201


def test_the_limit_of_the_elbow_holds_at_its_edge() -> None:
    rng = np.random.default_rng(12)
    rows = starts(rng, STARTS)
    rows[:, 2] = rng.choice((-1.0, 1.0), len(rows)) * rng.uniform(2.2, FOLDED, len(rows))
    for begin in rows[~JUDGE.colliding(rows[:, :4], rows[:, 4])]:
        assert hits(begin, ARM.homing_order) == []


@pytest.mark.skipif(STARTS < 1000, reason="compares hundreds of homings: make laws")
def test_no_other_order_is_better_and_no_width_is_free() -> None:
    rng = np.random.default_rng(13)
    begins = starts(rng, STARTS // 10)
    counts = {
        order: sum(bool(hits(begin, order)) for begin in begins)
        for order in itertools.permutations(NAMES)
    }
    wide = starts(rng, STARTS // 2)
    by_width = {}
    for width in np.linspace(*WIDTHS, 9):
        wide[:, 4] = width
        free = wide[~JUDGE.colliding(wide[:, :4], wide[:, 4])]
        by_width[round(width, 3)] = sum(bool(hits(begin, ARM.homing_order)) for begin in free)
    print("by order, of", len(begins), counts)  # noqa: T201
    print("by width, of", len(wide), by_width)  # noqa: T201
    assert counts[ARM.homing_order] == min(counts.values())
    assert min(by_width.values()) > 0


class Standing:
    """A robot whose joints stand somewhere, not homed, and a record of its plant."""

    def __init__(self, at: Sequence[float], width: float) -> None:
        self.arm = SimulatedArm(seed=4, positions=dict(zip(NAMES, at, strict=True)))
        self.robot = Robot(FirmwareBus(self.arm), self.arm.clock, ARM, "standing")
        self.width, self.rows = width, []  # type: ignore[var-annotated]

    def look(self, _: object = None) -> None:
        self.rows.append((*(self.arm.position(name) for name in NAMES), self.width))

    def seen(self) -> Array:
        rows, self.rows = np.array(self.rows), []
        return rows


def test_homing_of_the_simulated_arm_takes_the_same_path() -> None:
    rng = np.random.default_rng(14)
    for begin in starts(rng, 8 * ON_PLANT)[:ON_PLANT]:
        begin[0] = LOWER[0] + 0.2 * rng.random()  # The column takes minutes and meets nothing.
        begin[2] = np.clip(begin[2], -FOLDED, FOLDED)
        if JUDGE.colliding(begin[:4], begin[4]).any():
            continue
        standing = Standing(begin[:4], begin[4])
        with standing.robot:
            standing.robot.home(on_cycle=standing.look)
            rows = standing.seen()
            assert rows[-1, :4] == pytest.approx(ENDS, abs=5e-3)
            assert too_near(rows) == []


NEAR = (-3.0, 0.33, 2.58, 2.9)
OPEN = (-3.0, 0.33, 0.3, 0.1)


@pytest.fixture
def homed() -> Iterator[Standing]:
    standing = Standing(NEAR, ARM.gripper.initial)
    with standing.robot:
        standing.robot.home()
        yield standing


def lose(standing: Standing, joint: str) -> None:
    """Let a joint's controller restart: it loses its reference."""
    robot = standing.robot
    standing.arm.reset(joint)
    standing.arm.run(0.5)
    robot.state  # noqa: B018
    if robot.faults:
        robot.acknowledge()
        robot.recover()


def test_an_elbow_that_is_homed_alone_finds_the_wrist_at_its_end_stop(homed: Standing) -> None:
    robot = homed.robot
    robot.unfold()
    robot.move_joints(OPEN)
    lose(homed, "j3")
    robot.home(on_cycle=homed.look)
    rows = homed.seen()
    assert too_near(rows) == []
    assert rows[-1, 2] == pytest.approx(ENDS[2], abs=5e-3)
    # A rotor that slips at the second touch rests a period of its field farther inside: 10.5 mrad.
    assert rows[-1, 3] == pytest.approx(ENDS[3], abs=1.5e-2)
    assert robot.state.positions[3] == pytest.approx(rows[-1, 3], abs=2e-3)
    assert "j4 is homed again, before j3" in robot.warnings[-1]
    # The path of the elbow alone.
    alone = np.linspace((*OPEN, 0.08), (*OPEN[:2], ENDS[2], OPEN[3], 0.08), 400)
    assert JUDGE.colliding(alone[:, :4], alone[:, 4]).any()


def test_a_wrist_is_homed_with_the_lift_up(homed: Standing) -> None:
    robot = homed.robot
    robot.unfold()
    robot.move_joints((-3.0, 0.25, 0.3, 2.9))
    lose(homed, "j4")
    robot.home(on_cycle=homed.look)
    rows = homed.seen()
    turned = np.flatnonzero(np.abs(rows[:, 3] - rows[0, 3]) > 0.02)
    assert rows[turned[0], 1] == pytest.approx(ENDS[1], abs=5e-3)
    assert "j2 is homed again, before j4" in robot.warnings[-1]


def test_a_wrist_is_not_turned_while_the_elbow_is_folded(homed: Standing) -> None:
    robot = homed.robot
    lose(homed, "j4")
    with pytest.raises(HomingError, match=r"j3 at 2\.62.*open the elbow by hand"):
        robot.home(on_cycle=homed.look)
    assert homed.rows == []
    robot.disable()
    turn_by_hand(homed.arm, "j3", 2.0)
    robot.home(on_cycle=homed.look)
    assert homed.seen()[-1, 3] == pytest.approx(ENDS[3], abs=5e-3)


def test_homed_joints_stay_homed_where_their_path_is_clear(homed: Standing) -> None:
    robot = homed.robot
    lose(homed, "j1")
    begin = homed.arm.now()
    robot.home()
    assert homed.arm.now() - begin < 30.0
    assert robot.warnings == ()
    assert set(BEFORE) == {"j3", "j4"}
