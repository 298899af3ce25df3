"""The model of the arm, as a browser draws it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from bioscara.dashboard.model import ArmModel, model_of
from bioscara.kinematics import Scara
from bioscara.model import ArmParameters
from bioscara.model.loading import load_parameters
from bioscara.robot import kinematics_of


@pytest.fixture(scope="module")
def parameters() -> ArmParameters:
    return load_parameters()


def rotation(roll: float, pitch: float, yaw: float) -> Any:
    """Return the rotation about the fixed axes x, y and z, as a browser has to compute it."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def placed(model: ArmModel, positions: dict[str, float]) -> dict[str, Any]:
    """Return the pose of each link in the root."""
    children = {joint.child for joint in model.joints}
    (root,) = (link.name for link in model.links if link.name not in children)
    poses = {root: np.eye(4)}
    for joint in model.joints:
        value = positions.get(joint.name, 0.0)
        if joint.mimic is not None:
            value = joint.mimic.multiplier * positions[joint.mimic.joint] + joint.mimic.offset
        pose, moved = np.eye(4), np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation(*joint.origin[3:]), joint.origin[:3]
        x, y, z = joint.axis
        if joint.type == "prismatic":
            moved[:3, 3] = np.multiply(joint.axis, value)
        elif joint.type == "revolute":
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            moved[:3, :3] += math.sin(value) * cross + (1 - math.cos(value)) * cross @ cross
        poses[joint.child] = poses[joint.parent] @ pose @ moved
    return poses


def test_the_tool_of_the_model_is_where_the_kinematics_have_it(parameters: ArmParameters) -> None:
    model, arm = model_of(parameters), kinematics_of(parameters)
    assert isinstance(arm, Scara)
    for joints in ([0.3, 0.2, 0.8, -0.5], [-1.0, 0.1, -0.4, 2.0]):
        positions = dict(zip(("j1", "j2", "j3", "j4"), joints, strict=True))
        poses = placed(model, {**positions, "gripper": 0.03})
        in_base = np.linalg.inv(poses[model.base]) @ poses[model.tool]
        expected = arm.forward(joints)
        assert in_base[:3, 3] == pytest.approx(expected[:3], abs=1e-9)
        assert math.atan2(in_base[1, 0], in_base[0, 0]) == pytest.approx(expected.yaw)
