"""Self-collision near the homed position: the arm can leave it, and no link meets another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from bioscara import Robot
from bioscara.errors import MotionCancelledError, ZoneError
from bioscara.model import load_parameters
from bioscara.planning import Trajectory, point_to_point
from bioscara.planning.collision.arm_bodies import WIDTHS
from bioscara.planning.collision.margins import GOAL_SLACK
from bioscara.planning.collision.scene import Cylinder, Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.planning.motions.jog import JointVelocity
from bioscara.robot.planner import ACCELERATION_SHARE, Planner
from bioscara.robot.workspace.workspace import Workspace
from planning.scenes import COUNT

pytestmark = [pytest.mark.usefixtures("near_the_stops"), pytest.mark.thorough]

ARM = load_parameters()
LOWER = np.array([joint.lower for joint in ARM.joints])
UPPER = np.array([joint.upper for joint in ARM.joints])
PLANNED = [
    replace(joint, max_acceleration=ACCELERATION_SHARE * joint.max_acceleration)
    for joint in ARM.joints
]
NAMES = [joint.name for joint in ARM.joints]
HOMED = (-3.04568, 0.33792, 2.62565, 3.00842)
CENTER = (0.0, 0.2, 0.0, 0.0)
INTO_THE_RODS = (-2.9065, 0.3267, 2.4011, 1.1802)
"""Free itself; straight there from home a finger goes into the rods of the column."""
BETWEEN = (0.0, 0.0539, -2.2885, -1.0958)
"""Free with the gripper closed, not with it open."""

places = st.tuples(*(st.floats(joint.lower, joint.upper) for joint in ARM.joints))


class Beside:
    """A planner of an arm at some position, with its gripper as wide as is known."""

    def __init__(self, here: Sequence[float] = HOMED, widths: tuple[float, float] = WIDTHS) -> None:
        self.here, self.workspace = here, Workspace.of(ARM).with_widths(*widths)

    @property
    def plan(self) -> Planner:
        return Planner(self.workspace, lambda: self.here)

    @property
    def scene(self) -> Scene:
        return self.workspace.scene

    @scene.setter
    def scene(self, scene: Scene) -> None:
        self.workspace = self.workspace.with_scene(scene)

    def clearance(self, here: Sequence[float] | None = None) -> float:
        space = self.workspace
        return float(space.surroundings.clearance(space.kinematics, [here or self.here])[0])


def rows_of(trajectory: Trajectory, count: int = 200) -> np.ndarray:
    times = np.linspace(0.0, trajectory.duration, count)
    rows: np.ndarray = trajectory.sample_many(times)[0]
    return rows


def nearest(rows: np.ndarray, width: float) -> float:
    """Return the distance between links by their exact meshes [m]."""
    meshes = pytest.importorskip("planning.meshes", reason="pip install pin: the oracle")
    # The gripper passes 0.8 mm under the upper arm wherever it is, and never otherwise.
    apart = ({"link_2", "gripper"}, {"link_3", "gripper"})
    return min(
        gap
        for row in rows
        for pair, gap in meshes.gaps(row, width).items()
        if set(pair) not in apart
    )


@pytest.mark.parametrize("widths", [(0.04, 0.04), (0.07, 0.07), (0.08, 0.08), WIDTHS])
def test_a_path_from_home_into_the_column_rods_is_refused(
    widths: tuple[float, float],
) -> None:
    arm = Beside(widths=widths)
    direct = point_to_point(NAMES, HOMED, INTO_THE_RODS, PLANNED)
    assert nearest(rows_of(direct, 40), widths[1]) < 0.0
    try:
        plan = arm.plan.move_joints(INTO_THE_RODS)
    except ZoneError as error:
        refused = error
    else:
        refused = None
        assert nearest(rows_of(plan.trajectory, 60), widths[1]) > 0.0
    assert refused is None or (refused.link, refused.zone) == ("jaws", "link_1")


@pytest.mark.parametrize("spread", [0.3, 3.0])
def test_from_home_exactly_the_free_paths_are_accepted(spread: float) -> None:
    rng = np.random.default_rng(8)
    free = hit = 0
    while free + hit < COUNT // 5:
        width = float(rng.uniform(*WIDTHS))
        arm = Beside(widths=(width, width))
        goal = np.clip(HOMED + spread * rng.uniform(-1.0, 1.0, 4) * (1, 0.1, 1, 1), LOWER, UPPER)
        direct = point_to_point(NAMES, HOMED, goal.tolist(), PLANNED)
        least = nearest(rows_of(direct, 60), width)
        try:
            plan = arm.plan.move_joints(goal.tolist())
        except ZoneError:
            hit += 1
            assert least < 0.010, (goal, width)
        else:
            free += 1
            assert least > 0.0 or nearest(rows_of(plan.trajectory, 60), width) > 0.0, (goal, width)
    assert free > 0


@given(places, st.floats(0.0, 0.01), st.sampled_from((-1.0, 1.0)))
def test_the_elbow_alone_can_leave_the_homed_position(
    place: tuple[float, ...], off: float, side: float
) -> None:
    place = (*place[:2], side * (HOMED[2] - off), side * (HOMED[3] - off))
    arm = Beside(place)
    assume(arm.clearance() > 5e-3)
    arm.plan.move_joints((*place[:2], 0.0, place[3]))


def test_a_jog_folds_the_arm_as_far_as_its_margin_and_out_again() -> None:
    arm = Beside((0.0, 0.001, 2.28, -3.0))
    jog, period = arm.plan.jog(arm.here), 0.01
    for direction, steps in ((1.0, 150), (-1.0, 60), (1.0, 150)):
        for step in range(steps):
            jog.command(JointVelocity(j3=0.2 * direction), step * period)
            jog.step(step * period, period)
            arm.here = jog.positions
            assert arm.clearance() >= 5e-3 - 1e-9
        name = "" if jog.limitation is None else jog.limitation.name
        assert (name == "base_link") == (direction > 0.0)


@pytest.mark.parametrize(("nearer", "fine"), [(0.8e-3, True), (1.0e-3, False)])
@pytest.mark.parametrize("margin", [2e-3, 5e-3, 0.02])
def test_a_position_slightly_too_near_may_be_left_but_not_approached(
    margin: float, nearer: float, fine: bool
) -> None:
    arm = Beside()
    arm.scene = Scene(table_height=0.0, margin=margin)
    low = 0.1466 - 0.135 + margin - nearer
    arm.here = (0.0, low, 0.0, 0.0)
    if not fine:
        with pytest.raises(ZoneError, match="at the start"):
            arm.plan.move_joints(CENTER)
        return
    arm.plan.move_joints(CENTER)
    arm.plan.jog(arm.here)
    with pytest.raises(ZoneError, match="table"):
        arm.plan.move_joints((0.0, low - 0.1e-3, 0.0, 0.0))


PUSHED = (0.0, 0.001, 2.303, -3.0)
"""By hand, with the gripper 2 mm from the base."""


def test_an_arm_pushed_against_itself_may_only_move_away() -> None:
    arm = Beside(PUSHED, (0.08, 0.08))
    elbow = next(
        at for at in np.arange(2.3, 2.5, 1e-4) if arm.clearance((*PUSHED[:2], at, PUSHED[3])) < 2e-3
    )
    arm.here = (*PUSHED[:2], float(elbow), PUSHED[3])
    begin = arm.clearance()
    assert begin == pytest.approx(2e-3, abs=1e-4)
    for goal in (elbow + 1e-4, elbow, elbow - 1e-3):
        with pytest.raises(ZoneError, match=r"base_link at the start|base_link from .*"):
            arm.plan.move_joints((*PUSHED[:2], float(goal), PUSHED[3]))
    arm.plan.move_joints((*PUSHED[:2], float(elbow) - 0.01, PUSHED[3]))
    arm.plan.move_joints(CENTER)
    jog = arm.plan.jog(arm.here)
    for step in range(60):
        jog.command(JointVelocity(j3=0.1 if step < 30 else -0.1), step * 0.01)
        arm.here = jog.step(step * 0.01, 0.01)[0]
        assert arm.clearance() >= begin - 1e-9
    assert arm.clearance() > begin + 1e-3


FREE = (0.0, 0.001, 2.28, -3.0)
"""With the gripper turned to the base: 20.5 mm away."""
MOVES = min(COUNT, 40)
"""Number of small moves towards the base, of which about twenty use up the distance."""
STEPS = (0.01, 0.005, 0.002, 0.001, 0.0005, 0.0003, 0.0)


def approach(arm: Beside, off: float) -> float:
    """Approach by small moves as long as one is found, resting after each; return the nearest."""
    nearest_ = arm.clearance()
    for move in range(MOVES):
        for step in STEPS:
            goal = (arm.here[0], arm.here[1] - 1e-3 * (-1) ** move, arm.here[2] + step, arm.here[3])
            try:
                arm.plan.move_joints(goal)
            except ZoneError:
                continue
            arm.here = (*goal[:2], goal[2] + off, goal[3])
            break
        else:
            break
        nearest_ = min(nearest_, arm.clearance())
    return nearest_


def test_small_moves_do_not_accumulate_into_a_collision_with_the_base() -> None:
    arm = Beside(FREE)
    assert arm.clearance() > 0.01
    with pytest.raises(ZoneError, match=r"the margin of 5 mm"):
        arm.plan.move_joints((*FREE[:2], 2.45, FREE[3]))  # the same path in one move
    assert approach(arm, 0.0) > arm.scene.margin - 1e-6


@pytest.mark.parametrize("off", [1e-4, 4e-4])
def test_small_moves_do_not_accumulate_even_if_each_rests_slightly_nearer(off: float) -> None:
    arm = Beside(FREE)
    assert approach(arm, off) > arm.scene.margin - 2.0 * GOAL_SLACK
    arm.plan.move_joints(CENTER)


def test_a_load_is_kept_clear_of_every_link_within_its_reach() -> None:
    """A bottle that is as high as the forearm: folded, it meets the upper arm."""
    arm = Beside((0.0, 0.2, 1.0, 2.5))
    goal = (0.0, 0.2, 2.4, 2.5)
    arm.plan.move_joints(goal)
    bottle = Prism(0.119, 0.0, 0.0, 0.0, -0.15, 0.08, 0.03)
    arm.scene = Scene().carrying(bottle)
    with pytest.raises(ZoneError, match="load comes too near to link_2"):
        arm.plan.move_joints(goal)


def test_from_a_goal_that_was_free_the_arm_can_leave_again() -> None:
    """It rests slightly off the goal, here by more than the goal's slack."""
    start = (0.4297746953080669, 0.2, 1.095035170767486, 0.17580086493352587)
    goal = (-0.023961089524598078, 0.2, 0.9301880158531971, 0.19255204471056064)
    place = (0.5973388428514501, 0.024934661973487482)
    with Robot.simulated(ARM) as robot:
        robot.home()
        robot.move_joints(start)
        thin = Scene((Cylinder("post", *place, 0.01, -1.0, 1.0),))
        room = float(thin.clearance(robot.kinematics, [goal])[0])
        radius = 0.01 + room - thin.margin - 1e-9
        robot.scene = Scene((Cylinder("post", *place, radius, -1.0, 1.0),))
        rests = []
        for _ in range(3):
            robot.move_joints(goal)
            rests.append(robot.state.positions)
            robot.move_joints(start)
        assert robot.scene.clearance(robot.kinematics, rests).min() < 5e-3


def test_collision_checks_use_the_known_jaw_width() -> None:
    every = ARM.gripper.lower, ARM.gripper.upper
    with Robot.simulated(ARM) as robot:
        space = robot.plan.workspace
        assert space.widths == robot.gripper.widths == every
        robot.gripper.enable()
        told = robot.gripper.width
        assert robot.plan.workspace.widths == (told, told) == (0.08, 0.08)
        robot.gripper.move(0.05)
        space = robot.plan.workspace
        assert space.widths == pytest.approx((0.05, 0.05), abs=1e-6)
        assert robot.plan.workspace is space
        robot.gripper.disable()
        assert robot.plan.workspace.widths == every
        # The caller that sets a scene need not know the width.
        robot.scene = replace(Scene(), margin=0.01)
        robot.gripper.enable()
        assert robot.plan.workspace.widths == pytest.approx((0.05, 0.05), abs=1e-6)
        assert robot.plan.workspace.surroundings.margin == 0.01


def test_the_gripper_does_not_open_against_the_arm() -> None:
    with Robot.simulated(ARM) as robot:
        robot.gripper.move(0.05)  # not homed: there is no position to check it by
        robot.home()
        robot.move_joints((BETWEEN[0], BETWEEN[1], 0.0, 0.0))
        robot.move_joints(BETWEEN)
        with pytest.raises(ZoneError, match=r"jaws comes too near to .* at the start") as refused:
            robot.gripper.move(0.11)
        assert refused.value.link == "jaws"
        assert robot.gripper.width == pytest.approx(0.05, abs=1e-6)
        robot.gripper.move(0.045)
        robot.move_joints(CENTER)
        robot.gripper.move(0.11)
        with pytest.raises(ZoneError, match="jaws comes too near"):
            robot.move_joints(BETWEEN)


def test_after_a_cancelled_motion_the_jaws_count_as_anywhere_along_their_travel() -> None:
    with Robot.simulated(ARM) as robot:
        robot.gripper.move(0.05)
        with pytest.raises(MotionCancelledError):
            robot.gripper.move(0.09, on_cycle=lambda _: robot.stop())
        low, high = robot.gripper.widths
        assert (low, high) == pytest.approx((0.05, 0.09), abs=1e-6)
        robot.gripper.move(0.07)
        assert robot.gripper.widths == pytest.approx((0.07, 0.07), abs=1e-6)
        assert math.isfinite(robot.gripper.width)
