"""Controllers of clients at a served arm, over its socket."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from bioscara.control.controllers.gripper_messages import GripperGoal
from bioscara.control.controllers.joint_trajectory import (
    Goal,
    JointTrajectory,
    Point,
)
from bioscara.errors import (
    ConfigurationError,
    GoalRejectedError,
    InvalidArgumentError,
    SwitchError,
)
from bioscara.remote.remote_controllers import RemoteControllers
from client_controllers import (
    BROADCASTER,
    FORWARD,
    GRIPPER,
    JOINTS,
    JTC,
    POSITION_JTC,
    Site,
    parameter_file,
    site,
)
from entries import entry
from served import eventually


@pytest.fixture
def left() -> Iterator[Site]:
    with site() as made:
        yield made


def test_controllers_of_the_original_load_in_addition_to_those_of_the_arm(left: Site) -> None:
    for name, given in parameter_file().items():
        left.load(name, **given)
    left.load("joint_state_broadcaster", BROADCASTER)
    left.load("gripper_controller", GRIPPER, {"joint": "gripper"})
    states = left.states()
    own = {name for name in states if name.startswith("arm.")}
    assert len(own) == 6
    assert {name: states[name] for name in states.keys() - own} == dict.fromkeys(
        [*parameter_file(), "joint_state_broadcaster", "gripper_controller"], "inactive"
    )
    controllers = {each.name: each for each in left.robot.controllers.list().controllers}
    assert controllers["homing_controller"].commands == tuple(f"{each}/home" for each in JOINTS)
    left.robot.controllers.cleanup("homing_controller")
    left.robot.controllers.unload("homing_controller")
    assert "homing_controller" not in left.states()


def test_a_broadcaster_is_active_without_an_operation(left: Site) -> None:
    left.load("joint_state_broadcaster", BROADCASTER)
    text = left.robot.controllers.switch(["joint_state_broadcaster"])
    assert text == "Successfully switched controllers!"
    assert not left.robot.is_moving
    left.robot.move_relative(z=0.005)
    eventually(lambda: left.newest.active == ("joint_state_broadcaster",))
    left.robot.controllers.switch((), ["joint_state_broadcaster"])
    eventually(lambda: left.newest.active == ())


def test_a_goal_is_cancelled(left: Site) -> None:
    left.activated(POSITION_JTC)
    goal = left.follow(POSITION_JTC, time=6.0)
    left.moving()
    left.robot.controllers.cancel(POSITION_JTC, goal)
    ended = left.ended(goal)
    assert (ended.status, ended.error_code) == ("canceled", 0)
    eventually(lambda: left.speed < 1e-3)
    assert left.states()[POSITION_JTC] == "active"
    left.robot.controllers.cancel(POSITION_JTC, goal)
    with pytest.raises(InvalidArgumentError, match="has no goal 77"):
        left.robot.controllers.cancel(POSITION_JTC, 77)


FOREIGN: tuple[Callable[[RemoteControllers, str], object], ...] = (
    lambda c, name: c.load(name, JTC, {"joints": ["j1"]}),
    lambda c, name: c.configure(name),
    lambda c, name: c.cleanup(name),
    lambda c, name: c.unload(name),
    lambda c, name: c.switch([name]),
    lambda c, name: c.switch((), [name]),
    lambda c, name: c.cancel(name, 1),
    lambda c, name: c.command(name, (0.0,)),
    lambda c, name: c.query(name, 0.0),
)
"""Requests for a controller that is not the client's."""


def test_the_arms_own_controllers_are_not_for_clients(left: Site) -> None:
    states = left.states()
    for number, change in enumerate(FOREIGN):
        with entry(f"FOREIGN[{number}]"):
            with pytest.raises((SwitchError, GoalRejectedError, InvalidArgumentError)):
                change(left.robot.controllers, "arm.joint_trajectory_controller")
            assert left.states() == states


REFUSED: tuple[tuple[str, str, dict[str, Any], type[Exception], str], ...] = (
    ("a b", JTC, {}, SwitchError, "letters, digits and underscores"),
    ("", JTC, {}, SwitchError, "letters"),
    ("x" * 65, JTC, {}, SwitchError, "letters"),
    ("x", "bioscara_controllers/HoldController", {}, SwitchError, "no controller type"),
    ("x", "bioscara_controllers/JogController", {}, SwitchError, "no controller type"),
    ("x", JTC, {"joints": ["j1", "j9"]}, ConfigurationError, "'j9' is none of j1, j2"),
    (
        "x",
        JTC,
        {"joints": ["j1"], "fallback_controllers": ["arm.hold_controller"]},
        SwitchError,
        "the arm's own",
    ),
    (
        "x",
        GRIPPER,
        {"joint": "gripper", "limits": [0.03, 0.1]},
        ConfigurationError,
        r"limits 0.03 .. 0.1 m are wider .* 0.04 .. 0.112 m",
    ),
    (
        "x",
        GRIPPER,
        {"joint": "gripper", "velocity_limit": 2.0},
        ConfigurationError,
        "velocity_limit 2 m/s is above .* at most 0.07 m/s",
    ),
    ("x", JTC, {"joints": ["j" * 200_000]}, ConfigurationError, "is none of"),
)
"""Name, type and parameters of a controller, with the error and its text."""


def test_a_controller_that_cannot_be_loaded_is_named(left: Site) -> None:
    for name, kind, parameters, error, text in REFUSED:
        with entry(f"{name} {kind} {str(parameters)[:80]}"):
            with pytest.raises(error, match=text) as raised:
                left.robot.controllers.load(name, kind, parameters)
            assert len(str(raised.value)) < 500
            assert "x" not in left.states()


def test_32_controllers_are_loaded_at_most(left: Site) -> None:
    for number in range(32):
        left.robot.controllers.load(
            f"c{number}", FORWARD, {"joints": ["j1"], "interface_name": "position"}
        )
    with pytest.raises(SwitchError, match="32 controllers are loaded"):
        left.load("c32", FORWARD, {"joints": ["j1"], "interface_name": "position"})
    left.robot.controllers.unload("c2")
    with pytest.raises(SwitchError, match="named c1 is loaded already"):
        left.load("c1", FORWARD, {"joints": ["j1"], "interface_name": "position"})


def test_values_that_are_not_finite_are_refused_and_nothing_moves(left: Site) -> None:
    bad, controllers = math.nan, left.robot.controllers
    left.activated(POSITION_JTC)
    point = Point(1.0, (bad, 0.0, 0.0, 0.0))
    with pytest.raises(GoalRejectedError):
        controllers.follow(POSITION_JTC, Goal(JointTrajectory(JOINTS, (point,))))
    with pytest.raises(GoalRejectedError):
        controllers.stream(POSITION_JTC, JointTrajectory(JOINTS, (point,)))
    with pytest.raises(GoalRejectedError):
        controllers.set_scaling(POSITION_JTC, bad)
    with pytest.raises(InvalidArgumentError):
        controllers.query(POSITION_JTC, bad)
    left.load("forward", FORWARD, {"joints": ["j1"], "interface_name": "position"})
    controllers.switch(["forward"], [POSITION_JTC])
    with pytest.raises(InvalidArgumentError):
        controllers.command("forward", (bad,))
    with pytest.raises(InvalidArgumentError, match="2 values"):
        controllers.command("forward", (0.0, 0.0))
    assert left.speed < 1e-3


def test_a_request_for_a_controller_of_another_kind_or_none_is_named(left: Site) -> None:
    controllers = left.robot.controllers
    left.activated(POSITION_JTC)
    with pytest.raises(GoalRejectedError, match="not a forward_command_controller"):
        controllers.command(POSITION_JTC, (0.0,) * 4)
    with pytest.raises(GoalRejectedError, match="not a parallel_gripper"):
        controllers.move_gripper(POSITION_JTC, GripperGoal((0.04,)))
    with pytest.raises(GoalRejectedError, match="not a single_trigger"):
        controllers.trigger(POSITION_JTC, "j1", 1.0)
    with pytest.raises(SwitchError, match="no controller is named 'nobody'"):
        left.follow("nobody")
    for names in (["nobody"], [POSITION_JTC, "nobody"]):
        with pytest.raises(SwitchError):
            controllers.switch(names)
    assert left.states()[POSITION_JTC] == "active"
    with pytest.raises(GoalRejectedError):
        controllers.follow(POSITION_JTC, Goal(JointTrajectory(("j1",), (Point(1.0, (0.0,)),))))
