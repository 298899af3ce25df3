"""The example that publishes goals by topic: its parameters and its check of the start."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
EXAMPLE = runpy.run_path(str(ROOT / "examples/ros2/publisher_joint_trajectory_controller.py"))
read_task, outside = EXAMPLE["read_task"], EXAMPLE["outside"]
JOINTS = ["j1", "j2"]


def given(**parameters: Any) -> dict[str, Any]:
    return {"joints": JOINTS, "goal_names": ["a"], "a.positions": [0.1, 0.2]} | parameters


def test_the_parameters_make_a_task() -> None:
    task = read_task(
        given(
            controller_name="velocity_joint_trajectory_controller",
            goal_names=["a", "b"],
            b=[0.3, 0.1],
            wait_sec_between_publish=3,
            **{"a.velocities": [0.0, 0.0]},
        )
    )
    assert task.topic == "velocity_joint_trajectory_controller/joint_trajectory"
    assert (task.joints, task.wait) == (("j1", "j2"), 3.0)
    assert [goal.name for goal in task.goals] == ["a", "b"]
    assert task.goals[0].values == {"positions": (0.1, 0.2), "velocities": (0.0, 0.0)}
    assert task.goals[1].values == {"positions": (0.3, 0.1)}
    assert task.start == {}


def test_the_defaults_are_those_of_the_original() -> None:
    task = read_task({"joints": JOINTS, "pos1": [0, 0], "pos2": [0.1, 0.1]})
    assert [goal.name for goal in task.goals] == ["pos1", "pos2"]
    assert task.wait == 6.0
    assert task.topic == "position_trajectory_controller/joint_trajectory"


@pytest.mark.parametrize(
    ("parameters", "complaint"),
    [
        (given(joints=[]), "joints is empty"),
        (given(joints=[""]), "joints is empty"),
        (given(goal_names=[]), "goal_names is empty"),
        (given(wait_sec_between_publish=0), "is 0 s but must be above 0 s"),
        (given(wait_sec_between_publish=float("nan")), "is nan s"),
        ({"joints": JOINTS, "goal_names": ["a"]}, r"goal a has no values: give a\.positions"),
        (given(**{"a.positions": [0.1]}), r"a\.positions has 1 values; there are 2 joints"),
        (given(**{"a.velocities": [0.1, 0, 0]}), r"a\.velocities has 3 values"),
        (given(**{"a.positions": [0.1, float("inf")]}), "must be finite"),
        (given(check_starting_point=True, **{"starting_point_limits.j2": [0.3]}),
         r"starting_point_limits\.j2 is \[0\.3\]"),
        (given(check_starting_point=True, **{"starting_point_limits.j1": [1.0, -1.0]}),
         "a lower and an upper limit"),
    ],
)  # fmt: skip
def test_parameters_that_cannot_be_used_are_refused(
    parameters: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        read_task(parameters)


def test_the_start_is_checked_for_the_controllers_joints_alone() -> None:
    task = read_task(given(check_starting_point=True, **{"starting_point_limits.j2": [0.1, 0.3]}))
    # The original stops with an error when there is the gripper among the joint states.
    assert outside(task, ["gripper", "j2", "j1"], [0.08, 0.2, 0.0]) == []
    assert outside(task, ["j1", "j2"], [0.0, 0.4]) == ["j2 is at 0.4, outside 0.1 .. 0.3"]
    assert outside(task, ["j1", "j2"], [7.0, 0.2]) == ["j1 is at 7, outside -6.28319 .. 6.28319"]


def test_the_start_waits_for_joints_that_have_no_position() -> None:
    task = read_task(given(check_starting_point=True))
    assert outside(task, ["j1"], [0.0]) is None
    assert outside(task, ["j1", "j2"], [float("nan"), 0.2]) is None


def test_the_installed_parameter_file_can_be_used() -> None:
    path = ROOT / "ros/bioscara_arm_bringup/config/test_goal_publishers_config.yaml"
    ((node, content),) = yaml.safe_load(path.read_text()).items()
    assert node == "/**"
    values: dict[str, Any] = {}
    for name, value in content["ros__parameters"].items():
        inner = value.items() if isinstance(value, dict) else ()
        values |= {f"{name}.{key}": each for key, each in inner} if inner else {name: value}
    task = read_task(values)
    assert task.joints == ("j1", "j2", "j3", "j4")
    assert len(task.goals) == 4
    assert set(task.start) == set(task.joints)
