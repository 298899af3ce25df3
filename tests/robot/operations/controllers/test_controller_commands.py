"""Goals of clients' controllers that depend on the whole arm: homing and the jaws."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from bioscara.api import messages as m
from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory import (
    Goal,
    JointTrajectory,
    Point,
)
from bioscara.errors import (
    GoalRejectedError,
    HomingError,
    LifecycleError,
    ModeSwitchError,
    SwitchError,
    ZoneError,
)
from bioscara.planning.collision.scene import Box, Scene
from bioscara.planning.collision.shapes import Prism
from bioscara.robot.workspace.load import Load
from client_controllers import (
    GRIPPER,
    JOINTS,
    POSITION_JTC,
    Site,
    parameter_file,
    site,
    values_of,
)
from served import eventually


@pytest.fixture
def left() -> Iterator[Site]:
    with site() as made:
        yield made


@pytest.fixture
def jaws() -> Iterator[Site]:
    """A slow site in which the gripper is driven: its stroke takes 70 ms."""
    with site(speed=0.3) as left:
        controllers = left.robot.controllers
        assert controllers.set_hardware_state("bioscara_gripper_128", "active") == "active"
        left.load("gripper_controller", GRIPPER, {"joint": "gripper", "goal_tolerance": 1e-3})
        controllers.switch(["gripper_controller"])
        yield left


def test_the_jaws_move_to_a_goal(jaws: Site) -> None:
    controllers = jaws.robot.controllers
    ended = jaws.ended(controllers.move_gripper("gripper_controller", GripperGoal((0.04,))))
    assert ended.status == "succeeded"
    assert ended.gripper is not None
    assert ended.gripper.reached_goal
    jaws.passed(0.1)
    assert values_of(jaws.newest)["gripper/position"] == pytest.approx(0.04)
    (status,) = jaws.newest.controllers
    assert isinstance(status, m.GripperStatus)
    assert (status.goal, status.reached, status.stalled) == (None, True, False)
    with pytest.raises(GoalRejectedError, match="outside"):
        controllers.move_gripper("gripper_controller", GripperGoal((0.5,)))
    eventually(lambda: jaws.robot.workspace.widths == pytest.approx((0.04, 0.04), abs=1e-6))
    # Its controller is left first.
    assert controllers.set_hardware_state("bioscara_gripper_128", "inactive") == "inactive"
    eventually(lambda: not jaws.robot.is_moving)
    assert jaws.states()["gripper_controller"] == "inactive"


def test_rule_71_a_client_may_give_tighter_limits_of_the_jaws(left: Site) -> None:
    controllers = left.robot.controllers
    controllers.set_hardware_state("bioscara_gripper_128", "active")
    tight = {"joint": "gripper", "limits": [0.05, 0.1], "velocity_limit": 0.01}
    left.load("gripper_controller", GRIPPER, tight)
    controllers.switch(["gripper_controller"])
    for width in (0.045, 0.105):
        with pytest.raises(GoalRejectedError, match=r"outside 0.05 .. 0.1 m"):
            controllers.move_gripper("gripper_controller", GripperGoal((width,)))
    start = values_of(left.newest)["gripper/position"]
    width = 0.1 if start < 0.075 else 0.05
    begin = left.newest.time
    left.ended(controllers.move_gripper("gripper_controller", GripperGoal((width,))))
    # Within the tolerance of 10 mm the goal is reached.
    assert left.newest.time - begin > (abs(width - start) - 0.01) / 0.01 - 0.1


def test_a_stroke_that_is_not_clear_is_refused(jaws: Site) -> None:
    controllers = jaws.robot.controllers
    jaws.ended(controllers.move_gripper("gripper_controller", GripperGoal((0.04,))))
    eventually(lambda: jaws.robot.workspace.widths[1] < 0.05)
    controllers.switch((), ["gripper_controller"])
    eventually(lambda: not jaws.robot.is_moving)
    x, y, z, yaw = jaws.robot.pose
    aside = 0.06
    beside = (x - aside * math.sin(yaw), y + aside * math.cos(yaw))
    low, high = ([value + sign * 0.002 for value in beside] for sign in (-1.0, 1.0))
    post = Box("post", (*low, z - 0.05), (*high, z + 0.05))
    jaws.robot.scene = Scene((post,))
    controllers.switch(["gripper_controller"])
    with pytest.raises(ZoneError, match="post"):
        controllers.move_gripper("gripper_controller", GripperGoal((0.11,)))
    assert jaws.newest.ended[-1].status == "succeeded"
    assert jaws.robot.workspace.widths[1] < 0.05


def test_a_goal_of_the_jaws_is_cancelled(jaws: Site) -> None:
    controllers = jaws.robot.controllers
    goal = controllers.move_gripper("gripper_controller", GripperGoal((0.04,)))
    controllers.cancel("gripper_controller", goal)
    assert jaws.ended(goal).status == "canceled"


def test_a_stop_holds_the_jaws_and_ends_their_goal(jaws: Site) -> None:
    controllers = jaws.robot.controllers
    jaws.ended(controllers.move_gripper("gripper_controller", GripperGoal((0.11,))))
    goal = controllers.move_gripper("gripper_controller", GripperGoal((0.04,)))
    jaws.robot.stop()
    ended = jaws.ended(goal)
    assert (ended.status, "stop" in ended.text) == ("aborted", True)
    jaws.at_rest()
    assert jaws.states()["gripper_controller"] == "inactive"
    # They do not go on to the goal.
    assert values_of(jaws.newest)["gripper/position"] > 0.045
    low, high = jaws.robot.workspace.widths
    assert low < high


def test_the_jaws_move_beside_a_planned_goal_and_at_once_after_it(left: Site) -> None:
    controllers = left.robot.controllers
    controllers.set_hardware_state("bioscara_gripper_128", "active")
    left.load("gripper_controller", GRIPPER, {"joint": "gripper"})
    left.load(POSITION_JTC, **parameter_file()[POSITION_JTC])
    controllers.switch(["gripper_controller", POSITION_JTC])
    goal = left.follow(POSITION_JTC, time=6.0)
    left.moving()
    jaws = left.ended(controllers.move_gripper("gripper_controller", GripperGoal((0.05,))))
    assert jaws.status == "succeeded"
    assert left.speed > 0.01
    assert left.ended(goal).status == "succeeded"
    jaws = left.ended(controllers.move_gripper("gripper_controller", GripperGoal((0.04,))))
    assert jaws.status == "succeeded"
    # A stream may lead anywhere.
    controllers.stream(POSITION_JTC, left.trajectory((-0.3, 0.0, 0.0, 0.0), time=6.0))
    left.moving()
    with pytest.raises(GoalRejectedError, match="moves, and on no course that is known"):
        controllers.move_gripper("gripper_controller", GripperGoal((0.05,)))


def test_a_stroke_that_is_not_clear_along_a_goal_is_refused(left: Site) -> None:
    controllers = left.robot.controllers
    controllers.set_hardware_state("bioscara_gripper_128", "active")
    left.load("gripper_controller", GRIPPER, {"joint": "gripper"})
    left.load(POSITION_JTC, **parameter_file()[POSITION_JTC])
    controllers.switch(["gripper_controller"])
    left.ended(controllers.move_gripper("gripper_controller", GripperGoal((0.04,))))
    eventually(lambda: left.robot.workspace.widths[1] < 0.05)
    controllers.switch((), ["gripper_controller"])
    eventually(lambda: not left.robot.is_moving)
    here = left.robot.state.positions
    # Next to the path near its end, where only open jaws would be too near.
    x, y, z, yaw = left.robot.kinematics.forward((here[0] + 0.3, *here[1:]))
    beside = (x - 0.055 * math.sin(yaw), y + 0.055 * math.cos(yaw))
    ahead = (beside[0] - 0.02 * math.cos(yaw), beside[1] - 0.02 * math.sin(yaw))
    low, high = ([value + sign * 0.002 for value in ahead] for sign in (-1.0, 1.0))
    left.robot.scene = Scene((Box("post", (*low, z - 0.05), (*high, z + 0.05)),))
    controllers.switch(["gripper_controller", POSITION_JTC])
    goal = left.follow(POSITION_JTC, (0.3, 0.0, 0.0, 0.0), time=6.0)
    left.moving()
    with pytest.raises(ZoneError, match="post"):
        controllers.move_gripper("gripper_controller", GripperGoal((0.11,)))
    assert left.ended(goal).status == "succeeded"
    assert left.robot.workspace.widths[1] < 0.05


def test_the_jaws_do_not_move_with_a_load(left: Site) -> None:
    controllers = left.robot.controllers
    controllers.set_hardware_state("bioscara_gripper_128", "active")
    left.load("gripper_controller", GRIPPER, {"joint": "gripper"})
    controllers.switch(["gripper_controller"])
    ended = left.ended(controllers.move_gripper("gripper_controller", GripperGoal((0.04,))))
    assert ended.status == "succeeded"
    controllers.switch((), ["gripper_controller"])
    eventually(lambda: not left.robot.is_moving)


SIGNS = {"j2": 1.0, "j1": -1.0, "j4": 1.0, "j3": 1.0}
"""Directions of homing, in its order."""


def test_a_joint_is_homed_again_only_where_the_others_are_at_their_stops(left: Site) -> None:
    controllers = left.robot.controllers
    left.activated("homing_controller")
    for joint, before in (("j4", "j2"), ("j3", "j2")):
        with pytest.raises(HomingError, match=f"{before} is 0.[0-9]+ m from its end stop"):
            controllers.trigger("homing_controller", joint, SIGNS[joint])
    controllers.switch((), ["homing_controller"])
    eventually(lambda: not left.robot.is_moving)
    here = left.robot.state.positions
    left.robot.move_joints((here[0], here[1], 2.5, 0.0))
    controllers.switch(["homing_controller"])
    with pytest.raises(HomingError, match="the elbow is folded"):
        controllers.trigger("homing_controller", "j4", SIGNS["j4"])
    controllers.trigger("homing_controller", "j2", SIGNS["j2"])
    eventually(lambda: left.newest.ended and left.newest.ended[-1].status == "succeeded")


def test_joints_are_homed_by_triggers_in_a_safe_order() -> None:
    with site(at=None, speed=50.0) as left:
        controllers = left.robot.controllers
        controllers.set_hardware_state("bioscara_arm", "active")
        left.activated("homing_controller")
        for joint, before in (("j1", "j2"), ("j4", "j2"), ("j3", "j2")):
            with pytest.raises(HomingError, match=f"{joint} cannot be homed: {before} is not"):
                controllers.trigger("homing_controller", joint, SIGNS[joint])
        with pytest.raises(HomingError, match="leads away from its end stop"):
            controllers.trigger("homing_controller", "j2", -1.0)
        left.load(POSITION_JTC, **parameter_file()[POSITION_JTC])
        for joint, command in SIGNS.items():
            controllers.trigger("homing_controller", joint, command)
            with pytest.raises(GoalRejectedError, match="is homing"):
                controllers.trigger("homing_controller", joint, command)
            with pytest.raises((ModeSwitchError, SwitchError)):
                controllers.switch([POSITION_JTC])
            with pytest.raises(GoalRejectedError, match="inactive: activate it first"):
                left.robot.controllers.follow(
                    POSITION_JTC, Goal(JointTrajectory(JOINTS, (Point(1.0, (0.0,) * 4),)))
                )
            eventually(lambda name=joint: values_of(left.newest)[f"{name}/home"] > 0.0)
            eventually(lambda: left.newest.ended and left.newest.ended[-1].status == "succeeded")
        assert left.robot.is_homed
        controllers.switch([POSITION_JTC], ["homing_controller"])
        with pytest.raises(GoalRejectedError, match="activate it first"):
            controllers.trigger("homing_controller", "j1", -1.0)


def test_a_homing_is_stopped_by_0_and_by_a_stop() -> None:
    with site(at=None, speed=20.0) as left:
        controllers = left.robot.controllers
        controllers.set_hardware_state("bioscara_arm", "active")
        left.activated("homing_controller")
        controllers.trigger("homing_controller", "j2", 1.0)
        left.passed(0.5)
        controllers.trigger("homing_controller", "j2", 0.0)
        eventually(lambda: left.newest.ended)
        assert left.newest.ended[-1].status == "canceled"
        eventually(lambda: left.speed < 1e-3)
        controllers.trigger("homing_controller", "j2", 1.0)
        left.passed(0.5)
        left.robot.stop()
        eventually(lambda: len(left.newest.ended) == 2)
        assert left.newest.ended[-1].status == "aborted"
        left.at_rest()
        assert left.states()["homing_controller"] == "inactive"


def test_homing_needs_an_empty_gripper_and_no_pause() -> None:
    with site() as left:
        controllers = left.robot.controllers
        left.robot.attach(Load("bar", Prism.between((0.0, -0.01, -0.02), (0.05, 0.01, 0.01))))
        left.activated("homing_controller")
        with pytest.raises(LifecycleError, match="the tool carries bar"):
            controllers.trigger("homing_controller", "j2", 1.0)
        left.robot.pause()
        with pytest.raises(LifecycleError, match="motion is paused"):
            controllers.trigger("homing_controller", "j2", 1.0)
