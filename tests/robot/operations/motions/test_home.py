"""Homing of chosen joints, by the same rules of order as that of all."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import pytest

from bioscara import Robot
from bioscara.errors import HomingError, InvalidArgumentError
from served import own_robot


@pytest.fixture
def robot(tmp_path: Path) -> Iterator[Robot]:
    """Return a robot near its end stops that is not homed."""
    with own_robot(tmp_path) as made:
        yield made


def known(robot: Robot) -> list[str]:
    """Return the names of the joints whose positions are known."""
    state = robot.state
    return [n for n, p in zip(state.names, state.positions, strict=True) if not math.isnan(p)]


def test_chosen_joints_are_homed_and_no_others(robot: Robot) -> None:
    robot.home(["j2"])
    assert known(robot) == ["j2"]
    robot.home(("j4", "j1"))
    assert known(robot) == ["j1", "j2", "j4"]
    robot.home()
    assert robot.is_homed


def test_a_joint_is_not_homed_before_those_that_keep_the_hand_clear(robot: Robot) -> None:
    for joint, other in (("j1", "j2"), ("j4", "j2"), ("j3", "j2")):
        with pytest.raises(HomingError, match=f"{joint} cannot be homed: {other} is not homed"):
            robot.home([joint])
    with pytest.raises(HomingError, match="j3 cannot be homed: j4 is not homed"):
        robot.home(["j2", "j1", "j3"])
    assert known(robot) == []


def test_a_homed_joint_is_homed_again_if_it_is_chosen(robot: Robot) -> None:
    robot.home()
    robot.unfold()
    here = robot.state.positions
    robot.move_joints((here[0] + 0.02, *here[1:]))
    at = robot.clock.now()
    robot.home(["j1"])
    assert robot.clock.now() > at + 0.5
    assert robot.is_homed
    end = robot.parameters.joints[0].home_position
    assert robot.state.positions[0] == pytest.approx(end, abs=0.05)


def test_a_joint_is_not_homed_again_while_another_is_far_from_its_end_stop(robot: Robot) -> None:
    robot.home()
    robot.unfold()
    here = robot.state.positions
    robot.move_joints((here[0], here[1] - 0.1, 0.0, here[3]))
    with pytest.raises(HomingError, match=r"j2 is 0\.1 m from its end stop"):
        robot.home(["j4"])
    assert robot.state.positions[1] == pytest.approx(here[1] - 0.1, abs=1e-3)


@pytest.mark.parametrize("joints", [["j5"], [], "j2", [3]])
def test_joints_that_there_are_not_are_refused(robot: Robot, joints: list[str]) -> None:
    with pytest.raises(InvalidArgumentError):
        robot.home(joints)
