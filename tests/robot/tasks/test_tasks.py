"""A task is declared once: its doors refuse the same values with the same sentence."""

from __future__ import annotations

import inspect
from typing import Any

import msgspec
import numpy as np
import pytest

from bioscara import Pose
from bioscara.api import framing, messages as m
from bioscara.errors import BioscaraError, ConfigurationError
from bioscara.robot import tasks
from bioscara.robot.arm_methods import ArmMethods
from bioscara.robot.robot_gripper import RobotGripper
from bioscara.robot.sequences.steps import sequence_of

WRONG: list[tuple[type[Any], str, Any, str]] = [
    (tasks.Unfold, "velocity_scaling", 3.0, "3.0 is outside 0.001 .. 1"),
    (tasks.MoveRelative, "x", 50.0, "50 m is outside -10 .. 10 m; are these millimetres?"),
    (tasks.MoveRelative, "yaw", 90.0, "90 rad is outside"),
    (tasks.MoveGripper, "width", 60.0, "60 m is outside 0 .. 1 m; give a width"),
]


@pytest.mark.parametrize(("kind", "field", "value", "text"), WRONG)
def test_each_door_refuses_a_value_with_the_same_sentence(
    kind: Any, field: str, value: Any, text: str
) -> None:
    with pytest.raises(BioscaraError) as made:
        kind(**{field: value})
    assert text in str(made.value)
    sent = {"kind": "start", "task": {"kind": kind.kind(), field: value}}
    message = msgspec.json.encode({"kind": "request", "id": 1, "command": sent})
    with pytest.raises(msgspec.ValidationError) as read:
        framing.json_from_client.decode(message)
    refused = framing.unusable(read.value)
    assert (type(refused), str(refused)) == (type(made.value), str(made.value))
    with pytest.raises(ConfigurationError) as step:
        sequence_of({"steps": [{"kind": kind.kind(), field: value}]})
    assert text in str(step.value)


def test_all_problems_of_a_file_are_told_at_once() -> None:
    first = {"kind": "move_linear", "pose": {"x": 50, "y": 0, "zz": 0}, "velocity_scaling": 3}
    with pytest.raises(ConfigurationError) as caught:
        sequence_of({"steps": [first, {"kind": "move_gripper"}]})
    for text in (
        "step 1 pose zz is not a known parameter",
        "step 1 pose x: 50 m is outside",
        "step 1 pose z is missing",
        "step 1 velocity_scaling: 3.0 is outside",
        "step 2 width is missing",
    ):
        assert text in str(caught.value)


def test_each_task_has_its_method_with_its_arguments() -> None:
    for kind in tasks.TASKS:
        *parts, name = kind.call().split(".")
        member = inspect.getattr_static(RobotGripper if parts else ArmMethods, name)
        if isinstance(member, property):
            continue
        names = set(inspect.signature(member).parameters)
        assert set(kind.__struct_fields__) - {"revision"} <= names, kind


def test_arrays_are_taken_and_values_stay_as_they_were_checked() -> None:
    goal = tasks.MoveJoints(positions=np.array([0.3, 0.2, 0.8, -0.5]))  # type: ignore[arg-type]
    assert goal.positions == (0.3, 0.2, 0.8, -0.5)
    assert type(tasks.MoveGripper(np.float32(0.5)).width) is float  # type: ignore[arg-type]
    with pytest.raises(AttributeError):
        tasks.MoveTo(pose=Pose(0.3, 0.1, 0.2)).pose = "center"  # type: ignore[misc]
    assert m.Start(task=goal).task is goal
