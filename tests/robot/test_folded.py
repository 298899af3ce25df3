"""The arm folded up, as homing leaves it: it gets out, back to where it was, and no further in."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bioscara.errors import ZoneError
from bioscara.model import load_parameters
from bioscara.planning.jog import JointVelocity
from bioscara.planning.standing import STAND
from bioscara.planning.zones import Cylinder, Scene
from bioscara.robot import Robot
from bioscara.robot.planner import Planner

ARM = load_parameters()
HOMED = (-3.04568, 0.33792, 2.62565, 3.00842)
HALF = (*HOMED[:2], 2.5, HOMED[3])
"""Folded up, but with room to fold farther."""
CENTER = (0.0, 0.2, 0.0, 0.0)

places = st.tuples(*(st.floats(joint.lower, joint.upper) for joint in ARM.joints))
inaccuracies = st.tuples(*(st.floats(-1e-3, 1e-3) for _ in ARM.joints))
shares = st.floats(0.0, 1.0)


class Folded:
    """A planner of an arm that stands where homing left it, and is then put elsewhere."""

    def __init__(self, here: Sequence[float] = HOMED) -> None:
        self.here = here
        self.plan = Planner(ARM, lambda: self.here)

    def stand(self, near: Sequence[float], off: Sequence[float]) -> None:
        """Stand somewhere, but not exactly."""
        self.here = tuple(
            min(max(place + error, joint.lower), joint.upper)
            for joint, place, error in zip(ARM.joints, near, off, strict=True)
        )

    def clearance(self) -> float:
        return self.plan.scene.own_clearance(self.plan.kinematics, self.here)


@given(places, shares, inaccuracies)
def test_wherever_it_is_stopped_it_can_go_back_to_where_it_came_from(
    goal: tuple[float, ...], share: float, off: tuple[float, ...]
) -> None:
    folded = Folded()
    try:
        way = folded.plan.joints(goal).trajectory
    except ZoneError:
        assume(False)
    folded.stand(way.sample(share * way.duration).positions, off)
    assume(folded.clearance() < folded.plan.scene.margin)
    folded.plan.joints(HOMED)
    folded.plan.jog(folded.here)


@given(inaccuracies, inaccuracies)
def test_a_milliradian_does_not_shut_it_in(
    off: tuple[float, ...], other: tuple[float, ...]
) -> None:
    folded = Folded()
    folded.stand(HALF, off)
    folded.plan.joints(HALF)
    folded.stand(HALF, other)
    folded.plan.joints(CENTER)
    folded.plan.joints(HALF)


def test_it_does_not_creep_in() -> None:
    """A little nearer with each motion would end in the column."""
    folded = Folded(HALF)
    folded.plan.joints(CENTER)
    begin = folded.clearance()

    def creep() -> None:
        for _ in range(100):
            deeper = (*HALF[:2], folded.here[2] + 1e-3, HALF[3])
            folded.plan.joints(deeper)
            folded.here = deeper

    with pytest.raises(ZoneError, match="nearer than where the arm began, folded up"):
        creep()
    assert folded.clearance() > begin - STAND - 0.5e-3


def test_a_refusal_speaks_of_what_a_person_sees() -> None:
    with pytest.raises(ZoneError) as refused:
        Folded(HALF).plan.joints(HOMED)
    text = str(refused.value)
    assert "margin" not in text
    assert "-" not in text
    assert "unfold the elbow alone first: unfold(), which is j3 to 0 and no other joint" in text


@given(places, st.floats(2.3, 2.62), st.sampled_from((-1.0, 1.0)))
def test_the_elbow_alone_leads_out_from_anywhere(
    place: tuple[float, ...], elbow: float, side: float
) -> None:
    place = (*place[:2], side * elbow, place[3])
    folded = Folded(place)
    assume(folded.clearance() < folded.plan.scene.margin)
    folded.plan.joints((*place[:2], 0.0, place[3]))


def test_unfolded_it_is_not_folded_up_again() -> None:
    folded = Folded()
    folded.plan.joints(CENTER)
    folded.here = CENTER
    with pytest.raises(ZoneError, match=r"the margin of 5 mm is missed"):
        folded.plan.joints(HOMED)
    folded.plan.jog(CENTER)
    folded.here = HALF
    with pytest.raises(ZoneError, match="unfold"):
        folded.plan.joints(HOMED)


def test_a_jog_comes_back_too_and_no_further() -> None:
    folded = Folded()
    jog, period = folded.plan.jog(HOMED), 0.01
    for direction, steps in ((-1.0, 60), (1.0, 200)):
        for step in range(steps):
            jog.command(JointVelocity(j3=0.3 * direction), step * period)
            jog.step(step * period, period)
    assert jog.positions[2] == pytest.approx(HOMED[2], abs=5e-3)
    assert jog.positions[2] < HOMED[2] + 2e-3
    assert jog.reason in ("link_1", "base_link")


@pytest.mark.parametrize(("nearer", "fine"), [(0.8e-3, True), (1.0e-3, False)])
@pytest.mark.parametrize("margin", [2e-3, 5e-3, 0.02])
def test_a_stand_that_is_a_little_too_near_may_be_left_and_not_approached(
    margin: float, nearer: float, fine: bool
) -> None:
    folded = Folded()
    folded.plan.scene = Scene(table_height=0.0, margin=margin)
    low = 0.1466 - 0.135 + margin - nearer
    folded.here = (0.0, low, 0.0, 0.0)
    if not fine:
        with pytest.raises(ZoneError, match="at the start"):
            folded.plan.joints(CENTER)
        return
    folded.plan.joints(CENTER)
    folded.plan.jog(folded.here)
    with pytest.raises(ZoneError, match="table"):
        folded.plan.joints((0.0, low - 0.1e-3, 0.0, 0.0))


FREE = (0.0, 0.001, 2.28, -3.0)
"""Unfolded, with the gripper turned to the base: 11.6 mm away."""
STEPS = (0.01, 0.005, 0.002, 0.001, 0.0005, 0.0003, 0.0)


def approach(arm: Folded, off: float) -> float:
    """Go nearer by small moves as long as one is found, resting beside each; return the nearest."""
    nearest = arm.clearance()
    for move in range(100):
        for step in STEPS:
            goal = (arm.here[0], arm.here[1] - 1e-3 * (-1) ** move, arm.here[2] + step, arm.here[3])
            try:
                arm.plan.joints(goal)
            except ZoneError:
                continue
            arm.here = (*goal[:2], goal[2] + off, goal[3])
            break
        else:
            break
        nearest = min(nearest, arm.clearance())
    return nearest


def test_small_moves_do_not_lead_the_gripper_into_the_base() -> None:
    arm = Folded(FREE)
    assert arm.clearance() > 0.01
    with pytest.raises(ZoneError, match=r"the margin of 5 mm"):
        arm.plan.joints((*FREE[:2], 2.32, FREE[3]))  # the same way in one go
    assert approach(arm, 0.0) > arm.plan.scene.margin - 1e-6


@pytest.mark.parametrize("off", [1e-4, 4e-4])
@pytest.mark.parametrize("begin", [FREE, HALF], ids=["free", "folded"])
def test_nor_do_they_where_it_always_rests_a_little_nearer(
    begin: Sequence[float], off: float
) -> None:
    arm = Folded(begin)
    least = min(arm.clearance(), arm.plan.scene.margin) - 2.0 * STAND
    assert approach(arm, off) > least
    arm.plan.joints(CENTER)


def test_from_a_goal_that_was_free_the_arm_can_leave_again() -> None:
    """It rests a hair beside the goal, here by more than what the goal had to spare."""
    start = (0.4297746953080669, 0.2, 1.095035170767486, 0.17580086493352587)
    goal = (-0.023961089524598078, 0.2, 0.9301880158531971, 0.19255204471056064)
    place = (0.5973388428514501, 0.024934661973487482)
    with Robot.simulated(ARM) as robot:
        robot.home()
        robot.move_joints(start)
        thin = Scene((Cylinder("post", *place, 0.01, -1.0, 1.0),))
        room = float(thin.clearance(robot.kinematics, [goal])[0])
        radius = 0.01 + room - thin.margin - 1e-6
        robot.plan.scene = Scene((Cylinder("post", *place, radius, -1.0, 1.0),))
        robot.move_joints(goal)
        assert robot.plan.scene.clearance(robot.kinematics, [robot.state.positions])[0] < 5e-3
        robot.move_joints(start)
